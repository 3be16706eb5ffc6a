"""The contacts of `ablated_reference`: which bodies touch, with which impulses, within a step and
from step to step.

A contact is of disk i and disk j, or wall w as j = -1 - w. Its normal n points from j to i, as at
its detection. In Rapier (`consider`) a pair is tested when its boxes start to overlap, and
again only after a relative motion above a given length: until then a contact keeps its normal and
contact points, and a pair without contact stays without. Compiled by numba, as `exercise` is.
"""

from math import cos, hypot, inf, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crosscheck2d.reference_impl import compiled as compiling
from crosscheck2d.reference_impl.compiled import compiled, forget_stale, internal
from crosscheck2d.reference_impl.exercise import direction, move, nearest_point
from crosscheck2d.reference_impl.state import Disks, World

forget_stale(Path(__file__).parent, Path(compiling.__file__).parent)

TURNED = 0.98  # cos of the rotation after which a body is tested again

CONTACT = np.dtype(
    [
        ("i", "i8"),  # a disk
        ("j", "i8"),  # another disk, or wall w as -1 - w
        ("nx", "f8"),  # x of the unit normal, towards i
        ("ny", "f8"),  # y of it
        ("gap", "f8"),  # m between the surfaces at the start of the step
        ("seen", "f8"),  # m between them at the last test of the pair
        ("target", "f8"),  # m/s: the target speed of separation
        ("impulse", "f8"),  # N s along the normal
        ("slide", "f8"),  # N s along the tangent (-ny, nx)
        ("strongest", "f8"),  # N s, largest impulse added by one solve
        ("total", "f8"),  # N s, of the impulses at the end of each substep
        ("bore", "b1"),  # whether there was one in the step before
        ("nudged", "f8"),  # N s, of `ablated_reference.nudge`
        ("island", "i8"),  # from 1; 0: none yet
        ("colour", "i8"),  # from 1; 0: none yet
        ("late", "b1"),  # whether its impulses are older than the last step
    ]
)


LOOK = np.dtype(
    [
        ("known", "b1"),  # whether the pair was tested since the boxes overlap
        ("touches", "b1"),  # whether they were a contact
        ("x", "f8"),  # m, the centre of the second in the frame of the first
        ("y", "f8"),  # m, of it
        ("angle", "f8"),  # rad, of the first
        ("other", "f8"),  # rad, of the second
        ("nx", "f8"),  # x of the unit normal, towards the first
        ("ny", "f8"),  # y of it
        ("gap", "f8"),  # m between the surfaces
    ]
)


class Contacts(NamedTuple):
    """The contacts of a step, the first `found[0]` of `rows`, and other data that the stages
    share."""

    found: np.ndarray  # (1,): how many
    rows: np.ndarray  # of CONTACT, enough for twice as many as there can be
    start: np.ndarray  # (n, 2) m: where the disks were at the start of the step
    moved: np.ndarray  # (n, 2) m: their motion since then
    turned: np.ndarray  # (n,) rad: their rotation since then
    facing: np.ndarray  # (n, 2): cos and sin of their angles, if stored
    nudge: np.ndarray  # (n, 2) m/s: added to the velocity in the next move only
    # (n, n + w, 5): impulse, slide, colour, age in steps (0: long ago), and total
    before: np.ndarray
    looks: np.ndarray  # (n, n + w) of `LOOK`
    boxes: np.ndarray  # (n + w, 4) m: of `enclose`, left, bottom, right, top
    least: np.ndarray  # (4,) m: the smallest box of one body


def no_contacts(n: int, walls: int, precision: type) -> Contacts:
    most = n * (n - 1) // 2 + n * walls
    place: np.ndarray = np.zeros((n, 2), precision)
    return Contacts(
        found=np.zeros(1, np.int64),
        rows=np.zeros(2 * most + 1, CONTACT).view(np.recarray),
        start=place,
        moved=np.zeros_like(place),
        turned=np.zeros(n),
        facing=np.zeros_like(place),
        nudge=np.zeros((n, 2)),
        before=np.zeros((n, n + walls, 5)),
        looks=np.zeros((n, n + walls), LOOK).view(np.recarray),
        boxes=np.full((n + walls, 4), np.nan, precision),
        least=np.zeros(4, precision),
    )


@internal
def detect(disks: Disks, world: World, on, kept: Contacts) -> None:
    """Find the contacts: pairs i < j with a gap below `margin`, then walls, thicker by `skin`.

    If `touching`, a gap of exactly `margin` counts as well. A contact starts with its last
    impulses, unless these are older than `memory` steps. If `recycled`, only those pairs are tested
    whose boxes overlap and that have moved by more than it; by more than `margin` if they were no
    contact (Rapier, process_pair).
    """
    n, margin = len(disks.radius), on.margin
    remember(on.memory, kept)
    kept.found[0] = 0
    if on.recycled > 0.0:
        enclose(disks, world, margin / 2, on.fattened, kept)
    for i in range(n):
        for j in range(i + 1, n):
            if disks.mass[i] == inf and disks.mass[j] == inf:
                continue
            if on.recycled > 0.0:
                consider(disks, world, margin, on.recycled, kept, i, j)
                continue
            dx, dy = (
                disks.position[i, 0] - disks.position[j, 0],
                disks.position[i, 1] - disks.position[j, 1],
            )
            reach = disks.radius[i] + disks.radius[j] + margin
            near = dx * dx + dy * dy - reach * reach
            if near < 0.0 or (on.touching and near == 0.0):
                note(disks, world, 0.0, kept, i, j)
    for i in range(n):
        for w in range(len(world.walls)):
            if disks.mass[i] == inf:
                continue
            if on.recycled > 0.0:
                consider(disks, world, margin, on.recycled, kept, i, -1 - w)
                continue
            near = gap_of(disks, world, i, -1 - w)[0] - margin - on.skin
            if near < 0.0 or (on.touching and near == 0.0):
                note(disks, world, on.skin, kept, i, -1 - w)


@internal
def remember(memory: int, kept: Contacts) -> None:
    rows, columns = kept.before.shape[:2]
    for i in range(rows):
        for other in range(columns):
            if kept.before[i, other, 3] > 0.0:
                kept.before[i, other, 3] += 1.0
                if kept.before[i, other, 3] > memory:
                    kept.before[i, other, :] = 0.0
    for c in range(kept.found[0]):
        contact = kept.rows[c]
        had = kept.before[contact.i, column(contact.j, rows)]
        had[0], had[1], had[2], had[3] = contact.impulse, contact.slide, contact.colour, 1.0
        had[4] = contact.total


@internal
def note(disks: Disks, world: World, skin: float, kept: Contacts, i: int, j: int) -> None:
    contact, other = kept.rows[kept.found[0]], column(j, len(disks.radius))
    kept.found[0] += 1
    contact.i, contact.j = i, j
    gap, contact.nx, contact.ny = gap_of(disks, world, i, j)
    contact.gap = contact.seen = gap - skin
    contact.target = contact.strongest = contact.total = 0.0
    contact.island, contact.colour = 0, int(kept.before[i, other, 2])
    contact.impulse, contact.slide = kept.before[i, other, 0], kept.before[i, other, 1]
    contact.late = kept.before[i, other, 3] > 1.0
    contact.bore = kept.before[i, other, 4] > 0.0


@internal
def column(j: int, n: int) -> int:
    return j if j >= 0 else n - 1 - j


@compiled
def by_island(mass, kept: Contacts) -> None:
    """Sort the contacts into islands, which share no moving disk, in the order of a depth-first
    search.

    The search starts from the last disk, and takes the last contact of a disk first (Box2D 2.3,
    b2World::Solve).
    """
    rows, n, count, copies = kept.rows, len(mass), kept.found[0], len(kept.rows) // 2
    for c in range(count):
        rows[copies + c] = rows[c]
    seen, stack, done = np.zeros(n, np.bool_), np.zeros(n, np.int64), 0
    for seed in range(n - 1, -1, -1):
        high = 0
        if not seen[seed] and mass[seed] != inf:
            seen[seed], stack[0], high = True, seed, 1
        while high > 0:
            high -= 1
            disk = stack[high]
            for c in range(copies + count - 1, copies - 1, -1):
                i, j = rows[c].i, rows[c].j
                if rows[c].island == 0 and (i == disk or j == disk):
                    rows[c].island = seed + 1
                    rows[done] = rows[c]
                    done += 1
                    other = j if i == disk else i
                    if other >= 0 and not seen[other] and mass[other] != inf:
                        seen[other], stack[high] = True, other
                        high += 1


@internal
def by_colour(mass, kept: Contacts) -> None:
    """Sort the contacts by colour: no moving disk has two contacts of one colour.

    A new contact takes the first free colour, from the second on if only one body can move, and
    keeps it while it lasts (Box2D 3.1, b2AssignGraphColor).
    """
    rows, count, copies, most = kept.rows, kept.found[0], len(kept.rows) // 2, 0
    for c in range(count):
        if rows[c].colour == 0:
            colour = (
                1 if rows[c].j >= 0 and mass[rows[c].i] != inf and mass[rows[c].j] != inf else 2
            )
            while taken(mass, kept, c, colour):
                colour += 1
            rows[c].colour = colour
        most = max(most, rows[c].colour)
        rows[copies + c] = rows[c]
    done = 0
    for colour in range(1, most + 1):
        for c in range(copies, copies + count):
            if rows[c].colour == colour:
                rows[done] = rows[c]
                done += 1


@internal
def taken(mass, kept: Contacts, c: int, colour: int) -> bool:
    i, j = kept.rows[c].i, kept.rows[c].j
    moving_i, moving_j = mass[i] != inf, j >= 0 and mass[j] != inf
    for k in range(kept.found[0]):
        a, b = kept.rows[k].i, kept.rows[k].j
        if kept.rows[k].colour == colour and (
            (moving_i and (a == i or b == i)) or (moving_j and (a == j or b == j))
        ):
            return True
    return False


@internal
def gap_of(disks: Disks, world: World, i: int, j: int) -> tuple[float, float, float]:
    """The gap between the surfaces in m, and the normal, at the present positions."""
    x, reach = disks.position, disks.radius[i]
    if j >= 0:
        px, py = x[j, 0], x[j, 1]
        reach += disks.radius[j]
    else:
        px, py = nearest_point(world.walls, -1 - j, x[i, 0], x[i, 1])
    distance, nx, ny = direction(x[i, 0] - px, x[i, 1] - py)
    return distance - reach, nx, ny


@internal
def gap_along(moved, contact) -> float:
    """The gap in m along the normal of the contact: when it was found, plus the motion of both
    bodies since then."""
    i, j = contact.i, contact.j
    gap = contact.gap + moved[i, 0] * contact.nx + moved[i, 1] * contact.ny
    if j >= 0:
        gap -= moved[j, 0] * contact.nx + moved[j, 1] * contact.ny
    return gap


@internal
def carried_off(radius, turned, contact) -> float:
    """The change of the gap, in m, because the contact points have turned with the disks
    (Box2D 3.1, b2SolveContact: moving anchors)."""
    i, j = contact.i, contact.j
    gap = (radius[i] + contact.seen / 2) * (1.0 - cos(turned[i]))
    if j >= 0:
        gap += (radius[j] + contact.seen / 2) * (1.0 - cos(turned[j]))
    return gap


@internal
def closing(v, i: int, j: int, nx: float, ny: float) -> float:
    """The relative velocity along n in m/s, negative while the bodies approach."""
    speed = v[i, 0] * nx + v[i, 1] * ny
    if j >= 0:
        speed -= v[j, 0] * nx + v[j, 1] * ny
    return speed


@internal
def inverse_mass(mass, i: int, j: int) -> float:
    return 1.0 / mass[i] + (1.0 / mass[j] if j >= 0 else 0.0)


@internal
def drive_to_target(disks: Disks, contact, target: float, share: float, memory: float) -> None:
    """Apply the impulse that gives a contact its target velocity; the sum stays at least 0.

    A soft contact gets the fraction `share` of it, minus `memory` times its impulse so far.
    """
    i, j, nx, ny, before = contact.i, contact.j, contact.nx, contact.ny, contact.impulse
    wanted = (target - closing(disks.velocity, i, j, nx, ny)) / inverse_mass(disks.mass, i, j)
    contact.impulse = max(before + share * wanted - memory * before, 0.0)
    contact.strongest = max(contact.strongest, contact.impulse - before)
    apply_pair(disks.velocity, disks.mass, i, j, nx, ny, contact.impulse - before)


@internal
def apply_pair(rows, mass, i: int, j: int, nx: float, ny: float, by: float) -> None:
    """Add `by` along n to row i and against n to row j, each by its inverse mass."""
    move(rows, i, nx, ny, by / mass[i])
    if j >= 0:
        move(rows, j, nx, ny, -by / mass[j])


@internal
def rub(disks: Disks, contact, friction: float, lever: float) -> None:
    """Reduce the slip of the surfaces with a tangential impulse of at most `friction` times the
    normal one.

    A lever arm is the radius and `lever` times the gap: 1/2 is the middle of the gap.
    """
    i, j, spin, inertia = contact.i, contact.j, disks.angular_velocity, disks.inertia
    arm = disks.radius[i] + contact.seen * lever
    speed = closing(disks.velocity, i, j, -contact.ny, contact.nx) - arm * spin[i]
    weight = inverse_mass(disks.mass, i, j) + arm * arm / inertia[i]
    if j >= 0:
        other = disks.radius[j] + contact.seen * lever
        speed -= other * spin[j]
        weight += other * other / inertia[j]
    most, before = friction * contact.impulse, contact.slide
    contact.slide = min(max(before - speed / weight, -most), most)
    turn(disks, contact, contact.slide - before, lever)


@internal
def turn(disks: Disks, contact, by: float, lever: float) -> None:
    i, j, inertia = contact.i, contact.j, disks.inertia
    apply_pair(disks.velocity, disks.mass, i, j, -contact.ny, contact.nx, by)
    disks.angular_velocity[i] -= (disks.radius[i] + contact.seen * lever) * by / inertia[i]
    if j >= 0:
        disks.angular_velocity[j] -= (disks.radius[j] + contact.seen * lever) * by / inertia[j]


@internal
def enclose(disks: Disks, world: World, margin: float, fattened: float, kept: Contacts) -> None:
    """Renew every box that does not contain its body and `margin` around it.

    A box is larger by `fattened`, except the first one (parry, Bvh::insert_or_update_partially).
    Boxes have the precision of the positions, because the last digit decides whether a disk leaves
    its box after a whole number of steps.
    """
    n, x, least = len(disks.radius), disks.position, kept.least
    for k in range(n + len(world.walls)):
        box = kept.boxes[k]
        for axis in range(2):
            if k < n:
                least[axis] = x[k, axis] - disks.radius[k]
                least[2 + axis] = x[k, axis] + disks.radius[k]
            else:
                ends = world.walls[k - n]
                least[axis] = min(ends[0, axis], ends[1, axis])
                least[2 + axis] = max(ends[0, axis], ends[1, axis])
            least[axis] -= margin
            least[2 + axis] += margin
        if not (
            box[0] <= least[0] and box[1] <= least[1] and least[2] <= box[2] and least[3] <= box[3]
        ):
            more = fattened if box[0] <= box[2] else 0.0
            for axis in range(2):
                box[axis], box[2 + axis] = least[axis] - more, least[2 + axis] + more


@internal
def consider(
    disks: Disks, world: World, margin: float, recycled: float, kept: Contacts, i: int, j: int
) -> None:
    n = len(disks.radius)
    look, one, other = kept.looks[i, column(j, n)], kept.boxes[i], kept.boxes[column(j, n)]
    if one[0] > other[2] or other[0] > one[2] or one[1] > other[3] or other[1] > one[3]:
        look.known = False
        return
    most = recycled if look.touches else min(recycled, margin)
    if not look.known or drift(disks, world, look, i, j) > most:
        look.known = True
        look.gap, look.nx, look.ny = gap_of(disks, world, i, j)
        look.touches = look.gap < margin
        look.x, look.y, look.angle, look.other = lie(disks, i, j)
    if look.touches:
        note(disks, world, 0.0, kept, i, j)
        contact = kept.rows[kept.found[0] - 1]
        contact.nx, contact.ny, contact.seen = look.nx, look.ny, look.gap
        contact.gap = gap_since(disks, look, i, j)


@internal
def lie(disks: Disks, i: int, j: int) -> tuple[float, float, float, float]:
    """The centre of disk j (the origin for a wall) in the frame of disk i; the angles of both."""
    x, angle = disks.position, disks.angle[i]
    dx, dy, other = -x[i, 0], -x[i, 1], 0.0
    if j >= 0:
        dx, dy, other = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], disks.angle[j]
    c, s = cos(angle), sin(angle)
    return c * dx + s * dy, c * dy - s * dx, angle, other


@internal
def drift(disks: Disks, world: World, look, i: int, j: int) -> float:
    """m, largest relative motion of any point of the pair since its last test; inf if one body has
    turned too far (Rapier, relative_pose_drift)."""
    x, y, angle, other = lie(disks, i, j)
    if min(cos(angle - look.angle), cos(other - look.other)) <= TURNED:
        return inf
    extent = hypot(disks.radius[i], disks.radius[i])  # to a corner of the box around it
    if j >= 0:
        extent = max(extent, hypot(disks.radius[j], disks.radius[j]))
    else:
        (ax, ay), (bx, by) = world.walls[-1 - j]
        extent = max(extent, hypot(min(ax, bx), min(ay, by)), hypot(max(ax, bx), max(ay, by)))
    turned = (other - look.other) - (angle - look.angle)
    return hypot(x - look.x, y - look.y) + 2.0 * abs(sin(turned / 2.0)) * extent


@internal
def gap_since(disks: Disks, look, i: int, j: int) -> float:
    """The gap in m along the normal of the last test, between the points that were nearest then and
    have turned with the disks."""
    x, (_, _, angle, other) = disks.position, lie(disks, i, j)
    c, s = cos(look.angle), sin(look.angle)
    dx, dy = -x[i, 0] + s * look.y - c * look.x, -x[i, 1] - s * look.x - c * look.y
    if j >= 0:
        dx, dy = dx + x[j, 0], dy + x[j, 1]
    gap = look.gap - dx * look.nx - dy * look.ny
    gap += disks.radius[i] * (1.0 - cos(angle - look.angle))
    if j >= 0:
        gap += disks.radius[j] * (1.0 - cos(other - look.other))
    return gap
