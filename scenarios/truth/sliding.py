"""Closed forms with Coulomb friction: a bounce, two disks that meet, a slide that becomes a roll.

The last axis of the legs here is (x, y, angle), or (distance, angle) along a wall: between events
an angle is a parabola in time, as a position is. k = m r^2 / I is 2 for a solid disk.
"""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.model import Array, Scene
from crosscheck2d.scenarios.truth.closed_forms import Legs, pair


def friction_kick(slip: Array, inverse_mass: Array | float, most: Array) -> Array:
    """The impulse of friction (N s, or m/s per mass) on contact points with a slip (m/s): the one
    that ends the slip, `-slip / inverse_mass`, limited to `most` either way.

    inverse_mass: 1/kg (or a number, per mass), the effective one along the tangent.

    Foerster, Louge, Chang & Allia, Phys. Fluids 6, 1108, 1994, with no tangential restitution.
    """
    return -np.clip(slip / inverse_mass, -most, most)


def bounced(
    v: Array, spin: Array, radius: Array, k: Array, restitution: float, friction: float
) -> tuple[Array, Array]:
    """Velocities (n, 2) m/s and spins (n,) rad/s of disks after one bounce each on a floor.

    v, spin: before the bounce. The contact point of a disk moves at v_x + r w along the floor. An
    impulse J along the floor changes v_x by J / m, the speed of the contact point by (1 + k) J / m,
    and the spin by k J / (m r).
    """
    kick = friction_kick(
        v[:, 0] + radius * spin, 1 + k, friction * (1 + restitution) * np.abs(v[:, 1])
    )
    after = np.stack([v[:, 0] + kick, -restitution * v[:, 1]], axis=-1)
    return after, spin + k * kick / radius


def bounce(
    start: Array,
    v: Array,
    radius: Array,
    k: Array,
    restitution: float,
    friction: float,
    height: float,
) -> Legs:
    """Disks that fly freely at one speed downwards onto the floor y = 0: legs (2, n, 3).

    start, v: (n, 3) m, m and rad, m/s and rad/s; height: m, the gap under each.
    """
    t = height / -v[0, 1]
    flown, spin = bounced(v[:, :2], v[:, 2], radius, k, restitution, friction)
    return Legs(
        start=np.array([0.0, t]),
        position=np.array([start, start + v * t]),
        velocity=np.array([v, np.column_stack([flown, spin])]),
        acceleration=np.zeros((2, 1, 1)),
    )


def between_plates(
    start: Array, v: Array, radius: float, k: float, gap: float, friction: float, until: float
) -> Legs:
    """A disk that bounces between a floor and a ceiling at e = 1, up to `until` s: legs (s, 3).

    gap: m, the distance that its centre travels from one to the other. It starts half-way, at
    `start` (3,), and moves down. Turned by 180 degrees the ceiling is a floor: that changes the
    sign of velocities, but not of the spin.
    """
    turned = np.array([-1.0, -1.0, 1.0])
    t, x, side = 0.0, start, 1.0
    legs = [(t, x, v)]
    while t < until:
        step = (gap / 2 if len(legs) == 1 else gap) / abs(v[1])
        t, x = t + step, x + v * step
        seen = v * (turned if side < 0 else 1.0)
        flown, spin = bounced(
            seen[None, :2], seen[2:], np.array([radius]), np.array([k]), 1.0, friction
        )
        v = np.array([*flown[0], spin[0]]) * (turned if side < 0 else 1.0)
        side = -side
        legs.append((t, x, v))
    begins, places, velocities = (np.array(part) for part in zip(*legs))
    return Legs(begins, places, velocities, np.zeros((len(legs), 1)))


def spinning_pair(scene: Scene, first: int) -> tuple[Legs, Array]:
    """Disk `first` and the next one fly freely, spin and collide once: their legs (2, 2, 3), and
    the impulse (1,) N s along the normal, as of `closed_forms.pair`.

    Friction acts along the tangent t = (-n_y, n_x), n from the first to the second, on the slip t .
    (v_2 - v_1) - r_1 w_1 - r_2 w_2, which J changes by J (1/m_1 + 1/m_2 + r_1^2/I_1 + r_2^2/I_2).
    """
    two = slice(first, first + 2)
    position, velocity, spin = scene.position[two], scene.velocity[two], scene.angular_velocity[two]
    radius, mass, inertia = scene.radius[two], scene.mass[two], scene.inertia[two]
    legs, impulse = pair(position, velocity, radius, mass, scene.restitution)
    way = legs.position[1, 1] - legs.position[1, 0]
    tangent = np.array([-way[1], way[0]]) / np.hypot(*way)
    slip = (velocity[1] - velocity[0]) @ tangent - radius @ spin
    inverse_mass = (1 / mass + radius**2 / inertia).sum()
    kick = friction_kick(slip, inverse_mass, scene.friction * impulse[0])
    flown = legs.velocity[1] + np.array([[-1.0], [1.0]]) * kick / mass[:, None] * tangent
    spun = spin - radius / inertia * kick
    return Legs(
        legs.start,
        np.concatenate([legs.position, np.outer(legs.start, spin)[..., None]], axis=-1),
        np.array([np.column_stack([velocity, spin]), np.column_stack([flown, spun])]),
        np.zeros((2, 1, 1)),
    ), impulse


def slide(
    v: float,
    spin: float,
    radius: float,
    k: float,
    friction: float,
    acceleration: float,
    load: float,
) -> Legs:
    """A disk on a wall that it does not leave: legs (s, 2) of its way along the wall, m, and its
    angle.

    acceleration, load: m/s2, of the disk without friction, along the wall and into it. While the
    rim slips, the friction mu N opposes the slip. The disk rolls as soon as the slip is gone, or at
    once where there is none, if |acceleration| <= mu (1 + k) load: on a slope if
    tan(angle) <= mu (1 + m r^2 / I) (any textbook of mechanics, under "rolling"). With no slope
    v_0 becomes 2/3 v_0 at v_0 / (3 mu g).
    """
    slip, most = v + radius * spin, friction * load
    rolls = abs(acceleration) <= most * (1 + k)
    way = np.sign(slip) if slip else 0.0 if rolls else np.sign(acceleration)
    force = -way * most
    slides = np.array([acceleration + force, k * force / radius])
    rolling = np.array([acceleration, -acceleration / radius]) * k / (1 + k)
    slower = -way * (acceleration + (1 + k) * force)
    if not way:
        slides = rolling
    if not (way and slip and slower > 0):
        return Legs(np.zeros(1), np.zeros((1, 2)), np.array([[v, spin]]), slides[None])
    t = abs(slip) / slower
    begun = np.array([v, spin])
    then = begun + slides * t
    return Legs(
        start=np.array([0.0, t]),
        position=np.array([[0.0, 0.0], (begun + slides * t / 2) * t]),
        velocity=np.array([begun, [then[0], -then[0] / radius]]),
        acceleration=np.array([slides, rolling if rolls else [np.nan, np.nan]]),
    )
