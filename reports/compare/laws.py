"""What is measured on trajectories, sample by sample: momentum, energy, penetration, deviation.

k samples, n disks; a static disk carries no momentum and no energy.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import numpy as np

from crosscheck2d.scenarios.model import Array, Scene, Thrust, Trajectory

Law = TypeVar("Law", bound=Callable[..., Any])

ON_THE_WALL = 1e-9  # radii: more than rounding, in the coordinates of any scene that is measured


def cached(law: Law) -> Law:
    """The law with a cache, which is dropped together with the first argument; an array is
    read-only.

    Trajectories, scenes and scenarios are frozen, and equal only to themselves. A run is compared
    with every other engine at its dt: without the cache its energy would be computed about forty
    times.
    """
    cache: WeakKeyDictionary[Any, dict[tuple[Any, ...], Any]] = WeakKeyDictionary()

    @wraps(law)
    def cached_law(what: Any, *others: Any) -> Any:
        values = cache.setdefault(what, {})
        if others not in values:
            values[others] = value = law(what, *others)
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        return values[others]

    return cast(Law, cached_law)


@cached
def moving_mass(scene: Scene) -> Array:
    """(n,) kg, 0 for static disks."""
    return np.where(scene.static, 0.0, scene.mass)


@cached
def moving_inertia(scene: Scene) -> Array:
    """(n,) kg m2, 0 for disks that do not turn: static ones, and those of infinite inertia."""
    return np.where(scene.static | np.isinf(scene.inertia), 0.0, scene.inertia)


@cached
def momentum(trajectory: Trajectory, scene: Scene) -> Array:
    """(k, 2) kg m/s: sum of m v."""
    total: Array = np.einsum("i,kia->ka", moving_mass(scene), trajectory.velocity)
    return total


@cached
def momenta(trajectory: Trajectory, scene: Scene) -> Array:
    """(k, n, 2) kg m/s: m v of each disk."""
    return moving_mass(scene)[:, None] * trajectory.velocity


@cached
def energies(trajectory: Trajectory, scene: Scene) -> Array:
    """(k, n) J: what each disk adds to `energy`."""
    linear = (trajectory.velocity**2).sum(axis=2) / 2 - trajectory.position @ scene.gravity
    both: Array = (
        linear * moving_mass(scene) + trajectory.angular_velocity**2 * moving_inertia(scene) / 2
    )
    return both


@cached
def centre(scene: Scene) -> Array:
    """(2,) m, the centre of mass of the moving disks at the start; the origin if nothing moves."""
    mass = moving_mass(scene)
    return mass @ scene.position / (mass.sum() or 1.0)


def angular_momentum(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) kg m2/s about the scene's centre of mass at the start: sum of m x cross v + I w."""
    orbital = cross(trajectory.position - centre(scene), trajectory.velocity) @ moving_mass(scene)
    return orbital + trajectory.angular_velocity @ moving_inertia(scene)


@cached
def kinetic_energy(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) J: sum of m v2 / 2 + I w2 / 2."""
    linear = (trajectory.velocity**2).sum(axis=2) @ moving_mass(scene) / 2
    both: Array = linear + trajectory.angular_velocity**2 @ moving_inertia(scene) / 2
    return both


@cached
def energy(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) J: kinetic energy less sum of m g.x (zero at the origin)."""
    return kinetic_energy(trajectory, scene) - (trajectory.position @ scene.gravity) @ moving_mass(
        scene
    )


def half_step(trajectory: Trajectory, scene: Scene, dt: float) -> Array:
    """(k,) J that gravity changes in half a step: to so much the energy is known, as the velocities
    of an engine may be those of half a step before or after its positions."""
    return np.abs(trajectory.velocity @ scene.gravity) @ moving_mass(scene) * dt / 2


def penetration(trajectory: Trajectory, scene: Scene) -> Array:
    """(k,) largest overlap of two disks, or of a disk and a wall, in radii of the smaller disk; 0
    without overlap."""
    r, moving = scene.radius, ~scene.static
    x, y = np.ascontiguousarray(np.moveaxis(trajectory.position, 2, 0))
    worst = np.zeros(len(trajectory))
    for i in range(scene.n - 1):
        across, up = x[:, i + 1 :] - x[:, i, None], y[:, i + 1 :] - y[:, i, None]
        gap = np.sqrt(across**2 + up**2) - (r[i] + r[i + 1 :])
        gap[:, scene.static[i + 1 :] & scene.static[i]] = 0.0
        worst = np.maximum(worst, (-gap / np.minimum(r[i], r[i + 1 :])).max(axis=1))
    points = trajectory.position[:, moving].reshape(-1, 2)
    for start, end in scene.walls:
        distance = lengths(points - nearest_on_segment(points, start, end))
        inside = 1 - distance.reshape(len(x), -1) / r[moving]
        worst = np.maximum(worst, inside.max(axis=1, initial=0.0))
    return worst


def nearest_on_segment(x: Array, start: Array, end: Array) -> Array:
    """(k, 2) m, the points of the segment nearest to x (k, 2)."""
    span = end - start
    along = np.clip((x - start) @ span / (span @ span or 1.0), 0, 1)  # it may be a point
    return start + along[:, None] * span


def contact_normal(x: Array, scene: Scene, i: int, j: int) -> Array:
    """(2,) of length 1: from disk j, or wall -1 - j, to disk i, with the disks at x (n, 2)."""
    other = x[j] if j >= 0 else nearest_on_segment(x[i : i + 1], *scene.walls[-1 - j])[0]
    normal: Array = (x[i] - other) / np.linalg.norm(x[i] - other)
    return normal


@cached
def wall_crossings(trajectory: Trajectory, scene: Scene) -> list[tuple[float, int, int]]:
    """(s, disk, -1 - wall) where the centre of a disk crosses a wall between two samples, on a
    straight line, and had no time to go round an end of the wall. Between an end and another wall
    nearer than its diameter no disk goes.

    If a sample lies on the wall itself, the side of the sample before it counts. A disk that wraps
    moves out of one edge and in at the other, and not across the box; one so fast that it may have
    gone round either way is not judged.
    """
    x, t, number = trajectory.position, trajectory.t, np.arange(len(trajectory))[:, None]
    speed = lengths(trajectory.velocity)
    size = np.inf if scene.wrap is None else (scene.wrap[1] - scene.wrap[0]).min()
    known = speed[1:] * np.diff(t)[:, None] < size / 2  # which way it takes round the torus
    gained, crossings = lengths(scene.gravity) * np.diff(t[:2]).sum(), []
    for w, (a, b) in enumerate(scene.walls):
        side, length = cross(x - a, b - a), lengths(b - a)
        others = np.delete(scene.walls, w, axis=0)
        gaps = [
            min((lengths(q - nearest_on_segment(q[None], *c)[0]) for c in others), default=np.inf)
            for q in (a, b)
        ]
        tells = np.abs(side) > ON_THE_WALL * scene.radius * length
        last = np.maximum.accumulate(np.where(tells, number, 0), axis=0)[:-1]
        start, end = np.take_along_axis(x, last[..., None], axis=0), x[1:]
        way = nearer_way(end - start, scene)
        parts = [(start, end)] if scene.wrap is None else [(start, start + way), (end - way, end)]
        for first, second in parts:
            sides = cross(first - a, b - a) * cross(second - a, b - a)
            ends = cross(a - first, way) * cross(b - first, way)
            for k, i in np.argwhere((sides < 0) & tells[1:] & known & (ends <= 0)):
                r = scene.radius[i]
                along, span = (b - a) / length * r, (first[k, i], second[k, i])
                most = (t[k + 1] - t[last[k, i]]) * (speed[k : k + 2, i].max() + gained)
                rounds = zip(gaps, (a - along, b + along))
                if all(gap < 2 * r or detour(*span, q) > most for gap, q in rounds):
                    crossings.append((float(t[k + 1]), int(i), -1 - w))
    return crossings


def detour(start: Array, end: Array, around: Array) -> float:
    """m, the way from start to end by a third point."""
    return float(lengths(around - start) + lengths(end - around))


def apexes(y: Array) -> tuple[np.ndarray, Array]:
    """(m,) the highest sample of each flight, and (m,) m, the vertex of the parabola through it and
    the two beside it; of the first flight, which may begin with a drop, through its first three.

    `y`: (k,) m, the height of a disk. A flight with fewer samples is left out.
    """
    top = np.flatnonzero((y[1:-1] >= y[:-2]) & (y[1:-1] > y[2:])) + 1
    top = np.concatenate([[1], top[top > 1]]) if len(y) > 2 else top
    before, at, after = y[top - 1], y[top], y[top + 1]
    bend = before - 2 * at + after
    return top, at - (after - before) ** 2 / (8 * np.where(bend == 0.0, np.nan, bend))


def time_on(thrust: Thrust, t: Array | float) -> Array:
    """(k,) s for which the thrust has been on by `t`."""
    return np.clip(t - thrust.start, 0.0, thrust.stop - thrust.start)


def cross(u: Array, v: Array) -> Array:
    """(...) the third component of the cross product of (..., 2) vectors."""
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def deviation(a: Trajectory, b: Trajectory, scene: Scene) -> Array:
    """(k, n) m between the positions in the common samples; across an edge if the scene wraps and
    that is shorter."""
    return lengths(difference(a, b, scene))


def difference(a: Trajectory, b: Trajectory, scene: Scene) -> Array:
    """(k, n, 2) m from b to a, as `deviation`."""
    k = min(len(a), len(b))
    return nearer_way(a.position[:k] - b.position[:k], scene)


def nearer_way(way: Array, scene: Scene) -> Array:
    """(..., 2) m: the vector `way`, or the one across an edge if the scene wraps and that is
    shorter."""
    if scene.wrap is None:
        return way
    size = scene.wrap[1] - scene.wrap[0]
    nearer: Array = way - size * np.round(way / size)
    return nearer


def lengths(vectors: Array) -> Array:
    """(...) of (..., 2) vectors: the same bits as `np.linalg.norm` over the last axis, in a quarter
    of the time."""
    return np.sqrt(vectors[..., 0] ** 2 + vectors[..., 1] ** 2)
