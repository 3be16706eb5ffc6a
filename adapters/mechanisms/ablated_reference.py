"""The exercise's solver with every mechanism by which engines differ: each engine is an order of
stages.

Every stage is a function below, and `Parameters` holds their numbers. The order accelerate, move,
pairs, walls gives the bits of the exercise. The solver tests all pairs, so it suits up to some
hundred disks. Compiled by numba, as `exercise` is.
"""

from math import atan, atan2, inf, pi, sqrt
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.mechanisms.contacts import (
    Contacts,
    apply_pair,
    by_colour,
    by_island,
    carried_off,
    closing,
    detect,
    drive_to_target,
    gap_along,
    gap_of,
    inverse_mass,
    rub,
    turn,
)
from crosscheck2d.reference_impl.compiled import compiled, internal
from crosscheck2d.reference_impl.coulomb import carry_over, collide, collide_wall
from crosscheck2d.reference_impl.exercise import touching, touching_wall, wrap
from crosscheck2d.reference_impl.state import Disks, World

Collision = tuple[int, int, int, float]  # step, i, j or -1 - wall, impulse N s
STAGES = (
    *("accelerate", "move", "pairs", "walls", "detect", "by_island", "by_colour", "aim"),
    *("warm_start", "bounce", "cap", "position_correction", "nudge", "soften", "relax"),
    "restitute",
)
ACCELERATE, MOVE, PAIRS, WALLS, DETECT, BY_ISLAND, BY_COLOUR, AIM = range(8)
WARM_START, BOUNCE, CAP, POSITION_CORRECTION, NUDGE, SOFTEN, RELAX, RESTITUTE = range(8, 16)


class Parameters(NamedTuple):
    """The numbers of the stages; the defaults are those of the exercise."""

    order: np.ndarray  # the stages of a step, as places in STAGES
    drift: float = 0.0  # of a h2, the term that `move` adds to v h
    summed: bool = True  # of `move`: sum the moves of a step, then add them to the position
    tangent: bool = False  # of `move`: (cos, sin) is stored, and turns along its tangent
    threshold: float = 0.0  # m/s: closing speeds up to which a collision is inelastic
    project: bool = True  # of `pairs`: do the projection
    project_walls: bool = True  # of `walls`
    iterations: int = 8  # of `bounce`
    lever: float = 0.0  # of the gap, added to the lever arm of friction, the radius
    onto_edge: bool = True  # a disk that leaves the box is set onto the edge: its flight is cut off
    rub_first: bool = False  # of `bounce`: friction before the normal impulse of the same pass
    rub_restituted: bool = True  # of `restitute`: its impulses allow more friction
    rub_biased: bool = True  # of `soften`: friction in its first pass, too
    rebounds: bool = True  # of `aim`: a contact with an impulse in the last step may bounce again
    correction_share: float = 0.0  # of the overlap beyond the slop, each iteration or `nudge`
    correction_iterations: int = 3
    correction_most: float = inf  # m, largest correction in one of them
    slop: float = 0.0  # m, overlap that remains: the slop
    cap: float = inf  # m, cap of a move; the velocity is cut
    margin: float = 0.0  # m, gap below which two bodies are a contact
    touching: bool = False  # whether a gap of exactly `margin` is a contact, too
    recycled: float = 0.0  # m, relative motion after which a pair is tested again
    fattened: float = 0.0  # m, margin of the boxes that must overlap before a test
    memory: int = 1  # steps for which a lost contact keeps its impulses
    skin: float = 0.0  # m, skin of the walls
    carried: bool = False  # of `soften`: contact points turn with their disks
    hertz: float = 30.0  # of `soften`: the stiffness of a contact of two free disks
    static_hertz: float = 30.0  # half of that of a contact with a wall or a static disk
    damping: float = 10.0  # its damping ratio
    correction_speed: float = 0.0  # m/s, cap of the position correction
    share_capped: bool = False  # whether it caps the share of `soften`, not the whole


@compiled
def advance(  # noqa: C901, PLR0912 - a branch for each stage: numba has no table of functions
    disks: Disks, world: World, on: Parameters, kept: Contacts, h: float, count: int
) -> list[Collision]:
    """Advance `count` steps, each move by `h` s; return the collisions as `exercise.advance`
    does."""
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know the element type
    for k in range(count):
        for i in range(len(disks.mass)):
            kept.start[i, 0], kept.start[i, 1] = disks.position[i, 0], disks.position[i, 1]
        kept.moved[:], kept.turned[:] = 0.0, 0.0
        for stage in on.order:
            if stage == ACCELERATE:
                accelerate(disks, world, h)
            elif stage == MOVE:
                move(disks, world, on, kept, h)
            elif stage == PAIRS:
                pairs(disks, world, on, k, collisions)
            elif stage == WALLS:
                walls(disks, world, on, k, collisions)
            elif stage == DETECT:
                detect(disks, world, on, kept)
            elif stage == BY_ISLAND:
                by_island(disks.mass, kept)
            elif stage == BY_COLOUR:
                by_colour(disks.mass, kept)
            elif stage == AIM:
                aim(disks.velocity, world.restitution, on, kept)
            elif stage == WARM_START:
                warm_start(disks, on, kept)
            elif stage == BOUNCE:
                bounce(disks, world, on, kept)
            elif stage == CAP:
                cap(disks.velocity, on.cap, h)
            elif stage == POSITION_CORRECTION:
                position_correction(disks, world, on, kept)
            elif stage == NUDGE:
                nudge(disks.mass, on, kept, h)
            elif stage == SOFTEN:
                soften(disks, world, on, kept, h, True)
            elif stage == RELAX:
                soften(disks, world, on, kept, h, False)
            elif stage == RESTITUTE:
                restitute(disks, world, on, kept)
        for c in range(kept.found[0]):
            if kept.rows[c].impulse > 0.0:
                collisions.append((k, kept.rows[c].i, kept.rows[c].j, kept.rows[c].impulse))
        if on.onto_edge:
            wrap(disks.position, world)
        else:
            carry_over(disks.position, world)
    return collisions


@internal
def accelerate(disks: Disks, world: World, h: float) -> None:
    for i in range(len(disks.mass)):
        if disks.mass[i] != inf:
            for axis in range(2):
                disks.velocity[i, axis] += (
                    world.gravity[axis] + disks.force[i, axis] / disks.mass[i]
                ) * h
            disks.angular_velocity[i] += disks.torque[i] / disks.inertia[i] * h


@internal
def move(disks: Disks, world: World, on: Parameters, kept: Contacts, h: float) -> None:
    """x += v h + drift a h2, plus the velocity of `nudge`; the angle alike.

    If `summed`, as in Box2D 3.1, the moves of a step are summed before they are added to the
    position, so that the moves are rounded, not the position; else, as in Rapier, each move rounds
    the position.
    """
    v, moved, more = disks.velocity, kept.moved, on.drift * h * h
    for i in range(len(disks.mass)):
        if disks.mass[i] != inf:
            for axis in range(2):
                acceleration = world.gravity[axis] + disks.force[i, axis] / disks.mass[i]
                by = (v[i, axis] + kept.nudge[i, axis]) * h + more * acceleration
                if on.summed:
                    moved[i, axis] += by
                    disks.position[i, axis] = kept.start[i, axis] + moved[i, axis]
                else:
                    disks.position[i, axis] += by
                    moved[i, axis] = disks.position[i, axis] - kept.start[i, axis]
                kept.nudge[i, axis] = 0.0
            turned = disks.angular_velocity[i] * h
            kept.turned[i] += atan(turned)  # as b2IntegrateRotation does
            if on.tangent:
                turn_along(disks.angle, kept.facing, i, turned)
            else:
                disks.angle[i] += turned + more * disks.torque[i] / disks.inertia[i]


@internal
def turn_along(angle, facing, i: int, by: float) -> None:
    """Turn (cos, sin) of disk i along its tangent, and normalise it (Box2D 3.1,
    b2IntegrateRotation): by atan(by), and by what rounding (cos, sin) adds."""
    c, s = facing[i, 0] - facing[i, 1] * by, facing[i, 1] + facing[i, 0] * by
    length = sqrt(c * c + s * s)
    facing[i, 0], facing[i, 1] = c / length, s / length
    ahead = atan2(facing[i, 1], facing[i, 0]) - angle[i]
    angle[i] += ahead - 2.0 * pi * round(ahead / (2.0 * pi))


@compiled
def pairs(disks: Disks, world: World, on: Parameters, k: int, collisions: list[Collision]) -> None:
    x, radius = disks.position, disks.radius
    for i in range(len(radius)):
        for j in range(i + 1, len(radius)):
            if touching(x, radius, i, j):
                meet(disks, world, on, i, j, k, collisions)


@compiled
def walls(disks: Disks, world: World, on: Parameters, k: int, collisions: list[Collision]) -> None:
    x, radius = disks.position, disks.radius
    for i in range(len(radius)):
        for w in range(len(world.walls)):
            if touching_wall(x, radius, i, world.walls, w):
                meet(disks, world, on, i, -1 - w, k, collisions)


@compiled
def meet(
    disks: Disks, world: World, on: Parameters, i: int, j: int, k: int, collisions: list[Collision]
) -> None:
    """Collide one pair as in the exercise, with friction; without projection both positions are
    restored afterwards."""
    x, other = disks.position, max(j, 0)
    xi, yi, xj, yj = x[i, 0], x[i, 1], x[other, 0], x[other, 1]
    _, nx, ny = gap_of(disks, world, i, j)
    law = world
    if on.threshold > 0.0 and closing(disks.velocity, i, j, nx, ny) >= -on.threshold:
        law = World(0.0, *world[1:])
    impulse = collide(disks, i, j, law) if j >= 0 else collide_wall(disks, i, -1 - j, law)
    if not (on.project if j >= 0 else on.project_walls):
        x[i, 0], x[i, 1] = xi, yi
        if j >= 0:
            x[j, 0], x[j, 1] = xj, yj
    if impulse != 0.0:
        collisions.append((k, i, j, impulse))


@compiled
def aim(v, restitution: float, on: Parameters, kept: Contacts) -> None:
    """Set the target velocity of every contact, before any impulse: e times the closing speed, 0
    for slow collisions.

    Without `rebounds` it is 0, too, where e < 1 and the contact bore an impulse in the step before
    (Rapier, is_bouncy).
    """
    for c in range(kept.found[0]):
        contact = kept.rows[c]
        speed = closing(v, contact.i, contact.j, contact.nx, contact.ny)
        fresh = on.rebounds or restitution >= 1.0 or not contact.bore
        contact.target = -restitution * speed if speed < -on.threshold and fresh else 0.0


@internal
def warm_start(disks: Disks, on: Parameters, kept: Contacts) -> None:
    """Apply the impulses that the contacts had in the last step.

    An impulse older than that is not applied, but `bounce` treats it as applied, and may take it
    back (Munk2D, cpArbiterUpdate).
    """
    for c in range(kept.found[0]):
        contact = kept.rows[c]
        if contact.late:
            continue
        i, j, nx, ny = contact.i, contact.j, contact.nx, contact.ny
        apply_pair(disks.velocity, disks.mass, i, j, nx, ny, contact.impulse)
        turn(disks, contact, contact.slide, on.lever)


@internal
def bounce(disks: Disks, world: World, on: Parameters, kept: Contacts) -> None:
    """Sequential impulses: solve all contacts in turn, `iterations` times; a later pass may take
    an impulse back."""
    for _ in range(on.iterations):
        for c in range(kept.found[0]):
            contact = kept.rows[c]
            if on.rub_first:
                rub(disks, contact, world.friction, on.lever)
            drive_to_target(disks, contact, contact.target, 1.0, 0.0)
            if not on.rub_first:
                rub(disks, contact, world.friction, on.lever)


@internal
def cap(v, most: float, h: float) -> None:
    for i in range(len(v)):
        far = sqrt(v[i, 0] * v[i, 0] + v[i, 1] * v[i, 1]) * h
        if far > most:
            v[i, 0] *= most / far
            v[i, 1] *= most / far


@internal
def position_correction(disks: Disks, world: World, on: Parameters, kept: Contacts) -> None:
    """Undo a fraction of every overlap beyond the slop, `correction_iterations` times in each
    island."""
    first = 0
    while on.correction_share > 0.0 and first < kept.found[0]:
        end = first
        while end < kept.found[0] and kept.rows[end].island == kept.rows[first].island:
            end += 1
        worst = -inf
        for _ in range(on.correction_iterations):
            if worst < -3.0 * on.slop:  # else all overlaps are within three slops
                worst = correct_island(disks, world, on, kept, first, end)
        first = end


@internal
def correct_island(
    disks: Disks, world: World, on: Parameters, kept: Contacts, first: int, end: int
) -> float:
    """Correct the contacts from `first` to before `end` once; returns the smallest gap in m before
    it, at most 0."""
    worst = 0.0
    for c in range(first, end):
        i, j = kept.rows[c].i, kept.rows[c].j
        gap, nx, ny = gap_of(disks, world, i, j)
        gap -= on.skin if j < 0 else 0.0
        worst = min(worst, gap)
        by = min(max(-on.correction_share * (gap + on.slop), 0.0), on.correction_most)
        apply_pair(disks.position, disks.mass, i, j, nx, ny, by / inverse_mass(disks.mass, i, j))
    return worst


@internal
def nudge(mass, on: Parameters, kept: Contacts, h: float) -> None:
    """Give overlapping disks a velocity for the next move only, which undoes a fraction of the
    overlap beyond the slop."""
    for c in range(kept.found[0]):
        kept.rows[c].nudged = 0.0
    for _ in range(on.iterations):
        for c in range(kept.found[0]):
            contact = kept.rows[c]
            i, j, nx, ny, before = contact.i, contact.j, contact.nx, contact.ny, contact.nudged
            wanted = on.correction_share * max(-(contact.gap + on.slop), 0.0) / h
            more = (wanted - closing(kept.nudge, i, j, nx, ny)) / inverse_mass(mass, i, j)
            contact.nudged = max(before + more, 0.0)
            apply_pair(kept.nudge, mass, i, j, nx, ny, contact.nudged - before)


@internal
def soften(
    disks: Disks, world: World, on: Parameters, kept: Contacts, h: float, biased: bool
) -> None:
    """Solve each contact as a damped spring, implicitly for the end of the substep (E. Catto,
    Solver2D, 2024: soft step).

    The second pass, not `biased`, removes the bias from the velocities. Bodies that do not touch
    yet may only close their gap.
    """
    for c in range(kept.found[0]):
        contact = kept.rows[c]
        gap = gap_along(kept.moved, contact)
        if on.carried:
            gap += carried_off(disks.radius, kept.turned, contact)
        target, share, memory = 0.0, 1.0, 0.0
        if gap > 0.0:
            target = -gap / h
        elif biased and on.correction_speed > 0.0:
            rigid = contact.j < 0 or disks.mass[contact.i] == inf or disks.mass[contact.j] == inf
            stiffness = 2.0 * min(on.static_hertz, 0.125 / h) if rigid else min(on.hertz, 0.125 / h)
            omega = 2.0 * pi * stiffness
            stiff = 2.0 * on.damping + h * omega
            memory = 1.0 / (1.0 + h * omega * stiff)
            share = 1.0 - memory
            part = share if on.share_capped else 1.0
            target = min(-part * omega / stiff * gap, on.correction_speed) / part
        drive_to_target(disks, contact, target, share, memory)
        if on.rub_biased or not biased:
            rub(disks, contact, world.friction, on.lever)
        contact.total += 0.0 if biased else contact.impulse


@internal
def restitute(disks: Disks, world: World, on: Parameters, kept: Contacts) -> None:
    """Give every contact that had an impulse its target velocity, in one pass."""
    for c in range(kept.found[0]):
        contact = kept.rows[c]
        if contact.target != 0.0 and contact.strongest > 0.0:
            drive_to_target(disks, contact, contact.target, 1.0, 0.0)
            if on.rub_restituted:
                rub(disks, contact, world.friction, on.lever)
