"""A small finished run, made once by the command, of which every input that needs one gets a
copy."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from tests.reports.run.journals import contents, put

from tests.hostile.played import CROSSCHECK

TWO = (Path(__file__).parents[1] / "data" / "scenes" / "two.toml").read_text()
MADE = "CROSSCHECK_HOSTILE_RUN"  # variable that says to the processes of the pool where it is
RUN = ("run", "two.toml", "--engine", "pymunk", "--dt", "0.02", "--workers", "1")
CELL = "CELL"  # in the words of an input: the first cell of the copy that was made for it
Prepare = Callable[[Path], dict[str, str]]


def finished_run() -> Path:
    """Its folder, made when it is first asked for, by this process or the one that has started this
    one."""
    if MADE not in os.environ:
        place = Path(tempfile.mkdtemp())
        atexit.register(shutil.rmtree, place, ignore_errors=True)
        (place / "two.toml").write_text(TWO)
        subprocess.run(
            [CROSSCHECK, *RUN, "--out", "out"],
            cwd=place,
            check=True,
            capture_output=True,
            timeout=300,
        )
        os.environ[MADE] = str(place / "out")
    return Path(os.environ[MADE])


def copy(here: Path, *names: str) -> dict[str, str]:
    """Set copies of the run into a folder, as if it had been made there, with its scene file."""
    made = finished_run()
    lines = contents(made)
    lines[0]["header"]["folder"] = str(here)
    for name in names:
        shutil.copytree(made, here / name)
        put(here / name, lines)
    (here / "two.toml").write_text(TWO)
    return {CELL: next(line["cell"] for line in lines if "cell" in line)}


def copied(*names: str, then: Callable[[Path], object] | None = None) -> Prepare:
    """What `copy` does, and then something more with the folder in which the copies are."""
    return partial(_copied, names, then)


def _copied(
    names: tuple[str, ...], then: Callable[[Path], object] | None, here: Path
) -> dict[str, str]:
    words = copy(here, *names)
    if then is not None:
        then(here)
    return words


def edited(kind: str, at: tuple[Any, ...], value: Any) -> Prepare:
    """A copy `out` of the run in which one thing in the first line of a kind is another, while its
    sum stays; and a whole one, `before`."""
    return partial(_edited, kind, at, value)


def _edited(kind: str, at: tuple[Any, ...], value: Any, here: Path) -> dict[str, str]:
    words = copy(here, "before", "out")
    journal = here / "out" / "journal.jsonl"
    lines = [json.loads(line) for line in journal.read_text().splitlines()]
    inner: Any = next(line for line in lines if kind in line)
    for key in at[:-1]:
        inner = inner[key]
    inner[at[-1]] = value
    journal.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    return words


def torn(change: Callable[[bytes], bytes], pattern: str = "journal.jsonl") -> Prepare:
    """A copy `out` of the run in which the bytes of the first file of that pattern are others, and
    a whole one."""
    return partial(_torn, change, pattern)


def _torn(change: Callable[[bytes], bytes], pattern: str, here: Path) -> dict[str, str]:
    words = copy(here, "before", "out")
    # The trajectory of the cell that CELL stands for, where there are several.
    path = sorted((here / "out").glob(pattern.replace(CELL, words[CELL])))[0]
    path.write_bytes(change(path.read_bytes()))
    return words
