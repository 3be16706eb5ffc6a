"""Where a command is asked to write, and something else is already, or nothing can be."""

from __future__ import annotations

import contextlib
import fcntl
import os
import socket
import sqlite3
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.hostile.played import Input
from tests.hostile.small_run import RUN, TWO, copied

PLAIN = (Path(__file__).parent.parent / "solvers" / "correct" / "plain.py").read_text()
SCENE = {"two.toml": TWO}
OUT = {
    "run": "run two.toml --engine pymunk:shipped --out",
    "speed": "speed free_fall --engine pymunk:shipped --out",
    "stability": "stability slow_collision --engine pymunk:shipped --out",
    "tune": "tune pymunk --out",
    "lesson": "lesson --export",
}
# Somebody's folder: what is in it.
FOREIGN: dict[str, dict[str, str | bytes]] = {
    "scenes and nothing else": {"out/scenes/mine.toml": TWO},
    "trajectories and nothing else": {"out/trajectories/mine.npz": b"years of work"},
    "a page of his own": {"out/report.html": "<html>mine</html>"},
    "tables as ours are called": {
        "out/runs.csv": "mine",
        "out/speed.csv": "mine",
        "out/limits.csv": "mine",
        "out/matched.csv": "mine",
        "out/index.html": "mine",
    },
    "a journal that is a diary": {"out/journal.jsonl": '{"dear": "diary"}\n'},
    "a results.sqlite of another program": {"out/results.sqlite": "years of work" * 100},
    "a file that is hidden": {"out/.git/config": "[core]"},
}
TAKEN = tuple(
    Input(
        f"{command} into a folder with {what}",
        f"{words} out",
        SCENE | files,
        says="is damaged" if "another program" in what else "out",
    )
    for what, files in FOREIGN.items()
    for command, words in OUT.items()
    if command != "lesson"
)

# What is no folder, or none that can be written: the path after --out, and how it comes about.
Prepare = Callable[[Path], object]


def link(to: str, here: Path) -> None:
    (here / "out").symlink_to(to)


def bound(here: Path) -> None:
    with contextlib.chdir(here), socket.socket(socket.AF_UNIX) as one:  # whose path may not be long
        one.bind("out")


PATHS: dict[str, tuple[str, Prepare | None]] = {
    "where one is": (".", None),
    "above where one is": ("..", None),
    "the top of all": ("/", None),
    "a file": ("two.toml", None),
    "below a file": ("two.toml/out", None),
    "the kernel's folder": ("/proc/out", None),
    "a device": ("/dev/null", None),
    "a name that is too long": ("x" * 300, None),
    "a path that is too long": ("/".join(["x" * 200] * 30), None),
    "a link to nothing": ("out", partial(link, "nowhere")),
    "a link to itself": ("out", partial(link, "out")),
    "a link to where one is": ("out", partial(link, ".")),
    "a link to a file": ("out", partial(link, "two.toml")),
    "a pipe": ("out", lambda here: os.mkfifo(here / "out")),
    "a socket": ("out", bound),
}
NO_PLACE = tuple(
    Input(
        f"{command} into {what}",
        f"{OUT[command]} {path}",
        SCENE,
        prepare=prepare,
        says=path.strip("./")[:20] or "is the current folder",
    )
    for number, (what, (path, prepare)) in enumerate(PATHS.items())
    for command in [
        ("run", "speed", "stability", "tune", "lesson")[number % 5],
        ("lesson", "run", "run", "stability", "run")[number % 5],
    ]
)


def note(name: str, here: Path) -> None:
    path = here / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("years of work")


def moved_and_linked(here: Path) -> None:
    (here / "out").rename(here / "elsewhere")
    (here / "out").symlink_to(here / "elsewhere")


def held(here: Path) -> None:
    HELD.append(file := (here / "out" / ".crosscheck.lock").open("ab"))
    fcntl.flock(file, fcntl.LOCK_EX)


HELD: list[object] = []


def damaged(here: Path) -> None:
    path = here / "out" / "results.sqlite"
    path.write_bytes(path.read_bytes()[:20_000])


def edited(here: Path) -> None:
    file = sqlite3.connect(here / "out" / "results.sqlite")
    file.execute("update results set value = '{}' where kind = 'cell'")
    file.commit()
    file.close()


AGAIN = f"{RUN} --out out"
REPORT = "report out"
done = partial(Input, codes=(0,), writes=("out",), says="2 cells ended")
OURS = (
    *(
        Input(
            f"{what}, {words.split()[1]}",
            words,
            prepare=copied(partial(note, f"out/{path}")),
            says="holds",
        )
        for what, path in {
            "a run with a note": "notes.txt",
            "a run with a trajectory of the user's": "trajectories/mine.npz",
            "a run with a folder of the user's": "trajectories/deeper/mine.txt",
            "a run whose page was written over": "report.html",
            "a run whose table was edited": "deviations.csv",
        }.items()
        for words in (AGAIN, REPORT)
    ),
    Input(
        "a run that is a link to a run",
        AGAIN,
        prepare=copied(moved_and_linked),
        codes=(0,),
        writes=("elsewhere", "out"),
        says="2 cells ended",
    ),
    Input(
        "a run that another process writes", AGAIN, prepare=copied(held), says="another crosscheck"
    ),
    *(
        Input(f"a run that is {what}, {words.split()[0]}", words, prepare=copied(how), **ends)
        for what, how, words, ends in (
            ("damaged", damaged, AGAIN, {"says": "is damaged"}),
            ("damaged", damaged, REPORT, {"says": "is damaged"}),
            ("edited", edited, AGAIN, {"says": "2 cells ended", "codes": (0,), "writes": ("out",)}),
            ("edited", edited, REPORT, {"says": "is not what was written"}),
        )
    ),
    done("a run again", AGAIN, prepare=copied()),
    done(
        "a run into a folder that is empty",
        AGAIN,
        SCENE,
        prepare=lambda here: (here / "out").mkdir(),
    ),
    Input(
        "a run of a scene in the folder's own scenes",
        "run out/scenes/a.toml --out out",
        {"out/scenes/a.toml": TWO},
        says="holds scenes",
    ),
    Input(
        "speed into a run", f"{OUT['speed']} out", prepare=copied(), says="made by crosscheck run"
    ),
    Input(
        "stability into a run",
        f"{OUT['stability']} out",
        prepare=copied(),
        says="made by crosscheck run",
    ),
    Input("tune into a run", f"{OUT['tune']} out", prepare=copied(), says="made by crosscheck run"),
    Input(
        "a run into where the current folder is",
        f"{RUN} --out ../here",
        SCENE,
        says="is the current folder",
    ),
)

NO_RUN: dict[str, tuple[str, dict[str, str | bytes], str]] = {
    "run: a folder of the old format": (AGAIN, {"out/journal.jsonl": "{}"} | SCENE, "earlier"),
    "report: a folder of the old format": (REPORT, {"out/journal.jsonl": "{}"}, "earlier"),
    "report: nothing there": ("report out", {}, "results.sqlite"),
    "report: a file": ("report two.toml", SCENE, "two.toml"),
    "report: a folder of the user's": ("report out", {"out/report.html": "mine"}, "results.sqlite"),
    "diff: nothing there": ("diff a b", {}, "a"),
    "diff: two files": ("diff a b", {"a": "1", "b": "2"}, "a"),
    "diff: a folder of the user's": ("diff a a", {"a/deviations.csv": "mine"}, "results.sqlite"),
    "check --page: another page": ("check plain.py --page a.html", {"a.html": "mine"}, "no page"),
    "check --page: a folder": ("check plain.py --page a", {"a/b": "mine"}, "a"),
    "check --page: below a file": ("check plain.py --page plain.py/a.html", {}, "plain.py/a.html"),
    "check --page: the solver itself": ("check plain.py --page plain.py", {}, "no page"),
    "check --page: a folder that is not there": (
        "check plain.py --page no/a.html",
        {},
        "no/a.html",
    ),
    "check --page: the page of the user's that is there": (
        "check plain.py",
        {"check.html": "mine"},
        "no page",
    ),
    "check --junit: another file": (
        "check plain.py --junit a.xml",
        {"a.xml": "<mine/>"},
        "no JUnit",
    ),
    "check --junit: a page of ours": (
        "check plain.py --junit a.xml",
        {"a.xml": '<meta name="generator" content="crosscheck check">'},
        "no JUnit",
    ),
    "check --junit: where the page goes": ("check plain.py --junit a --page ./a", {}, "page goes"),
    "check: nothing there": ("check nothing.py", {}, "nothing.py"),
    "check: an empty folder's file": (
        "check a",
        {"a/readme.md": "mine"},
        "holds no .js and no .py",
    ),
    "lesson --export: another page": (
        "lesson order --export a.html",
        {"a.html": "mine"},
        "no page",
    ),
    "lesson --export: a folder for one lesson": (
        "lesson order --export a",
        {"a/b": "1"},
        "is a folder",
    ),
    "lesson --export: below a file": ("lesson order --export a/b.html", {"a": "mine"}, "a/b.html"),
    "lesson --export: a device that is full": (
        "lesson order --export /proc/a.html",
        {},
        "/proc/a.html",
    ),
}
FOLDERS = (
    *TAKEN,
    *NO_PLACE,
    *OURS,
    *(
        Input(name, words, {"plain.py": PLAIN} | files, says=says)
        for name, (words, files, says) in NO_RUN.items()
    ),
)
