"""Explains failures without a reason in the table: the failing run is played with one thing
changed, until it works."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fnmatch import fnmatch
from functools import partial
from typing import NamedTuple

import numpy as np

from adapters.engines import ENGINES, FETCHED
from reports.stability.ablations import ACTS_AT_END, reason_by_ablation
from reports.stability.cases_collisions import BULLETS
from reports.stability.limits import NOT_KNOWN, Limit
from reports.stability.predicates import judge
from reports.stability.search import LimitSearch
from reports.stability.variants import play_as
from reports.stability.vary import similar
from scenarios.model import Scenario

FINER = 8
# a power of two: an engine without length and time scales of its own plays the same to the last
# bit, so that no change helps by chance
UNITS = 32.0


def finer(one: Scenario) -> Scenario:
    """The same scene in steps of an eighth."""
    return replace(one, substeps=(one.substeps[0] * FINER,))


def at_home(one: Scenario) -> Scenario:
    """The same scene, moved along x so that its middle is at the origin."""
    return similar(one, shift=-float(np.mean(one.scene.position[:, 0])))


def unchanged(one: Scenario) -> Scenario:
    """The same scene."""
    return one


class Intervention(NamedTuple):
    """One change to a failing run.

    Attributes:
        engines, varied: patterns of engines and of what is varied, for which it is tried.
        reason: why it failed, if it works with the change.
        how: the change in words.
        change: what is done to the scene.
        engine: the engine that plays it instead; "": the same.
    """

    engines: str
    varied: str
    reason: str
    how: str
    change: Callable[[Scenario], Scenario] = unchanged
    engine: str = ""

    def fits(self, engine: str, varied: str) -> bool:
        """Whether the change is tried for this engine and this parameter."""
        return fnmatch(engine, self.engines) and fnmatch(varied, self.varied)


SAYS_SO = "the engine's message says so"
INTERVENTIONS = {
    "at_home": Intervention(
        "box2d*",
        "offset",
        "positions are float32, too coarse so far from the origin",
        "at the origin",
        at_home,
    ),
    "faster": Intervention(
        "[pb]*",
        "*",
        "too slow for a time scale of the engine (threshold of restitution, rate of position"
        " correction)",
        "32 times as fast",
        partial(similar, tempo=UNITS),
    ),
    "slower": Intervention(
        "[pb]*",
        "*",
        "too fast for a time scale of the engine (cap on speed, rate of position correction)",
        "32 times as slow",
        partial(similar, tempo=1 / UNITS),
    ),
    "larger": Intervention(
        "[pb]*",
        "*",
        "too small for a length scale of the engine (slop, margin, skin)",
        "32 times as large, at the same speeds",
        partial(similar, size=UNITS, tempo=1 / UNITS),
    ),
    "smaller": Intervention(
        "[pb]*",
        "*",
        "too large for a length scale of the engine (limit on displacement in a step, slop)",
        "32 times as small, at the same speeds",
        partial(similar, size=1 / UNITS, tempo=UNITS),
    ),
    "in_order": Intervention(
        "reference:[el]*", "*", ACTS_AT_END, "as reference:ordered", engine="reference:ordered"
    ),
    # For matter a smaller step is ambiguous: its friction, its friction of the air and its resting
    # threshold depend on the step, too.
    "finer_matter": Intervention(
        "matter:*",
        "[!d]*",
        f"{NOT_KNOWN}; the step is too large for something in it",
        "in steps of an eighth",
        finer,
    ),
    "finer": Intervention(
        "*",
        "[!d]*",
        f"{ACTS_AT_END}, and the step is too large for that",
        "in steps of an eighth",
        finer,
    ),
    **{
        f"{bullets.partition(':')[0]}_swept": Intervention(
            bullets.removesuffix("+bullets"),
            "*",
            "disks are not swept against each other",
            f"as {bullets}",
            engine=bullets,
        )
        for bullets in BULLETS
    },
    **{
        f"{engine}_matched": Intervention(
            f"{engine}:shipped",
            "*",
            "a default of the engine that the matched profile changes",
            f"as {engine}:matched",
            engine=f"{engine}:matched",
        )
        for engine in dict.fromkeys(name.partition(":")[0] for name in (*ENGINES, *FETCHED))
        if {f"{engine}:shipped", f"{engine}:matched"} <= {*ENGINES, *FETCHED}
    },
}
"""In the order in which they are tried: changes of one thing only come first, a finer step comes
later.

Where the step itself is varied, a finer one is not tried.
"""


def intervention_of(search: LimitSearch, limit: Limit) -> str:
    """The first change with which the run that failed at the limit works; "" if none does, or if
    nothing failed.

    A refusal needs no other explanation.
    """
    seen = search.failure(limit)
    if seen is None or seen[1].status == "unsupported":
        return ""
    scenario, _ = seen
    for name, intervention in INTERVENTIONS.items():
        if intervention.fits(search.engine, search.case.varies):
            changed = intervention.change(scenario)
            if not judge(
                search.case.predicate,
                changed,
                play_as(intervention.engine or search.engine, changed),
            ).failed:
                return name
    return ""


def reason_by_intervention(limit: Limit, varied: str) -> tuple[str, str, str]:
    """The reason for a failure that has none in the table, its source, and how it was tested, or
    ""."""
    failing = limit.failing
    if failing is None:
        return "", "", ""
    if limit.mechanisms:
        return reason_by_ablation(limit)
    if intervention := INTERVENTIONS.get(limit.intervention):
        return intervention.reason, "", f"works {intervention.how}"
    if failing.broken == "refused":
        return "the engine refuses it", "", SAYS_SO
    tried = [
        intervention.how
        for intervention in INTERVENTIONS.values()
        if intervention.fits(limit.engine, varied)
    ]
    return f"{NOT_KNOWN}; it also fails {', '.join(tried)}" if tried else NOT_KNOWN, "", ""
