"""`pytest --solver FILE`: the check of a solver as tests, in any project. Its modules are imported
only when it runs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from crosscheck2d.reports.check.rows import CheckRow


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option, which is repeatable."""
    group = parser.getgroup("crosscheck", "a hand-written solver of 2D disks")
    group.addoption(
        "--solver",
        action="append",
        default=[],
        metavar="FILE",
        help="check this Exercise.js or solver.py",
    )


def pytest_collection_modifyitems(session: pytest.Session, items: list[pytest.Item]) -> None:
    """Add a test for each row, before all others."""
    for name in reversed(session.config.getoption("--solver")):
        items[:0] = SolverFile.from_parent(
            session, path=(session.config.invocation_params.dir / name)
        ).collect()


class SolverFile(pytest.File):
    """A solver's file as a collector of tests."""

    def collect(self) -> Iterator[pytest.Item]:
        """A test for each row."""
        from crosscheck2d.adapters.own_solver.file import NotASolver
        from crosscheck2d.reports.check.solver import check_solver

        try:
            rows = check_solver(Path(self.path))
        except NotASolver as refusal:
            raise pytest.UsageError(f"--solver {refusal}") from None
        for row in rows:
            yield RowItem.from_parent(
                self, name=f"{row.task}-{row.name.replace(' ', '_')}", row=row
            )


class Fault(Exception):
    """A row that found a fault."""


class RowItem(pytest.Item):
    """A row as a test."""

    def __init__(self, *, row: CheckRow, **given: Any) -> None:
        super().__init__(**given)
        self.row = row

    def runtest(self) -> None:
        """Fail for a fault, skip if the question could not be asked or the row follows from a
        fault."""
        if self.row.verdict in ("not asked", "follows"):
            pytest.skip(self.row.cause)
        if self.row.verdict == "fault":
            raise Fault(self.row.cause)

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], *given: Any, **named: Any
    ) -> str:
        """The row in words, because a traceback would show this program and not the solver."""
        if not isinstance(excinfo.value, Fault):
            return str(super().repr_failure(excinfo, *given, **named))
        from crosscheck2d.reports.check.evidence import evidence

        likely = f"likely: {self.row.cause}"
        return "\n  ".join([self.row.asked, likely, *evidence(self.row)])

    def reportinfo(self) -> tuple[Path, None, str]:
        """The reported location of the test."""
        return self.path, None, f"{self.path.name}: {self.row.name}"
