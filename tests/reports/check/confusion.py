"""The confusion table of the check: `python -m tests.reports.check.confusion` writes
tests/data/confusion.csv from all known solvers."""

from __future__ import annotations

import csv
import os
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from crosscheck2d.reports.check.rows import CheckRow
from crosscheck2d.reports.check.verdict import FileCheck, check_file
from tests.solvers.mutants import CORRECT, MUTANTS, Mutant

TABLE = Path(__file__).parents[3] / "tests" / "data" / "confusion.csv"
COLUMNS = (
    "solver",
    "fault is in",
    "found",
    "reported first in",
    "first cause",
    "first cause is right",
    "second fault is in",
    "second is found",
)


def judged(paths: Sequence[Path]) -> dict[Path, FileCheck]:
    """The checks of many files, as many at once as there are cores."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(paths, pool.map(check_file, paths)))


def first(one: FileCheck) -> CheckRow | None:
    """What is said first: a fault, or where there is none that a case is not handled."""
    return next(iter(one.faults), None) or next(
        (row for row in one.choices if "does not handle" in row.cause), None
    )


def said_first(mutant: Mutant, one: FileCheck) -> bool:
    """Whether the first thing said is this mutant's fault, in its task."""
    row = first(one)
    return row is not None and row.task == mutant.task and mutant.cause in row.cause


def said_too(mutant: Mutant, one: FileCheck) -> bool:
    """Whether the second fault of a file with two has a row with its cause."""
    assert mutant.second is not None
    task, cause = mutant.second
    return any(row.task == task and cause in row.cause for row in one.faults)


def main() -> None:
    """Check all, write the table, print how many are right."""
    with tempfile.TemporaryDirectory() as folder:
        checks = judged([mutant.write(Path(folder)) for mutant in MUTANTS])
        rows = [
            row_of(mutant.name, mutant, checks[Path(folder) / mutant.name]) for mutant in MUTANTS
        ]
    rows += [row_of(path.name, None, one) for path, one in judged(CORRECT).items()]
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([COLUMNS, *rows])
    found, right = (sum(row[k] == "yes" for row in rows[: len(MUTANTS)]) for k in (2, 5))
    both = sum(row[7] == "yes" for row in rows)
    pairs = sum(mutant.second is not None for mutant in MUTANTS)
    faulted = sum(row[2] == "yes" for row in rows[len(MUTANTS) :])
    print(
        f"{found} of {len(MUTANTS)} mutants found, {right} with the right cause first; "
        f"of {pairs} with two faults the second is found in {both}; "
        f"{faulted} of {len(CORRECT)} correct solvers faulted"
    )


def row_of(name: str, mutant: Mutant | None, one: FileCheck) -> tuple[str, ...]:
    """A row of the table; a correct solver has no fault that could be found."""
    row = first(one) if mutant else next(iter(one.faults), None)
    reported = (row.task, row.cause) if row else ("", "")
    right = "" if mutant is None else "yes" if said_first(mutant, one) else "no"
    second = ("", "")
    if mutant is not None and mutant.second is not None:
        second = (mutant.second[0], "yes" if said_too(mutant, one) else "no")
    return (name, mutant.task if mutant else "", "yes" if row else "no", *reported, right, *second)


if __name__ == "__main__":
    main()
