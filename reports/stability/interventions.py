"""Explains failures without a reason in the table: the failing run is played with one thing
changed, until it works."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from fnmatch import fnmatch
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.settings import find_remedy, settings_of, without_finer
from crosscheck2d.reports.compare.causes import (
    ACTS_AT_END,
    Cause,
    CauseKind,
    by_mechanisms,
    unknown,
)
from crosscheck2d.reports.compare.faces import ALONG, first_on_line
from crosscheck2d.reports.stability.limits import Limit
from crosscheck2d.reports.stability.predicates import REFUSED, judge
from crosscheck2d.reports.stability.predicates_usable import GHOST
from crosscheck2d.reports.stability.search import LimitSearch
from crosscheck2d.reports.stability.variants import DrivenEngine, play_as
from crosscheck2d.reports.stability.vary import similar
from crosscheck2d.scenarios.model import Array, Scenario, Scene
from crosscheck2d.scenarios.truth.exact import with_oracle

FINER = 8
SAYS_SO = "the engine's message says so"


def finer(scenario: Scenario) -> Scenario:
    """The same scene in steps of an eighth."""
    return replace(scenario, substeps=(scenario.substeps[0] * FINER,))


def at_home(scenario: Scenario) -> Scenario:
    """The same scene, moved along x so that its middle is at the origin."""
    return similar(scenario, shift=-float(np.mean(scenario.scene.position[:, 0])))


def joined(scenario: Scenario) -> Scenario:
    """The same scene with walls that touch on one line joined into one."""
    walls, scene = list[Array](), scenario.scene
    lines = np.array([first_on_line(scene.walls, w) for w in range(len(scene.walls))])
    for line in np.unique(lines):
        start, end = scene.walls[line]
        way = end - start
        spans = np.sort((scene.walls[lines == line] - start) @ way / (way @ way), axis=1)
        spans = spans[spans[:, 0].argsort()]
        reach = np.maximum.accumulate(spans[:, 1])
        first = np.flatnonzero(np.append(True, spans[1:, 0] > reach[:-1] + ALONG))
        last = np.append(first[1:], len(spans)) - 1
        walls += [start + np.outer(pair, way) for pair in zip(spans[first, 0], reach[last])]
    whole: Scene = replace(scene, walls=np.array(walls).reshape(-1, 2, 2))
    return with_oracle(replace(scenario, scene=whole))


def unchanged(scenario: Scenario) -> Scenario:
    """The same scene."""
    return scenario


class Intervention(NamedTuple):
    """One change to a failing run.

    Attributes:
        engines, varied: patterns of engines and of what is varied, for which it is tried.
        reason: why it failed, if it works with the change; None: that is not known.
        how: the change in words.
        change: what is done to the scene.
        engine: the engine that plays it instead; "": the same.
    """

    engines: str
    varied: str
    reason: str | None
    how: str
    change: Callable[[Scenario], Scenario] = unchanged
    engine: str = ""

    def fits(self, engine: str, varied: str) -> bool:
        """Whether the change is tried for this engine and this parameter."""
        return fnmatch(engine, self.engines) and fnmatch(varied, self.varied)


PIECES = "the walls of one floor act as several; join them into one wall"
FLOAT32 = "positions are float32, too coarse so far from the origin"
TOO_LARGE = f"{ACTS_AT_END}, and the step is too large for that"
UNSWEPT, EIGHTHS = "disks are not swept against each other", "in steps of an eighth"
BULLETS = "box2d_v3:matched+bullets"
INTERVENTIONS = {
    "joined": Intervention("*", "*", PIECES, "on a floor of one wall", joined),
    "at_home": Intervention("box2d*", "offset", FLOAT32, "at the origin", at_home),
    "in_order": Intervention(
        "reference:[el]*", "*", ACTS_AT_END, "as reference:ordered", engine="reference:ordered"
    ),
    # For matter a smaller step is ambiguous: its friction, its friction of the air and its resting
    # threshold depend on the step, too.
    "finer_matter": Intervention("matter:*", "[!d]*", None, EIGHTHS, finer),
    "finer": Intervention("*", "[!d]*", TOO_LARGE, EIGHTHS, finer),
    "swept": Intervention("box2d_v3:matched", "*", UNSWEPT, f"as {BULLETS}", engine=BULLETS),
}
"""In the order in which they are tried: changes of one thing only come first, a finer step comes
later. The settings of the engine come after `FIRST`.

Where the step itself is varied, a finer one is not tried.
"""
FIRST = ("joined",)


def intervention_of(
    search: LimitSearch, limit: Limit, names: Iterable[str] = tuple(INTERVENTIONS)
) -> str:
    """The first change of `names` with which the run that failed at the limit works; "" if none
    does, or if nothing failed.

    A refusal needs no other explanation.
    """
    failure = search.failure(limit)
    if failure is None or failure[1].status == "unsupported":
        return ""
    for name in names:
        intervention = INTERVENTIONS[name]
        if intervention.fits(search.engine, search.case.varies):
            changed = intervention.change(failure[0])
            run = play_as(intervention.engine or search.engine, changed)
            if not judge(search.case.predicate, changed, run).failed:
                return name
    return ""


def with_settings(search: LimitSearch, limit: Limit) -> Limit:
    """The limit with the settings of the engine with which the run that failed at it works, or with
    those that do not help."""
    failure = search.failure(limit)
    if failure is None or failure[1].status == "unsupported" or "+" in search.engine:
        return limit
    scenario, predicate = failure[0], search.case.predicate

    def error(parameters: Mapping[str, Any]) -> float:
        chosen, steps = without_finer(parameters)
        driven = DrivenEngine(search.engine, partial(row_of(search.engine).make, **chosen))
        finer = replace(scenario, substeps=(scenario.substeps[0] * steps,))
        verdict = judge(predicate, *search.case.play(driven, finer))
        share = abs(verdict.value) / (predicate.bound or 1.0)
        if verdict.failed:
            return share if share > 1.0 else np.inf
        return float(np.fmin(share, 1.0))  # nan: there is nothing to judge

    dt = scenario.dt(scenario.substeps[0])
    remedy = find_remedy(settings_of(search.engine, scenario.scene, dt), error, bound=1.0)
    helps = bool(remedy.settings) and remedy.after <= 1.0
    words = remedy.sentence(search.engine) if helps else remedy._replace(settings=()).sentence("")
    return replace(limit, settings=words, settings_help=helps)


def cause_by_replays(limit: Limit, varied: str) -> Cause | None:
    """The cause of a failure that has none in the table, as what removes it shows; None if nothing
    failed."""
    failing = limit.failing
    if failing is None:
        return None
    if limit.settings_help:
        return Cause(CauseKind.SETTING, limit.settings, shown="works with it")
    if limit.mechanisms:
        return by_mechanisms(limit.mechanisms, limit.engine)
    ghost = f"a {GHOST}: " * (failing.broken == GHOST)
    if intervention := INTERVENTIONS.get(limit.intervention):
        shown = f"works {intervention.how}"
        if intervention.reason is None:
            cause = unknown(shown, "the step is too large for something in it")
            return cause._replace(text=ghost + cause.text)
        return Cause(CauseKind.INTERVENTION, ghost + intervention.reason, shown=shown)
    if failing.broken == REFUSED:
        return Cause(CauseKind.REFUSAL, "the engine refuses it", shown=SAYS_SO)
    tried = dict.fromkeys(
        intervention.how
        for name, intervention in INTERVENTIONS.items()
        if name not in FIRST and intervention.fits(limit.engine, varied)
    )
    also = f"it also fails {', '.join(tried)}" if tried else ""
    return unknown("", also, limit.settings)
