"""The checks of solvers' files that take part in a run or in the game."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.check.evidence import lines_and_formula
from crosscheck2d.reports.check.verdict import check_file
from crosscheck2d.reports.page.kit import Said, with_lines
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.suite import Check
from crosscheck2d.reports.terminal.exits import say

CHECKING = 10.0  # s that the game waits for the check of a file, which takes one or two


def checks_of(engines: Sequence[str]) -> dict[str, Callable[[], Check]]:
    """A task for each solver's file among these engines, relative to the current folder."""
    return {
        name: partial(checked, Path(name.removesuffix(OWN)).absolute())
        for name in engines
        if name.endswith(OWN)
    }


def checked(path: Path) -> Check:
    one = check_file(path)
    shown = [lines_and_formula(row) for row in one.findings]
    return Check(one.passed, one.sentences, shown, one.solver.source if one.solver else "")


def said_of(engines: Sequence[str]) -> dict[str, list[Said]]:
    """The check of each solver's file among these engines, its sentences also printed on standard
    error: the game plays them with their faults."""
    tasks: dict[Hashable, Any] = {name: check for name, check in checks_of(engines).items()}
    if not tasks:
        return {}
    found: dict[str, list[Said]] = {}
    with closing(run_all(tasks, min(os.cpu_count() or 1, len(tasks)), CHECKING)) as results:
        for name, check in results:
            if isinstance(check, Failure):
                late = f"It was not checked within {CHECKING:g} s: crosscheck check says more."
                found[name] = with_lines([late], [])
            else:
                found[name] = with_lines(check.says, check.shown)
    found = {name: found[name] for name in engines if name in found}
    for name, pairs in found.items():
        say("\n".join(lines(name, [sentence for sentence, _ in pairs])))
    return found


def lines(name: str, sentences: Sequence[str]) -> list[str]:
    numbers = [f"{k}. " for k in range(1, len(sentences) + 1)] if len(sentences) > 1 else [""]
    heading = f"{name.removesuffix(OWN)}, by crosscheck check:"
    return [heading, *(f"  {number}{text}" for number, text in zip(numbers, sentences))]
