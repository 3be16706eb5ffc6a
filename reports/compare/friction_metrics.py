"""The metrics of friction: tangential velocity, spin, energy, and the time until a disk rolls.

None applies to a scene without friction. Each is a row of `METRICS` (metrics.py), with the sentence
that says what it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from math import ceil
from typing import NamedTuple

import numpy as np

from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.collisions import SAME, WINDOW, interval
from crosscheck2d.reports.compare.delays import collision_free
from crosscheck2d.reports.compare.view import LEAST_SHARE, Value, View, not_judged
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory

ROLLS = 1e-9  # radii, and m/s over the largest speed: the bound of the exact answers
# of the initial slip: less is rolling, even if the engine's lever arm is off by 2 %
GONE = 0.05

# In collisions.


def tangential_velocity_error(view: View) -> Value | None:
    if not has_friction(view):
        return None
    truth, collisions = view.reference, view.reference.collisions
    free, along = collision_free(truth, view.dt), tangents(truth, view.scenario)
    after = np.searchsorted(truth.t, collisions.t + WINDOW * view.dt, "right")
    errors = []
    for row in np.flatnonzero(collisions.impulse):  # without it: a contact that lasts
        k = int(after[row])
        for disk in (int(collisions.i[row]), int(collisions.j[row])):
            if disk >= 0 and not view.scene.static[disk] and k < len(truth) and free[k, disk]:
                error = (view.played.velocity[k, disk] - truth.velocity[k, disk]) @ along[row]
                errors.append(Value(float(abs(error)), disk, float(truth.t[k])))
    return over_collisions(worst_of(errors), len(errors), view)


def friction_impulse_error(view: View) -> Value | None:
    if not has_friction(view):
        return None
    truth, errors = view.reference, []
    weight = laws.moving_inertia(view.scene) / view.scene.radius
    for disks, _, before, after in isolated_collisions(truth, view.scenario, view.dt):
        for disk in disks:
            turned, expected = (
                motion.angular_velocity[after, disk] - motion.angular_velocity[before, disk]
                for motion in (view.played, truth)
            )
            error = float(weight[disk] * abs(turned - expected))
            errors.append(Value(error, disk, float(truth.t[after])))
    return over_collisions(worst_of(errors), len(errors), view)


def worst_of(errors: Sequence[Value]) -> Value:
    return max([Value(0.0), *errors], key=lambda error: error.value)


def friction_loss_error(view: View) -> Value | None:
    return loss_error(view, of_friction=True)


def restitution_loss_error(view: View) -> Value | None:
    return loss_error(view, of_friction=False)


def loss_error(view: View, of_friction: bool) -> Value | None:
    """Energy lost by the engine minus that of the truth, over all collisions that can be read off
    two samples. Friction takes it from the tangential motion and the spins, restitution from the
    normal motion; each includes the potential energy along its own axis, and so is constant in
    flight."""
    scenario, scene = view.scenario, view.scene
    if not has_friction(view) or scenario.thrusts or scales.lifts(scenario):
        return None
    isolated = isolated_collisions(view.reference, scenario, view.dt)

    def energy_lost(motion: Trajectory, collision: Isolated) -> float:
        disks, (x, y) = collision.disks, collision.tangent
        axis = collision.tangent if of_friction else np.array([-y, x])
        at = np.array([collision.before, collision.after])[:, None], disks
        speed, place = motion.velocity[at] @ axis, motion.position[at] @ axis
        energy = (speed**2 / 2 - scene.gravity @ axis * place) @ laws.moving_mass(scene)[disks]
        if of_friction:
            spin = motion.angular_velocity[at]
            energy = energy + spin**2 / 2 @ laws.moving_inertia(scene)[disks]
        return float(energy[0] - energy[1])

    own, exact = (
        np.array([energy_lost(motion, collision) for collision in isolated])
        for motion in (view.played, view.reference)
    )
    scale = scales.energy(scenario) or 1.0
    note = f"{exact.sum() / scale:.2g} in {len(isolated)} collisions of the exact answer"
    carried = sum(len(collision.disks) for collision in isolated)
    return over_collisions(Value(float((own - exact).sum() / scale), note=note), carried, view)


def has_friction(view: View) -> bool:
    """Whether disks collide with friction in the exact answer that the run is compared with."""
    if not view.scene.friction or view.jumps is None:
        return False
    return bool(view.reference.collisions.impulse.any())


def over_collisions(value: Value, carried: int, view: View) -> Value:
    """The value with the number of times that a disk collides in the exact answer and can be read;
    "not judged" where they are fewer than `LEAST_SHARE` of all."""
    collisions = view.reference.collisions
    sides = np.stack([collisions.i, collisions.j])[:, collisions.impulse > 0]
    every = int((~view.scene.static[sides[sides >= 0]]).sum())
    share = f"{carried} of {every} times a disk collides are far enough from all other collisions"
    if carried < max(LEAST_SHARE * every, 1):
        return not_judged(f"only {share}")
    return value._replace(note=", ".join(filter(None, (value.note, share))))


class Isolated(NamedTuple):
    """A collision of the truth between two samples, each more than 3.2 steps from all collisions of
    its disks, with no other collision of these between them."""

    disks: list[int]  # those of the pair that move
    tangent: Array  # (2,) of length 1, along the surfaces
    before: int
    after: int


@laws.cached
def tangents(truth: Trajectory, scenario: Scenario) -> Array:
    """(m, 2) of length 1: the direction along the surfaces in each collision of the truth."""
    assert scenario.truth is not None
    collisions, tangents = truth.collisions, []
    for t, i, j in zip(collisions.t, collisions.i, collisions.j):
        contact = scenario.truth(np.array([t])).position[0]
        x, y = laws.contact_normal(contact, scenario.scene, i, j)
        tangents.append([-y, x])
    return np.array(tangents).reshape(-1, 2)


@laws.cached
def isolated_collisions(truth: Trajectory, scenario: Scenario, dt: float) -> list[Isolated]:
    """The collisions that can be read off two samples, in order of time. A disk that rests on
    something has none, because friction also acts on it between collisions."""
    collisions, free = truth.collisions, collision_free(truth, dt)
    along, isolated = tangents(truth, scenario), []
    for row, (t, i, j) in enumerate(zip(collisions.t, collisions.i, collisions.j)):
        disks = [int(disk) for disk in (i, j) if disk >= 0 and not scenario.scene.static[disk]]
        alone = free[:, disks].all(axis=1)
        early = np.flatnonzero(alone & (truth.t < t))
        late = np.flatnonzero(alone & (truth.t > t))
        if not len(early) or not len(late):
            continue
        before, after = int(early[-1]), int(late[0])
        theirs = np.isin(collisions.i, disks) | np.isin(collisions.j, disks)
        between = theirs & (collisions.t > truth.t[before]) & (collisions.t < truth.t[after])
        lies = theirs & (collisions.impulse == 0) & (collisions.t < truth.t[after])
        if lies.any() or np.flatnonzero(between)[0] < row:
            continue
        # a wall that is listed twice, or in two pieces, is one
        together = (np.abs(collisions.t[between] - t) <= SAME * interval(truth)).all()
        if together and (abs(laws.cross(along[row], along[between])) < ROLLS).all():
            isolated.append(Isolated(disks, along[row], before, after))
    return isolated


# Where a disk slides on a wall, and where it rolls.


def slip_at_rest(view: View) -> Value | None:
    if not view.scene.friction or view.jumps is None:
        return None
    truth, slips = view.reference, []
    late = ceil(WINDOW * view.dt / view.scenario.sample_interval)
    for disk, wall in pairs(view.scene):
        exact, _, rolls = slide(truth, view.scene, disk, wall)
        lasts = rolls & np.append(np.zeros(late, bool), rolls)[: len(rolls)]
        if lasts.any():
            slip = np.abs(slide(view.played, view.scene, disk, wall)[0] - exact)
            slip = np.where(lasts, slip, 0)
            k = int(np.argmax(slip))
            slips.append(Value(float(slip[k]), disk, float(truth.t[k])))
    return worst_of(slips) if slips else None


def time_to_roll_error_s(view: View) -> Value | None:
    if not view.scene.friction or view.jumps is None:
        return None
    truth, scene, errors = view.reference, view.scene, []
    for disk, wall in pairs(scene):
        exact, touches, rolls = slide(truth, scene, disk, wall)
        slips = touches & ~rolls
        for begins in np.flatnonzero(rolls[1:] & slips[:-1]) + 1:
            first = begins - int(np.argmin(np.append(slips[:begins][::-1], False)))
            if begins - first < 2:  # samples from which the end of the slip is extrapolated
                continue
            slip, _, _ = slide(view.played, scene, disk, wall)
            time = end_of_slip(view.played.t[first:], slip[first:])
            expected = end_of_slip(truth.t[first:], exact[first:])
            note = "" if np.isfinite(time) else "at least: it slips to the end"
            errors.append(Value(min(time, truth.t[-1]) - expected, disk, float(expected), note))
    return max(errors, key=lambda error: abs(error.value), default=None)


def pairs(scene: Scene) -> Iterator[tuple[int, int]]:
    """Every disk that moves, with every wall."""
    return product(np.flatnonzero(~scene.static).tolist(), range(len(scene.walls)))


def end_of_slip(t: Array, slip: Array) -> float:
    """s, when a slip (k,) m/s reaches 0, extrapolated on the line from the first sample to the last
    above `GONE` of the first; `inf` if it never falls below that.

    The end is at most where a straight line from the first sample through the first one below
    `GONE` would put it.
    """
    left = slip / slip[0]
    k = int(np.argmax(left < GONE))
    if left[k] >= GONE:
        return np.inf
    taken, latest = 1 - left[k - 1], (t[k] - t[0]) / (1 - GONE)
    straight = (t[k - 1] - t[0]) / taken if taken > 0 else latest
    return float(t[0] + min(straight, latest))


def slide(
    motion: Trajectory, scene: Scene, disk: int, wall: int
) -> tuple[Array, np.ndarray, np.ndarray]:
    """(k,) m/s, the slip of the point of a disk that is nearest to a wall, along the wall; (k,)
    whether the disk touches the wall; (k,) whether it touches and does not slide."""
    x = motion.position[:, disk]
    away = x - laws.nearest_on_segment(x, *scene.walls[wall])
    distance = laws.lengths(away)
    normal = away / distance[:, None]
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=-1)
    along = (motion.velocity[:, disk] * tangent).sum(axis=1)
    slip: Array = along - scene.radius[disk] * motion.angular_velocity[:, disk]
    touches = np.abs(distance / scene.radius[disk] - 1) < ROLLS
    fastest = laws.lengths(motion.velocity).max() or 1.0
    return slip, touches, touches & (np.abs(slip) < ROLLS * fastest)
