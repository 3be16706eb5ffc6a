"""Which habits of an engine suffice for its limit: the reference with these alone works and fails where the engine
does.

What an engine does otherwise than exact flight with late collisions is a table of habits
(`adapters.mechanisms.habits`), each of them a switch of `adapters.mechanisms.ablated_reference`.
A twin is the reference with some; one that has the engine's limit shows the cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import partial
from math import isnan

from adapters.mechanisms.habits import (
    DIGITS,
    FLIGHT,
    FRICTION,
    HABITS,
    IMPULSE,
    POSITION_CORRECTION,
    RESTITUTION,
    SKIN,
    Habit,
    habits_of,
    with_habits,
)
from reports.stability.limits import Case, Limit
from reports.stability.predicates import Reading, judge
from reports.stability.search import Search
from reports.stability.variants import Variant
from scenarios.model import Scenario

LATE = "late collisions"  # a twin without any habit
COLLISIONS_WAIT = "a collision waits for the end of its step"
MOST = 300  # disks: the switched solver asks all pairs
NEAR = 2.0  # where an engine works nowhere, its twin must read as much as it does, to this factor

B2_SETTINGS, B2_TYPES = "Box2D 2.3 Common/b2Settings.h: ", "Box2D 3.1 src/types.c: "
THRESHOLD = "collisions that close at less than 1 m/s are played as inelastic"
THRESHOLDS = {"box2d": B2_SETTINGS + "b2_velocityThreshold", "box2d_v3": B2_TYPES + "restitutionThreshold"}
PRODUCT = "the elasticities of the two shapes are multiplied: e on every shape gives e²"
OF_PYMUNK = "Munk2D src/cpArbiter.c, cpArbiterUpdate"
TOGETHER = "the contacts of a step get their impulses together, in the engine's own order of stages"
OWN_ORDER = "adapters/mechanisms/switched.py, from the engine's own step"
AT_ONCE = "an overlap is undone at once, so that disks move that have struck nothing yet"
SENTENCES = (
    (LATE, "*", COLLISIONS_WAIT, "contacts are looked for once a step"),
    (FLIGHT, "*", "under a force a step of flight goes another way than v dt + a dt² / 2", "alpha of ENGINES"),
    (RESTITUTION, "pymunk:*", PRODUCT, OF_PYMUNK),
    (RESTITUTION, "box2d:*", THRESHOLD, THRESHOLDS["box2d"]),
    (RESTITUTION, "box2d_v3:*", THRESHOLD, THRESHOLDS["box2d_v3"]),
    (IMPULSE, "reference:*", "walls come first, then pairs", "reference_impl/lesson.py"),
    (IMPULSE, "*", TOGETHER, OWN_ORDER),
    (POSITION_CORRECTION, "reference:*", AT_ONCE, "exercise 11, task 2"),
    (POSITION_CORRECTION, "*", "overlaps are corrected gradually, apart from the motion", OWN_ORDER),
    (FRICTION, "*", "friction takes speed along the contact", "the engine's default"),
    (SKIN, "*", "walls are thicker than they are drawn", B2_SETTINGS + "b2_polygonRadius"),
    (DIGITS, "*", "numbers are float32", "IEEE 754"),
)
"""Habit, engines, what it does, and where that stands."""


def twin_of(search: Search, limit: Limit) -> str:
    """The fewest habits whose twin has the limit, as text; `LATE` for none of them; "" if no twin has it, or none is.

    First late collisions alone, then every habit by itself (with those it acts on), then all less what is not needed.
    """
    twins = Twins.of(search, limit)
    if twins is None:
        return ""
    for habits in twins.simple():
        if twins.alike(habits):
            return ", ".join(habit.name for habit in habits) or LATE
    if not twins.habits or not twins.alike(twins.habits):
        return ""
    return ", ".join(habit.name for habit in twins.needed())


@dataclass(frozen=True)
class Twins:
    """A case with the scenarios that fail and work next to a limit, the engine's habits, and what is read off its run.

    Attributes:
        bad: the first run that failed.
        good: all runs next to it, none of which failed; none where the engine works nowhere.
    """

    case: Case
    bad: Scenario
    good: list[Scenario]
    habits: list[Habit]
    reading: Reading

    @staticmethod
    def of(search: Search, limit: Limit) -> Twins | None:
        """None where nothing failed or was played at all, or nothing is known of the engine."""
        seen, failing, (name, *switched) = search.failure(limit), limit.failing, search.engine.split("+")
        if seen is None or failing is None or seen[1].trajectory is None or name not in HABITS:
            return None
        judged, run = seen
        scene, runs = search.case.scene, failing.runs
        bad = scene(limit.fails_at, failing.first)
        good = [] if isnan(limit.works_at) else [scene(limit.works_at, run) for run in range(runs)]
        if bad.scene.n > MOST:
            return None
        known = [] if switched else habits_of(name, run.settings, bad.scene, bad.dt(bad.substeps[0]))
        habits = [habit for habit in known if habit.switches]
        return Twins(search.case, bad, good, habits, judge(search.case.predicate, judged, run))

    def simple(self) -> Iterator[list[Habit]]:
        """None, then each with those it acts on."""
        yield []
        for habit in self.habits:
            yield [*(each for each in self.habits if each.name in habit.on_top), habit]

    def needed(self) -> Sequence[Habit]:
        """All habits less those without which, one after the other, the twin still has the limit."""
        left = list(self.habits)
        for habit in self.habits:
            fewer = [each for each in left if each is not habit and habit.name not in each.on_top]
            if self.alike(fewer):
                left = fewer
        return left

    def alike(self, habits: Sequence[Habit]) -> bool:
        """Whether the twin breaks what the engine breaks where that fails, and works where it works."""
        reading = self.read(self.bad, habits)
        if not reading.failed or reading.broken != self.reading.broken:
            return False
        if self.good:
            failed = sum(self.read(scenario, habits).failed for scenario in self.good)
            return failed <= self.case.by_chance * len(self.good)
        return 1 / NEAR <= reading.value / self.reading.value <= NEAR

    def read(self, scenario: Scenario, habits: Sequence[Habit]) -> Reading:
        """What the predicate reads off the twin's run, or runs."""
        twin = Variant("reference:twin", partial(with_habits, habits))
        return judge(self.case.predicate, *self.case.play(twin, scenario))


def told(limit: Limit) -> tuple[str, str, str]:
    """The reason that the twin gives, where it stands, and how it was tested."""
    names = limit.twin.split(", ")
    rows = [next(row for row in SENTENCES if row[0] == name and fnmatch(limit.engine, row[1])) for name in names]
    text, source = ("; ".join(dict.fromkeys(row[k] for row in rows)) for k in (2, 3))
    if limit.twin == LATE:
        return text, source, "the reference with late collisions and nothing else has this limit"
    tested = f"the reference with late collisions and the engine's {listed(names)} has this limit"
    return text, source, tested


def listed(names: Sequence[str]) -> str:
    """a, b and c."""
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
