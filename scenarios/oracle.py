"""The exact answer to scenes without a closed form: hit by hit in many digits, and no further than it is right."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from scenarios.closed_forms import Hit, answer, world_pushes
from scenarios.event_truth import float64_truth
from scenarios.model import Array, Scenario, Scene, Thrust, Trajectory, frozen
from scenarios.no_truth import NoTruth
from scenarios.numbers import Numbers, Undecided, balls, digits, has_balls
from scenarios.oracle_bodies import Leg
from scenarios.oracle_events import Event, Path, trace
from scenarios.truth_cache import keep, key_of, look_up

FEWEST_BITS, MOST_BITS = 128, 4096
MOST_DISKS = 200
LARGEST = 1e6  # of any length, speed or time, SI; and the inverse of the smallest radius
ACCURACY = 1e-12  # m; two precisions that differ by more have parted
CERTIFIED_BITS = 4  # times as many for balls, which lose 2.6 times as many as the motion does
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class TruthRecord:
    """An exact motion as its flights, and how far it can be trusted.

    Attributes:
        legs: (l, 8) disk, t s, x, y m, vx, vy m/s, ax, ay m/s2: flights, disk by disk in order of time.
        events: (h, 5) t s, disk, other disk or -1 - wall, impulse N s, cosine of the impact angle |v_n| / |v|.
        valid_until: s; nothing is said of what comes later.
        error_bound: m.
        bits: of the numbers it was computed with; and before that with half as many.
        method: "closed form", "two-precision" or "certified" (also by interval arithmetic).
        reason: why it ends where it does.
        followed_until: s; until then a player with nothing but the rounding of float64 stays within 1e-9 m of it.
    """

    legs: Array = field(repr=False)
    events: Array = field(repr=False)
    valid_until: float
    error_bound: float
    bits: int
    method: str
    reason: str
    followed_until: float = np.inf

    def sampled(self, scene: Scene, thrusts: Sequence[Thrust], t: Array) -> Trajectory:
        """The motion at the times t (k,) s up to where it is known and can be followed; later times are left out."""
        t = np.asarray(t, float)
        position, velocity = np.empty((len(t), scene.n, 2)), np.empty((len(t), scene.n, 2))
        for i in range(scene.n):
            legs = self.legs[self.legs[:, 0] == i]
            leg = legs[np.maximum(np.searchsorted(legs[:, 1], t, side="right") - 1, 0)]
            since, v, a = (t - leg[:, 1])[:, None], leg[:, 4:6], leg[:, 6:8]
            position[:, i] = leg[:, 2:4] + (v + a * since / 2) * since
            velocity[:, i] = v + a * since
        turning = world_pushes(scene, [replace(p, force=np.zeros(2)) for p in thrusts], t)
        hits: list[Hit] = [(float(at), int(i), int(j), float(kick)) for at, i, j, kick, _ in self.events]
        angles = turning.angle, turning.angular_velocity
        until, reason = self.valid_until, self.reason
        if self.followed_until < until:
            until, reason = self.followed_until, "from there on the rounding of float64 leads any player elsewhere"
        return answer(scene, t, (position, velocity), hits, angles, until, self.error_bound, reason)


@dataclass(frozen=True, eq=False)
class OracleTruth:
    """The truth of a scenario by the oracle; nothing is computed before it is called."""

    scenario: Scenario

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
        key = key_of(self.scenario, has_balls())
        found = look_up(key)
        if found is None:
            found = vars(replace(computed(self.scenario), followed_until=followed_until(self.scenario)))
            keep(key, found)
        return TruthRecord(**found)


def followed_until(scenario: Scenario) -> float:
    """s, up to when float64 events from starts a unit in the last place apart stay together; inf: to the end.

    Beyond it a distance between trajectories says nothing about a solver, only about chaos.
    """
    try:
        horizon, reason = float64_truth(scenario).horizon
    except NoTruth:  # no judge in float64: the truth stands by itself
        return np.inf
    return horizon if reason.startswith("float64") else np.inf


def oracle_truth(scenario: Scenario) -> Callable[[Array], Trajectory]:
    """Times (k,) s -> the exact `Trajectory` of `scenario` at those: see `OracleTruth`."""
    return OracleTruth(scenario)


def with_oracle(scenario: Scenario) -> Scenario:
    """The scenario with the oracle for its truth."""
    return replace(scenario, truth=oracle_truth(scenario), without_truth="")


def computed(scenario: Scenario, kind: Callable[[int], Numbers] = digits) -> TruthRecord:
    """The record of a scenario, computed; twice the bits until two precisions agree to the end.

    Raises:
        NoTruth: the scene has more than the oracle can do, or bodies overlap at the start.
    """
    scene, thrusts, until = scenario.scene, scenario.thrusts, scenario.duration
    if scene.n > MOST_DISKS:
        raise NoTruth(f"{scene.n} disks are more than the {MOST_DISKS} that are followed in many digits")
    if fault := _out_of_scale(scenario):
        raise NoTruth(fault)
    if any(push.frame == "body" and push.force.any() for push in thrusts):
        raise NoTruth("a push that turns with its disk makes paths whose contacts no polynomial gives")
    pushes = [push for push in thrusts if push.force.any()]
    bits = FEWEST_BITS
    coarse = trace(scene, pushes, until, kind(bits))
    while True:
        fine = trace(scene, pushes, until, kind(2 * bits))
        parted, error = difference(coarse, fine, until, kind(2 * bits))
        end = min(coarse.end, fine.end, until)
        if parted >= end or 2 * bits >= MOST_BITS:
            break
        bits, coarse = 2 * bits, fine
    reason = fine.reason if fine.end < until else ""
    if parted < end:
        end, reason = parted, f"the digits of {2 * bits} bits are used up at t = {parted:.9g} s"
    method = "two-precision"
    if not reason and has_balls() and certified(scenario, pushes, fine, 2 * bits * CERTIFIED_BITS):
        method = "certified"
    return _record(scenario, fine, end, error, 2 * bits, method, reason)


def _out_of_scale(scenario: Scenario) -> str:
    """What is too small or too large for `Numbers.tie`, which takes numbers to be of the order of 1; or ""."""
    scene = scenario.scene
    if not (scene.radius >= 1 / LARGEST).all():
        return f"a radius of {scene.radius.min():g} m is below {1 / LARGEST:g} m: too small to tell a hit from a touch"
    sizes = {
        "radius": scene.radius, "position": scene.position, "wall": scene.walls, "velocity": scene.velocity,
        "gravity": scene.gravity, "duration": np.array([scenario.duration]),
    }  # fmt: skip
    for name, values in sizes.items():
        if values.size and (most := float(np.abs(values).max())) > LARGEST:
            return f"a {name} of {most:g} (SI) is above {LARGEST:g}: too large to follow to {ACCURACY:g} m"
    return ""


def difference(coarse: Path, fine: Path, until: float, k: Numbers) -> tuple[float, float]:
    """When the two part, s, or inf: the first event in which they differ by `ACCURACY`; and the error until then, m."""
    parted, errors = np.inf, [(0.0, 0.0)]
    end = min(coarse.end, fine.end, until)
    with k.precise():
        for mine, theirs in zip(coarse.legs, fine.legs):
            for leg in mine[len(theirs) :] + theirs[len(mine) :]:
                parted = min(parted, float(leg.t)) if float(leg.t) < end - ACCURACY else parted
            for one, other in zip(mine, theirs):
                t = min(float(one.t), float(other.t))
                if t < end and (error := _apart(one, other, end - t)) > ACCURACY:
                    parted = min(parted, t)
                    break
                errors.append((t, error if t < end else 0.0))
    return parted, max(error for t, error in errors if t < parted)


def _apart(one: Leg, other: Leg, left: float) -> float:
    """m between two flights at their start and, at worst, `left` s later."""
    place = max(abs(float(one.x - other.x)), abs(float(one.y - other.y)))
    speed = max(abs(float(one.vx - other.vx)), abs(float(one.vy - other.vy)))
    late = abs(float(one.t - other.t)) * max(abs(float(one.vx)), abs(float(one.vy)))
    return place + late + speed * left


def certified(scenario: Scenario, pushes: Sequence[Thrust], path: Path, bits: int) -> bool:
    """Whether interval arithmetic proves every comparison of `path`: same hits, and balls smaller than `ACCURACY`."""
    k = balls(bits)
    try:
        proven = trace(scenario.scene, pushes, scenario.duration, k)
    except Undecided:
        return False
    same = [(e.i, e.j) for e in proven.events] == [(e.i, e.j) for e in path.events]
    widest = max(float(x.rad()) for legs in proven.legs for leg in legs for x in leg)
    near = all(
        abs(float(a) - float(b)) < ACCURACY
        for mine, theirs in zip(proven.legs, path.legs)
        for one, other in zip(mine, theirs)
        for a, b in zip(one, other)
    )
    return same and near and widest < ACCURACY and not proven.reason


def _record(
    scenario: Scenario, path: Path, end: float, error: float, bits: int, method: str, reason: str
) -> TruthRecord:
    flights = [(i, leg) for i, legs in enumerate(path.legs) for leg in legs if float(leg.t) < end or leg is legs[0]]
    legs = np.array([[i, *map(float, leg)] for i, leg in flights])
    events = sorted((_row(event) for event in path.events if float(event.t) < end), key=lambda row: row[:3])
    # The instant at which the answer is lost already belongs to what is not known.
    horizon = float(np.nextafter(end, 0)) if reason else np.inf
    # Legs and samples are float64: a few roundings of the largest coordinate and of the longest way since a hit.
    reach = np.abs(legs[:, 2:4]).max() + scenario.duration * np.abs(legs[:, 4:6]).max()
    return TruthRecord(
        legs=frozen(legs),
        events=frozen(np.array(events).reshape(-1, 5)),
        valid_until=max(horizon, 0.0),
        error_bound=error + 4 * EPS * float(reach),
        bits=bits,
        method=method,
        reason=reason,
    )


def _row(event: Event) -> list[float]:
    i, j = (event.i, event.j) if event.j < 0 or event.i < event.j else (event.j, event.i)
    return [float(event.t), i, j, float(event.impulse), event.cosine]
