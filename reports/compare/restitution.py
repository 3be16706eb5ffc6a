"""The restitution of each collision of a trajectory, read off the samples around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reports.compare import laws
from reports.compare.faces import SAME, interval, on_faces
from scenarios.model import Array, Scene, Trajectory


class Restitutions(NamedTuple):
    """What was read off samples.

    Attributes:
        values: (m,) e of each collision that was read; `times`: (m,) s, when.
        below: how many were below the floor.
        unfinished: how many were not over before something else happened to a disk, or the run
            ended.
    """

    values: Array
    times: Array
    below: int
    unfinished: int


# of the change of velocity; float32 leaves about 1e-7 of the velocity, an unreported collision
# far more
CLEAN = 1e-4
# times the rounding of the velocities that a change must have: e is then read to a hundredth or so
FLOOR = 100


def effective_restitution(
    trajectory: Trajectory, scene: Scene, slowest: float, rounding: float
) -> Restitutions:
    """Restitution of each collision that can be read off the samples.

    One can be read if neither disk has another in the same sample interval or the next, and none of
    them changes its spin (friction): then the change of velocity points along the normal n, and e =
    -(dv'.n) / (dv.n). Two disks must also change their momenta by as much, and a disk at a wall
    along the wall's normal: else there was a collision that the engine did not report. Those
    closing slower than `slowest` m/s are left out.

    An engine with soft contacts takes several steps for a collision: it is read at the first sample
    at which the two no longer approach. Two that a law leaves approaching pass through each other,
    and then move apart, so that such a law is read too: with e < 0, as they still have some of the
    velocity they came with. A collision is counted as unfinished if it is never over, not before
    another of either disk, or so late that gravity matters: those that take m sample intervals must
    close m times as fast.

    Those that change the velocities by no more than `FLOOR` times their rounding, which is
    relative, are below the floor: their normal, and with it e, would be noise. What gravity adds
    before and after is taken out with the velocities, and rounded as they are. Engines report such
    collisions during a contact that lasts: Box2D 3.1 does where a disk slides along a wall,
    whenever it comes nearer at any speed at all.
    """
    t, spin, collisions = trajectory.t, trajectory.angular_velocity, on_faces(trajectory, scene)
    # A collision at the instant of a sample, at the end of its step, belongs to the interval that
    # ends there.
    before = np.searchsorted(t, collisions.t - SAME * interval(trajectory), side="left") - 1
    busy: dict[tuple[int, int], int] = {}
    for k, i, j in zip(before, collisions.i, collisions.j):
        for disk in (i, j):
            busy[k, disk] = busy.get((k, disk), 0) + 1
    values, times, below, unfinished = [], [], 0, 0
    for k, i, j, when in zip(before, collisions.i, collisions.j, collisions.t):
        disks = (i, j) if j >= 0 else (i,)
        alone = all(busy[k, disk] == 1 and (k + 1, disk) not in busy for disk in disks)
        if not (alone and 0 <= k < len(t) - 1) or scene.static[i]:
            continue
        earlier, later = around(trajectory, scene, (k, k + 1), when)
        moving = [disk for disk in disks if not scene.static[disk]]
        if is_rounding(earlier, later, moving, rounding):
            below += 1
            continue
        after = k + 1
        while after < len(t) and approach(trajectory, scene, (i, j), after, when, rounding):
            after = len(t) if any((after + 1, disk) in busy for disk in disks) else after + 1
        if after == len(t):
            unfinished += 1
            continue
        later = around(trajectory, scene, (after, after), when)[1]
        turned = np.abs(spin[after] - spin[k]) * scene.radius
        closing, separating = speeds_along_normal(earlier, later, scene, int(i), int(j), turned)
        if closing > max(slowest, 0.0) * (after - k):
            values.append(separating / closing)
            times.append(when)
        elif closing > max(slowest, 0.0):
            unfinished += 1
    return Restitutions(np.array(values), np.array(times), below, unfinished)


def approach(
    trajectory: Trajectory,
    scene: Scene,
    pair: tuple[int, int],
    k: int,
    when: float,
    rounding: float,
) -> bool:
    """Whether the two of a pair approach in sample k, by more than `FLOOR` roundings, after a
    collision at `when` s."""
    i, j = pair
    x, v = trajectory.position[k], around(trajectory, scene, (k, k), when)[1]
    other = x[j] if j >= 0 else laws.nearest_on_segment(x[i : i + 1], *scene.walls[-1 - j])[0]
    way = laws.nearer_way(x[i] - other, scene)
    others = v[j] if j >= 0 else np.zeros(2)
    floor = FLOOR * rounding * (laws.lengths(v[i]) + laws.lengths(others))
    return bool(way @ (v[i] - others) < -floor * laws.lengths(way))


def around(
    trajectory: Trajectory, scene: Scene, samples: tuple[int, int], when: float
) -> tuple[Array, Array]:
    """(n, 2) m/s just before and just after `when` s, from one sample before it, one after it, and
    gravity."""
    t, velocity, (k, m) = trajectory.t, trajectory.velocity, samples
    falling = np.where(scene.static[:, None], 0.0, scene.gravity)
    return velocity[k] + falling * (when - t[k]), velocity[m] - falling * (t[m] - when)


def is_rounding(earlier: Array, later: Array, moving: list[int], rounding: float) -> bool:
    """Whether the change of a disk that moves, or that of both to each other, is below the
    floor."""
    change = later[moving] - earlier[moving]
    speed = laws.lengths(earlier[moving]) + laws.lengths(later[moving])
    between = change[0] - change[-1] if len(moving) > 1 else change[0]
    floor = FLOOR * rounding
    return bool(
        (laws.lengths(change) <= floor * speed).any()
        or laws.lengths(between) <= floor * speed.sum()
    )


def speeds_along_normal(
    earlier: Array, later: Array, scene: Scene, i: int, j: int, turned: Array
) -> tuple[float, float]:
    """m/s at which disk i and disk or wall j close before and part after a collision; `turned` (n,)
    m/s by friction.

    The normal is that of the change of their velocity to each other, whichever of the two is named
    first. (nan, nan) if the change is not that of one frictionless collision.
    """
    change = later - earlier
    one, two = (change[i], change[j]) if j >= 0 else (change[i], np.zeros(2))
    between = one - two
    normal = between / (np.linalg.norm(between) or 1.0)
    if j >= 0 and not scene.static[j]:
        kicks = scene.mass[i] * one, scene.mass[j] * two
        unreported = np.linalg.norm(kicks[0] + kicks[1]) > CLEAN * max(map(np.linalg.norm, kicks))
        slid = (turned[[i, j]] > CLEAN * laws.lengths(change[[i, j]])).any()
    elif j < 0:
        start, end = scene.walls[-1 - j]
        slack = CLEAN * np.linalg.norm(end - start) * np.linalg.norm(one)
        unreported = abs(one @ (end - start)) > slack
        slid = turned[i] > CLEAN * np.linalg.norm(one)
    else:
        unreported, slid = False, turned[i] > CLEAN * np.linalg.norm(one)
    if unreported or slid:
        return np.nan, np.nan
    before, after = (
        (earlier[i] - earlier[j], later[i] - later[j]) if j >= 0 else (earlier[i], later[i])
    )
    return float(-before @ normal), float(after @ normal)
