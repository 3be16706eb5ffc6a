"""Velocity, momentum and energy of the truth, with an allowance for collisions found a little late
or early.

An engine that steps finds a collision at the end of a step. Until then its velocities are those
before the collision, while the truth already has those after it. This delay has its own metric
(`collision_delay_dt`) and is no error here. Every other difference is an error, at every sample:
gravity and thrust are taken at the instant of the sample.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.collisions import SAME, WINDOW
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory

# passes of `distance_to_range`; one is exact if all impulses lie along two axes, as in a box
SWEEPS = 100


class Jumps(NamedTuple):
    """What each of the h collisions of a truth changes, in order of time; those that change nothing
    are left out."""

    t: Array  # (h,) s
    impulse: Array  # (h, 2) N s from walls and static disks; 0 between two moving disks
    energy: Array  # (h,) J lost
    limits: np.ndarray  # (n + 1,) where the rows of each disk begin in `when` and `change`
    when: Array  # (d,) s, times of the collisions, disk by disk
    change: Array  # (d, 2) m/s, change of velocity of that disk


@laws.cached
def jumps_of(truth: Trajectory, scenario: Scenario) -> Jumps:
    """The jumps of a truth; the trajectory of `scenario.truth` gives the positions at each
    collision.

    The impulse acts along the normal; at restitution e an impulse J between two disks of the
    reduced mass m takes J2 (1 - e) / (1 + e) / 2 m from the energy (J = (1 + e) m v, and m v2 (1 -
    e2) / 2; any textbook of mechanics). Friction adds an impulse along the tangent, read from the
    disk's velocity just before and just after the collision; the energy that it takes is what the
    spins and the tangential motion lose.
    """
    assert scenario.truth is not None
    scene, collisions = scenario.scene, truth.collisions
    e, inverse = scene.restitution, np.where(scene.static, 0.0, 1 / scene.mass)
    at = scenario.truth(collisions.t) if len(collisions) else truth
    rows: list[tuple[float, ...]] = []
    disks: list[tuple[float, ...]] = []
    for x, t, i, j, size in zip(
        at.position, collisions.t, collisions.i, collisions.j, collisions.impulse
    ):
        if not size:  # a contact at rest
            continue
        normal = laws.contact_normal(x, scene, i, j)
        impulse = size * normal
        if scene.friction:
            rub, rubbed = friction_of(scenario, t, i, j, normal)
            impulse = impulse + rub
        bodies = ((i, impulse), (j, -impulse)) if j >= 0 else ((i, impulse),)
        moved = [(k, change) for k, change in bodies if not scene.static[k]]
        lost = size**2 * (1 - e) / (1 + e) / 2 * sum(inverse[k] for k, _ in moved)
        lost += rubbed if scene.friction else 0.0
        rows.append((t, *(moved[0][1] if len(moved) == 1 else (0.0, 0.0)), lost))
        disks += [(k, t, *(change * inverse[k])) for k, change in moved]
    table, by_disk = np.array(rows).reshape(-1, 4), np.array(disks).reshape(-1, 4)
    by_disk = by_disk[np.argsort(by_disk[:, 0], kind="stable")]
    limits = np.searchsorted(by_disk[:, 0], np.arange(scene.n + 1))
    columns = table[:, 0], table[:, 1:3], table[:, 3], limits, by_disk[:, 1], by_disk[:, 2:]
    return Jumps(*map(np.ascontiguousarray, columns))


def friction_of(scenario: Scenario, t: float, i: int, j: int, normal: Array) -> tuple[Array, float]:
    """(2,) N s on disk i along the tangent of its collision at `t` s in the truth, and J that
    friction takes.

    Both are read from the last float64 before that time to it; nothing else happens to the disk
    between them.
    """
    assert scenario.truth is not None
    scene, tangent = scenario.scene, np.array([-normal[1], normal[0]])
    two = scenario.truth(np.array([np.nextafter(t, 0.0), t]))
    k = i if not scene.static[i] else j
    change = scene.mass[k] * (two.velocity[1, k] - two.velocity[0, k]) @ tangent
    kick = change if k == i else -change
    moving = [body for body in (i, j) if body >= 0 and not scene.static[body]]
    along = two.velocity[:, moving] @ tangent
    turns = np.where(np.isinf(scene.inertia), 0.0, scene.inertia)[moving]
    energy = along**2 @ scene.mass[moving] / 2
    energy = energy + two.angular_velocity[:, moving] ** 2 @ turns / 2
    return kick * tangent, float(energy[0] - energy[1])


def nearest_velocity(played: Trajectory, truth: Trajectory, jumps: Jumps, dt: float) -> Array:
    """(k, n, 2) m/s: of the velocities that each disk has in the truth within `WINDOW` dt of a
    sample, the one nearest to the engine's.

    The candidates are the truth's velocity at that instant; the same with the disk's latest
    collisions undone, one after the other; and with its next collisions added. Of two collisions at
    one instant either may come first. A disk that rested on a floor when it was struck is taken to
    have been falling before: its velocity may be off by g `WINDOW` dt. For a collision at the
    instant of a sample the truth has the velocity before or after it, depending on rounding: both
    are tried.
    """
    window = WINDOW * dt
    found: Array = nearest(
        played.t, played.velocity, truth.velocity, jumps.limits, jumps.when, jumps.change, window
    )
    return found


@njit(cache=True)
def nearest(t, played, true, limits, when, change, window):  # type: ignore[no-untyped-def]
    """(k, n, 2) as in `nearest_velocity`; `window` in s."""
    found = true.copy()
    for i in range(len(limits) - 1):
        first, past, now, last = limits[i], limits[i], limits[i], limits[i]  # as of `windows`
        end = limits[i + 1]
        for k in range(len(t) if first < end else 0):
            while first < end and when[first] < t[k] - window:
                first += 1
            while past < end and when[past] < t[k] - SAME * window:
                past += 1
            while now < end and when[now] <= t[k] + SAME * window:
                now += 1
            while last < end and when[last] <= t[k] + window:
                last += 1
            least = np.hypot(true[k, i, 0] - played[k, i, 0], true[k, i, 1] - played[k, i, 1])
            for start in range(past, now + 1):
                # undo past collisions, the latest first; add future ones, the next first
                for way in (-1, 1):
                    vx, vy = true[k, i, 0], true[k, i, 1]
                    stop = first - 1 if way < 0 else last
                    for h in range(start - 1 if way < 0 else start, stop, way):
                        beside = h + way != stop and abs(when[h + way] - when[h]) < SAME * window
                        # of two at one instant: the second only, then also the first
                        for turn in range(1 - beside, 2):
                            new = h + way if turn == 0 else h
                            ux, uy = vx + way * change[new, 0], vy + way * change[new, 1]
                            off = np.hypot(ux - played[k, i, 0], uy - played[k, i, 1])
                            if off < least:
                                least = off
                                found[k, i, 0], found[k, i, 1] = ux, uy
                        vx, vy = ux, uy
    return found


def momentum_outside(
    played: Trajectory, truth: Trajectory, jumps: Jumps, dt: float, scene: Scene
) -> Array:
    """(k,) kg m/s, distance of the engine's momentum from the range that the detection delay
    allows.

    The range: the truth's momentum, less any part of each outer impulse up to `WINDOW` dt before
    the sample, plus any part of each up to `WINDOW` dt after it.
    """
    difference = laws.momentum(played, scene) - laws.momentum(truth, scene)
    first, past, now, last = windows(played, jumps, dt)
    off = laws.lengths(difference)
    for k in np.flatnonzero(first < last):
        impulses = np.concatenate(
            [-jumps.impulse[first[k] : now[k]], jumps.impulse[past[k] : last[k]]]
        )
        off[k] = distance_to_range(difference[k], impulses)
    return off


@njit(cache=True)
def distance_to_range(point, parts):  # type: ignore[no-untyped-def]
    """Distance of a point (2,) from the nearest sum of `parts` (m, 2), each times a factor from 0
    to 1; one factor is fitted after the other."""
    rest, shares = point.copy(), np.zeros(len(parts))
    for _ in range(SWEEPS):
        moved = False
        for h in range(len(parts)):
            size = parts[h, 0] ** 2 + parts[h, 1] ** 2
            if size > 0:
                share = shares[h] + (rest[0] * parts[h, 0] + rest[1] * parts[h, 1]) / size
                share = min(max(share, 0.0), 1.0)
                if share != shares[h]:
                    rest += (shares[h] - share) * parts[h]
                    shares[h], moved = share, True
        if not moved:
            break
    return np.hypot(rest[0], rest[1])


def energy_range(
    played: Trajectory, truth: Trajectory, jumps: Jumps, dt: float, scene: Scene
) -> tuple[Array, Array]:
    """(k,) J, the least and the largest energy that collisions within `WINDOW` dt of a sample, late
    or early, explain.

    The least: the truth's, less what the collisions just after the sample take. The largest: the
    truth's, plus what those just before it took.
    """
    true, (first, past, now, last) = laws.energy(truth, scene), windows(played, jumps, dt)
    lost = np.concatenate([[0.0], np.cumsum(jumps.energy)])
    return true + (lost[past] - lost[last]), true + (lost[now] - lost[first])


def windows(played: Trajectory, jumps: Jumps, dt: float) -> tuple[np.ndarray, ...]:
    """(k,) indices of collisions: the first within `WINDOW` dt of a sample, the first not before
    it, the first after it, the first beyond."""
    t, window = played.t, WINDOW * dt
    not_before, after = (np.searchsorted(jumps.t, t + shift * SAME * window) for shift in (-1, 1))
    return (
        np.searchsorted(jumps.t, t - window),
        not_before,
        after,
        np.searchsorted(jumps.t, t + window),
    )


@laws.cached
def collision_free(trajectory: Trajectory, dt: float) -> np.ndarray:
    """(k, n) whether a disk has no collision within `WINDOW` dt of a sample."""
    collisions, near = trajectory.collisions, WINDOW * dt
    k, n = trajectory.angle.shape
    free = np.ones((k, n), bool)
    for disk in range(n):
        times = collisions.t[(collisions.i == disk) | (collisions.j == disk)]
        early, late = (np.searchsorted(times, trajectory.t + shift) for shift in (-near, near))
        free[:, disk] = early == late
    return free
