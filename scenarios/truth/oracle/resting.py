"""What comes to rest: bounces that die out in finite time (rule Z1), what lies still from the
start, what slides.

A disk that leaves a line at the speed v and is accelerated back at g bounces infinitely often
within 2 v / (g (1 - e)), and rests from then on (any textbook of mechanics, under "bouncing ball").
If nothing can touch it before, that is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from scenarios.model import Array, Thrust
from scenarios.no_truth import NoTruth
from scenarios.truth.oracle.ahead import Ahead, collinear, key
from scenarios.truth.oracle.bodies import FALLING, STATIC, Bodies, Hop, Leg, rational, square_to
from scenarios.truth.oracle.filter import moved, touching
from scenarios.truth.oracle.numbers import Number
from scenarios.truth.oracle.ties import Contact

SAFE = 1 + 1e-6  # times every length by which float64 judges that two cannot meet
FAR = 1e-12  # of the largest coordinate, the same


def settle(ahead: Ahead, contact: Contact, now: Number, thrusts: Sequence[Thrust]) -> Number | None:
    """Let a disk that has just struck a wall bounce on for good, if nothing can touch it; when it
    rests (s), or None.

    It must be on its leg after the collision, e < 1.
    """
    bodies, k, i = ahead.bodies, ahead.k, contact.i
    leg, wall = bodies.legs[i], bodies.walls[contact.j]
    fall = -bodies.outward(contact, leg.ax, leg.ay)
    if k.sign(fall) <= 0 or not slip_stays(ahead, contact, thrusts):
        return None
    speed = bodies.outward(contact, leg.vx, leg.vy)
    stop = now + 2 * speed / (fall * (1 - bodies.matter.restitution))
    vx, vy = along(bodies, contact, leg.vx, leg.vy)
    ax, ay = along(bodies, contact, leg.ax, leg.ay)
    hop = Hop(-contact.side * wall.ty, contact.side * wall.tx, speed, fall)
    bounces = Leg(now, leg.x, leg.y, vx, vy, ax, ay, hop, turn=leg.turn)
    edges = [edge for thrust in thrusts if thrust.disk == i for edge in (thrust.start, thrust.stop)]
    if any(float(now) < edge <= float(stop) * SAFE for edge in edges):
        return None
    if not untouched(ahead, contact, bounces, float(stop), thrusts):
        return None
    bodies.begin(i, bounces)
    bodies.asleep[i] = True
    return stop


def slip_stays(ahead: Ahead, contact: Contact, thrusts: Sequence[Thrust]) -> bool:
    """Whether friction does nothing in the bounces of a disk: there is none, or the disk bounces
    without slip on a level wall, and nothing turns it."""
    bodies, i = ahead.bodies, contact.i
    if bodies.matter.grip is None:
        return True
    falls = bodies.free[i][0] == FALLING and square_to(
        ahead.scene.walls[contact.j], ahead.scene.gravity
    )
    return falls and bodies.gripping[i] == contact and not any(p.torque for p in thrusts)


def along(bodies: Bodies, contact: Contact, x: Number, y: Number) -> tuple[Number, Number]:
    """The part of a vector (x, y) along the wall of a contact; none where the disk rests on another
    wall, too."""
    if bodies.held[contact.i]:
        return bodies.k.exact(0.0), bodies.k.exact(0.0)
    return bodies.slide(contact, x, y)


def untouched(
    ahead: Ahead, contact: Contact, leg: Leg, stop: float, thrusts: Sequence[Thrust]
) -> bool:
    """Rule Z1: whether the disk on `leg` meets nothing but its wall until `stop` s, whatever the
    others do.

    None can be faster than all energy there is, with what gravity and thrusts may add, makes it:
    d sqrt(K) / dt <= a sqrt(M / 2), K <= sum m v^2 / 2, |v_j| <= sqrt(2 K / m_j).
    """
    bodies, scene, i, w = ahead.bodies, ahead.scene, contact.i, contact.j
    left, table = stop - float(leg.t), bodies.table
    x, y, vx, vy, ax, ay = (float(value) for value in leg[1:7])
    assert leg.hop is not None
    rise = float(leg.hop.speed) ** 2 / 2 / float(leg.hop.fall)
    own = (np.hypot(vx, vy) + np.hypot(ax, ay) * left / 2) * left + rise
    states = np.array([moved(row, float(leg.t)) for row in table])
    heights = np.array([hop_height(each) for each in bodies.legs])
    energy = spin_energy(bodies, leg.t)
    others = travel(bodies, states, left, thrusts, energy)
    distance = np.hypot(states[:, 0] - x, states[:, 1] - y) - bodies.radii - bodies.radii[i]
    slack = FAR * (np.abs(states[:, :2]).max() + 1)
    needed = (own + others) * SAFE
    clear = distance - heights > needed + slack
    clear[[i, *ahead.in_line[w]]] = True
    if (~clear & (bodies.asleep | (distance < needed - slack))).any():
        return False
    for j in np.flatnonzero(~clear).tolist():  # too close for float64
        clear[j] = apart(bodies, i, j, leg.t) > needed[j]
    room, in_line = stretch(ahead, contact, float(bodies.foot(w, leg.x, leg.y)))
    if not clear.all() or not own * SAFE + slack < room:
        return False
    if scene.wrap is not None and (
        scene.n > 1 or not (np.abs(scene.wrap - [x, y]) > own * SAFE + slack).all()
    ):
        return False
    known = in_line | {c.j for c in bodies.held[i] if c.kind == "wall"}
    walls = np.array([wall for k, wall in enumerate(scene.walls) if k not in known]).reshape(
        -1, 2, 2
    )
    span = walls[:, 1] - walls[:, 0]
    share = np.clip((([x, y] - walls[:, 0]) * span).sum(axis=1) / (span**2).sum(axis=1), 0, 1)
    away = np.hypot(*(walls[:, 0] + share[:, None] * span - [x, y]).T) - bodies.radii[i]
    return bool((away > own * SAFE + slack).all())


def stretch(ahead: Ahead, contact: Contact, foot: float) -> tuple[float, set[int]]:
    """How far a disk may slide either way, m, from `foot` m along its wall; and that wall with all
    in line with it."""
    rooms, walls = [], {contact.j}
    for side in (1, -1):
        here: Contact | None = contact
        room = foot if side < 0 else float(ahead.bodies.walls[contact.j].length) - foot
        heading = side
        while here is not None and (following := next_in_line(ahead, here, heading)) is not None:
            if following.j in walls:
                break
            room += float(ahead.bodies.walls[following.j].length)
            heading = heading if following.side == here.side else -heading
            walls.add(following.j)
            here = following
        rooms.append(room)
    return min(rooms), walls


def apart(bodies: Bodies, i: int, j: int, now: Number) -> float:
    """m between two bodies, to all digits of a float64 however small it is."""
    (x, y, _, _), (px, py, _, _) = bodies.state_at(i, now), bodies.state_at(j, now)
    dx, dy, reach = px - x, py - y, bodies.radius[i] + bodies.radius[j]
    gap = dx * dx + dy * dy - reach * reach
    return float(gap / (bodies.k.sqrt(dx * dx + dy * dy) + reach)) - bodies.k.spread(gap) / float(
        reach
    )


def travel(
    bodies: Bodies, states: Array, left: float, thrusts: Sequence[Thrust], spins: float
) -> Array:
    """(b,) m, how far each body gets within `left` s at most, from states (b, 6) as of `moved`; see
    `untouched`. spins: J, that friction may make flight of."""
    mass = np.append(bodies.scene.mass, np.full(len(states) - bodies.scene.n, np.inf))
    moves = np.isfinite(mass)
    accelerations = [float(np.hypot(*thrust.force)) / mass[thrust.disk] for thrust in thrusts]
    acceleration = float(np.hypot(*bodies.scene.gravity)) + sum(accelerations)
    hops = np.array([0.0 if leg.hop is None else float(leg.hop.speed) ** 2 for leg in bodies.legs])
    energy = (mass[moves] * ((states[moves, 2:4] ** 2).sum(axis=1) + hops[moves])).sum() / 2
    energy += spins
    speed = np.sqrt(energy) + np.sqrt(mass[moves].sum() / 2) * acceleration * left
    rise: Array = np.sqrt(2 / mass) * speed * left
    return rise


def spin_energy(bodies: Bodies, now: Number) -> float:
    """J, of all that turns, where there is friction; 0 where there is none."""
    scene = bodies.scene
    turns = np.isfinite(scene.inertia) & ~scene.static
    spins = np.array([float(bodies.turn_at(i, now).spin) for i in range(scene.n)])
    return float((scene.inertia[turns] * spins[turns] ** 2).sum() / 2)


def hop_height(leg: Leg) -> float:
    """m, how high the bounces on a leg reach."""
    return 0.0 if leg.hop is None else float(leg.hop.speed) ** 2 / 2 / float(leg.hop.fall)


def press(ahead: Ahead, contact: Contact, now: Number) -> bool:
    """Let a disk that is accelerated onto a wall it touches, with no speed across it, rest on it;
    False if it cannot.

    On a second wall it rests if that stands at right angles to the first, or if it lies still
    between the two.
    """
    bodies, i = ahead.bodies, contact.i
    if contact.kind != "wall":
        return False
    held, v = bodies.held[i], bodies.velocity_at(i, now)
    if held:
        still = not bodies.table[i, 2:4].any()
        _, ax, ay = bodies.free[i]
        if len(held) > 1 or held[0].kind != "wall" or bodies.matter.grip is not None:
            return False
        wedged = (
            still and bodies.k.sign(bodies.outward(held[0], *bodies.slide(contact, ax, ay))) < 0
        )
        if not wedged and not bodies.upright(held[0], contact):
            return False
    rolls = bodies.gripping[i] == contact and bodies.legs[i].t is now
    bodies.hold(i, now, (*held, contact), (*along(bodies, contact, *v[:2]), v[2]), rolls)
    return True


def lie_down(ahead: Ahead) -> list[Contact]:
    """Rest what lies still at the start: disks on walls, and disks straight above each other on
    those. The contacts."""
    bodies, now = ahead.bodies, ahead.bodies.k.exact(0.0)
    found = start(ahead)
    lying = [
        c for c, approach in found if c.kind == "wall" and approach == 0 and _pressed(bodies, c)
    ]
    rested = [c for c in lying if press(ahead, c, now)]
    pairs = [
        Contact("body", *ends)
        for c, _ in found
        if c.kind == "body"
        for ends in ((c.i, c.j), (c.j, c.i))
    ]
    still = [not row.any() for row in bodies.table[:, 2:4]]
    if bodies.matter.grip is not None:
        pairs = []  # with friction more than one contact that lasts is refused
    while upper := next(
        (c for c in pairs if still[c.i] and not bodies.held[c.i] and _carries(bodies, c)), None
    ):
        bodies.hold(upper.i, now, (upper,), bodies.velocity_at(upper.i, now))
        rested.append(upper)
    return rested


def next_in_line(ahead: Ahead, contact: Contact, side: int) -> Contact | None:
    """The wall that goes on where this one ends (side 1) or starts (-1), in line with it, as a
    contact; or None."""
    walls, w = ahead.scene.walls, contact.j
    tip, heading = walls[w, 1 if side > 0 else 0], side * (walls[w, 1] - walls[w, 0])
    for other, wall in enumerate(walls):
        ahead_of = wall.sum(axis=0) - 2 * tip
        joined = other != w and (wall == tip).all(axis=1).any() and ahead_of @ heading > 0
        if joined and all(collinear(walls[w], end) for end in wall):
            same = (wall[1] - wall[0]) @ (walls[w, 1] - walls[w, 0]) > 0
            return contact._replace(j=other, side=contact.side if same else -contact.side)
    return None


def _pressed(bodies: Bodies, contact: Contact) -> bool:
    """Whether its acceleration presses the disk of a contact onto the wall, when nothing holds
    it."""
    _, ax, ay = bodies.free[contact.i]
    return bodies.k.sign(bodies.outward(contact, ax, ay)) < 0


def _carries(bodies: Bodies, contact: Contact) -> bool:
    """Whether contact.j lies still and exactly below contact.i, so that gravity alone keeps the two
    together."""
    scene, i, j = bodies.scene, contact.i, contact.j
    if bodies.free[i][0] != FALLING or scene.static[i]:
        return False
    firm = bool(bodies.held[j]) and bodies.kind[j] == STATIC and not bodies.table[j, 2:4].any()
    if not (firm or j >= scene.n or scene.static[j]) or (firm and bodies.free[j][0] != FALLING):
        return False
    (x, y), (px, py) = rational(bodies.table[i, :2]), rational(bodies.table[j, :2])
    gx, gy = rational(scene.gravity)
    return (px - x) * gy == (py - y) * gx and (px - x) * gx + (py - y) * gy > 0


def start(ahead: Ahead) -> list[tuple[Contact, Fraction]]:
    """The contacts that touch at the start, exactly, and dr.dv of each (up to a positive factor);
    facts are noted.

    Raises:
        NoTruth: bodies overlap.
    """
    bodies, scene = ahead.bodies, ahead.scene
    faults, found = [], dict[tuple[Any, ...], tuple[Contact, Fraction]]()
    for i in np.flatnonzero(~scene.static).tolist():
        count = touching(
            bodies.table, bodies.radii, bodies.asleep, scene.walls, i, 0.0, ahead.codes
        )
        for contact in [ahead.contact(i, code) for code in ahead.codes[:count].tolist()]:
            gap, approach, overlap = at_start(bodies, contact)
            if gap < 0 and key(contact) not in found:
                name = bodies.name(contact)
                faults.append(
                    f"disk {i} and {name} overlap by {overlap:.3g} m at the start: move them apart"
                    " by that"
                )
            if gap <= 0:
                found[key(contact)] = contact, approach
    if faults:
        raise NoTruth(faults[0] + (f" ({len(faults) - 1} more)" if len(faults) > 1 else ""))
    for contact, approach in found.values():
        if approach >= 0:
            bodies.remember([ahead.touch(contact, bodies.legs[contact.i].t)], set())
    return list(found.values())


def at_start(bodies: Bodies, contact: Contact) -> tuple[Fraction, Fraction, float]:
    """The gap (up to a positive factor), dr.dv (the same) and the overlap, m, of a contact; all but
    the last exact."""
    rows, scene, i = bodies.table, bodies.scene, contact.i
    (x, y), (u, v), r = (
        rational(rows[i, :2]),
        rational(rows[i, 2:4]),
        Fraction(float(bodies.radii[i])),
    )
    if contact.kind == "body":
        (px, py), (pu, pv) = rational(rows[contact.j, :2]), rational(rows[contact.j, 2:4])
        r += Fraction(float(bodies.radii[contact.j]))
        dx, dy = px - x, py - y
        square = dx * dx + dy * dy
        return square - r * r, dx * (pu - u) + dy * (pv - v), float(r) - float(square) ** 0.5
    (px, py), (qx, qy) = (rational(end) for end in scene.walls[contact.j])
    tx, ty = qx - px, qy - py
    across, foot, square = (
        tx * (y - py) - ty * (x - px),
        tx * (x - px) + ty * (y - py),
        tx * tx + ty * ty,
    )
    if not 0 <= foot <= square:
        return Fraction(1), Fraction(0), 0.0
    overlap = float(r) - abs(float(across)) / float(square) ** 0.5
    return across * across - r * r * square, contact.side * (tx * v - ty * u), overlap
