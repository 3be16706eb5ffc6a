"""Somebody's own solver that does everything but solve, as `check` is given it and as an engine of
a run."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.hostile.played import Input
from tests.hostile.small_run import TWO as WALLED

CORRECT = Path(__file__).parent.parent / "solvers" / "correct"
PY, JS = (CORRECT / "plain.py").read_text(), (CORRECT / "plain.js").read_text()
TWO = WALLED[: WALLED.index("[[wall]]")]  # the exercise's functions know no walls
PLAYED = "run two.toml --dt 0.02 --workers 1 --timeout 5 --out out --engine"
STEP, COLLISION = (
    "def integrate(sphere, dt):\n",
    "def sphereSphereCollisionHandling(sphereA, sphereB):\n",
)
JS_STEP = "function integrate(sphere, dt) {\n"


def within(*lines: str, head: str = STEP) -> str:
    """A right solver, of which a function begins with these lines."""
    assert head in (PY if head != JS_STEP else JS)
    body = "".join(f"    {line}\n" for line in lines)
    return (PY if head != JS_STEP else JS).replace(head, head + body)


# What the file is called and holds; what must be said of it. It is loaded, and fails there.
LOADING: dict[str, tuple[str, str | bytes, str]] = {
    "a syntax error": ("mine.py", "def f(:\n", "SyntaxError"),
    "a syntax error in JavaScript": ("mine.js", "let b = ;\n", "SyntaxError"),
    "tabs and blanks": ("mine.py", "if 1:\n\tx = 1\n        y = 2\n", "TabError"),
    "an endless loop": ("mine.py", "while True: pass\n", "does not come back"),
    "an endless loop in JavaScript": ("mine.js", "for (;;);\n", "does not come back"),
    "an endless loop that hears nothing": (
        "mine.py",
        (
            "import signal\nfor n in range(1, 65):\n  try: signal.signal(n, signal.SIG_IGN)\n"
            "  except (OSError, ValueError): pass\nwhile True: pass\n"
        ),
        "",
    ),
    "sleep without end": ("mine.py", "import time\ntime.sleep(1e9)\n", "does not come back"),
    "all memory": ("mine.py", "x = bytearray(10**11)\n", "memory"),
    "all memory in JavaScript": (
        "mine.js",
        "var a = []; for (;;) a.push(new Array(1e6).fill(1));",
        "memory",
    ),
    "sys.exit with success": ("mine.py", "import sys\nsys.exit(0)\n", "SystemExit"),
    "sys.exit with words": ("mine.py", "raise SystemExit('\\x1b[31mno')\n", "SystemExit"),
    "os._exit with success": ("mine.py", "import os\nos._exit(0)\n", "ended its own process"),
    "abort": ("mine.py", "import os\nos.abort()\n", "SIGABRT"),
    "a crash in C": ("mine.py", "import ctypes\nctypes.string_at(0)\n", "SIGSEGV"),
    "killing itself": ("mine.py", "import os\nos.kill(os.getpid(), 9)\n", "SIGKILL"),
    "killing its group": ("mine.py", "import os\nos.killpg(0, 9)\n", "SIGKILL"),
    "an exception that is none": (
        "mine.py",
        "class E(BaseException): pass\nraise E('no')\n",
        "E: no",
    ),
    "an interrupt": ("mine.py", "raise KeyboardInterrupt\n", "KeyboardInterrupt"),
    "an exception that cannot be shown": (
        "mine.py",
        "class E(Exception):\n  def __str__(self): raise self\nraise E\n",
        "",
    ),
    "an exception with escape codes": (
        "mine.py",
        "raise ValueError('\\x1b[31m\\r\\n\\x07[/nope]')\n",
        "\\x1b[31m",
    ),
    "an exception of megabytes": ("mine.py", "raise ValueError('x' * 10**7)\n", "xxx ..."),
    "thousands of causes": (
        "mine.py",
        (
            "e = ValueError()\nfor k in range(5000):\n  n = ValueError(k); n.__cause__ = e; e ="
            " n\nraise e\n"
        ),
        "",
    ),
    "input": ("mine.py", "n = input('how many? ')\n", "input() is not available"),
    "a module that is not there": (
        "mine.py",
        "import nothing_of_the_kind\n",
        "nothing_of_the_kind",
    ),
    "a module that imports itself": ("mine.py", "import mine\nmine.integrate\n", "integrate"),
    "no function at all": ("mine.py", "x = 1\n", "no function integrate"),
    "functions that are numbers": (
        "mine.py",
        "integrate = sphereSphereCollisionHandling = 7\n",
        "integrate",
    ),
    "functions that take nothing": (
        "mine.py",
        PY.replace(STEP, "def integrate():\n").replace(
            COLLISION, "def sphereSphereCollisionHandling():\n"
        ),
        "",
    ),
    # there is a page, which holds nothing
    "page in JavaScript": ("mine.js", f"document.write('x');\n{JS}", "No fault found"),
    "modules in JavaScript": ("mine.js", f"import {{ a }} from './b.js';\n{JS}", "no modules"),
    "a regular expression without end": (
        "mine.js",
        "/(a+)+$/.test('a'.repeat(40) + 'b');\n",
        "does not come back",
    ),
    "nothing thrown in JavaScript": ("mine.js", "throw undefined;\n", "undefined"),
}
# It is called, and fails there.
CALLED: dict[str, tuple[str, str, str]] = {
    "an endless loop in a call": ("mine.py", within("while True: pass"), "does not come back"),
    "an endless loop in a call in JavaScript": (
        "mine.js",
        within("for (;;);", head=JS_STEP),
        "does not come back",
    ),
    "a call that calls itself": (
        "mine.py",
        within("integrate(sphere, dt)"),
        "calls itself without end",
    ),
    "os._exit in a call": ("mine.py", within("import os; os._exit(0)"), "ended its own process"),
    "abort in a call": ("mine.py", within("import os; os.abort()", head=COLLISION), "SIGABRT"),
    "all memory in a call": ("mine.py", within("x = [0] * 10**10"), "memory"),
    "an exception that is none in a call": (
        "mine.py",
        within("raise KeyboardInterrupt"),
        "KeyboardInterrupt",
    ),
    "nan": ("mine.py", within("sphere.velocity.x = float('nan')"), "NaN"),
    "infinity": ("mine.py", within("sphere.position.y = float('inf')"), "infinite"),
    "a number of 400 digits": ("mine.py", within("sphere.velocity.x = 10**400"), ""),
    "a complex number": ("mine.py", within("sphere.velocity.x = 1j"), ""),
    "text": ("mine.py", within("sphere.velocity.x = 'fast'"), ""),
    "positions that are lists": ("mine.py", within("sphere.position = [0.0, 0.0]", "return"), ""),
    "positions that are gone": ("mine.py", within("del sphere.position", "return"), ""),
    "a coroutine": ("mine.py", PY.replace("def integrate", "async def integrate"), "async def"),
    "a generator": ("mine.py", within("yield"), "runs nothing"),
    "megabytes that are printed": ("mine.py", within("print('x' * 10**5)"), ""),
    "escape codes that are printed": ("mine.py", within("print('\\x1b[2J\\x1b]0;mine\\x07')"), ""),
    "answers that are forged": (
        "mine.py",
        within(
            "import os",
            "for k in range(3, 30):",
            "    try: os.write(k, b'[]\\n')",
            "    except OSError: pass",
        ),
        "",
    ),
    "threads without end": (
        "mine.py",
        within(
            "import threading, time", "threading.Thread(target=time.sleep, args=(600,)).start()"
        ),
        "",
    ),
    "a process that goes on": (
        "mine.py",
        f"import subprocess\nsubprocess.Popen(['sleep', '600'])\n{PY}",
        "",
    ),
    "warnings": ("mine.py", within("import warnings; warnings.warn('mine')"), ""),
    "chance": (
        "mine.py",
        within("import random, time; sphere.position.x += random.Random(time.time()).random()"),
        "",
    ),
}
WRITES = ("check.html", "out", "out.part")
right = partial(Input, codes=(0,), writes=WRITES)
harmless = partial(Input, codes=(0,))
CHECKED = tuple(
    Input(
        f"check: {what}",
        ("check", name),
        {name: text},
        # what is not there is no fault: nothing is judged
        codes=({"a module that is not there": 2, "page in JavaScript": 0}.get(what, 1),),
        says=says,
        writes=WRITES,
    )
    for what, (name, text, says) in LOADING.items()
) + tuple(
    Input(
        f"check: {what}",
        ("check", name),
        {name: text},
        says=says,
        writes=WRITES,
        codes=(0,) if what.endswith("printed") or what == "warnings" else (1,),
    )
    for what, (name, text, says) in CALLED.items()
)

# The same as an engine: a run goes on, and says what was not played. A file without a function that
# is known is refused, so what happens on loading happens in a file that has them.
IN_A_RUN = (
    "a syntax error",
    "an endless loop",
    "all memory",
    "os._exit with success",
    "killing its group",
    "an exception with escape codes",
    "an endless loop in a call",
    "nan",
    "abort in a call",
    "megabytes that are printed",
    "answers that are forged",
)
ENGINES = (
    *(
        Input(
            f"run: {what}",
            f"{PLAYED} {name}",
            {"two.toml": TWO, name: f"{text}\n{PY}" if what in LOADING else text},
            writes=WRITES,
            codes=(0,) if what.endswith("printed") else (1,),
        )
        for what in IN_A_RUN
        for name, text, _ in [(LOADING | CALLED)[what]]
    ),
    Input(
        "run: no function at all",
        f"{PLAYED} mine.py",
        {"two.toml": TWO, "mine.py": LOADING["no function at all"][1]},
        says="has neither the functions of the exercise",
    ),
)

# It does something to where it is: that stays the user's own doing, and what the program does is
# not changed by it.
DELETES = within("import os", "if os.path.exists(__file__): os.remove(__file__)")
WRITING = f"open('made_by_me.txt', 'w').write('x')\n{PY}"
OWN_DOING = (
    harmless(
        "check: deletes itself", "check mine.py", {"mine.py": DELETES}, writes=(*WRITES, "mine.py")
    ),
    harmless(
        "run: deletes itself",
        f"{PLAYED} mine.py",
        {"two.toml": TWO, "mine.py": DELETES},
        writes=(*WRITES, "mine.py"),
    ),
    harmless(
        "check: writes into where one is",
        "check mine.py",
        {"mine.py": WRITING},
        writes=(*WRITES, "made_by_me.txt"),
    ),
    harmless(
        "run: writes over itself",
        f"{PLAYED} mine.py",
        {"two.toml": TWO, "mine.py": within("open(__file__, 'w').write('nonsense(')")},
        writes=(*WRITES, "mine.py"),
    ),
    harmless(
        "run: leaves where one is",
        f"{PLAYED} mine.py",
        {"two.toml": TWO, "mine.py": within("import os; os.chdir('/')")},
        writes=WRITES,
    ),
)

NO_TEXT: dict[str, tuple[str, str | bytes | Callable[[Path], object] | None]] = {
    "a file that is not there": ("mine.py", None),
    "an empty file": ("mine.py", ""),
    "blanks and nothing else": ("mine.py", " \n\t\n"),
    "a program in machine code": ("mine.py", b"\x7fELF" + bytes(100)),
    "two megabytes": ("mine.py", "# x\n" * 500_000),
    "a folder that is called so": ("mine.py", lambda here: (here / "mine.py").mkdir()),
    "a pipe": ("mine.py", lambda here: os.mkfifo(here / "mine.py")),
    "a link to nothing": ("mine.js", lambda here: (here / "mine.js").symlink_to("nothing.js")),
    "a link to itself": ("mine.js", lambda here: (here / "mine.js").symlink_to("mine.js")),
    "a device": ("mine.js", lambda here: (here / "mine.js").symlink_to("/dev/zero")),
    "a C file": ("mine.c", "int main() {}\n"),
    "no ending": ("mine", PY),
}
REFUSED = tuple(
    Input(
        f"{words.split()[0]}: {what}",
        f"{words} {name}",
        {} if content is None or callable(content) else {name: content},
        prepare=content if callable(content) else None,
        says=name,
    )
    for number, (what, (name, content)) in enumerate(NO_TEXT.items())
    for words in ("check", ("run free_fall --engine", "play --engine")[number % 2])
    if not (words == "check" and "folder" in what)
)

# Files with the names of Python's own modules, and of ours: nothing imports them.
TRAP = "open('trapped.txt', 'w').write('foreign code ran')\nraise SystemExit('trapped')\n"
MODULES = (
    "random.py",
    "secrets.py",
    "numbers.py",
    "scenarios.py",
    "adapters/__init__.py",
    "numpy.py",
    "json.py",
    "sitecustomize.py",
    "reports/__main__.py",
)
TRAPS = dict.fromkeys(MODULES, TRAP)
BESIDE = (
    right("check: beside modules of Python's names", "check mine.py", TRAPS | {"mine.py": PY}),
    right(
        "run: beside modules of Python's names",
        f"{PLAYED} pymunk:shipped",
        TRAPS | {"two.toml": TWO},
        says="1 cell ended: 1 ok",
    ),
    Input(
        "truth: beside modules of Python's names",
        "truth two.toml",
        TRAPS | {"two.toml": TWO},
        codes=(0,),
    ),
    right(
        "run with a shell: beside modules of Python's names",
        files=TRAPS | {"two.toml": TWO},
        shell=f"$crosscheck {PLAYED} pymunk:shipped",
    ),
    Input(
        "check: a folder of such modules",
        "check .",
        {"random.py": TRAP, "mine.py": PY},
        codes=(1,),
        writes=(*WRITES, "trapped.txt"),
        says="trapped",
    ),
)
NAMES = (
    right("check: a name in capitals", "check UPPER.PY", {"UPPER.PY": PY}),
    right(
        "run: a name in capitals",
        f"{PLAYED} UPPER.PY",
        {"two.toml": TWO, "UPPER.PY": PY},
        says="1 cell ended: 1 ok",
    ),
    Input(
        "run: a name with a colon", "run free_fall --engine a:b.py", {"a:b.py": PY}, says="colon"
    ),
    right("check: a name in markup", ("check", "[/nope].py"), {"[/nope].py": PY}),
    right("check: a name with escape codes", ("check", "a\x1b[31m.py"), {"a\x1b[31m.py": PY}),
    right("check: a name with a line end", ("check", "a\nb.py"), {"a\nb.py": PY}),
    right("check: a name like an option", "check -- --json.py", {"--json.py": PY}),
    right(
        "check: letters of another encoding",
        "check mine.py",
        {"mine.py": f"# {'ü' * 20}\n{PY}".encode("latin-1")},
    ),
    right(
        "check: UTF-16 from an editor of Windows", "check mine.py", {"mine.py": PY.encode("utf-16")}
    ),
    Input(
        "check: a class of which nobody has a solver",
        "check .",
        {"a/mine.py": "x = (\n", "b/mine.js": "x = ;\n", "c/read.me": "later", "d/mine.py": ""},
        codes=(1,),
        writes=WRITES,
    ),
)
SOLVERS = (*CHECKED, *ENGINES, *OWN_DOING, *REFUSED, *BESIDE, *NAMES)
