"""Turns limits into what the page and the README show: cells, findings, and maps as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from math import isnan
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.page.situations import ENGINE, FAR_OFF, grouped
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.stability.cases_friction import FRICTION
from crosscheck2d.reports.stability.limits import (
    LIMIT,
    NEVER_FAILS,
    NEVER_WORKS,
    ONLY_BEYOND,
    Case,
    Limit,
)
from crosscheck2d.reports.stability.maps import MAPS, MapOf
from crosscheck2d.reports.stability.touching import AT_ONCE, PAIRS, AtGap
from crosscheck2d.reports.terminal.counts import counted, listed
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario

WITH_FRICTION = {case.name for case in FRICTION}


def in_words(limit: Limit) -> str:
    """The limit in a few characters."""
    refused = "refused from " if limit.refused else ""
    end = "" if limit.monotone else "*"
    return limit.word or f"{refused}{limit.sign}{number(limit.fails_at)}{end}"


class LimitCell(NamedTuple):
    """A cell of a table: its text, a longer remark, its colour in the heat ramp (-1: none), and
    whether it failed."""

    text: str
    remark: str = ""
    heat: int = -1
    failed: bool = False


class SharedReason(NamedTuple):
    """A reason in words, its source, how it was tested, and the engines with this reason."""

    text: str
    source: str
    tested: str
    engines: list[str]


class MapTable(NamedTuple):
    """An engine's map: a row for each y, from large to small, with a cell for each x."""

    engine: str
    rows: list[tuple[float, list[LimitCell]]]


def cell_of(case: Case, limit: Limit | None) -> LimitCell:
    """A limit in the overview; the gentler the value at which it fails, the deeper its colour."""
    if limit is None:
        return LimitCell("")
    remark = f"{limit.verdict}. {why(limit)}"
    if limit.verdict == NEVER_FAILS:
        return LimitCell(limit.word, f"does not fail up to {number(limit.works_at)}", 0)
    if limit.word:
        return LimitCell(limit.word, remark, -1, True)
    gentler = sum(case.harsher * value < case.harsher * limit.fails_at for value in case.values)
    passed = gentler / len(case.values)
    return LimitCell(in_words(limit), remark, max(1, min(9, round(9 * (1 - passed)))))


def held(case: Case) -> dict[str, str]:
    """Symbol -> value with unit of what the numbers of a case depend on and it does not vary: the
    step size dt and the radii R of the disks that move. A symbol is left out if it varies, and R if
    no disk moves."""
    ends = [case.scene(value, 0) for value in (case.values[0], case.values[-1])]
    steps = [scenario.dt(scenario.substeps[0]) for scenario in ends]
    radii = [scenario.scene.radius[~scenario.scene.static] for scenario in ends]
    found = {}
    if steps[0] == steps[1]:
        found["dt"] = f"{number(1e3 * steps[0])} ms"
    least, most = (
        sorted({float(pick(each)) for each in radii if len(each)}) for pick in (np.min, np.max)
    )
    if len(least) == len(most) == 1:
        span = (
            number(least[0]) if least == most else f"{number(least[0], 2)} to {number(most[0], 2)}"
        )
        found["R"] = f"{span} m"
    return found


def in_report(case: Case) -> str:
    """How the report judges the scene `case.report`, and how its question differs from the case's;
    "" if the case names none."""
    if not case.report:
        return ""
    one, mine = scenario(case.report), case.scene(case.values[0], 0)
    dt = number(1e3 * one.dt(one.middle_substeps))
    here = f"dt is {kept}" if (kept := held(case).get("dt")) else "dt is varied"
    if np.array_equal(one.scene.position, mine.scene.position):
        differ = f"the same scene, at dt {dt} ms; here {here}"
    else:
        differ = f"another scene: {setting(one)}, at dt {dt} ms; here {setting(mine)}, and {here}"
    return (
        f"{case.report} is {differ}. In the report an engine fails if a disk is more than"
        f" {number(FAR_OFF)} radius from its exact position, or if there is no result. Here it"
        f" fails if {case.predicate.means}. So an engine may fail here and not in the report, or"
        " the other way round."
    )


def setting(one: Scenario) -> str:
    """How many walls a scene has, and how long it lasts."""
    return f"{counted(len(one.scene.walls), 'wall')} for {number(one.duration)} s"


def why(limit: Limit) -> str:
    """The reason as a sentence."""
    if not limit.reason:
        return "" if limit.verdict == NEVER_FAILS else "Not explained."
    return f"{limit.why[0].upper()}{limit.why[1:]}."


def reasons(limits: Sequence[Limit]) -> list[SharedReason]:
    """Every reason once, with its engines, in the order of first appearance."""
    found: dict[tuple[str, str, str], list[str]] = {}
    for limit in limits:
        if limit.verdict != NEVER_FAILS:
            found.setdefault((why(limit), limit.source, limit.tested), []).append(limit.engine)
    return [SharedReason(*key, engines) for key, engines in found.items()]


def bracket(limit: Limit) -> tuple[str, str]:
    """The values where it works and where it fails, as text."""
    works = "nowhere" if isnan(limit.works_at) else number(limit.works_at, 4)
    fails = "nowhere tried" if isnan(limit.fails_at) else limit.sign + number(limit.fails_at, 4)
    return works, fails


def where_it_works(limit: Limit) -> str:
    """The values at which it works and fails, from gentle to harsh; "" if there is only one
    change."""
    if limit.monotone:
        return ""
    said = []
    for works, group in groupby(limit.trials, key=lambda trial: trial.works):
        first, *others = (number(trial.value, 4) for trial in group)
        span = f"{first} to {others[-1]}" if others else first
        said.append(f"{'works' if works else 'fails'} at {span}")
    return "From gentle to harsh it " + ", ".join(said) + "."


def findings(limits: Sequence[Limit]) -> list[str]:
    """A few sentences with counts of the limits."""
    mine = [limit for limit in limits if limit.engine in ENGINES]
    cases = list(dict.fromkeys(limit.case for limit in mine))
    failing = [limit for limit in mine if limit.verdict != NEVER_FAILS]
    refused = sum(limit.word == "refused" for limit in mine)
    found = [limit for limit in mine if limit.verdict in (LIMIT, ONLY_BEYOND)]
    said = [
        f"{counted(len(mine), 'search', 'searches')} in {counted(len(cases), 'case')}:"
        f" {len(mine) - len(failing)} found no failure at any value tried,"
        f" {sum(not limit.refused for limit in found)} found a limit,"
        f" {sum(limit.verdict == NEVER_WORKS for limit in mine) - refused} failed at every value,"
        f" and in {refused + sum(limit.refused for limit in found)} the engine refused to play, at"
        " every value or from one on."
    ]
    rough = [limit for limit in mine if limit.case in WITH_FRICTION]
    smooth = [limit for limit in mine if limit.case not in WITH_FRICTION]
    said += fewest_and_most(smooth, " without friction" if rough else "")
    said += fewest_and_most(rough, " with friction")
    if failing:
        tested = sum(bool(limit.tested) for limit in failing)
        said.append(
            f"The reason of {tested} of {counted(len(failing), 'limit')} was tested in one of four"
            " ways. The limit follows from the reason; an engine that differs in this one thing"
            " works at harsher values; the failing run works without this thing; or the ablated"
            " reference, with as few mechanisms of the engine as possible, works and fails at the"
            " same values. The other reasons are called likely, or not known."
        )
    odd = [limit for limit in mine if not limit.monotone]
    if odd:
        names = ", ".join(dict.fromkeys(f"{limit.engine} in {limit.case}" for limit in odd[:3]))
        said.append(
            f"In {counted(len(odd), 'search', 'searches')} (marked *) the engine works again beyond"
            f" its first failure, for example {names}. The table has the first failure."
        )
    return said


def fewest_and_most(limits: Sequence[Limit], which: str) -> list[str]:
    """A sentence that names the engines that fail in the fewest and in the most of these cases,
    among those that model any of them, and which of the libraries fail in the fewest if all of the
    former are this project's; none for a single case, or if no engine fails."""
    taken = [limit for limit in limits if limit.word != "refused"]
    fails = dict.fromkeys((limit.engine for limit in taken), 0)
    for limit in limits:
        if limit.engine in fails:
            fails[limit.engine] += limit.verdict != NEVER_FAILS
    cases = len({limit.case for limit in limits})
    if cases < 2 or not any(fails.values()):
        return []
    these = f"the {cases} cases{which}" if which else f"these {cases} cases"
    said = f"In {these} the fewest failures are those of {engines_with(fails, min)}, the most are"
    said += f" those of {engines_with(fails, max)}. A refusal counts as a failure."
    libraries = {engine: fails[engine] for engine in grouped(fails).get(ENGINE, [])}
    if libraries and min(libraries.values()) > min(fails.values()):
        said += f" Of the libraries, the fewest are those of {engines_with(libraries, min)}."
    return [said]


def engines_with(fails: Mapping[str, int], extreme: Callable[[Iterable[int]], int]) -> str:
    """The engines that fail in the fewest or in the most cases, with the number of these."""
    count = extreme(fails.values())
    names = [engine for engine, number in fails.items() if number == count]
    return f"{listed(names)} ({count})"


def map_tables(maps: Sequence[MapOf]) -> dict[str, list[MapTable]]:
    """Map -> a table for each engine."""
    tables: dict[str, list[MapTable]] = {}
    for one in maps:
        bound = MAPS[one.name].predicate.bound
        at = {
            (x, y): map_cell(value, failed, broken, bound)
            for x, y, value, failed, broken in one.cells
        }
        rows = [
            (y, [at[x, y] for x in MAPS[one.name].x if (x, y) in at])
            for y in reversed(MAPS[one.name].y)
        ]
        tables.setdefault(one.name, []).append(MapTable(one.engine, rows))
    return tables


def map_cell(value: float, failed: bool, broken: str, bound: float) -> LimitCell:
    """A reading as a share of its bound: pale far below the bound, in the deeper half of the
    ramp where it fails."""
    if isnan(value):
        return LimitCell("r" if broken.startswith("refused") else "!", broken, -1, True)
    steps = (0.01, 0.1, 0.3, 1.0, 2.0, 5.0, 20.0, 100.0, 1e3)
    share = value / bound
    return LimitCell(
        "×" if failed else "",
        f"{number(value)}{'; ' + broken if broken else ''}",
        sum(share > s for s in steps),
    )


def law_cell(at: AtGap) -> LimitCell:
    """The law that an engine follows at a gap, with a colour where it follows none."""
    if not at.velocity:
        return LimitCell(at.law, "", -1, True)
    motion = "; ".join(f"({number(x, 2)}, {number(y, 2)})" for x, y in at.velocity)
    remark = f"{number(at.off, 2)} off, energy {number(at.energy)}; leave with {motion}"
    short = {PAIRS: "pairs", AT_ONCE: "at once"}.get(at.law, f"energy {at.energy:.2f}")
    return LimitCell(short, remark, {PAIRS: 0, AT_ONCE: 2}.get(at.law, 6))
