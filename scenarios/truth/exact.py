"""The exact answer to scenes without a closed form: hit by hit in many digits, and no further than it is right."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from scenarios.model import Array, Scenario, Thrust, Trajectory
from scenarios.no_truth import NoTruth
from scenarios.truth.cache import keep, key_of, look_up
from scenarios.truth.oracle.bodies import Leg
from scenarios.truth.oracle.events import trace
from scenarios.truth.oracle.numbers import Numbers, Undecided, balls, digits, has_balls
from scenarios.truth.oracle.path import Path
from scenarios.truth.record import TruthRecord, record_of

FEWEST_BITS, MOST_BITS = 128, 8192  # half of them are the tie: float64 must be told apart
LEAST_GAIN = 1.05  # times as far must half as many bits again reach, or more will not help
SPARE, LEFT = 1.3, 64  # times as many bits as the rate so far asks for, and so many to be left for the accuracy
MOST_DISKS = 200
WORK = 40_000  # steps of the event loop for one attempt, some twenty seconds; few attempts get so far
HEAVY = 4096  # bits that make a step twice as dear as one of few bits
LARGEST = 1e6  # of any length, speed or time, SI; and the inverse of the smallest radius
CLOSED_FORM, HIT_BY_HIT, NOTHING = "closed form", "hit by hit, in many digits", "nothing"
ACCURACY = 1e-12  # radii of the smallest disk, and s; two precisions that differ by more have parted


@dataclass(frozen=True, eq=False)
class OracleTruth:
    """The truth of a scenario by the oracle; nothing is computed before it is called, nor what is `known` already."""

    scenario: Scenario
    known: TruthRecord | None = None

    def __call__(self, t: Array) -> Trajectory:
        """The exact `Trajectory` at the times t (k,) s, cut at its horizon.

        Raises:
            NoTruth: there is no answer, or none that reaches the second sample.
            ValueError: a time lies after the scenario's duration.
        """
        one = self.scenario
        if np.max(t) > one.duration * (1 + 1e-9):
            raise ValueError(f"t = {np.max(t):g} s: the truth of {one.name} is known up to {one.duration:g} s")
        record = self.record()
        if record.valid_until < one.sample_interval:
            raise NoTruth(record.reason)
        return record.sampled(one.scene, one.thrusts, t)

    def record(self) -> TruthRecord:
        """The record: from the cache, or computed and put there. Raises `NoTruth`."""
        if self.known is not None:
            return self.known
        key = key_of(self.scenario, has_balls())
        found = look_up(key)
        if found is None:
            found = vars(computed(self.scenario))
            keep(key, found)
        return TruthRecord(**found)


def oracle_truth(scenario: Scenario) -> Callable[[Array], Trajectory]:
    """Times (k,) s -> the exact `Trajectory` of `scenario` at those: see `OracleTruth`."""
    return OracleTruth(scenario)


def answered_by(scenario: Scenario) -> str:
    """The cheapest model that answers it and is no player, which the harness takes for its truth: one of the three."""
    if scenario.truth is None:
        return NOTHING
    return HIT_BY_HIT if isinstance(scenario.truth, OracleTruth) else CLOSED_FORM


def with_oracle(scenario: Scenario) -> Scenario:
    """The scenario with the oracle for its truth."""
    return replace(scenario, truth=oracle_truth(scenario), without_truth="")


def computed(scenario: Scenario, kind: Callable[[int], Numbers] | None = None) -> TruthRecord:
    """The record of a scenario: proven by balls where they are installed and can, else the same at two precisions.

    kind: numbers to compute it in, at two precisions, whatever is installed.

    Raises:
        NoTruth: the scene has more than the oracle can do, or bodies overlap at the start.
    """
    scene, thrusts = scenario.scene, scenario.thrusts
    if scene.n > MOST_DISKS:
        raise NoTruth(f"{scene.n} disks are more than the {MOST_DISKS} that are followed in many digits")
    if fault := _out_of_scale(scenario):
        raise NoTruth(fault)
    if any(push.frame == "body" and push.force.any() for push in thrusts):
        raise NoTruth("a push that turns with its disk makes paths whose contacts no polynomial gives")
    pushes = [push for push in thrusts if push.force.any()]
    record = certified(scenario, pushes) if kind is None and has_balls() else None
    return record or two_precisions(scenario, pushes, kind or digits)


def certified(scenario: Scenario, pushes: Sequence[Thrust]) -> TruthRecord | None:
    """The record by interval arithmetic, which proves every comparison; None where no precision decides one.

    How far the first bits reach tells how many are needed for all: a motion loses them at a steady rate.
    """
    bits, before, until, accuracy = FEWEST_BITS, 0.0, scenario.duration, accuracy_of(scenario)
    while bits <= MOST_BITS:
        try:
            path = trace(scenario.scene, pushes, until, balls(bits), steps(bits))
            error, reached = spread(path, until), until
            if error < accuracy:
                return record_of(scenario, path, error, bits, "certified")
        except Undecided as doubt:
            reached = doubt.t
        # Bits help against chaos, not where two things are equal.
        if reached <= before * LEAST_GAIN and before < until:
            return None
        needed = LEFT + ceil(SPARE * bits * until / max(reached, until * bits / MOST_BITS))
        before, bits = reached, max(bits + bits // 2, needed)
    return None


def steps(bits: int) -> int:
    """How many steps of the event loop in numbers of so many bits are the work of one attempt."""
    return int(WORK / (1 + bits / HEAVY))


def spread(path: Path, until: float) -> float:
    """m, how far the right motion may be from the middle of the balls, at worst."""
    widths = [
        [leg.x.rad(), leg.y.rad(), leg.vx.rad(), leg.vy.rad(), leg.t.rad(), abs(leg.vx), abs(leg.vy), leg.t]
        + [x.rad() for x in leg.hop or ()]
        for legs in path.legs for leg in legs
    ]  # fmt: skip
    most = 0.0
    for x, y, u, v, late, vx, vy, t, *hop in ([float(each) for each in row] for row in widths):
        left = max(min(path.end, until) - t, 0.0)
        most = max(most, max(x, y) + late * max(vx, vy) + (max(u, v) + sum(hop)) * left)
    return most


def two_precisions(scenario: Scenario, pushes: Sequence[Thrust], kind: Callable[[int], Numbers]) -> TruthRecord:
    """The record in numbers of one kind, up to where twice as many bits say the same."""
    scene, until, bits = scenario.scene, scenario.duration, FEWEST_BITS
    while True:
        coarse, fine = (trace(scene, pushes, until, kind(each), steps(each)) for each in (bits, 2 * bits))
        parted, error = difference(coarse, fine, until, kind(2 * bits), accuracy_of(scenario))
        end = min(coarse.end, fine.end, until)
        if parted >= end or 2 * bits >= MOST_BITS:
            break
        needed = ceil(SPARE * bits * until / max(parted, until * bits / MOST_BITS))
        bits = min(max(2 * bits, needed), MOST_BITS // 2)
    if parted < end:
        reason = f"the digits of {2 * bits} bits are used up at t = {parted:.9g} s"
        fine = replace(fine, end=parted, reason=reason, disks=[], outcomes=[])
    return record_of(scenario, fine, error, 2 * bits, "two-precision")


def _out_of_scale(scenario: Scenario) -> str:
    """What is too small or too large for `Numbers.tie`, which takes numbers to be of the order of 1; or ""."""
    scene = scenario.scene
    if not (scene.radius >= 1 / LARGEST).all():
        return f"a radius of {scene.radius.min():g} m is below {1 / LARGEST:g} m: too small to tell a hit from a touch"
    sizes = {
        "radius": scene.radius, "position": scene.position, "wall": scene.walls, "velocity": scene.velocity,
        "gravity": scene.gravity, "duration": np.array([scenario.duration]),
        "acceleration by a thrust": np.array([p.force / scene.mass[p.disk] for p in scenario.thrusts]),
    }  # fmt: skip
    for name, values in sizes.items():
        if values.size and (most := float(np.abs(values).max())) > LARGEST:
            return f"the largest {name} is {most:g} (SI), above {LARGEST:g}: too large to follow exactly"
    return ""


def accuracy_of(scenario: Scenario) -> float:
    """m, `ACCURACY` of the smallest radius: the same in any unit of length."""
    return ACCURACY * float(scenario.scene.radius.min())


def difference(coarse: Path, fine: Path, until: float, k: Numbers, accuracy: float) -> tuple[float, float]:
    """When the two part, s, or inf: the first event in which they differ by `accuracy` m; the error until then, m."""
    parted, errors = np.inf, [(0.0, 0.0)]
    end = min(coarse.end, fine.end, until)
    with k.precise():
        for mine, theirs in zip(coarse.legs, fine.legs):
            for leg in mine[len(theirs) :] + theirs[len(mine) :]:
                parted = min(parted, float(leg.t)) if float(leg.t) < end - ACCURACY else parted
            for one, other in zip(mine, theirs):
                t = min(float(one.t), float(other.t))
                if t < end and (error := _apart(one, other, end - t)) > accuracy:
                    parted = min(parted, t)
                    break
                errors.append((t, error if t < end else 0.0))
    return parted, max((error for t, error in errors if t < parted), default=0.0)


def _apart(one: Leg, other: Leg, left: float) -> float:
    """m between two flights at their start and, at worst, `left` s later."""
    place = max(abs(float(one.x - other.x)), abs(float(one.y - other.y)))
    speed = max(abs(float(one.vx - other.vx)), abs(float(one.vy - other.vy)))
    late = abs(float(one.t - other.t)) * max(abs(float(one.vx)), abs(float(one.vy)))
    if (one.hop is None) != (other.hop is None):
        return np.inf
    hop = sum(abs(float(a - b)) for a, b in zip(one.hop or (), other.hop or ()))
    return place + late + (speed + hop) * left
