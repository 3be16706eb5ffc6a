"""What the page, the terminal and the README say of limits: words for a limit, what a case keeps,
and a few sentences with counts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from math import isnan

import numpy as np

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.page.scenes import LOST, is_library
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
from crosscheck2d.reports.stability.predicates import REFUSED
from crosscheck2d.reports.terminal.counts import counted, listed
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario

WITH_FRICTION = {case.name for case in FRICTION}
MARKS = {
    "–": "did not fail at any value tried",
    "everywhere": "fails at every value, with * at most of them",
    "refused": "the engine does not play the scene, or not from a value on",
    "≤": "fails at this value and below, works above",
    "≥": "fails at this value and above, works below",
    "*": "works again at a harsher value, or also fails at the gentlest value",
}


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


def in_report(case: Case) -> str:
    if not case.report:
        return ""
    reported, here = scenario(case.report), case.scene(case.values[0], 0)
    dt = number(1e3 * reported.dt(reported.middle_substeps))
    dt_here = held(case).get("dt")
    varies = f"dt is {dt_here}" if dt_here else "dt is varied"
    if np.array_equal(reported.scene.position, here.scene.position):
        differ = f"the same scene, at dt {dt} ms; here {varies}"
    else:
        differ = f"another scene: {setting(reported)}, at dt {dt} ms; here {setting(here)}, and"
        differ += f" {varies}"
    return (
        f"{case.report} is {differ}. In the report an engine fails if a disk is more than"
        f" {number(LOST)} radius from its exact position, or if there is no result. Here it"
        f" fails if {case.predicate.means}. So an engine may fail here and not in the report, or"
        " the other way round."
    )


def setting(scene: Scenario) -> str:
    return f"{counted(len(scene.scene.walls), 'wall')} for {number(scene.duration)} s"


def findings(limits: Sequence[Limit]) -> list[str]:
    limits = [limit for limit in limits if limit.engine in ENGINES]
    cases = {limit.case for limit in limits}
    failing = [limit for limit in limits if limit.verdict != NEVER_FAILS]
    nowhere = [limit for limit in limits if limit.verdict == NEVER_WORKS]
    bracketed = [limit for limit in limits if limit.verdict in (LIMIT, ONLY_BEYOND)]
    refused = sum(limit.refused for limit in (*nowhere, *bracketed))
    sentences = [
        f"{counted(len(limits), 'search', 'searches')} in {counted(len(cases), 'case')}:"
        f" {len(limits) - len(failing)} found no failure at any value tried,"
        f" {sum(not limit.refused for limit in bracketed)} found a limit,"
        f" {sum(not limit.refused for limit in nowhere)} failed at every value, and in {refused}"
        " the engine refused to play, at every value or from one on."
    ]
    rough = [limit for limit in limits if limit.case in WITH_FRICTION]
    smooth = [limit for limit in limits if limit.case not in WITH_FRICTION]
    sentences += fewest_and_most(smooth, " without friction" if rough else "")
    sentences += fewest_and_most(rough, " with friction")
    if failing:
        shown = sum(bool(limit.cause and limit.cause.shown) for limit in failing)
        sentences.append(
            f"The reason of {shown} of {counted(len(failing), 'limit')} was tested in one of four"
            " ways. The limit follows from the reason; an engine that differs in this one thing"
            " works at harsher values; the failing run works without this thing; or the ablated"
            " reference, with as few mechanisms of the engine as possible, works and fails at the"
            " same values. The other reasons are called likely, or not known."
        )
    if odd := [limit for limit in limits if not limit.monotone]:
        names = ", ".join(dict.fromkeys(f"{limit.engine} in {limit.case}" for limit in odd[:3]))
        sentences.append(
            f"In {counted(len(odd), 'search', 'searches')} (marked *) the engine works again beyond"
            f" its first failure, for example {names}. The table has the first failure."
        )
    return sentences


def fewest_and_most(limits: Sequence[Limit], which: str) -> list[str]:
    # among those that model any of these cases; libraries apart if all in front are this project's
    taken = [x for x in limits if not (x.verdict == NEVER_WORKS and x.refused) or x.status != "ok"]
    fails = dict.fromkeys((limit.engine for limit in taken), 0)
    for limit in limits:
        if limit.engine in fails:
            fails[limit.engine] += limit.verdict != NEVER_FAILS
    cases = len({limit.case for limit in limits})
    if cases < 2 or not any(fails.values()):
        return []
    these = f"the {cases} cases{which}" if which else f"these {cases} cases"
    sentence = f"In {these} the fewest failures are those of {engines_with(fails, min)}, the most"
    sentence += f" are those of {engines_with(fails, max)}. A refusal counts as a failure."
    libraries = {engine: count for engine, count in fails.items() if is_library(engine)}
    if libraries and min(libraries.values()) > min(fails.values()):
        sentence += f" Of the libraries, the fewest are those of {engines_with(libraries, min)}."
    return [sentence]


def engines_with(fails: Mapping[str, int], extreme: Callable[[Iterable[int]], int]) -> str:
    count = extreme(fails.values())
    names = [engine for engine, number in fails.items() if number == count]
    return f"{listed(names)} ({count})"
