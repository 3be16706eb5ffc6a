"""Prints what marks of a class cost: `python -m tests.bench.class_of_students [STUDENTS]`, 200 by
default.

Seconds by the clock depend on what else the machine does; those of the processors do so far less.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from pathlib import Path
from time import monotonic

from tests.bench.check import spent
from tests.reports.terminal.command_line import CROSSCHECK
from tests.solvers.class_folder import write_class

STUDENTS = 200
LONGEST, LARGEST = 40.0, 8.0  # s on two processors; MB of the page


def main(students: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        write_class(home / "class", students)
        page = home / "class.html"
        words = ["check", "class", "--format", "csv", "--out", "marks.csv", "--page", page.name]
        began, before = monotonic(), spent()
        subprocess.run([CROSSCHECK, *words], cwd=home, stdout=subprocess.DEVNULL)
        took, used = monotonic() - began, spent() - before
        size = page.stat().st_size / 1e6
    print(
        f"{students} students: {took:.1f} s (at most {LONGEST:g}), {used:.1f} s of"
        f" {os.cpu_count()} processors; page {size:.2f} MB (at most {LARGEST:g})"
    )


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("students", nargs="?", type=int, default=STUDENTS, metavar="STUDENTS")
    main(parser.parse_args().students)
