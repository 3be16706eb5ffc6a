"""A small finished run, made once by the command, of which every input that needs one gets a
copy."""

from __future__ import annotations

import atexit
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

from tests.hostile.played import CROSSCHECK

TWO = (Path(__file__).parents[1] / "data" / "scenes" / "two.toml").read_text()
MADE = "CROSSCHECK_HOSTILE_RUN"  # variable that says to the processes of the pool where it is
RUN = "run two.toml --engine pymunk --dt 0.02 --workers 1"


def finished_run() -> Path:
    """Its folder, made when it is first asked for, by this process or the one that has started this
    one."""
    if MADE not in os.environ:
        place = Path(tempfile.mkdtemp())
        atexit.register(shutil.rmtree, place, ignore_errors=True)
        (place / "two.toml").write_text(TWO)
        subprocess.run(
            [CROSSCHECK, *RUN.split(), "--out", "out"],
            cwd=place,
            check=True,
            capture_output=True,
            timeout=300,
        )
        os.environ[MADE] = str(place / "out")
    return Path(os.environ[MADE])


def copied(then: Callable[[Path], object] | None = None) -> Callable[[Path], None]:
    """Sets a copy of the run into a folder, as if it had been made there, with its scene file;
    then something more."""

    def copy(here: Path) -> None:
        shutil.copytree(finished_run(), here / "out")
        (here / "two.toml").write_text(TWO)
        if then is not None:
            then(here)

    return copy
