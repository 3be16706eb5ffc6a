"""The truth record: an exact motion in float64 as flights and bounces, with its collisions, the
time and reason of its end, and what still holds after it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust, Trajectory, frozen
from crosscheck2d.scenarios.truth.closed_forms import Collision, answer, flight, world_thrusts
from crosscheck2d.scenarios.truth.horizon import DIVERGED
from crosscheck2d.scenarios.truth.oracle.bodies import nearest
from crosscheck2d.scenarios.truth.oracle.jets import count_pieces, push
from crosscheck2d.scenarios.truth.oracle.path import Path
from crosscheck2d.scenarios.truth.order import float64_horizon

EPS = float(np.finfo(float).eps)
# relative to `reach`: a few roundings, of the start of a leg, of a time and of a sample
ROUNDINGS = 4 * EPS
# of the duration of a scene; of bounces that die out, those that last less are not listed, as in
# `walls.bouncing_ball_e09`
LEAST_SHARE = 1e-5
TOUCH = 1e-6  # m; a disk closer to a wall than this at the end may touch it
CERTIFIED, TWO_PRECISIONS = "certified", "two-precision"
SEARCHED = "certified but for the collapse, which is searched"  # see `clusters.collapse`
NO_HOP, NO_TURN = (0.0,) * 4, (0.0,) * 3
# The columns of `TruthRecord.legs`; `NORMAL`, `SPEED` and `FALL` are of the bounces, `TURN` is
# angle, spin and its rate.
DISK, T, PLACE, VELOCITY, ACCELERATION = 0, 1, slice(2, 4), slice(4, 6), slice(6, 8)
NORMAL, SPEED, FALL, TURN = slice(8, 10), 10, 11, slice(12, 15)


@dataclass(frozen=True, eq=False)
class TruthRecord:
    """An exact motion as a list of flights, with its error bound and its horizon."""

    # (l, 15) disk, t s, x, y m, vx, vy m/s, ax, ay m/s2; then, where the disk bounces on a wall
    # until it rests, the normal nx, ny, the speed m/s after the first bounce and the acceleration
    # m/s2 towards the wall, else 0; then, where there is friction, angle rad, spin rad/s and its
    # rate rad/s2, else 0. Sorted by disk, then by time.
    legs: Array = field(repr=False)
    # (h, 5) t s, disk, other disk or -1 - wall, impulse N s, cosine of the impact angle
    # |v_n| / |v|; an impulse of 0 is no collision: from then on the disk rests on the other.
    events: Array = field(repr=False)
    horizon: float  # s; the motion is not known after it
    error_bound: float  # m
    bits: int  # precision of the numbers it was computed with
    # "closed form", `TWO_PRECISIONS` (half as many bits give the same), `CERTIFIED` (interval
    # arithmetic), or `SEARCHED`
    method: str
    reason: str  # why it ends where it does
    float64_horizon: float = np.inf  # s; up to then float64 engines are compared, see `order.py`
    # (o, 4) outcome, disk, vx, vy m/s: all possible outcomes, where the motion ends because the
    # order of collisions matters that are simultaneous but for a rounding
    outcomes: Array = field(repr=False, default_factory=lambda: frozen(np.zeros((0, 4))))
    # (p, 3) outcome, disk, other: for each outcome one order of collisions that leads to it
    orders: Array = field(repr=False, default_factory=lambda: frozen(np.zeros((0, 3))))
    remains: tuple[str, ...] = ()  # sentences on what still holds after the end

    def motion(
        self, scene: Scene, thrusts: Sequence[Thrust], t: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Position and velocity, and angle and spin, (k, n, ...) each, at t (k,) s before the
        horizon."""
        position, velocity = np.empty((len(t), scene.n, 2)), np.empty((len(t), scene.n, 2))
        turning = world_thrusts(scene, [replace(p, force=np.zeros(2)) for p in thrusts], t)
        angle, spin = turning.angle.copy(), turning.angular_velocity.copy()
        for i in range(scene.n):
            legs = self.legs[self.legs[:, DISK] == i]
            leg = legs[np.maximum(np.searchsorted(legs[:, T], t, side="right") - 1, 0)]
            position[:, i], velocity[:, i] = along(leg, t, scene.restitution)
            jets = [p for p in thrusts if p.disk == i and p.frame == "body" and p.force.any()]
            for jet, begun in (
                (p, row) for p in jets for row in {row[T]: row for row in legs}.values()
            ):
                if jet.start <= begun[T] < jet.stop:
                    on = (t >= begun[T]) & (leg[:, T] == begun[T])
                    pushed = push_float64(jet.force / scene.mass[i], begun[TURN], t[on] - begun[T])
                    position[on, i] += pushed[0]
                    velocity[on, i] += pushed[1]
            if scene.friction:
                angle[:, i], spin[:, i] = flight(t - leg[:, T], *leg[:, TURN].T)
        return (position, velocity), (angle, spin)

    def sampled(self, scene: Scene, thrusts: Sequence[Thrust], t: Array) -> Trajectory:
        t = np.asarray(t, float)
        moved, turned = self.motion(scene, thrusts, t)
        # A disk that rests on a wall from the start has a contact without impulse at t = 0. One
        # that comes to rest later is not listed: its contact began with a collision.
        collisions: list[Collision] = [
            (float(at), int(i), int(j), float(kick))
            for at, i, j, kick, _ in self.events
            if kick or not at
        ]
        until, reason = self.horizon, self.reason
        if self.float64_horizon < until:
            until = self.float64_horizon
            reason = "beyond it the rounding of float64 makes any engine diverge"
        return answer(scene, t, moved, collisions, turned, until, self.error_bound, reason)


def along(leg: Array, t: Array, restitution: float) -> tuple[Array, Array]:
    """Position and velocity (k, 2) on the legs (k, 12) at the times t (k,) s: the flight, plus the
    bounces along the normal.

    Bounce k begins s_k = 2 v (1 - e^k) / (g (1 - e)) after the first one at the speed v e^k; from 2
    v / (g (1 - e)) on there is none (any textbook of mechanics, under "bouncing ball").
    """
    since, normal, speed = (t - leg[:, T])[:, None], leg[:, NORMAL], leg[:, SPEED, None]
    position, velocity = flight(since, leg[:, PLACE], leg[:, VELOCITY], leg[:, ACCELERATION])
    hops = speed[:, 0] > 0
    if hops.any():
        e, s, u, g = restitution, since[hops], speed[hops], leg[hops, FALL, None]
        done = np.minimum(s * g * (1 - e) / (2 * u), 1.0)  # of the time until it rests
        with np.errstate(divide="ignore"):
            k = np.floor(np.log1p(-done) / np.log(e))
        k = np.where(done < 1, np.maximum(k, 0), np.inf)
        after = np.maximum(s - 2 * u / g * powers(e, k), 0.0)
        up = np.where(done < 1, u * e**k - g * after, 0.0)
        height = np.where(done < 1, np.maximum((u * e**k - g * after / 2) * after, 0.0), 0.0)
        position[hops] += normal[hops] * height
        velocity[hops] += normal[hops] * up
    return position, velocity


def push_float64(force: Array, turn: Array, s: Array) -> tuple[Array, Array]:
    """Displacement m and gain of velocity m/s, (k, 2) each, after s (k,) s of a thrust (2,) m/s2
    that turns with its disk, from its angle, spin and rate of spin (3,) on."""
    angle, spin, rate = turn
    pieces = count_pieces(spin, rate, float(s.max(initial=0.0)))
    gain = push((force[0], force[1]), angle, spin, rate, s, pieces, 60)
    moved, faster = (np.stack(part, axis=-1) for part in gain)
    return moved, faster


def powers(e: float, k: Array | int) -> Array:
    """1 + e + ... + e^(k - 1) = (1 - e^k) / (1 - e), also where e is so close to 1 that 1 - e^k has
    lost its digits."""
    total: Array = np.expm1(k * np.log(e)) / (e - 1)
    return total


def record_of(scenario: Scenario, path: Path, error: float, bits: int, method: str) -> TruthRecord:
    until, path = float64_horizon(scenario, within_float64(scenario, path, error))
    end = min(path.end, scenario.duration) if path.reason else np.inf
    if method == CERTIFIED and path.searched < end:
        method = SEARCHED
    legs = legs_of(path, end)
    rows = [
        [float(t), *((i, j) if j < 0 or i < j else (j, i)), float(impulse), cosine]
        for t, i, j, impulse, cosine, _ in path.events
        if float(t) < end
    ]
    rows += bounces(scenario, legs, min(end, float(np.nextafter(scenario.duration, np.inf))))
    outcomes = [
        [k, i, *map(float, v[:2])]
        for k, one in enumerate(path.outcomes)
        for i, v in one.velocities.items()
        if i < scenario.scene.n
    ]
    orders = [[k, *pair] for k, collisions in enumerate(path.named) for pair in collisions]
    return TruthRecord(
        legs=frozen(legs),
        events=frozen(np.array(sorted(rows, key=lambda row: row[:3])).reshape(-1, 5)),
        # The state at the end itself is not known: the horizon is the float64 before it.
        horizon=max(float(np.nextafter(end, 0)), 0.0) if path.reason else np.inf,
        error_bound=error
        + ROUNDINGS * (reach(legs, min(end, scenario.duration)) + reach_of_jets(scenario, legs)),
        bits=bits,
        method=method,
        reason=path.reason,
        float64_horizon=float(until),
        outcomes=frozen(np.array(outcomes).reshape(-1, 4)),
        orders=frozen(np.array(orders).reshape(-1, 3)),
        remains=tuple(remains(scenario.scene, legs, path.disks, end)) if path.disks else (),
    )


def within_float64(scenario: Scenario, path: Path, error: float) -> Path:
    """The path, cut where its legs and samples in float64 become less accurate than promised.

    The promised accuracy is `DIVERGED` radii of the smallest disk, the same limit as that of the
    horizon. The rounding of float64 exceeds it far from the origin, and after a long distance.
    """
    end = min(path.end, scenario.duration) if path.reason else scenario.duration
    legs = legs_of(path, end)
    room = (DIVERGED * float(scenario.scene.radius.min()) - error) / ROUNDINGS
    if reach(legs, end) <= room:
        return path
    held = last_time(lambda t: reach(legs, t) <= room, end)
    reason = (
        f"the rounding of float64 is more than {DIVERGED:g} of the smallest radius from t ="
        f" {held:.9g} s on"
    )
    return path.cut(held, reason)


def last_time(holds: Callable[[float], bool], end: float) -> float:
    """The time in s, to the last place of float64, up to which `holds` is true: it is true from 0
    on, and then false up to `end`."""
    held, lost = 0.0, end
    for _ in range(64):  # halvings
        middle = (held + lost) / 2
        held, lost = (middle, lost) if holds(middle) else (held, middle)
    return held


def legs_of(path: Path, end: float) -> Array:
    rows = [
        [i, *map(float, (*leg[:7], *(leg.hop or NO_HOP), *(leg.turn or NO_TURN)))]
        for i, legs in enumerate(path.legs)
        for leg in legs
        if float(leg.t) < end or leg is legs[0]
    ]
    return np.array(rows)


def reach(legs: Array, until: float) -> float:
    """m, the length to which the rounding of float64 is relative up to `until` s: the largest
    coordinate plus the distance at the largest speed."""
    begun = legs[:, T] <= until
    follows = np.append(legs[1:, DISK] == legs[:-1, DISK], False)
    stop = np.minimum(np.where(follows, np.append(legs[1:, T], until), until), until)
    s, a = np.maximum(stop - legs[:, T], 0.0)[:, None], legs[:, ACCELERATION]
    x, v = flight(s, legs[:, PLACE], legs[:, VELOCITY], a)
    # the last term bounds the apex between the two ends
    far = np.maximum(np.abs(legs[:, PLACE]), np.abs(x)) + np.abs(a) * s**2 / 8
    speed = np.maximum(np.abs(legs[:, VELOCITY]), np.abs(v)) + legs[:, SPEED, None]
    return float(far[begun].max() + until * speed[begun].max())


def reach_of_jets(scenario: Scenario, legs: Array) -> float:
    """m, likewise by thrusts that turn with their disk: f T^2, times the rounding of the angle."""
    begun, total = np.abs(legs[:, TURN]), 0.0
    for p in (p for p in scenario.thrusts if p.frame == "body" and p.force.any()):
        angle, spin, rate = begun[legs[:, DISK] == p.disk].max(axis=0)
        acts, mass = p.stop - p.start, scenario.scene.mass[p.disk]
        turned = 1 + angle + (spin + rate * acts) * acts
        total += float(np.hypot(*p.force) / mass * acts * scenario.duration * turned)
    return total


def bounces(scenario: Scenario, legs: Array, end: float) -> Iterator[list[float]]:
    """Rows as in `TruthRecord.events` for the bounces on legs before `end` s that last
    `LEAST_SHARE` of the duration or more."""
    scene = scenario.scene
    e, least = scene.restitution, LEAST_SHARE * scenario.duration
    span = scene.walls[:, 1] - scene.walls[:, 0]
    for row in np.flatnonzero(legs[:, SPEED] > 0):
        leg, follows = legs[row], row + 1 < len(legs) and legs[row + 1, DISK] == legs[row, DISK]
        stop = min(end, legs[row + 1, T] if follows else np.inf)
        v, g, disk = leg[SPEED], leg[FALL], int(leg[DISK])
        count = max(0, int(np.ceil(np.log(least * g / (2 * v)) / np.log(e))))
        for k in range(1, count):
            t = leg[T] + 2 * v / g * float(powers(e, k))
            if t >= stop:
                break
            place, sliding = flight(t - leg[T], leg[PLACE], leg[VELOCITY], leg[ACCELERATION])
            # the nearest wall parallel to the leg
            _, distance = nearest(place[None], scene.walls)
            slope = np.abs((span * leg[NORMAL]).sum(axis=1)) / np.hypot(*span.T)
            wall = int(np.argmin(np.abs(distance[0] - scene.radius[disk]) + slope))
            before, beside = v * e ** (k - 1), np.hypot(*sliding)
            kick = scene.mass[disk] * (1 + e) * before
            yield [t, disk, -1 - wall, kick, before / np.hypot(before, beside)]


def remains(scene: Scene, legs: Array, disks: Sequence[int], end: float) -> Iterator[str]:
    """Sentences on what holds for these disks after the end: their momentum along the walls they
    touch, if all these are parallel, is conserved, and their energy does not grow."""
    ours = [i for i in sorted(set(disks)) if i < scene.n and not scene.static[i]]
    last = np.array([legs[(legs[:, DISK] == i) & (legs[:, T] <= end)][-1] for i in ours])
    (x, v), mass = along(last, np.full(len(last), end), scene.restitution), scene.mass[ours]
    share, distance = nearest(x, scene.walls)
    touched = distance - scene.radius[ours][:, None] < TOUCH
    near = (scene.walls[:, 1] - scene.walls[:, 0])[touched.any(axis=0)]
    names, they, their, touch = "disks " + ", ".join(map(str, ours)), "them", "their", "they touch"
    if len(ours) == 1:
        names, they, their, touch = f"disk {ours[0]}", "it", "its", "it touches"
    momentum = (mass[:, None] * v).sum(axis=0)
    # Momentum is conserved in no direction where the normal turns (around a static disk or the end
    # of a wall), or where friction acts along a wall.
    if (
        any(scene.static[i] for i in disks if i < scene.n)
        or (touched & ((share <= 0) | (share >= 1))).any()
        or (scene.friction and len(near))
    ):
        near = np.eye(2)
    exception = ", apart from the effect of gravity" if scene.gravity.any() else ""
    if not len(near):
        total = f"({momentum[0]:.6g}, {momentum[1]:.6g}) N s"
        yield (
            f"{names}: nothing else touches {they}, so {their} momentum {total} is"
            f" conserved{exception}"
        )
    elif (
        np.abs(near[:, 0] * near[0, 1] - near[:, 1] * near[0, 0]).max()
        <= EPS * np.abs(near).max() ** 2
    ):
        way = near[0] / np.hypot(*near[0])
        yield (
            f"{names}: all walls {touch} lie along ({way[0]:.4g}, {way[1]:.4g}), so {their}"
            f" momentum in that direction, {momentum @ way:.6g} N s, is conserved{exception}"
        )
    energy = (mass * (v**2).sum(axis=1)).sum() / 2
    if scene.friction:
        spin = np.array([flight(end - leg[T], *leg[TURN])[1] for leg in last])
        energy += (np.where(spin, scene.inertia[ours] * spin**2, 0.0)).sum() / 2
    yield f"{names}: {their} kinetic energy, {energy:.6g} J, can only fall{exception}"
