"""Places with other letters, and streams that are closed, full or read by nobody."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

from tests.hostile.played import Input
from tests.hostile.small_run import TWO, copied

PY = (Path(__file__).parent.parent / "solvers" / "correct" / "plain.py").read_text()
ASKS = TWO.replace("Does a head-on", "Хранит ли 保存 Does a")
OPEN = ASKS[: ASKS.index("[[wall]]")]  # the exercise's functions know no walls
FILES = {"two.toml": ASKS, "plain.py": PY}
RUN = "run two.toml --engine pymunk:shipped --dt 0.02 --out out --workers 1"
WRITES = ("out", "out.part", "check.html", "order.html", "printed")
NOT_UTF8 = os.fsdecode(b"caf\xe9")
ODD = "Ünï 保存 [/nope]"

# Variables of the place a command is started in.
PLACES_OF_ALL: dict[str, dict[str, str]] = {
    "the plainest locale": {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
    "streams in ASCII": {"PYTHONIOENCODING": "ascii"},
    "streams in Latin-1": {"PYTHONIOENCODING": "latin-1"},
    "a locale that is not there": {"LC_ALL": "xx_XX.UTF-8"},
    "a terminal that can do nothing": {"TERM": "dumb", "COLUMNS": "1", "LINES": "1"},
    "a width that is no number": {"COLUMNS": "wide"},
    "a home that is not there": {"HOME": "/nonexistent", "XDG_CACHE_HOME": "/nonexistent"},
}
COMMANDS: dict[str, tuple[str, tuple[int, ...]]] = {
    "truth": ("truth two.toml", (0,)),
    "list": ("list metrics", (0,)),
    "a refusal": ("truth nothing_保存.toml", (2,)),
}
right = partial(Input, codes=(0,), writes=WRITES)
TURNED = [
    Input(f"{what}: {place}", words, FILES, environment=environment, codes=codes, writes=WRITES)
    for place, environment in PLACES_OF_ALL.items()
    for what, (words, codes) in COMMANDS.items()
]
WHOLE = [
    right(
        "run: the plainest locale",
        RUN,
        FILES,
        environment=PLACES_OF_ALL["the plainest locale"],
        says="1 cell ended",
    ),
    right(
        "run: streams in ASCII",
        RUN,
        FILES,
        environment={"PYTHONIOENCODING": "ascii"},
        says="1 cell ended",
    ),
    right(
        "check: the plainest locale",
        "check plain.py",
        FILES,
        environment=PLACES_OF_ALL["the plainest locale"],
    ),
    right(
        "check: streams in ASCII, for programs",
        "check plain.py --json",
        FILES,
        environment={"PYTHONIOENCODING": "ascii"},
    ),
    Input(
        "truth: streams in ASCII, for programs",
        "truth two.toml --json",
        FILES,
        environment={"PYTHONIOENCODING": "ascii"},
        codes=(0,),
    ),
    right(
        "report: streams in ASCII",
        "report out",
        prepare=copied(),
        environment={"PYTHONIOENCODING": "ascii"},
    ),
    Input(
        "diff: streams in ASCII",
        "diff out out",
        prepare=copied(),
        environment={"PYTHONIOENCODING": "ascii"},
        codes=(0,),
    ),
]
# Options of the interpreter.
INTERPRETER_OPTIONS: dict[str, tuple[dict[str, str], tuple[int, ...]]] = {
    "without docstrings": ({"PYTHONOPTIMIZE": "2"}, (2,)),
    "without assertions": ({"PYTHONOPTIMIZE": "1"}, (0,)),
    "in development mode": ({"PYTHONDEVMODE": "0"}, (0,)),
    "verbose": ({"PYTHONVERBOSE": ""}, (0,)),
    "with other hashes": ({"PYTHONHASHSEED": "42"}, (0,)),
    "with a safe path": ({"PYTHONSAFEPATH": "1"}, (0,)),
    "without kernels compiled": ({"NUMBA_DISABLE_JIT": "1"}, (0,)),
    "with a path of nothing": ({"PYTHONPATH": ":::/nonexistent:"}, (0,)),
}
WITH_OPTIONS = [
    Input(f"truth: {what}", "truth two.toml", FILES, environment=environment, codes=codes)
    for what, (environment, codes) in INTERPRETER_OPTIONS.items()
]
TRAP = "open('trapped.txt', 'w').write('foreign code ran')\n"
PATHS = [
    Input(
        "truth: an empty entry in the path, beside modules of Python's names",
        "truth two.toml",
        FILES | {"random.py": TRAP, "secrets.py": TRAP, "scenarios.py": TRAP},
        environment={"PYTHONPATH": ":"},
        codes=(0,),
    ),
    right(
        "run: an empty entry in the path, beside modules of Python's names",
        RUN,
        FILES | {"random.py": TRAP, "secrets.py": TRAP, "scenarios.py": TRAP},
        environment={"PYTHONPATH": ":"},
    ),
    right(
        "check: a path that leads to where one is",
        "check plain.py",
        FILES | {"random.py": TRAP, "numbers.py": TRAP},
        environment={"PYTHONPATH": "."},
    ),
]
# What a path may be called that is no UTF-8, or more than letters.
NAMES = [
    *(
        Input(
            f"{what} in a folder called {shown}",
            words,
            {f"{name}/two.toml": OPEN, f"{name}/plain.py": PY},
            codes=(0,),
            writes=(*WRITES, f"{name}/out", f"{name}/out.part"),
        )
        for shown, name in (("in bytes", NOT_UTF8), ("oddly", ODD))
        for what, words in {
            "truth": ("truth", f"{name}/two.toml"),
            "check": ("check", f"{name}/plain.py"),
            "run": (
                "run",
                f"{name}/two.toml",
                *RUN.split()[2:6],
                "--out",
                f"{name}/out",
                "--workers",
                "1",
            ),
            "a solver as engine": (
                "run",
                f"{name}/two.toml",
                "--engine",
                f"{name}/plain.py",
                "--dt",
                "0.02",
                "--out",
                "out",
                "--workers",
                "1",
            ),
        }.items()
    ),
    right(
        "check: a class in a folder in bytes",
        ("check", NOT_UTF8),
        {f"{NOT_UTF8}/{NOT_UTF8}/plain.py": PY, f"{NOT_UTF8}/b/plain.py": PY},
    ),
    Input(
        "check: results in files in bytes",
        ("check", "plain.py", "--page", f"{NOT_UTF8}.html", "--junit", f"{NOT_UTF8}.xml"),
        FILES,
        codes=(0,),
        writes=(f"{NOT_UTF8}.html", f"{NOT_UTF8}.xml"),
    ),
    Input("a scene in bytes that is not there", ("truth", f"{NOT_UTF8}.toml"), says="\\udce9.toml"),
    Input("a scenario in bytes", ("run", NOT_UTF8), says="is not known"),
    Input("an engine in bytes", ("run", "--engine", NOT_UTF8), says="is not known"),
    Input("a name with a line end", ("truth", "a\nb.toml"), says="a\\nb.toml"),
    Input("a name with an escape code", ("truth", "a\x1b[31mb.toml"), says="a\\x1b[31mb.toml"),
]
# Streams, as a shell gives them.
REFUSED = "cannot write to standard output"
LINES: dict[str, tuple[str, tuple[int, ...], str]] = {
    "truth: a full disk": ("$crosscheck truth two.toml > /dev/full", (1,), REFUSED),
    "truth --json: a full disk": ("$crosscheck truth two.toml --json > /dev/full", (1,), REFUSED),
    "list: a full disk": ("$crosscheck list > /dev/full", (1,), REFUSED),
    "help: a full disk": ("$crosscheck run --help > /dev/full", (1,), REFUSED),
    "check: a full disk": ("$crosscheck check plain.py > /dev/full", (1,), REFUSED),
    "run: a full disk": (f"$crosscheck {RUN} > /dev/full", (1,), REFUSED),
    "truth: no output": ("$crosscheck truth two.toml >&-", (1,), ""),
    "list: no output": ("$crosscheck list >&-", (1,), ""),
    "run: no output": (f"$crosscheck {RUN} >&-", (1,), ""),
    "truth: no error output": ("$crosscheck truth two.toml 2>&-", (0,), "horizon"),
    "run: no error output": (f"$crosscheck {RUN} 2>&-", (0,), "1 cell ended"),
    "truth: no input": ("$crosscheck truth two.toml <&-", (0,), "horizon"),
    "run: no input": (f"$crosscheck {RUN} <&-", (0,), "1 cell ended"),
    "check: no stream at all": ("$crosscheck check plain.py <&- >&- 2>&-; test $? -le 1", (0,), ""),
    "truth: error output on a full disk": (
        "$crosscheck truth two.toml 2> /dev/full",
        (0,),
        "horizon",
    ),
    "a refusal on a full disk": ("$crosscheck truth no.toml 2> /dev/full; test $? -eq 2", (0,), ""),
    "truth: nobody reads on": ("$crosscheck truth two.toml --events | head -1", (0,), ""),
    "list: nobody reads at all": ("$crosscheck list | true", (0,), ""),
    "run: nobody reads at all": (f"$crosscheck {RUN} | true; test -e out/report.html", (0,), ""),
    "run: a folder that is gone": (f"mkdir a; cd a; rmdir ../a; $crosscheck {RUN}", (2,), ""),
    "truth: a folder that is gone": (
        "mkdir a; cd a; rmdir ../a; $crosscheck truth slow_collision",
        (0,),
        "horizon",
    ),
    "check: a folder that is gone": (
        "mkdir a; cd a; rmdir ../a; $crosscheck check plain.py",
        (2,),
        "",
    ),
    "run: files of no more than 100 kB": (f"ulimit -f 100; $crosscheck {RUN}", (1,), ""),
    "truth: three files at once": ("ulimit -n 12; $crosscheck truth two.toml", (2,), ""),
    "truth: signalled to stop": (
        "timeout -s TERM 0.3 $crosscheck truth two.toml; test $? -eq 124",
        (0,),
        "",
    ),
    "a command by its module": (
        "cd /; $python -m crosscheck2d.reports truth slow_collision",
        (0,),
        "horizon",
    ),
}
STREAMS = [
    Input(
        what,
        files=FILES,
        shell=line.replace("$python", '"$(dirname $crosscheck)/python"'),
        codes=codes,
        says=says,
        writes=WRITES,
    )
    for what, (line, codes, says) in LINES.items()
]
PLACES = (*TURNED, *WHOLE, *WITH_OPTIONS, *PATHS, *NAMES, *STREAMS)
