"""The exact answer to scenes without a closed form: an event-driven computation in many digits, cut
at the horizon up to which it is right."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from crosscheck2d.scenarios.model import Array, Scenario, Thrust, Trajectory
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.cache import keep, key_of, look_up
from crosscheck2d.scenarios.truth.oracle.bodies import Leg
from crosscheck2d.scenarios.truth.oracle.events import trace, turns_with_disk
from crosscheck2d.scenarios.truth.oracle.numbers import Numbers, Undecided, balls, mpfr
from crosscheck2d.scenarios.truth.oracle.path import Path, TimeLimit, WorkLimit
from crosscheck2d.scenarios.truth.oracle.resting import FOR_SERIES
from crosscheck2d.scenarios.truth.record import (
    CERTIFIED,
    TWO_PRECISIONS,
    TruthRecord,
    last_time,
    record_of,
)

FEWEST_BITS, MOST_BITS = 128, 8192  # the tie is 2^-(bits / 2), below the eps of float64
LEAST_GAIN = 1.05  # 1.5 times the bits must reach 1.05 times as far, else more bits do not help
# a factor on the bits predicted from the loss so far, and the bits to be left for the accuracy
SPARE, LEFT = 1.3, 64
MOST_DISKS = 200
# steps of the event loop for one attempt, about twenty seconds; few attempts need so many
WORK = 40_000
HEAVY = 4096  # bits at which a step takes twice the time of one with few bits
SHORTEST = 1e-9  # m, of a wall, as in scene files; the square of a tiny one is 0 in float64
LARGEST = 1e6  # of any length, speed or time, SI; and the inverse of the smallest radius
CLOSED_FORM, EVENT_DRIVEN, NOTHING = "closed form", "event-driven, in many digits", "nothing"
# share of the remaining time for the coarser of two precisions; the finer one takes a little longer
COARSE = 0.45
# radii of the smallest disk, and s; two precisions that differ by more than this have diverged
ACCURACY = 1e-12


@dataclass(frozen=True, eq=False)
class OracleTruth:
    """The truth of a scenario, computed by the oracle at the first call.

    known: a record to use instead of computing one.
    """

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
            raise ValueError(
                f"t = {np.max(t):g} s: the truth of {one.name} is known up to {one.duration:g} s"
            )
        record = self.record()
        if record.horizon < one.sample_interval:
            raise NoTruth(record.reason)
        return record.sampled(one.scene, one.thrusts, t)

    def record(self, clock: TimeLimit | None = None) -> TruthRecord:
        """From the cache or computed; cached unless the time of `clock` ran out. Raises
        `NoTruth`."""
        if self.known is not None:
            return self.known
        key = key_of(self.scenario)
        found = look_up(key)
        if found is None:
            clock = clock or TimeLimit()
            found = vars(computed(self.scenario, None, clock))
            if not clock.expired:
                keep(key, found)
        return TruthRecord(**found)


def answered_by(scenario: Scenario) -> str:
    if scenario.truth is None:
        return NOTHING
    return EVENT_DRIVEN if isinstance(scenario.truth, OracleTruth) else CLOSED_FORM


def with_oracle(scenario: Scenario) -> Scenario:
    return replace(scenario, truth=OracleTruth(scenario), without_truth="")


def computed(
    scenario: Scenario, kind: Callable[[int], Numbers] | None = None, clock: TimeLimit | None = None
) -> TruthRecord:
    """The record of a scenario: proven by interval arithmetic where that decides every comparison,
    else computed at two precisions that agree.

    kind: the numbers for two precisions; if given, no interval arithmetic.
    clock: when its time runs out, the record ends where the computation is then.

    Raises:
        NoTruth: the scene has more than the oracle can do, or bodies overlap at the start.
    """
    scene, thrusts = scenario.scene, scenario.thrusts
    if scene.n > MOST_DISKS:
        raise NoTruth(
            f"{scene.n} disks are more than the {MOST_DISKS} that are computed in many digits"
        )
    if fault := _out_of_scale(scenario):
        raise NoTruth(fault)
    # Without friction a torque does not affect the motion, unless a thrust turns with its disk.
    turning = scene.friction or turns_with_disk(thrusts)
    forced = [p for p in thrusts if p.force.any() or (turning and p.torque)]
    clock = clock or TimeLimit()
    record = certified(scenario, forced, clock) if kind is None else None
    return record or two_precisions(scenario, forced, kind or mpfr, clock)


def certified(scenario: Scenario, forced: Sequence[Thrust], clock: TimeLimit) -> TruthRecord | None:
    """The record by interval arithmetic, which proves every comparison; None where a comparison
    stays undecided at every precision.

    A motion loses bits at a steady rate: the time reached so far predicts the bits that the whole
    duration needs. When the time of `clock` runs out, the attempt that got farthest is returned.
    """
    bits, before, until, accuracy = FEWEST_BITS, 0.0, scenario.duration, accuracy_of(scenario)
    attempts: list[tuple[Path, int]] = []
    while bits <= MOST_BITS:
        try:
            work = WorkLimit(allowed_steps(bits), clock)
            path = trace(scenario.scene, forced, until, balls(bits), work)
            error, reached = widest(widths(path), min(path.end, until)), until
            if error < accuracy and not clock.expired:
                return record_of(scenario, path, error, bits, CERTIFIED)
        except Undecided as doubt:
            path, reached = replace(doubt.path, end=doubt.t), doubt.t
        attempts.append((path, bits))
        if clock.expired:
            return farthest(scenario, attempts, clock)
        # More bits help against chaos, but do not decide whether two numbers are equal.
        if reached <= before * LEAST_GAIN and before < until:
            return None
        needed = LEFT + ceil(SPARE * bits * until / max(reached, until * bits / MOST_BITS))
        before, bits = reached, max(bits + bits // 2, needed)
    return None


def allowed_steps(bits: int) -> int:
    return int(WORK / (1 + bits / HEAVY))


def farthest(
    scenario: Scenario, attempts: Sequence[tuple[Path, int]], clock: TimeLimit
) -> TruthRecord:
    found = [
        (exact_until(path, scenario.duration, accuracy_of(scenario)), path, bits)
        for path, bits in attempts
    ]
    (end, error), path, bits = max(found, key=lambda one: one[0][0])
    if end < path.end or not path.reason:
        path = path.cut(end, f"{clock.reason} at t = {end:.9g} s")
    return record_of(scenario, path, error, bits, CERTIFIED)


def exact_until(path: Path, until: float, accuracy: float) -> tuple[float, float]:
    """The time, s, up to which the spread of a path is below `accuracy` m, and the spread, m,
    then."""
    table, end = widths(path), min(path.end, until)
    if (most := widest(table, end)) < accuracy:
        return end, most
    held = last_time(lambda t: widest(table, t) < accuracy, end)
    return held, widest(table, held)


def widths(path: Path) -> Array:
    """(l, 3) for each leg: its start, s, the radius of its balls then, m, and the rate at which it
    grows, m/s; with friction angles count as well, 1 rad as 1 m."""
    rows = []
    for leg in (leg for legs in path.legs for leg in legs):
        angle, spin = leg.turn[:2] if leg.turn else (leg.x, leg.vx)
        places, rates = (leg.x, leg.y, angle), (leg.vx, leg.vy, spin)
        late, speed = float(leg.t.rad()), max(float(abs(rate)) for rate in rates)
        width = max(float(place.rad()) for place in places) + late * speed
        hop = sum(float(x.rad()) for x in leg.hop or ())
        rows.append((float(leg.t), width, max(float(rate.rad()) for rate in rates) + hop))
    return np.array(rows)


def widest(table: Array, until: float) -> float:
    begun = table[table[:, 0] <= until]
    return float((begun[:, 1] + begun[:, 2] * (until - begun[:, 0])).max())


def two_precisions(
    scenario: Scenario, forced: Sequence[Thrust], kind: Callable[[int], Numbers], clock: TimeLimit
) -> TruthRecord:
    scene, until, bits = scenario.scene, scenario.duration, FEWEST_BITS
    attempts: list[tuple[Path, float, int]] = []
    while True:
        work = WorkLimit(allowed_steps(bits), clock, COARSE)
        coarse = trace(scene, forced, until, kind(bits), work)
        work = WorkLimit(allowed_steps(2 * bits), clock)
        fine = trace(scene, forced, until, kind(2 * bits), work)
        diverged, error = difference(coarse, fine, until, kind(2 * bits), accuracy_of(scenario))
        end = min(coarse.end, fine.end, until)
        if clock.expired and coarse.end < fine.end:
            fine = fine.cut(end, coarse.reason)
        if diverged < end:
            reason = f"numbers of {2 * bits} bits have used up their digits at t = {diverged:.9g} s"
            fine = fine.cut(diverged, reason)
        attempts.append((fine, error, 2 * bits))
        few = (coarse.few_bits or fine.few_bits) and bits < FOR_SERIES
        if (diverged >= end and not few) or 2 * bits >= MOST_BITS or clock.expired:
            break
        needed = FOR_SERIES * few + ceil(
            SPARE * bits * until / max(diverged, until * bits / MOST_BITS)
        )
        bits = min(max(2 * bits, needed), MOST_BITS // 2)
    path, error, bits = attempts[-1]
    if clock.expired:
        path, error, bits = max(attempts, key=lambda attempt: min(attempt[0].end, until))
        if path.few_bits:  # more of them were tried, and the time ran out
            path = path.cut(path.end, f"{clock.reason} at t = {path.end:.9g} s")
    return record_of(scenario, path, error, bits, TWO_PRECISIONS)


def _out_of_scale(scenario: Scenario) -> str:
    """What is too small or too large for `Numbers.tie`, which assumes numbers of the order of 1, or
    ""."""
    scene = scenario.scene
    if not (scene.radius >= 1 / LARGEST).all():
        return (
            f"a radius of {scene.radius.min():g} m is below {1 / LARGEST:g} m: too small to tell a"
            " collision from a contact without approach"
        )
    if (length := np.hypot(*(scene.walls[:, 1] - scene.walls[:, 0]).T).min(initial=1.0)) < SHORTEST:
        return f"a wall of {length:g} m is below {SHORTEST:g} m: too short to follow exactly"
    sizes = {
        "radius": scene.radius,
        "position": scene.position,
        "wall": scene.walls,
        "velocity": scene.velocity,
        "gravity": scene.gravity,
        "friction": np.array(scene.friction),
        "duration": np.array([scenario.duration]),
        "acceleration by a thrust": np.array(
            [p.force / scene.mass[p.disk] for p in scenario.thrusts]
        ),
    }
    for name, values in sizes.items():
        if values.size and (most := float(np.abs(values).max())) > LARGEST:
            return (
                f"the largest {name} is {most:g} (SI), above {LARGEST:g}: too large to follow"
                " exactly"
            )
    return ""


def accuracy_of(scenario: Scenario) -> float:
    return ACCURACY * float(scenario.scene.radius.min())


def difference(
    coarse: Path, fine: Path, until: float, k: Numbers, accuracy: float
) -> tuple[float, float]:
    """When two paths first differ by `accuracy` m (s, or inf), and the largest difference before,
    m."""
    diverged, errors = np.inf, [(0.0, 0.0)]
    end = min(coarse.end, fine.end, until)
    with k.precise():
        for mine, theirs in zip(coarse.legs, fine.legs):
            for leg in mine[len(theirs) :] + theirs[len(mine) :]:
                if float(leg.t) < end - ACCURACY:
                    diverged = min(diverged, float(leg.t))
            for one, other in zip(mine, theirs):
                t = min(float(one.t), float(other.t))
                if t < end and (error := _apart(one, other, end - t)) > accuracy:
                    diverged = min(diverged, t)
                    break
                errors.append((t, error if t < end else 0.0))
    return diverged, max((error for t, error in errors if t < diverged), default=0.0)


def _apart(one: Leg, other: Leg, left: float) -> float:
    place = max(abs(float(one.x - other.x)), abs(float(one.y - other.y)))
    speed = max(abs(float(one.vx - other.vx)), abs(float(one.vy - other.vy)))
    if one.turn is not None and other.turn is not None:
        place = max(place, abs(float(one.turn.angle - other.turn.angle)))
        speed = max(speed, abs(float(one.turn.spin - other.turn.spin)))
    late = abs(float(one.t - other.t)) * max(abs(float(one.vx)), abs(float(one.vy)))
    if (one.hop is None) != (other.hop is None):
        return np.inf
    hop = sum(abs(float(a - b)) for a, b in zip(one.hop or (), other.hop or ()))
    return place + late + (speed + hop) * left
