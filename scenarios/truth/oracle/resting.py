"""Rest: bounces that die out in finite time (rule Z1), disks that rest from the start, disks that
slide.

A disk that leaves a wall at the speed v and is accelerated back at g bounces infinitely often
within 2 v / (g (1 - e)), and rests from then on (any textbook of mechanics, under "bouncing ball").
This is exact if nothing can touch the disk before.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import log
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.scenarios.model import Array, Scene, Thrust
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.oracle.bodies import (
    FALLING,
    STATIC,
    Bodies,
    Hop,
    Leg,
    nearest,
    rational,
    square_to,
)
from crosscheck2d.scenarios.truth.oracle.clusters import complementary, solve
from crosscheck2d.scenarios.truth.oracle.contact_finder import ContactFinder, line_span
from crosscheck2d.scenarios.truth.oracle.filter import moved
from crosscheck2d.scenarios.truth.oracle.numbers import Number, Numbers, Undecided
from crosscheck2d.scenarios.truth.oracle.path import MotionEnds
from crosscheck2d.scenarios.truth.oracle.ties import (
    Contact,
    TieOutcome,
    Touch,
    Velocities,
    apply,
    delassus,
    key,
)

SAFE = 1 + 1e-6  # factor on every length by which float64 decides that two disks cannot meet
# A series that takes more bounces than this to lose all but `SMALL` of its speed is followed bounce
# by bounce, within the limits of work: it would be a list of any length.
SMALL, MOST_BOUNCES = 1e-9, 100_000
CLOSE = 1e-9  # radii; a disk that comes so near under a thrust that turns with it touches
FAR = 1e-12  # relative to the largest coordinate, added to those lengths
# relative to the largest coordinate: how far the four ends of two walls in line are off the line by
# their own rounding and that of the check, a few units in the last place
ROUNDED = 2.0**-50
# Units in the last place of the largest coordinate: of centre, radius and wall each is rounded by
# half of one, and products on the way to them by as much again.
TOUCHING = 4
# Collisions that die out are followed until their speeds are below this share of a rounding; the
# factor bounds the limit by the impulses that are left. Gaps are then some 1e-50 m, which takes so
# many bits where small numbers count as zero.
LEFT_OVER, SPARE_LIMIT, FOR_SERIES = 1e-10, 1e3, 512
# In radii: where a disk is squeezed between others the gaps end before the speeds do.
NO_GAP = 1e-26
NO_MATTER = 1e-4  # share of a rounding below which it does not matter how disks collide
APART = 1e6  # of two speeds that belong to different series


def settle(
    finder: ContactFinder, contact: Contact, now: Number, thrusts: Sequence[Thrust]
) -> Number | None:
    """Replace all further bounces of a disk on a wall by one leg, if nothing can touch the disk
    before it rests; the time, s, at which it rests, or None.

    The disk must be on its leg after a collision with the wall; e < 1.
    """
    bodies, k, i = finder.bodies, finder.k, contact.i
    leg, wall = bodies.legs[i], bodies.walls[contact.j]
    fall = -bodies.outward(contact, leg.ax, leg.ay)
    if k.sign(fall) <= 0 or not slip_stays(finder, contact, thrusts):
        return None
    if log(SMALL) / log(finder.scene.restitution) > MOST_BOUNCES or any(bodies.jet):
        return None
    speed = bodies.outward(contact, leg.vx, leg.vy)
    stop = now + 2 * speed / (fall * (1 - bodies.law.restitution))
    vx, vy = along(bodies, contact, leg.vx, leg.vy)
    ax, ay = along(bodies, contact, leg.ax, leg.ay)
    hop = Hop(-contact.side * wall.ty, contact.side * wall.tx, speed, fall)
    bounces = Leg(now, leg.x, leg.y, vx, vy, ax, ay, hop, turn=leg.turn)
    edges = [edge for thrust in thrusts if thrust.disk == i for edge in (thrust.start, thrust.stop)]
    if any(float(now) < edge <= float(stop) * SAFE for edge in edges):
        return None
    if not untouched(finder, contact, bounces, float(stop), thrusts):
        return None
    bodies.begin(i, bounces)
    bodies.asleep[i] = True
    return stop


def slip_stays(finder: ContactFinder, contact: Contact, thrusts: Sequence[Thrust]) -> bool:
    """Whether friction does not act in the bounces of a disk: there is none, or the disk bounces
    without slip on a level wall, under no torque."""
    bodies, i = finder.bodies, contact.i
    if bodies.law.friction is None:
        return True
    falls = bodies.free[i][0] == FALLING and square_to(
        finder.scene.walls[contact.j], finder.scene.gravity
    )
    return falls and bodies.no_slip_on[i] == contact and not any(p.torque for p in thrusts)


def along(bodies: Bodies, contact: Contact, x: Number, y: Number) -> tuple[Number, Number]:
    if bodies.held[contact.i]:
        return bodies.k.exact(0.0), bodies.k.exact(0.0)
    return bodies.slide(contact, x, y)


def untouched(
    finder: ContactFinder, contact: Contact, leg: Leg, stop: float, thrusts: Sequence[Thrust]
) -> bool:
    """Rule Z1: whether the disk on `leg` can touch nothing but its wall until `stop` s, however the
    others move.

    No speed can exceed that of all the kinetic energy in one disk, with what gravity and thrusts
    can add: d sqrt(K) / dt <= a sqrt(M / 2), K <= sum m v^2 / 2, |v_j| <= sqrt(2 K / m_j).
    """
    bodies, scene, i, w = finder.bodies, finder.scene, contact.i, contact.j
    left, table = stop - float(leg.t), bodies.table
    x, y, vx, vy, ax, ay = (float(value) for value in leg[1:7])
    own = (np.hypot(vx, vy) + np.hypot(ax, ay) * left / 2) * left + hop_height(leg)
    states = np.array([moved(row, float(leg.t)) for row in table])
    heights = np.array([hop_height(each) for each in bodies.legs])
    others = travel(bodies, states, leg.t, left, thrusts)
    distance = np.hypot(states[:, 0] - x, states[:, 1] - y) - bodies.radii - bodies.radii[i]
    slack = FAR * (np.abs(states[:, :2]).max() + 1)
    needed = (own + others) * SAFE
    clear = distance - heights > needed + slack
    clear[[i, *finder.in_line[w]]] = True
    if (~clear & (bodies.asleep | (distance < needed - slack))).any():
        return False
    for j in np.flatnonzero(~clear).tolist():  # float64 does not decide these
        clear[j] = apart(bodies, i, j, leg.t) > needed[j]
    if not clear.all() or not own * SAFE + slack < room(finder, contact, leg):
        return False
    if scene.wrap is not None and (
        scene.n > 1 or not (np.abs(scene.wrap - [x, y]) > own * SAFE + slack).all()
    ):
        return False
    known = {*finder.surface[w], *(c.j for c in bodies.held[i] if c.kind == "wall")}
    rest = [k for k in range(len(scene.walls)) if k not in known]
    _, distance = nearest(np.array([[x, y]]), scene.walls[rest])
    return bool((distance - bodies.radii[i] > own * SAFE + slack).all())


def probe(finder: ContactFinder, i: int, now: Number) -> float:
    """s for which disk i touches nothing under a thrust that turns with it, if the others do not
    collide; raises `MotionEnds` where it may touch something."""
    bodies, scene, t = finder.bodies, finder.scene, float(now)
    rows = np.array([moved(row, t) for row in bodies.table])
    for j in [j for j, leg in enumerate(bodies.legs) if leg.jet is not None]:
        rows[j, :4] = [float(value) for value in bodies.state_at(j, now)]
    thrust = np.array([sum(abs(float(f)) for f in jet or ()) for jet in bodies.jet])
    fall = np.array([float(leg.hop.fall) if leg.hop else 0.0 for leg in bodies.legs])
    fast = np.hypot(*rows[:, 2:4].T) + [float(g.hop.speed) if g.hop else 0.0 for g in bodies.legs]
    pull = np.hypot(*rows[:, 4:6].T) + thrust + fall
    heights = np.array([hop_height(leg) for leg in bodies.legs])
    gap = np.hypot(*(rows[:, :2] - rows[i, :2]).T) - bodies.radii - bodies.radii[i] - heights
    gap[i] = 1e9  # m
    _, walls = nearest(rows[i : i + 1, :2], scene.walls)
    edges = [] if scene.wrap is None else np.abs(scene.wrap - rows[i, :2]).ravel()
    still = np.zeros(len(scene.walls) + len(edges))
    gaps = np.concatenate([gap, walls[0] - bodies.radii[i], edges])
    speed, more = fast[i] + np.append(fast, still), pull[i] + np.append(pull, still)
    first = int(np.argmin(gaps))
    if gaps[first] <= CLOSE * bodies.radii[i]:
        names = [bodies.name(Contact("body", i, j)) for j in range(len(fast))]
        names += [f"wall {w}" for w in range(len(scene.walls))] + ["the edge of the wrap"] * 4
        reason = f"disk {i} touches {names[first]} while a thrust that turns with it acts"
        raise MotionEnds(t, f"{reason}, and has no exact contact time then,")
    return float((2 * gaps / (speed + np.sqrt(speed**2 + 2 * more * gaps))).min()) / SAFE


def room(finder: ContactFinder, contact: Contact, leg: Leg) -> float:
    """m, how far a disk can slide along its wall, and the walls that continue it, either way."""
    walls, frame = finder.scene.walls, finder.bodies.walls[contact.j]
    foot = float(finder.bodies.foot(contact.j, leg.x, leg.y))
    ends = (walls[finder.surface[contact.j]].reshape(-1, 2) - walls[contact.j, 0]) @ [
        float(frame.tx),
        float(frame.ty),
    ]
    return float(min(foot - ends.min(), ends.max() - foot))


def apart(bodies: Bodies, i: int, j: int, now: Number) -> float:
    """m between two bodies, to all digits of float64 even where it is tiny."""
    (x, y, _, _), (px, py, _, _) = bodies.state_at(i, now), bodies.state_at(j, now)
    dx, dy, reach = px - x, py - y, bodies.reach(Contact("body", i, j))
    gap = dx * dx + dy * dy - reach * reach
    return float(gap / (bodies.k.sqrt(dx * dx + dy * dy) + reach)) - bodies.k.spread(gap) / float(
        reach
    )


def travel(
    bodies: Bodies, states: Array, now: Number, left: float, thrusts: Sequence[Thrust]
) -> Array:
    """(b,) m, the largest distance that each body can move within `left` s, from states (b, 6) as
    of `moved`; see `untouched`. Friction may turn the energy of rotation into motion."""
    mass = np.append(bodies.scene.mass, np.full(len(states) - bodies.scene.n, np.inf))
    moves = np.isfinite(mass)
    accelerations = [float(np.hypot(*thrust.force)) / mass[thrust.disk] for thrust in thrusts]
    acceleration = float(np.hypot(*bodies.scene.gravity)) + sum(accelerations)
    hops = np.array([0.0 if leg.hop is None else float(leg.hop.speed) ** 2 for leg in bodies.legs])
    energy = (mass[moves] * ((states[moves, 2:4] ** 2).sum(axis=1) + hops[moves])).sum() / 2
    turns = np.isfinite(bodies.scene.inertia) & ~bodies.scene.static
    spins = np.array([float(bodies.turn_at(i, now).spin) for i in range(bodies.scene.n)])
    energy += float((bodies.scene.inertia[turns] * spins[turns] ** 2).sum() / 2)
    speed = np.sqrt(energy) + np.sqrt(mass[moves].sum() / 2) * acceleration * left
    rise: Array = np.sqrt(2 / mass) * speed * left
    return rise


def hop_height(leg: Leg) -> float:
    return 0.0 if leg.hop is None else float(leg.hop.speed) ** 2 / 2 / float(leg.hop.fall)


def press(finder: ContactFinder, contact: Contact, now: Number) -> bool:
    """Let a disk rest on a wall that it touches without normal speed and is accelerated towards;
    False if it rests on something already: then the forces decide, see `lasting`."""
    bodies, i = finder.bodies, contact.i
    if contact.kind != "wall" or bodies.held[i]:
        return False
    v = bodies.velocity_at(i, now)
    rolls = bodies.no_slip_on[i] == contact and bodies.legs[i].t is now
    bodies.hold(i, now, (contact,), (*bodies.slide(contact, *v[:2]), v[2]), rolls)
    return True


class Group(NamedTuple):
    """Disks that move as one: their contacts, velocity m/s, and kind and acceleration m/s2."""

    disks: list[int]
    contacts: list[Contact]
    velocity: tuple[Number, Number]
    common: tuple[int, Number, Number]


def lasting(finder: ContactFinder, contact: Contact, now: Number) -> list[Group]:
    """The groups of disks that forces keep in contact from now on, where a disk is pressed onto
    another; none if this cannot be followed.

    Of all motions that open or keep the contacts the forces choose the one nearest to free flight
    (Gauss): a linear complementarity problem in the accelerations. Raises `MotionEnds` where a disk
    would roll over another.
    """
    bodies, k, law = finder.bodies, finder.k, finder.bodies.law
    touches = finder.cluster([contact], now)
    touches = [t for t in touches if key(t.contact) == key(contact) or closed(finder, t, now)]
    disks = {i for touch in touches for i in touch.contact.disks}
    v = {i: bodies.velocity_at(i, now) for i in disks}
    free = {i: (*bodies.free[i][1:], bodies.nought) for i in disks}
    matrix = delassus(law, touches)
    q = [law.approach(touch, free) + turning(finder, touch, v) for touch in touches]
    forces = complementary(k, matrix, q)
    if not forces or key(contact) not in {key(touches[a].contact) for a in forces}:
        return []
    pressed = [touches[a] for a in forces]
    after = apply(law, touches, forces, free)
    if any(bodies.rates[i] is not bodies.nought for i in disks) or any(
        k.sign(law.slip(touch, v)) or k.sign(law.slip(touch, after)) for touch in pressed
    ):
        return []  # friction acts
    for touch in pressed:
        at_rest = in_step(finder, touch.contact)
        if touch.contact.kind == "body" and (
            slides(k, touch, after) or (not at_rest and slides(k, touch, v))
        ):
            raise MotionEnds(float(now), *upper_and_lower(finder, touch))
    contacts = [touch.contact for touch in pressed]
    groups = [move_as_one(finder, disks, contacts, v) for disks in joined(finder.scene, contacts)]
    # `press` does a disk on one wall alone.
    return [g for g in groups if len(g.contacts) > 1 or g.contacts[0].kind == "body"]


class NoLimit(ArithmeticError):
    """Collisions that accumulate have no limit that can be followed, or not in so `few_bits`."""

    def __init__(self, few_bits: bool = False) -> None:
        super().__init__()
        self.few_bits = few_bits


def limit_of_series(
    finder: ContactFinder,
    touches: Sequence[Touch],
    v: Velocities,
    rest: float,
    share: float = LEFT_OVER,
) -> TieOutcome | None:
    """The limit of collisions of these contacts that die out while forces press the disks together;
    None while their speeds are not yet small enough.

    All their further impulses together end the speeds along the normals. Those are u at most, and
    the series lasts for about u / a, a the acceleration that presses: so the limit differs by the
    order of u from the velocities after the impulses that end the speeds at once. u times the rest
    of the motion, s, is below `share` of a rounding. Raises `NoLimit` where friction acts
    between disks, a contact is the end of a wall, or the contacts depend on each other.
    """
    k, law, scene = finder.k, finder.bodies.law, finder.scene
    lengths = [float(np.hypot(float(touch.dx), float(touch.dy))) for touch in touches]
    fast = [abs(float(law.approach(t, v))) / length for t, length in zip(touches, lengths)]
    least = share * np.finfo(float).eps * scene.radius.min() / (rest + 1)
    # A disk may bounce to its rest on one wall between two bounces on another one.
    slow, others = [u for u in fast if u <= least], [u for u in fast if u > least]
    if share == LEFT_OVER and slow and all(speed > APART * max(slow) for speed in others):
        touches = [touch for touch, speed in zip(touches, fast) if speed <= least]
    matrix, speeds = delassus(law, touches), [law.approach(touch, v) for touch in touches]
    ends = any(t.contact.kind == "body" and t.contact.j >= scene.n for t in touches)
    if law.sticks or ends or not touches:
        raise NoLimit
    if len(touches) > 1 and any(k.sign(law.slip(touch, v)) for touch in touches):
        raise NoLimit
    if (impulses := solve(k, matrix, [-speed for speed in speeds])) is None:
        raise NoLimit
    if not k.proves and k.bits < FOR_SERIES:
        raise NoLimit(few_bits=True)
    if len(touches) == len(fast) and max(fast) > least:
        return None
    spare = SPARE_LIMIT * max(abs(float(impulse)) for impulse in impulses)
    forces = {a: impulse + k.between(-spare, spare) for a, impulse in enumerate(impulses)}
    contacts = frozenset(touch.contact for touch in touches)
    return TieOutcome(apply(law, touches, forces, v), [], contacts)


def gap_of(finder: ContactFinder, touches: Sequence[Touch], now: Number) -> float:
    bodies, gaps = finder.bodies, list[float]()
    for contact, dx, dy in touches:
        x, y, _, _ = bodies.state_at(contact.i, now)
        wall = contact.kind == "wall"
        distance = bodies.height(contact, x, y) if wall else finder.k.sqrt(dx * dx + dy * dy)
        gaps.append(float((distance - bodies.reach(contact)) / bodies.radius[contact.i]))
    return max(gaps)


def closed(finder: ContactFinder, touch: Touch, now: Number) -> bool:
    bodies, contact = finder.bodies, touch.contact
    if in_step(finder, contact) or key(contact) in map(key, bodies.held[contact.i]):
        return True
    v = {i: bodies.velocity_at(i, now) for i in contact.disks}
    return bodies.k.sign(bodies.law.approach(touch, v)) == 0


def turning(finder: ContactFinder, touch: Touch, v: Velocities) -> Number:
    """m2/s2, |dv|^2: what the turning of a contact of two disks adds to dr.da; 0 if they are in
    step."""
    contact = touch.contact
    if contact.kind != "body" or in_step(finder, contact):
        return finder.bodies.nought
    (ux, uy, _), (px, py, _) = v[contact.i], v[contact.j]
    return (px - ux) * (px - ux) + (py - uy) * (py - uy)


def in_step(finder: ContactFinder, contact: Contact) -> bool:
    bodies, (i, j) = finder.bodies, sorted((contact.i, contact.j))
    counts = bodies.count[i], bodies.count[j]
    return contact.kind == "body" and (j in bodies.group[i] or bodies.in_step.get((i, j)) == counts)


def slides(k: Numbers, touch: Touch, v: Velocities) -> bool:
    (ux, uy, _), (px, py, _) = v[touch.contact.i], v[touch.contact.j]
    return k.sign(touch.dx * (py - uy) - touch.dy * (px - ux)) != 0


def in_step_after(
    finder: ContactFinder, outcome: TieOutcome, touches: Sequence[Touch]
) -> tuple[Velocities, list[Contact]]:
    """The velocities of an outcome, without a speed into walls that stay closed, and to all digits
    the same for disks whose contact has closed and that do not move along each other; and the
    contacts of these."""
    k, velocities = finder.k, dict(outcome.velocities)
    walls = [c for c in outcome.still if c.kind == "wall" and c.i in velocities]
    still = {key(c) for c in outcome.still}
    closed = [t for t in touches if t.contact.kind == "body" and key(t.contact) in still]
    pairs = [touch.contact for touch in closed if not may_slide(k, touch, velocities)]
    contacts = [*pairs, *walls]
    for members in joined(finder.scene, contacts):
        vx, vy = move_as_one(finder, members, contacts, velocities).velocity
        for i in members:
            velocities[i] = vx, vy, velocities[i][2]
    return velocities, pairs


def may_slide(k: Numbers, touch: Touch, v: Velocities) -> bool:
    try:
        return slides(k, touch, v)
    except Undecided:
        return True


def upper_and_lower(finder: ContactFinder, touch: Touch) -> tuple[str, list[int]]:
    contact, (gx, gy) = touch.contact, finder.scene.gravity.tolist()
    upper, lower = f"disk {contact.i}", finder.bodies.name(contact)
    disks = [i for i in (contact.i, contact.j) if i < finder.scene.n]
    if len(disks) == 2 and float(touch.dx) * gx + float(touch.dy) * gy < 0:
        upper, lower = lower, upper
    return f"{upper} rolls over {lower}", disks


def joined(scene: Scene, contacts: Sequence[Contact]) -> list[list[int]]:
    groups: list[set[int]] = []
    for contact in contacts:
        members = {i for i in contact.disks if i < scene.n and not scene.static[i]}
        linked = [group for group in groups if group & members]
        groups = [group for group in groups if group not in linked]
        groups.append(members.union(*linked))
    return [sorted(group) for group in groups]


def move_as_one(
    finder: ContactFinder, members: list[int], contacts: Sequence[Contact], v: Velocities
) -> Group:
    """The group of these disks on these contacts: all walls and static disks together leave it one
    direction or none, and its mean acceleration in that."""
    bodies, k, nought = finder.bodies, finder.k, finder.bodies.nought
    ours = [c for c in contacts if c.disks & {*members}]
    walls = list({c.j: c for c in ours if c.kind == "wall"}.values())
    fixed = any(not c.disks <= {*members} for c in ours if c.kind == "body")
    spans = [finder.scene.walls[c.j] for c in walls]
    if fixed or any(not parallel(spans[0], span) for span in spans[1:]):
        return Group(members, ours, (nought, nought), (STATIC, nought, nought))
    mass = [1 / bodies.law.inverse_mass[i] for i in members]
    ax, ay = (
        sum(m * bodies.free[i][axis] for m, i in zip(mass, members)) / sum(mass) for axis in (1, 2)
    )
    first = next((c.i for c in walls), members[0])
    vx, vy, _ = v[first]
    if walls:
        vx, vy = bodies.slide(walls[0], vx, vy)
        level = all(bodies.free[i][0] == FALLING for i in members) and square_to(
            spans[0], finder.scene.gravity
        )
        ax, ay = (nought, nought) if level else bodies.slide(walls[0], ax, ay)
    still = not (k.sign(ax) or k.sign(ay))
    kind = STATIC if still else 2 + finder.scene.n + members[0]
    return Group(members, ours, (vx, vy), (STATIC, nought, nought) if still else (kind, ax, ay))


def parallel(one: Array, other: Array) -> bool:
    (px, py), (qx, qy) = rational(other[0]), rational(other[1])
    (ax, ay), (bx, by) = rational(one[0]), rational(one[1])
    return (qx - px) * (by - ay) == (qy - py) * (bx - ax)


def lie_down(finder: ContactFinder) -> list[Contact]:
    bodies, now = finder.bodies, finder.bodies.nought
    walls = [c for c, approach in start(finder) if c.kind == "wall" and approach == 0]
    free = {c: bodies.outward(c, *bodies.free[c.i][1:]) for c in walls}
    pressed = [c for c in walls if bodies.k.sign(free[c]) < 0]
    return [c for c in pressed if press(finder, c, now)]


def next_in_line(finder: ContactFinder, contact: Contact, side: int) -> Contact | None:
    """With the wall that carries a disk on in line, farthest beyond the end (side 1) or start
    (-1)."""
    walls, w = finder.scene.walls, contact.j
    heading = walls[w] if side > 0 else walls[w, ::-1]
    tip = line_span(heading, heading)[1]
    spans = {k: line_span(heading, walls[k]) for k in finder.surface[w]}
    beyond = {k: high for k, (low, high) in spans.items() if low <= tip < high}
    if not beyond:
        return None
    return _moved_to(finder, contact, max(beyond, key=lambda k: beyond[k]))


def below(finder: ContactFinder, contact: Contact, now: Number) -> Contact:
    """The contact of a disk with the wall of a surface on which its foot lies: while it bounced it
    may have passed the end of the wall that it met first."""
    bodies, surface = finder.bodies, finder.surface[contact.j]
    if len(surface) == 1:
        return contact
    x, y, _, _ = bodies.state_at(contact.i, now)
    return _moved_to(
        finder, contact, next(k for k in (contact.j, *surface) if bodies.foot_on(k, x, y))
    )


def _moved_to(finder: ContactFinder, contact: Contact, k: int) -> Contact:
    walls, w = finder.scene.walls, contact.j
    same = (walls[k, 1] - walls[k, 0]) @ (walls[w, 1] - walls[w, 0]) > 0
    return contact._replace(j=k, side=contact.side if same else -contact.side)


def nearly_in_line(finder: ContactFinder, i: int, now: float) -> str:
    """What to do about two walls that disk i touches, if they are in line but for the rounding of
    their ends; "" if there are none.

    With such an angle, of some 1e-16, between them they are no single surface: a slow disk turns
    about the joint, or bounces off it.
    """
    walls = finder.scene.walls
    touched = [c.j for c in finder.touching(i, now) if c.kind == "wall"]
    for a, b in ((a, b) for a in touched for b in touched if b not in finder.surface[a]):
        (start, end), rounding = walls[a], ROUNDED * np.abs(walls[[a, b]]).max()
        (tx, ty), away = (end - start) / np.hypot(*(end - start)), walls[b] - start
        if (np.abs(tx * away[:, 1] - ty * away[:, 0]) <= rounding).all():
            a, b = sorted((a, b))
            return f"; walls {a} and {b} are in line but for rounding: write them as one wall"
    return ""


def start(finder: ContactFinder) -> list[tuple[Contact, Fraction]]:
    """The contacts that touch at the start, and dr.dv of each (up to a positive factor); those
    without approach are noted in `bodies`.

    What touches but for `TOUCHING` units in the last place of its coordinates touches: its radius
    is taken larger or smaller by so much. Likewise a disk on a wall has no speed along the normal
    if that is a rounding of its speed.

    Raises:
        NoTruth: bodies overlap.
    """
    bodies, scene = finder.bodies, finder.scene
    faults, found = [], dict[tuple[Any, ...], tuple[Contact, Fraction]]()
    for i in np.flatnonzero(~scene.static).tolist():
        for contact in finder.touching(i, 0.0):
            gap, approach, overlap, drift = at_start(bodies, contact)
            touches = abs(overlap) <= TOUCHING * last_place(bodies, contact)
            if key(contact) in found:
                continue
            if gap < 0 and not touches:
                name = bodies.name(contact)
                faults.append(
                    f"disk {i} and {name} overlap by {overlap:.3g} m at the start: move them apart"
                    " by that"
                )
            if touches and gap:
                fit(finder, contact)
            if touches:
                speed = np.abs(bodies.table[i, 2:4]).max()
                along_wall = contact.kind == "wall" and abs(drift) <= TOUCHING * np.spacing(speed)
                found[key(contact)] = contact, Fraction(0) if along_wall else approach
    if faults:
        raise NoTruth(faults[0] + (f" ({len(faults) - 1} more)" if len(faults) > 1 else ""))
    for contact, approach in found.values():
        if approach >= 0:
            bodies.remember([finder.touch(contact, bodies.legs[contact.i].t)], set())
    return list(found.values())


def last_place(bodies: Bodies, contact: Contact) -> float:
    wall = contact.kind == "wall"
    rows = [contact.i] if wall else [contact.i, contact.j]
    coordinates = [bodies.table[rows, :2].ravel(), bodies.radii[rows]]
    if wall:
        coordinates.append(bodies.scene.walls[contact.j].ravel())
    return float(np.spacing(np.abs(np.concatenate(coordinates)).max()))


def fit(finder: ContactFinder, contact: Contact) -> None:
    """Let a contact that touches but for a rounding touch exactly."""
    bodies, i, j, root = finder.bodies, contact.i, contact.j, finder.k.sqrt
    x, y = bodies.legs[i][1:3]
    if contact.kind == "body":
        px, py = bodies.legs[j][1:3]
        distance = root((px - x) * (px - x) + (py - y) * (py - y))
        bodies.snug[min(i, j), max(i, j)] = distance
        return
    distance = bodies.height(contact, x, y)
    for wall in (_moved_to(finder, contact, k) for k in finder.surface[j]):
        bodies.snug[i, wall.j, wall.side] = distance


def at_start(bodies: Bodies, contact: Contact) -> tuple[Fraction, Fraction, float, float]:
    """The gap and dr.dv of a contact, both exact up to a positive factor; and its overlap, m, and
    the speed, m/s, at which it opens, from these: a difference of two lengths in float64 would be 0
    for a small one."""
    rows, scene, i = bodies.table, bodies.scene, contact.i
    (x, y), (u, v) = rational(rows[i, :2]), rational(rows[i, 2:4])
    r = Fraction(float(bodies.radii[i]))
    if contact.kind == "body":
        (px, py), (pu, pv) = rational(rows[contact.j, :2]), rational(rows[contact.j, 2:4])
        r += Fraction(float(bodies.radii[contact.j]))
        dx, dy = px - x, py - y
        square, opens = dx * dx + dy * dy, dx * (pu - u) + dy * (pv - v)
        distance = float(square) ** 0.5
        overlap = float(r * r - square) / (float(r) + distance)
        return square - r * r, opens, overlap, float(opens) / distance
    (px, py), (qx, qy) = (rational(end) for end in scene.walls[contact.j])
    tx, ty = qx - px, qy - py
    across, foot = tx * (y - py) - ty * (x - px), tx * (x - px) + ty * (y - py)
    square = tx * tx + ty * ty
    if not 0 <= foot <= square:
        return Fraction(1), Fraction(0), -np.inf, 0.0
    gap, opens = across * across - r * r * square, contact.side * (tx * v - ty * u)
    length = float(square) ** 0.5
    overlap = -float(gap) / (length * (float(r) * length + abs(float(across))))
    return gap, opens, overlap, float(opens) / length
