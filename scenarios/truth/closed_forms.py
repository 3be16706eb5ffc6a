"""Closed forms of flights, bounces, single collisions and thrusts: exact answers without any
stepping.

SI units, float64; right to 1e-13 of the lengths and speeds of a scene
(tests/scenarios/test_closed_forms.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from crosscheck2d.scenarios.model import Array, Collisions, Scene, Thrust, Trajectory, frozen

Collision = tuple[float, int, int, float]
"""t s, disk, other disk or -1 - wall, impulse N s."""
Motion = tuple[Array, Array]
"""Position and velocity at k instants, (k, ...) m and m/s; or angle and angular velocity, rad and
rad/s."""


def answer(
    scene: Scene,
    t: Array,
    motion: Motion,
    collisions: Iterable[Collision] = (),
    turning: Motion | None = None,
    horizon: float = np.inf,
    error_bound: float = 0.0,
    reason: str = "",
) -> Trajectory:
    """An exact motion as the `Trajectory` of `scene` at the times t (k,) s, cut at `horizon` s.

    motion: position and velocity (k, n, 2) m, m/s. turning: angle and angular velocity (k, n) rad,
    rad/s; default: every disk keeps its spin. collisions: those after the last sample are dropped.
    reason: why the answer ends at the horizon.
    """
    angle, spin = turning or flight(t[:, None], scene.angle, scene.angular_velocity)
    kept = t <= horizon
    t, x, v, angle, spin = (frozen(part[kept]) for part in (t, *motion, angle, spin))
    known = Collisions.of([row for row in collisions if len(t) and row[0] <= t[-1]])
    return Trajectory(t, x, v, angle, spin, known, horizon, error_bound, reason)


def at_rest(scene: Scene, t: Array, collisions: Iterable[Collision] = ()) -> Trajectory:
    position = np.broadcast_to(scene.position, (len(t), scene.n, 2))
    return answer(scene, t, (position, np.zeros_like(position)), collisions)


def stacked(scene: Scene) -> list[Collision]:
    """The contacts of disks stacked on wall 0: they act from t = 0 with a force, so with no
    impulse."""
    return [(0.0, 0, -1, 0.0), *((0.0, i, i + 1, 0.0) for i in range(scene.n - 1))]


def flight(
    t: Array, position: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike = 0.0
) -> Motion:
    """Position x + v t + a t2 / 2 and velocity v + a t after t s, all broadcast (Galilei's
    parabola)."""
    x, v, a = np.asarray(position), np.asarray(velocity), np.asarray(acceleration)
    return x + (v + a * t / 2) * t, v + a * t + np.zeros_like(x)


@dataclass(frozen=True, eq=False)
class Legs:
    """A motion made of flights, each from one collision to the next.

    Attributes:
        start: (s,) s, increasing, from 0; all but the first are collisions.
        position, velocity, acceleration: (s, ...) at the start of each flight, m, m/s, m/s2.
    """

    start: Array
    position: Array
    velocity: Array
    acceleration: Array

    def at(self, t: Array) -> Motion:
        leg = np.searchsorted(self.start, t, side="right") - 1
        since = (t - self.start[leg]).reshape(-1, *[1] * (self.position.ndim - 1))
        return flight(since, self.position[leg], self.velocity[leg], self.acceleration[leg])

    def wall_collisions(
        self, disk: int, walls: Sequence[int], mass: float, restitution: float
    ) -> list[Collision]:
        """Collisions of a motion along one axis: on walls[0], walls[1] ... in turn, m (1 + e) |v| N
        s each."""
        before = np.abs(self.velocity[1:]) / restitution
        impulse = mass * (1 + restitution) * before
        return [
            (float(t), disk, -1 - walls[k % len(walls)], float(kick))
            for k, (t, kick) in enumerate(zip(self.start[1:], impulse))
        ]


def geometric(ratio: float, count: Array) -> Array:
    """1 + ratio + ratio^2 + ... of `count` terms."""
    return count if ratio == 1 else (1 - ratio**count) / (1 - ratio)


def bouncing(height: float, gravity: float, restitution: float, until: float) -> Legs:
    """The gap, m, under a ball dropped from rest: until it rests (e < 1), or to `until` s (e = 1).

    Bounce k leaves with u e^k at t_k = t_1 (1 + 2 e (1 - e^(k-1)) / (1 - e)), t_1 = sqrt(2 h / g),
    u = sqrt(2 g h); they accumulate at t_1 (1 + e) / (1 - e), after which the ball lies still
    (any textbook of mechanics, under "bouncing ball"). On the last leg the ball is at
    rest. 0 < e <= 1.
    """
    e, fall, speed = restitution, np.sqrt(2 * height / gravity), np.sqrt(2 * gravity * height)
    # For e < 1 the bounces left out last less than 1e-14 of the fall each: float64 cannot resolve
    # their height.
    count = int(until / (2 * fall)) + 2 if e == 1 else int(np.log(1e-14) / np.log(e))
    k = np.arange(1.0, count + 1)
    rest = np.inf if e == 1 else fall * (1 + e) / (1 - e)
    start = np.minimum(fall * (1 + 2 * e * geometric(e, k - 1)), rest)
    return Legs(
        start=np.array([0, *start, rest]),
        position=np.array([height, *np.zeros(count), 0]),
        velocity=np.array([0, *speed * e**k, 0]),
        acceleration=np.array([-gravity, *np.full(count, -gravity), 0]),
    )


def drop(scene: Scene, height: float, t: Array, shortest: float | None = None) -> Trajectory:
    """A disk dropped from rest `height` m above its floor; bounces that last less than `shortest` s
    are not listed."""
    legs = bouncing(height, -scene.gravity[1], scene.restitution, t[-1])
    gap, speed = legs.at(t)
    collisions = legs.wall_collisions(0, (0,), scene.mass[0], scene.restitution)
    if shortest is not None:
        collisions = collisions[: int((np.diff(legs.start)[1:] > shortest).sum())]
    position, velocity = (
        np.stack([0 * y, y], axis=-1)[:, None] for y in (gap + scene.radius[0], speed)
    )
    return answer(scene, t, (position, velocity), collisions)


def to_and_fro(
    place: float, velocity: float, length: float, restitution: float, until: float
) -> Legs:
    """A free point that bounces to and fro between walls at 0 and `length` m, up to `until` s.

    Leg k has speed v e^k and lasts D / (v e^k) (elementary; e = 1: the triangle wave). 0 < e <= 1,
    v != 0.
    """
    speed, up = abs(velocity), velocity > 0
    k = np.arange(1.0, int(until * speed / length) + 3)
    first = (length - place if up else place) / speed
    at_top = (k % 2 == 1) == up
    lasts = length / (speed * restitution) * geometric(1 / restitution, k - 1)
    return Legs(
        start=np.array([0, *first + lasts]),
        position=np.array([place, *np.where(at_top, length, 0.0)]),
        velocity=np.array([velocity, *np.where(at_top, -1, 1) * speed * restitution**k]),
        acceleration=np.zeros(len(k) + 1),
    )


def pair(
    position: Array, velocity: Array, radius: Array, mass: Array, restitution: float
) -> tuple[Legs, Array]:
    """Two disks that fly freely and collide once or never: their legs (s, 2, 2) and the impulses
    (s - 1,) N s.

    position, velocity (2, 2) m, m/s; radius, mass (2,) m, kg. Contact at |r + u t| = R = r_1 + r_2:
    t = c / (-b + sqrt(d)), c = r.r - R^2, b = r.u, d = b^2 - u.u c = u.u R^2 - (r x u)^2; impulse
    (1 + e) mu v_n along the line of centres, v_n = sqrt(d) / R (Landau & Lifshitz, Mechanics, 17).
    """
    r, u, reach = position[1] - position[0], velocity[1] - velocity[0], radius.sum()
    distance, speed = np.hypot(*r), np.hypot(*u)
    cross = abs(r[0] * u[1] - r[1] * u[0])
    d = (speed * reach - cross) * (speed * reach + cross)
    if r @ u >= 0 or d <= 0:
        return Legs(np.zeros(1), position[None], velocity[None], np.zeros((1, 1, 1))), np.zeros(0)
    t = (distance - reach) * (distance + reach) / (-(r @ u) + np.sqrt(d))
    contact = r + u * t
    normal = contact / np.hypot(*contact)
    impulse = (1 + restitution) * np.sqrt(d) / reach / (1 / mass).sum()
    after = velocity + np.array([[-1.0], [1.0]]) * impulse / mass[:, None] * normal
    legs = Legs(
        start=np.array([0, t]),
        position=np.array([position, position + velocity * t]),
        velocity=np.array([velocity, after]),
        acceleration=np.zeros((2, 1, 1)),
    )
    return legs, np.array([impulse])


def offset_growth(free_path: float, reach: float) -> float:
    """The factor by which a distance from the centre line grows per bounce between two static
    disks.

    q + sqrt(q^2 - 1), q = 1 + s / R: s m from surface to surface, R m the sum of the two radii that
    meet (the eigenvalue of the two-disk orbit; Gaspard & Rice, J. Chem. Phys. 90, 2225, 1989).
    """
    q = 1 + free_path / reach
    return float(q + np.sqrt(q * q - 1))


def world_thrusts(scene: Scene, thrusts: Sequence[Thrust], t: Array) -> Trajectory:
    """Free disks under constant thrusts fixed in the world, at the times t (k,) s.

    The sum of x + v t and, for each thrust, a (acted^2 / 2 + acted (t - stop)+), acted = how long
    it has acted; torque and angle alike (Newton's second law, twice integrated).
    """
    position, velocity = flight(t[:, None, None], scene.position, scene.velocity)
    angle, angular_velocity = flight(t[:, None], scene.angle, scene.angular_velocity)
    for thrust in thrusts:
        acted = np.clip(t - thrust.start, 0, thrust.stop - thrust.start)
        moved = acted * (acted / 2 + np.maximum(t - thrust.stop, 0))
        acceleration = thrust.force / scene.mass[thrust.disk]
        spin_up = thrust.torque / scene.inertia[thrust.disk]
        velocity[:, thrust.disk] += acted[:, None] * acceleration
        position[:, thrust.disk] += moved[:, None] * acceleration
        angular_velocity[:, thrust.disk] += acted * spin_up
        angle[:, thrust.disk] += moved * spin_up
    return answer(scene, t, (position, velocity), turning=(angle, angular_velocity))


def body_thrust(t: Array, acceleration: Array, angle: float, spin: float) -> Motion:
    """Displacement m and gain of velocity m/s, (k, 2) each, after t (k,) s of a thrust fixed to its
    disk.

    acceleration (2,) m/s2 in the disk's own axes, turned by angle + spin t; spin != 0. In the
    complex plane the integrals of exp(i w t): gain = f (exp(i w t) - 1) / (i w), displacement =
    (gain - f t) / (i w).
    """
    f = complex(*acceleration) * np.exp(1j * angle)
    half = spin * t / 2
    gain = f * t * np.sinc(half / np.pi) * np.exp(1j * half)
    displacement = (gain - f * t) / (1j * spin)
    return displacement.view(float).reshape(-1, 2), gain.view(float).reshape(-1, 2)
