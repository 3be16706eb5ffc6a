"""What friction does to a velocity: along the surfaces after a collision, and where a disk rolls.

None of it applies to a scene without friction.
"""

from __future__ import annotations

from math import ceil

import numpy as np

from reports.compare import laws
from reports.compare.delays import WINDOW, collision_free
from reports.compare.view import Value, View, not_judged
from scenarios.model import Array, Scene, Trajectory

ROLLS = 1e-9  # radii, and m/s over the largest speed: the bound of the exact answers


def tangential_velocity_error(view: View) -> Value | None:
    """Largest error of a disk's velocity along the surfaces, in the first sample after a collision
    that is more than three steps from all collisions."""
    scenario, truth = view.scenario, view.other
    if not scenario.scene.friction or truth is None or view.jumps is None:
        return None
    assert scenario.truth is not None
    free = collision_free(truth, view.dt)
    worst, carried = Value(0.0), 0
    met = truth.collisions
    for t, i, j, impulse in zip(met.t, met.i, met.j, met.impulse):
        if not impulse:  # a contact that lasts
            continue
        tangent = tangent_at(scenario.truth(np.array([t])), scenario.scene, int(i), int(j))
        k = int(np.searchsorted(truth.t, t + WINDOW * view.dt, "right"))
        for disk in (int(i), int(j)):
            if disk < 0 or scenario.scene.static[disk] or k >= len(truth) or not free[k, disk]:
                continue
            carried += 1
            error = (view.played.velocity[k, disk] - truth.velocity[k, disk]) @ tangent
            if abs(error) > worst.value:
                worst = Value(float(abs(error)), disk, float(truth.t[k]))
    if not carried:
        return not_judged("no sample is more than three steps from all collisions")
    return worst._replace(note=f"{carried} times a disk has collided")


def slip_at_rest(view: View) -> Value | None:
    """Largest speed with which surfaces slide on each other where in the exact answer a disk rolls
    or stands on a wall, from three steps after it began to."""
    scenario, truth = view.scenario, view.other
    if not scenario.scene.friction or truth is None or view.jumps is None:
        return None
    late = ceil(WINDOW * view.dt / scenario.sample_interval)
    worst, found = Value(0.0), False
    for disk in np.flatnonzero(~scenario.scene.static):
        for wall in range(len(scenario.scene.walls)):
            rests = rolling(truth, scenario.scene, int(disk), wall)
            held = rests & np.append(np.zeros(late, bool), rests)[: len(rests)]
            slip = np.where(held, np.abs(slip_of(view.played, scenario.scene, int(disk), wall)), 0)
            k = int(np.argmax(slip))
            found |= bool(held.any())
            if slip[k] > worst.value:
                worst = Value(float(slip[k]), int(disk), float(truth.t[k]))
    return worst if found else None


def tangent_at(contact: Trajectory, scene: Scene, i: int, j: int) -> Array:
    """(2,) of length 1: along the surfaces of disk i and of disk j, or of wall -1 - j, when they
    meet."""
    x = contact.position[0]
    other = x[j] if j >= 0 else laws.nearest_on_segment(x[i : i + 1], *scene.walls[-1 - j])[0]
    nx, ny = (x[i] - other) / np.linalg.norm(x[i] - other)
    return np.array([-ny, nx])


def rolling(truth: Trajectory, scene: Scene, disk: int, wall: int) -> np.ndarray:
    """(k,) whether a disk touches a wall and does not slide on it."""
    away = truth.position[:, disk] - laws.nearest_on_segment(
        truth.position[:, disk], *scene.walls[wall]
    )
    touches = np.abs(laws.lengths(away) / scene.radius[disk] - 1) < ROLLS
    fastest = laws.lengths(truth.velocity).max() or 1.0
    rests: np.ndarray = touches & (np.abs(slip_of(truth, scene, disk, wall)) < ROLLS * fastest)
    return rests


def slip_of(trajectory: Trajectory, scene: Scene, disk: int, wall: int) -> Array:
    """(k,) m/s of the point of a disk that is nearest to a wall, along the wall."""
    x = trajectory.position[:, disk]
    away = x - laws.nearest_on_segment(x, *scene.walls[wall])
    normal = away / laws.lengths(away)[:, None]
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=-1)
    along = (trajectory.velocity[:, disk] * tangent).sum(axis=1)
    slip: Array = along - scene.radius[disk] * trajectory.angular_velocity[:, disk]
    return slip
