"""What the page, the terminal and the README say of limits: words for a limit, what a case keeps,
and a few sentences with counts."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from itertools import groupby
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.page.scenes import is_library
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.stability import cases_few
from crosscheck2d.reports.stability.limits import (
    NEVER_FAILS,
    NEVER_WORKS,
    ONLY_BEYOND,
    Case,
    Limit,
)
from crosscheck2d.reports.stability.predicates import REFUSED
from crosscheck2d.reports.terminal.counts import counted, listed

WORDS: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("words.toml").read_text(encoding="utf-8")
)
MARKS: dict[str, str] = WORDS["marks"]


def in_words(limit: Limit) -> str:
    if limit.status != "ok":
        return limit.status
    if limit.verdict == NEVER_FAILS:
        return "–"
    end = "" if limit.monotone else "*"
    if limit.verdict == NEVER_WORKS:
        return (REFUSED if limit.refused else "everywhere") + end
    refused = "refused from " if limit.refused else ""
    return f"{refused}{sign(limit)}{number(limit.fails_at)}{end}"


def sign(limit: Limit) -> str:
    if limit.verdict != ONLY_BEYOND:
        return ""
    return "≤" if limit.works_at > limit.fails_at else "≥"


def bracket(limit: Limit) -> tuple[str, str]:
    works = "nowhere" if isnan(limit.works_at) else number(limit.works_at, 4)
    fails = "nowhere tried" if isnan(limit.fails_at) else sign(limit) + number(limit.fails_at, 4)
    return works, fails


def why(limit: Limit) -> str:
    if limit.cause is None:
        return "" if limit.verdict == NEVER_FAILS else "Not explained."
    text = limit.cause.sentence
    return f"{text[0].upper()}{text[1:]}."


def where_it_works(limit: Limit) -> str:
    if limit.monotone:
        return ""
    parts = []
    for works, trials in groupby(limit.trials, key=lambda trial: trial.works):
        first, *others = (number(trial.value, 4) for trial in trials)
        span = f"{first} to {others[-1]}" if others else first
        parts.append(f"{'works' if works else 'fails'} at {span}")
    return "From gentle to harsh it " + ", ".join(parts) + "."


def held(case: Case) -> dict[str, str]:
    """Symbol -> value with unit: the step size dt and the radii R of the disks that move, where the
    case does not vary them."""
    ends = [case.scene(value, 0) for value in (case.values[0], case.values[-1])]
    steps = {end.dt(end.substeps[0]) for end in ends}
    radii = [end.scene.radius[~end.scene.static] for end in ends]
    least, most = ({float(pick(r)) for r in radii if len(r)} for pick in (np.min, np.max))
    symbols = {}
    if len(steps) == 1:
        symbols["dt"] = f"{number(1e3 * steps.pop())} ms"
    if len(least) == len(most) == 1:
        low, high = least.pop(), most.pop()
        span = number(low) if low == high else f"{number(low, 2)} to {number(high, 2)}"
        symbols["R"] = f"{span} m"
    return symbols


def findings(limits: Sequence[Limit]) -> list[str]:
    limits = [limit for limit in limits if limit.engine in ENGINES]
    table = pd.DataFrame(
        {
            "case": limit.case,
            "engine": limit.engine,
            "failed": limit.verdict != NEVER_FAILS,
            "nowhere": limit.verdict == NEVER_WORKS,
            "refused": limit.refused,
            "tested": bool(limit.cause and limit.cause.shown),
            "lost": limit.status != "ok",
            "friction": limit.case in cases_few.SCENES_WITH_FRICTION,
        }
        for limit in limits
    )
    failed, limited = int(table.failed.sum()), table.failed & ~table.refused
    sentences = [
        WORDS["found"].format(
            counted(len(table), "search", "searches"),
            counted(table.case.nunique(), "case"),
            len(table) - failed,
            (limited & ~table.nowhere).sum(),
            (limited & table.nowhere).sum(),
            table.refused.sum(),
        )
    ]
    rough, smooth = table[table.friction], table[~table.friction]
    sentences += fewest_and_most(smooth, " without friction" if len(rough) else "")
    sentences += fewest_and_most(rough, " with friction")
    if failed:
        tested = (table.failed & table.tested).sum()
        sentences.append(WORDS["tested"].format(tested, counted(failed, "limit")))
    if odd := [limit for limit in limits if not limit.monotone]:
        names = ", ".join(dict.fromkeys(f"{limit.engine} in {limit.case}" for limit in odd[:3]))
        sentences.append(WORDS["again"].format(counted(len(odd), "search", "searches"), names))
    return sentences


def fewest_and_most(table: pd.DataFrame, which: str) -> list[str]:
    # among those that model any of these cases; libraries apart if all in front are this project's
    taken = table[~(table.nowhere & table.refused) | table.lost].engine.unique()
    fails = table[table.engine.isin(taken)].groupby("engine", sort=False).failed.sum()[taken]
    cases = table.case.nunique()
    if cases < 2 or not fails.any():
        return []
    these = f"the {cases} cases{which}" if which else f"these {cases} cases"
    ends = (engines_with(fails, end) for end in (fails.min(), fails.max()))
    sentence: str = WORDS["fewest"].format(these, *ends)
    libraries = fails[[is_library(engine) for engine in fails.index]]
    if len(libraries) and libraries.min() > fails.min():
        sentence += WORDS["libraries"].format(engines_with(libraries, libraries.min()))
    return [sentence]


def engines_with(fails: pd.Series[int], count: int) -> str:
    return f"{listed(list(fails.index[fails == count]))} ({count})"
