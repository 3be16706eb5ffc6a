"""The metrics of friction: tangential velocity, spin, energy, and the time until a disk rolls.

None applies to a scene without friction.
"""

from __future__ import annotations

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


def tangential_velocity_error(view: View) -> Value | None:
    """Largest error of a disk's velocity along the surfaces, in the first sample after a collision
    that is more than 3.2 steps from all collisions."""
    scenario, truth = view.scenario, view.other
    if truth is None or not has_friction(view):
        return None
    free = collision_free(truth, view.dt)
    worst, carried = Value(0.0), 0
    met = truth.collisions
    along = tangents(truth, scenario)
    for t, i, j, impulse, tangent in zip(met.t, met.i, met.j, met.impulse, along):
        if not impulse:  # a contact that lasts
            continue
        k = int(np.searchsorted(truth.t, t + WINDOW * view.dt, "right"))
        for disk in (int(i), int(j)):
            if disk < 0 or scenario.scene.static[disk] or k >= len(truth) or not free[k, disk]:
                continue
            carried += 1
            error = (view.played.velocity[k, disk] - truth.velocity[k, disk]) @ tangent
            if abs(error) > worst.value:
                worst = Value(float(abs(error)), disk, float(truth.t[k]))
    return over_collisions(worst, carried, view)


def slip_at_rest(view: View) -> Value | None:
    """Largest speed at which a disk slides on a wall while, in the exact answer, it rolls or rests
    there; counted from 3.2 steps after that begins."""
    scenario, truth = view.scenario, view.other
    if not scenario.scene.friction or truth is None or view.jumps is None:
        return None
    late = ceil(WINDOW * view.dt / scenario.sample_interval)
    worst, found = Value(0.0), False
    for disk in np.flatnonzero(~scenario.scene.static):
        for wall in range(len(scenario.scene.walls)):
            rests = rolling(truth, scenario.scene, int(disk), wall)
            held = rests & np.append(np.zeros(late, bool), rests)[: len(rests)]
            played, exact = (
                slip_of(motion, scenario.scene, int(disk), wall) for motion in (view.played, truth)
            )
            slip = np.where(held, np.abs(played - exact), 0)
            k = int(np.argmax(slip))
            found |= bool(held.any())
            if slip[k] > worst.value:
                worst = Value(float(slip[k]), int(disk), float(truth.t[k]))
    return worst if found else None


def has_friction(view: View) -> bool:
    """Whether disks collide with friction in the exact answer that the run is compared with."""
    if not view.scene.friction or view.other is None or view.jumps is None:
        return False
    return bool(view.other.collisions.impulse.any())


def over_collisions(value: Value, carried: int, view: View) -> Value:
    """The value with the number of times that a disk collides in the exact answer and can be read;
    "not judged" where they are fewer than `LEAST_SHARE` of all."""
    assert view.other is not None
    met = view.other.collisions
    sides = np.stack([met.i, met.j])[:, met.impulse > 0]
    every = int((~view.scene.static[sides[sides >= 0]]).sum())
    share = f"{carried} of {every} times a disk collides are far enough from all other collisions"
    if carried < max(LEAST_SHARE * every, 1):
        return not_judged(f"only {share}")
    return value._replace(note=", ".join(filter(None, (value.note, share))))


class Isolated(NamedTuple):
    """A collision of the truth between two samples, with no other collision of its disks between
    them.

    Attributes:
        disks: (d,) the moving disks of the pair.
        tangent: (2,) of length 1, along the surfaces.
        before, after: the samples, each more than 3.2 steps from all collisions of these disks.
    """

    disks: list[int]
    tangent: Array
    before: int
    after: int


@laws.cached
def tangents(truth: Trajectory, scenario: Scenario) -> Array:
    """(m, 2) of length 1: the direction along the surfaces in each collision of the truth."""
    assert scenario.truth is not None
    met = truth.collisions
    found = [
        tangent_at(scenario.truth(np.array([t])), scenario.scene, int(i), int(j))
        for t, i, j in zip(met.t, met.i, met.j)
    ]
    return np.array(found).reshape(-1, 2)


@laws.cached
def isolated_collisions(truth: Trajectory, scenario: Scenario, dt: float) -> list[Isolated]:
    """The collisions that can be read off two samples, in order of time. A disk that rests on
    something has none, because friction also acts on it between collisions."""
    met, free, along = truth.collisions, collision_free(truth, dt), tangents(truth, scenario)
    found: list[Isolated] = []
    for row, (t, i, j) in enumerate(zip(met.t, met.i, met.j)):
        disks = [int(disk) for disk in (i, j) if disk >= 0 and not scenario.scene.static[disk]]
        alone = free[:, disks].all(axis=1)
        early = np.flatnonzero(alone & (truth.t < t))
        late = np.flatnonzero(alone & (truth.t > t))
        if not len(early) or not len(late):
            continue
        before, after = int(early[-1]), int(late[0])
        theirs = np.isin(met.i, disks) | np.isin(met.j, disks)
        between = theirs & (met.t > truth.t[before]) & (met.t < truth.t[after])
        lies = theirs & (met.impulse == 0) & (met.t < truth.t[after])
        if lies.any() or np.flatnonzero(between)[0] < row:
            continue
        # a wall that is listed twice, or in two pieces, is one
        together = (np.abs(met.t[between] - t) <= SAME * interval(truth)).all()
        if together and (abs(laws.cross(along[row], along[between])) < ROLLS).all():
            found.append(Isolated(disks, along[row], before, after))
    return found


def friction_impulse_error(view: View) -> Value | None:
    """Largest error of the impulse of friction in a collision: I dw / r of a disk, because only
    friction changes its spin."""
    scene, truth = view.scene, view.other
    if truth is None or not has_friction(view):
        return None
    worst, judged = Value(0.0), 0
    weight = laws.moving_inertia(scene) / scene.radius
    for disks, _, before, after in isolated_collisions(truth, view.scenario, view.dt):
        for disk in disks:
            turned, ought = (
                one.angular_velocity[after, disk] - one.angular_velocity[before, disk]
                for one in (view.played, truth)
            )
            judged += 1
            error = float(weight[disk] * abs(turned - ought))
            if error > worst.value:
                worst = Value(error, disk, float(truth.t[after]))
    return over_collisions(worst, judged, view)


def friction_loss_error(view: View) -> Value | None:
    """Energy that friction takes in collisions, minus that of the exact answer, over the energy at
    hand.

    Friction takes it from the tangential motion and the spins; restitution takes only from the
    normal motion (`restitution_loss_error`).
    """
    return loss_error(view, of_friction=True)


def restitution_loss_error(view: View) -> Value | None:
    """Energy that restitution takes in collisions with friction, minus that of the exact answer,
    over the energy at hand."""
    return loss_error(view, of_friction=False)


def loss_error(view: View, of_friction: bool) -> Value | None:
    """One of the two losses, engine minus truth, over all collisions that can be read off two
    samples."""
    scenario, truth = view.scenario, view.other
    if truth is None or not has_friction(view) or scenario.thrusts or scales.lifts(scenario):
        return None
    losses = np.array(
        [
            [energy_lost(one, scenario.scene, each, of_friction) for one in (view.played, truth)]
            for each in isolated_collisions(truth, scenario, view.dt)
        ]
    ).reshape(-1, 2)
    carried = sum(len(each.disks) for each in isolated_collisions(truth, scenario, view.dt))
    scale = scales.energy(scenario) or 1.0
    off = (losses[:, 0] - losses[:, 1]).sum() / scale
    note = f"{losses[:, 1].sum() / scale:.2g} in {len(losses)} collisions of the exact answer"
    return over_collisions(Value(float(off), note=note), carried, view)


def energy_lost(one: Trajectory, scene: Scene, each: Isolated, along: bool) -> float:
    """J that a collision takes from the tangential motion and the spins, or from the normal motion.

    Each includes the potential energy along its own axis, and so is constant in flight.
    """
    axis = each.tangent if along else np.array([-each.tangent[1], each.tangent[0]])
    ends = np.array([each.before, each.after])[:, None]
    mass = laws.moving_mass(scene)[each.disks]
    speed, place = one.velocity[ends, each.disks] @ axis, one.position[ends, each.disks] @ axis
    energy = (speed**2 / 2 - scene.gravity @ axis * place) @ mass
    if along:
        spin = one.angular_velocity[ends, each.disks]
        energy = energy + spin**2 / 2 @ laws.moving_inertia(scene)[each.disks]
    return float(energy[0] - energy[1])


def time_to_roll_error_s(view: View) -> Value | None:
    """Time at which a sliding disk begins to roll, minus that of the exact answer; the largest of
    all disks. If it slips to the end, what is left until the end: a lower bound."""
    scenario, truth = view.scenario, view.other
    if not scenario.scene.friction or truth is None or view.jumps is None:
        return None
    worst: Value | None = None
    for disk in np.flatnonzero(~scenario.scene.static):
        for wall in range(len(scenario.scene.walls)):
            rolls = rolling(truth, scenario.scene, int(disk), wall)
            slips = touching(truth, scenario.scene, int(disk), wall) & ~rolls
            for begins in np.flatnonzero(rolls[1:] & slips[:-1]) + 1:
                first = begins - int(np.argmin(np.append(slips[:begins][::-1], False)))
                if begins - first < 2:  # samples from which the end of the slip is extrapolated
                    continue
                ours, ought = (
                    end_of_slip(
                        one.t[first:], slip_of(one, scenario.scene, int(disk), wall)[first:]
                    )
                    for one in (view.played, truth)
                )
                note = "" if np.isfinite(ours) else "at least: it slips to the end"
                off = Value(min(ours, truth.t[-1]) - ought, int(disk), float(ought), note)
                worst = max(worst or off, off, key=lambda one: abs(one.value))
    return worst


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


def tangent_at(contact: Trajectory, scene: Scene, i: int, j: int) -> Array:
    """(2,) of length 1: along the surfaces of disk i and of disk j, or of wall -1 - j, when they
    meet."""
    x = contact.position[0]
    other = x[j] if j >= 0 else laws.nearest_on_segment(x[i : i + 1], *scene.walls[-1 - j])[0]
    nx, ny = (x[i] - other) / np.linalg.norm(x[i] - other)
    return np.array([-ny, nx])


def rolling(truth: Trajectory, scene: Scene, disk: int, wall: int) -> np.ndarray:
    """(k,) whether a disk touches a wall and does not slide on it."""
    fastest = laws.lengths(truth.velocity).max() or 1.0
    rests = np.abs(slip_of(truth, scene, disk, wall)) < ROLLS * fastest
    return touching(truth, scene, disk, wall) & rests


def touching(truth: Trajectory, scene: Scene, disk: int, wall: int) -> np.ndarray:
    """(k,) whether a disk touches a wall."""
    away = truth.position[:, disk] - laws.nearest_on_segment(
        truth.position[:, disk], *scene.walls[wall]
    )
    touches: np.ndarray = np.abs(laws.lengths(away) / scene.radius[disk] - 1) < ROLLS
    return touches


def slip_of(trajectory: Trajectory, scene: Scene, disk: int, wall: int) -> Array:
    """(k,) m/s of the point of a disk that is nearest to a wall, along the wall."""
    x = trajectory.position[:, disk]
    away = x - laws.nearest_on_segment(x, *scene.walls[wall])
    normal = away / laws.lengths(away)[:, None]
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=-1)
    along = (trajectory.velocity[:, disk] * tangent).sum(axis=1)
    slip: Array = along - scene.radius[disk] * trajectory.angular_velocity[:, disk]
    return slip
