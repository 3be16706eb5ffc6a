"""The oracle's record against a motion that asks every pair for its next collision, in 420 bits:
`exact_motion`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.exact import computed
from crosscheck2d.scenarios.truth.record import TruthRecord
from tests.independent.exact_motion import Motion
from tests.independent.random_scenes import RESTITUTIONS, SURROUNDINGS, random_scene

pytestmark = pytest.mark.independent

Record = Callable[[str, object], None]

SCENES, MOST_EVENTS = 320, 60
ACCURACY = 1e-12  # m, and s: what the project says that its exact answers are certain to
# s: of bounces that die out on a wall those that last less are not in the record's list, as it says
LEAST = 1e-4
# s: no event so close to the end is compared, for it is in one list and may be just beyond the
# other
SHORT = 1e-9
# s: where collisions follow each other within 1e-9 s, the accumulation is nearer than that for all
# of our e
NEAR = 1e-8


@dataclass
class Compared:
    """What a scene's comparison found: events compared, the largest distance in m, and every
    disagreement."""

    events: int
    distance: float
    faults: list[str]


def compared(scenario: Scenario, motion: Motion, record: TruthRecord) -> Compared:
    faults = []
    if record.horizon < float(motion.end) - (NEAR if motion.reason == "accumulation" else ACCURACY):
        faults.append(
            f"the record ends at {record.horizon} s, the motion goes on to {float(motion.end)} s"
        )
    end = min(float(motion.end), record.horizon)
    own = [(float(e.t), e.i, e.j, float(e.impulse), float(e.cosine)) for e in motion.events]
    unlisted = {
        e[:3]
        for e in own
        if any(e[1:3] == f[1:3] and e[2] < 0 < abs(e[0] - f[0]) < LEAST for f in own)
    }
    own = [e for e in own if e[0] < end - SHORT and e[:3] not in unlisted]
    theirs = [tuple(row) for row in record.events if row[0] < end - SHORT and row[3] > 0]
    theirs = [
        f
        for f in theirs
        if not any(f[1:3] == u[1:3] and abs(f[0] - u[0]) < ACCURACY for u in unlisted)
    ]
    if len(own) != len(theirs):
        faults.append(f"{len(own)} events, the record has {len(theirs)}")
    for e, row in zip(own, theirs):
        if e[1:3] != row[1:3] or abs(e[0] - row[0]) > ACCURACY:
            faults.append(f"{e} is {row} in the record")
            break
        # a cosine near 0 is certain to less
        if not np.allclose(e[3:], row[3:], rtol=1e-10, atol=ACCURACY):
            faults.append(f"impulse or angle: {e} is {row} in the record")
    # The record is asked past its horizon, too: that is about engines of float64, not about the
    # record.
    times = np.linspace(0, end, 17)[:-1]
    whole = replace(record, float64_horizon=np.inf)
    sampled = whole.sampled(scenario.scene, scenario.thrusts, times)
    if len(sampled) < len(times):
        faults.append(f"{len(sampled)} of {len(times)} samples")
    distance = 0.0
    for k, t in enumerate(sampled.t):
        position = [[float(disk.x.real), float(disk.x.imag)] for disk in motion.at(float(t))]
        distance = max(distance, float(np.abs(position - sampled.position[k]).max()))
    if distance > ACCURACY:
        faults.append(f"{distance:.2g} m apart")
    return Compared(len(own), distance, faults)


@pytest.mark.parametrize(
    "seeds",
    [range(0, SCENES, 8), pytest.param(range(SCENES), marks=pytest.mark.long)],
    ids=["an eighth", "all"],
)
def test_the_oracle_gives_the_events_and_positions_of_a_motion_that_asks_all_pairs(
    record_property: Record, seeds: range
):
    found, ends = [], Counter()
    for seed in seeds:
        scenario = random_scene(seed)
        motion = Motion(scenario, MOST_EVENTS)
        found.append((scenario.name, compared(scenario, motion, computed(scenario))))
        ends[
            " ".join(word for word in motion.reason.split() if not word.isdigit()) or "duration"
        ] += 1
    faults = [f"{name}: {fault}" for name, result in found for fault in result.faults]
    record_property(
        "found",
        f"exact answers: {len(found)} scenes, {sum(r.events for _, r in found)} events, positions"
        f" within {max(r.distance for _, r in found):.1e} m, {len(faults)} disagreements; compared"
        f" up to: {dict(ends)}",
    )

    assert not faults
    assert sum(result.events for _, result in found) > 10 * len(seeds)


def test_every_restitution_meets_all_surroundings():
    scenes = [random_scene(seed) for seed in range(SCENES)]
    met = {(s.scene.restitution, s.name.split("-")[0]) for s in scenes}

    assert len(met) == len(RESTITUTIONS) * len(SURROUNDINGS)
    features = [(s.scene.gravity.any(), len(s.thrusts) > 0, s.scene.static.any()) for s in scenes]
    assert all({*map(bool, feature)} == {True, False} for feature in zip(*features))


@pytest.mark.parametrize("seed", [4, 21])
def test_a_record_that_is_wrong_in_one_thing_is_noticed(seed: int):
    # an event dropped, spurious, 2e-12 s late or of another pair; a disk off by 2e-12 m; an end
    # that is too early
    scenario = random_scene(seed)
    motion, record = Motion(scenario, MOST_EVENTS), computed(scenario)
    assert len(record.events) > 5

    def changed(row: int, column: int, by: float) -> np.ndarray:
        events = record.events.copy()
        events[row, column] += by
        return events

    moved = record.legs.copy()
    moved[:, 2] += 2e-12
    wrong = [
        replace(record, events=np.delete(record.events, 3, axis=0)),
        replace(record, events=np.insert(record.events, 3, record.events[2], axis=0)),
        replace(record, events=changed(3, 0, 2e-12)),
        replace(record, events=changed(3, 2, 1)),
        replace(record, events=changed(3, 3, 1e-6)),
        replace(record, legs=moved),
        replace(record, horizon=float(motion.end) / 2),
    ]

    assert not compared(scenario, motion, record).faults
    assert all(compared(scenario, motion, other).faults for other in wrong)
