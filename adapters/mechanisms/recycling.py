"""Contacts of pairs that are not tested in every step, as in Rapier.

A pair is tested when its boxes start to overlap, and again only after a relative motion above a
given length. Until then a contact keeps its normal and contact points, and a pair without contact
stays without. Compiled by numba, as `exercise` is.
"""

from math import cos, hypot, inf, sin

from crosscheck2d.adapters.mechanisms.contacts import Contacts, column, gap_of, note, remember
from crosscheck2d.reference_impl.compiled import internal
from crosscheck2d.reference_impl.state import Disks, World

TURNED = 0.98  # cos of the rotation after which a body is tested again


@internal
def detect_again(
    disks: Disks, world: World, margin: float, recycled: float, fattened: float, kept: Contacts
) -> None:
    """Find the contacts, pairs i < j with a gap below `margin`, then walls, but test only pairs
    whose boxes overlap and that have moved by more than `recycled`; by more than `margin` if they
    were no contact (Rapier, process_pair)."""
    n = len(disks.radius)
    remember(1, kept)
    kept.found[0] = 0
    enclose(disks, world, margin / 2, fattened, kept)
    for i in range(n):
        for j in range(i + 1, n):
            if disks.mass[i] != inf or disks.mass[j] != inf:
                consider(disks, world, margin, recycled, kept, i, j)
    for i in range(n):
        for w in range(len(world.walls)):
            if disks.mass[i] != inf:
                consider(disks, world, margin, recycled, kept, i, -1 - w)


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
    """Note a pair if it is a contact, or was one at its last test."""
    n = len(disks.radius)
    look, one, other = kept.looks[i, column(j, n)], kept.boxes[i], kept.boxes[column(j, n)]
    if one[0] > other[2] or other[0] > one[2] or one[1] > other[3] or other[1] > one[3]:
        look.known = False
        return
    most = recycled if look.touches else min(recycled, margin)
    if not look.known or drift(disks, world, look, i, j) > most:
        look_at(disks, world, margin, look, i, j)
    if look.touches:
        note(disks, world, 0.0, kept, i, j)
        contact = kept.rows[kept.found[0] - 1]
        contact.nx, contact.ny, contact.seen = look.nx, look.ny, look.gap
        contact.gap = gap_since(disks, look, i, j)


@internal
def look_at(disks: Disks, world: World, margin: float, look, i: int, j: int) -> None:  # type: ignore[no-untyped-def]
    """Test a pair: store whether it is a contact, and its relative position."""
    look.known = True
    look.gap, look.nx, look.ny = gap_of(disks, world, i, j)
    look.touches = look.gap < margin
    look.x, look.y, look.angle, look.other = lie(disks, i, j)


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
def drift(disks: Disks, world: World, look, i: int, j: int) -> float:  # type: ignore[no-untyped-def]
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
def gap_since(disks: Disks, look, i: int, j: int) -> float:  # type: ignore[no-untyped-def]
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
