"""Which mechanisms of an engine are enough to produce its limit: the reference with only these
works and fails at the same values as the engine.

`adapters/mechanisms/table.py` lists what an engine does differently from exact flight with
end-of-step detection, and `adapters/mechanisms/ablated_reference.py` can enable each of these
mechanisms. An ablation is the reference with some of them enabled. An ablation that has the
engine's limit shows its cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import partial
from math import isnan

from crosscheck2d.adapters.mechanisms.table import (
    AIR,
    DIGITS,
    EDGES,
    FLIGHT,
    FRICTION,
    IMPULSE,
    MECHANISMS,
    POSITION_CORRECTION,
    RECYCLING,
    RESTITUTION,
    SIDES,
    SKIN,
    SWEPT,
    Mechanism,
    mechanisms_of,
    with_mechanisms,
)
from crosscheck2d.reports.stability.limits import Case, Limit
from crosscheck2d.reports.stability.predicates import Reading, judge
from crosscheck2d.reports.stability.search import LimitSearch
from crosscheck2d.reports.stability.variants import DrivenEngine
from crosscheck2d.reports.terminal.counts import listed
from crosscheck2d.scenarios.model import Scenario

END_OF_STEP = "end-of-step detection"  # the ablation without any mechanism
ACTS_AT_END = "a collision takes effect at the end of the step in which it is found"
MOST = 300  # disks: the ablated reference tests all pairs
# where an engine works nowhere, the reading of its ablation must be the same within this factor
NEAR = 2.0

B2_SETTINGS, B2_TYPES = "Box2D 2.3 Common/b2Settings.h: ", "Box2D 3.1 src/types.c: "
THRESHOLD = "collisions that close at less than 1 m/s are played as inelastic"
THRESHOLDS = {
    "box2d": B2_SETTINGS + "b2_velocityThreshold",
    "box2d_v3": B2_TYPES + "restitutionThreshold",
}
PRODUCT = "the elasticities of the two shapes are multiplied: e on every shape gives e²"
OF_PYMUNK = "Munk2D src/cpArbiter.c, cpArbiterUpdate"
TOGETHER = "the contacts of a step are solved together, in the engine's own order of stages"
OWN_ORDER = "adapters/mechanisms/ablated.py, from the engine's own step"
AT_ONCE = "an overlap is corrected at once, which moves disks before they collide"
SENTENCES = (
    (END_OF_STEP, "*", ACTS_AT_END, "contacts are detected once per step"),
    (
        FLIGHT,
        "*",
        "under a force the displacement in a step is not v dt + a dt² / 2",
        "alpha of ENGINES",
    ),
    (RESTITUTION, "pymunk:*", PRODUCT, OF_PYMUNK),
    (RESTITUTION, "box2d:*", THRESHOLD, THRESHOLDS["box2d"]),
    (RESTITUTION, "box2d_v3:*", THRESHOLD, THRESHOLDS["box2d_v3"]),
    (RESTITUTION, "planck:*", THRESHOLD, "planck Settings.velocityThreshold"),
    (
        RESTITUTION,
        "rapier2d:*",
        "a contact that bore an impulse in the step before does not bounce unless e is 1",
        OWN_ORDER,
    ),
    (RESTITUTION, "*", "not every collision has the restitution that the scene states", OWN_ORDER),
    (RECYCLING, "*", "a pair that has hardly moved is not looked at again", OWN_ORDER),
    (EDGES, "*", "a disk that leaves a torus is set onto its edge", "exercise 11, projectObjects"),
    (IMPULSE, "reference:*", "walls come first, then pairs", "reference_impl/lesson.py"),
    (IMPULSE, "*", TOGETHER, OWN_ORDER),
    (POSITION_CORRECTION, "reference:*", AT_ONCE, "exercise 11, task 2"),
    (
        POSITION_CORRECTION,
        "*",
        "overlaps are corrected gradually, separately from the velocities",
        OWN_ORDER,
    ),
    (FRICTION, "*", "friction reduces the speed along the contact", "the engine's default"),
    (SKIN, "*", "walls are thicker than the scene states", B2_SETTINGS + "b2_polygonRadius"),
    (DIGITS, "*", "numbers are float32", "IEEE 754"),
    (SWEPT, "*", "a fast disk is swept along its path, a slow one sleeps", OWN_ORDER),
    (AIR, "*", "friction of the air slows every disk", OWN_ORDER),
    (SIDES, "*", "disks are polygons, so that an impulse acts at a corner", OWN_ORDER),
)
"""Mechanism, engines, what it does, and the source; the last row of each mechanism is for "*"."""


def sufficient_mechanisms(search: LimitSearch, limit: Limit) -> str:
    """The smallest set of mechanisms with which the reference has the limit, as text;
    `END_OF_STEP` if it needs none, "" if no set has the limit or no ablation can be played.

    Tried in this order: end-of-step detection alone; each mechanism alone (with those it acts
    on); all mechanisms, from which those that are not needed are then removed.
    """
    ablations = Ablations.of(search, limit)
    if ablations is None:
        return ""
    for mechanisms in ablations.simple():
        if ablations.alike(mechanisms):
            return ", ".join(mechanism.name for mechanism in mechanisms) or END_OF_STEP
    if not ablations.mechanisms or not ablations.alike(ablations.mechanisms):
        return ""
    return ", ".join(mechanism.name for mechanism in ablations.needed())


@dataclass(frozen=True)
class Ablations:
    """A case with the scenarios that fail and work next to a limit, the engine's mechanisms, and
    the reading of its failing run.

    Attributes:
        bad: the first run that failed.
        good: all runs at the nearest value that works; empty if the engine works nowhere.
    """

    case: Case
    bad: Scenario
    good: list[Scenario]
    mechanisms: list[Mechanism]
    reading: Reading

    @staticmethod
    def of(search: LimitSearch, limit: Limit) -> Ablations | None:
        """None if nothing failed, nothing was played, or the engine has no known mechanisms."""
        seen, failing = search.failure(limit), limit.failing
        name, _, variant = search.engine.partition("+")
        if seen is None or failing is None or seen[1].trajectory is None or name not in MECHANISMS:
            return None
        judged, run = seen
        scene, runs = search.case.scene, failing.runs
        bad = scene(limit.fails_at, failing.first)
        good = [] if isnan(limit.works_at) else [scene(limit.works_at, run) for run in range(runs)]
        if bad.scene.n > MOST:
            return None
        dt = bad.dt(bad.substeps[0])
        known = [] if variant else mechanisms_of(name, run.settings, bad.scene, dt)
        mechanisms = [mechanism for mechanism in known if mechanism.parameters]
        reading = judge(search.case.predicate, judged, run)
        return Ablations(search.case, bad, good, mechanisms, reading)

    def simple(self) -> Iterator[list[Mechanism]]:
        """No mechanism, then each one with those it acts on."""
        yield []
        for mechanism in self.mechanisms:
            yield [*(each for each in self.mechanisms if each.name in mechanism.on_top), mechanism]

    def needed(self) -> Sequence[Mechanism]:
        """The mechanisms that remain after removing, one after the other, each one without which
        the ablation still has the limit."""
        left = list(self.mechanisms)
        for mechanism in self.mechanisms:
            fewer = [
                each for each in left if each is not mechanism and mechanism.name not in each.on_top
            ]
            if self.alike(fewer):
                left = fewer
        return left

    def alike(self, mechanisms: Sequence[Mechanism]) -> bool:
        """Whether the ablation fails as the engine does at the limit, and works where the engine
        works."""
        reading = self.read(self.bad, mechanisms)
        if not reading.failed or reading.broken != self.reading.broken:
            return False
        if self.good:
            failed = sum(self.read(scenario, mechanisms).failed for scenario in self.good)
            return failed <= self.case.by_chance * len(self.good)
        return 1 / NEAR <= reading.value / self.reading.value <= NEAR

    def read(self, scenario: Scenario, mechanisms: Sequence[Mechanism]) -> Reading:
        """The readings of the predicate in the ablation's run or runs."""
        ablation = DrivenEngine("reference:ablation", partial(with_mechanisms, mechanisms))
        return judge(self.case.predicate, *self.case.play(ablation, scenario))


def words_of(mechanism: str, engine: str) -> tuple[str, str, str, str]:
    """The row of `SENTENCES` for a mechanism of an engine; raises `KeyError` if it is none."""
    for row in SENTENCES:
        if row[0] == mechanism and fnmatch(engine, row[1]):
            return row
    raise KeyError(mechanism)


def reason_by_ablation(limit: Limit) -> tuple[str, str, str]:
    """The reason that the ablation gives, its source, and how it was tested."""
    names = limit.mechanisms.split(", ")
    rows = [words_of(name, limit.engine) for name in names]
    text, source = ("; ".join(dict.fromkeys(row[k] for row in rows)) for k in (2, 3))
    more = "nothing else" if limit.mechanisms == END_OF_STEP else f"the engine's {listed(names)}"
    return text, source, f"the reference with end-of-step detection and {more} has this limit"
