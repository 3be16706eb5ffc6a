"""The collisions of a step in the order in which they happen: exact flight, and every impulse where
and when two meet.

The same law of impact as `exercise`, and no projection: all fly to the end of the step on their
parabolas; then, as long as two met on the way, the two that met first go back to where they
touched, get the impulse there, and fly to the end anew. Times count back from the end of the step:
s = 0 is the end, s = -dt the start.

Every search asks the pairs of a neighbour list. Where collisions accumulate (a ball that bounces
ever lower, a stack) the work is bounded: a bounce that would last less than a `REST` of a step is
the last one, and what touches then stays together to the end of the step (`settle`); so does what
is near after `MOST` collisions a disk. With e = 1 the rest of such a step goes unresolved, which
shows as overlap.

It knows friction. A contact that lasts is held to the end of the step, or until a collision opens
it; its friction, once it has acted, to the end. Compiled by numba, as `exercise` is.
"""

from math import inf, sqrt

import numpy as np

from .compiled import compiled, inlined, kernel, pasted
from .meetings import (
    COARSE,
    DUE,
    EDGE,
    EXACT,
    INDEXED,
    LEEWAY,
    NOBODY,
    Accelerations,
    Agenda,
    System,
    contact,
    empty_agenda,
    first_meeting,
    first_of_all_pairs,
    list_meetings,
    mark_changed,
    path_of,
    way_in_step,
)
from .neighbour_list import (
    PAIRS,
    SLACK,
    STRIDE,
    WALLS,
    NeighbourList,
    build_list,
    empty_list,
    holds,
    take_step,
    used_up,
)
from .neighbours import moving
from .state import Disks, World

REST = 1 / 16  # of a step
MOST = 8  # collisions a disk and step, on average
# As `LEEWAY` has it, a disk in a step is held alone; by the last solution. It touches what is in
# reach, in radii.
ALONE, LAST = 1, 5
REACH = 0.0, 0.0, 2.0**-30, 2.0**-16, 2.0**-2, inf
TURNS = 6  # of `solve_pushes` a contact, at most
TOGETHER = -1.0  # in place of an impulse: perhaps others touch these two


@pasted
def advance(disks: Disks, world: World, dt: float, count: int) -> list:
    """Advance `count` steps of `dt` s; return the collisions as (step, i, j, impulse in N s), wall
    w as j = -1 - w."""
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]  # empty, but numba must know what it will hold
    pushed = [(0, 0, 0, 0.0) for _ in range(0)]  # (i, j, row of the collision, force in N)
    system, k = System(disks, world, accelerations_of(disks, world), dt), 0
    near = empty_list(disks.radius, len(world.walls))
    agenda = empty_agenda(near)
    while True:
        k = fly_until_meeting(system, near, agenda, k, count)
        if k == count:
            break
        if used_up(near):
            find_near(system, near, agenda, -dt, count - k)
        if agenda.length[DUE] > 0 or not holds(near):
            resolve(system, near, agenda, k, count, collisions, pushed)
        k += 1
    if world.friction == 0.0:
        turn(system, count)
    return collisions


@compiled
def accelerations_of(disks: Disks, world: World) -> Accelerations:
    steady, turning = np.zeros_like(disks.velocity), np.zeros_like(disks.angle)
    strongest2 = 0.0
    for i in range(len(disks.mass)):
        if disks.mass[i] == inf:
            continue
        ax = world.gravity[0] + disks.force[i, 0] / disks.mass[i]
        ay = world.gravity[1] + disks.force[i, 1] / disks.mass[i]
        steady[i, 0], steady[i, 1] = ax, ay
        strongest2 = max(strongest2, ax * ax + ay * ay)
        turning[i] = disks.torque[i] / disks.inertia[i]
    now, held = np.zeros_like(steady), np.zeros(len(disks.mass), np.int64)
    return Accelerations(steady, now, turning, held, moving(disks.mass), sqrt(strongest2))


@kernel
def fly_until_meeting(
    system: System, near: NeighbourList, agenda: Agenda, k: int, count: int
) -> int:
    """Take steps from step k on until one in which two meet or the list is used up: in that one all
    have flown, and nothing else was done. Returns it; the agenda has its meetings, unless the list
    is used up."""
    dt = system.dt
    while k < count:
        fly(system)
        if system.world.friction > 0.0:
            turn(system, 1)
        take_step(near, system.acceleration.strongest * dt * dt)
        if used_up(near):
            break
        list_meetings(system, near, agenda, -dt)
        if agenda.length[DUE] > 0:
            break
        k += 1
    return k


@kernel
def fly(system: System) -> None:
    """x + v dt + a dt2 / 2 and v + a dt for all, as if nobody met.

    What rounding cuts off is kept for the next time (Kahan, Comm. ACM 8, 40, 1965): hundreds of
    small steps would else round ten times as much as the few flights event by event that they are.
    """
    disks, acceleration, dt = system.disks, system.acceleration, system.dt
    x, v = disks.position.reshape(-1), disks.velocity.reshape(-1)
    cut = disks.remainder.reshape(-1)
    a, steady = acceleration.now.reshape(-1), acceleration.steady.reshape(-1)
    for run in range(len(acceleration.moving)):
        begin, end = np.int64(acceleration.moving[run, 0]), np.int64(acceleration.moving[run, 1])
        for c in range(2 * begin, 2 * end):
            a[c] = steady[c]
            before, way = x[c], v[c] * dt + steady[c] * (dt * dt / 2) + cut[c]
            x[c] = before + way
            cut[c] = way - (x[c] - before)
            v[c] += steady[c] * dt


@kernel
def turn(system: System, count: int) -> None:
    """The angles and spins of `count` steps: of all at last, as no collision asks for them without
    friction."""
    acceleration, dt = system.acceleration, system.dt
    angle, spin = system.disks.angle, system.disks.angular_velocity
    turning = acceleration.turning
    for run in range(len(acceleration.moving)):
        begin, end = np.int64(acceleration.moving[run, 0]), np.int64(acceleration.moving[run, 1])
        for _ in range(count):
            for i in range(begin, end):
                angle[i] += spin[i] * dt + turning[i] * (dt * dt / 2)
                spin[i] += turning[i] * dt


@inlined
def resolve(
    system: System, near, agenda, k: int, count: int, collisions: list, pushed: list
) -> None:
    """Meeting after meeting of a step in which all have flown to its end."""
    held, any_held, now = system.acceleration.held, False, -system.dt
    most = MOST * len(held)
    for c in range(most + 1):
        if holds(near):
            first = first_meeting(system, near, agenda, now)
        else:
            first = first_of_all_pairs(system, near, now)
        now, i, j = first
        alone = near.found[PAIRS] + near.found[WALLS] == 1
        if i == NOBODY or (c == most and (alone or system.world.restitution == 1.0)):
            break
        if j == EDGE:
            carry_over(system.disks.position, system.world, i)
            near.length[SLACK] = -inf
        else:
            impulse, hold = TOGETHER, 0.0
            if c < most:
                impulse, hold = collide(system, i, j, now, alone)
            if impulse == TOGETHER:
                # after so many collisions, what is near stays together
                level = min(1 + max(held[i], held[max(i, j)], ALONE), LAST) if c < most else LAST
                any_held = True
                impulse, hold = settle(system, near, agenda, first, level, k, collisions, pushed)
            if impulse > 0.0:
                if len(pushed) > 0:
                    release(system, near, agenda, i, j, now, collisions, pushed)
                collisions.append((k, i, j, impulse))
                if hold > 0.0 and not alone:
                    pushed.append((i, j, len(collisions) - 1, hold))
                    held[i], held[max(i, j)] = max(held[i], ALONE), max(held[max(i, j)], ALONE)
            mark_changed(system, near, agenda, i)
            if j >= 0:
                mark_changed(system, near, agenda, j)
        if not holds(near):
            find_near(system, near, agenda, now, count - k)
    if any_held:
        held[:] = 0
        pushed.clear()


@compiled
def find_near(system: System, near, agenda, now: float, steps: int) -> None:
    """Build the list at the end of a step, and put down all meetings from `now` on: in the step,
    each may have been a step away from its end."""
    x, mass, longest = system.disks.position, system.disks.mass, 0.0
    for i in range(len(mass)):
        if mass[i] != inf:
            longest = max(longest, way_in_step(system, i))
    near.length[STRIDE] = longest
    build_list(near, x, system.disks.radius, system.world, steps)
    near.length[SLACK] -= longest
    agenda.length[INDEXED] = 0
    if holds(near):
        list_meetings(system, near, agenda, now)


@kernel
def move(x, remainder, i: int, axis: int, way: float) -> None:
    """Move disk i as `fly` does, and keep what rounding cuts off."""
    before, way = x[i, axis], way + remainder[i, axis]
    x[i, axis] = before + way
    remainder[i, axis] = way - (x[i, axis] - before)


@kernel
def weights(mass, i: int, j: int) -> tuple[float, float]:
    """1/kg of the two; a wall's is 0."""
    return 1.0 / mass[i], 1.0 / mass[j] if j >= 0 else 0.0


@compiled
def opening_acceleration(path, s: float, nx: float, ny: float) -> float:
    """m/s2 at which the gap opens at s as one slides past the other: v2 / distance, and nothing
    along a wall's face.

    Two that touch and slide past each other part, however hard they are pushed together, if that
    is more.
    """
    x, y, u, v, a, b, along, up, _ = path
    px, py = x + (u + a * s / 2) * s, y + (v + b * s / 2) * s
    part = 0.0
    if along != 0.0 or up != 0.0:
        part = (px * along + py * up) / (along * along + up * up)
        if 0.0 < part < 1.0:
            return 0.0
        part = min(max(part, 0.0), 1.0)
    slide = (v + b * s) * nx - (u + a * s) * ny
    px, py = px - part * along, py - part * up
    distance = sqrt(px * px + py * py)
    return slide * slide / distance if distance > 0.0 else 0.0


@kernel
def collide(system: System, i: int, j: int, s: float, alone: bool) -> tuple[float, float]:
    """The impulse J = -(1 + e) (vi - vj).n / (1/mi + 1/mj) at s, and both on their new ways to the
    end; returns J, and the force that holds them from then on. Unless they are alone, where they
    would rest or part by less than g dt / 32: `TOGETHER`, and nothing is done."""
    dt, low = system.dt, system.acceleration.strongest * system.dt * REST
    e, hold, path = system.world.restitution, 0.0, path_of(system, i, j)
    wi, wj = weights(system.disks.mass, i, j)
    _, rate, nx, ny = contact(path, s)
    speed = max(-rate, 0.0)
    inward = -(path[4] * nx + path[5] * ny) - opening_acceleration(path, s, nx, ny)
    # it would be back at once, and ever sooner: it rests, and is held
    rests = 2.0 * e * speed < inward * dt * REST
    if not alone and (rests or 2.0 * e * speed < low):
        return TOGETHER, 0.0
    if rests:
        e, hold = 0.0, inward / (wi + wj)
    J = (1.0 + e) * speed / (wi + wj)
    apply_push(system, i, j, nx, ny, J, hold, s)
    if system.world.friction > 0.0:
        apply_friction(system, i, j, path, J, hold, s)
    return J - hold * s, hold


@compiled
def release(system: System, near, agenda, i: int, j: int, s: float, collisions, pushed) -> None:
    """From s on, no force holds a contact of disk i or j that a collision has opened."""
    for p in range(len(pushed)):
        a, b, row, hold = pushed[p]
        if hold > 0.0 and (a in (i, j) or b in (i, j)):
            _, rate, nx, ny = contact(path_of(system, a, b), s)
            if rate > COARSE * system.acceleration.strongest * system.dt:
                apply_push(system, a, b, nx, ny, 0.0, -hold, s)
                k, _, _, impulse = collisions[row]
                collisions[row] = (k, a, b, impulse + hold * s)
                pushed[p] = (a, b, row, 0.0)
                for d in (a, max(a, b)):
                    mark_changed(system, near, agenda, d)


@compiled
def settle(
    system: System, near, agenda, first, level: int, k: int, collisions: list, pushed: list
) -> tuple[float, float]:
    """All that touch the two that meet first, and each other, at once: the impulses without bounce
    and then the forces, all >= 0, with which no gap of theirs closes before the end of the step.
    Returns `TOGETHER`, or what `collide` returns of the two alone if no other contact touches.

    A gap is convex along a straight way, so one that is open at the end by its normal now stays
    open. With friction, its impulses and forces follow from those, and then they once more.
    """
    mass, held = system.disks.mass, system.acceleration.held
    s, e, step = first[0], system.world.restitution, system.acceleration.strongest * system.dt
    slow = step * REST / (2.0 * e) if e > 0.0 and level < LAST else inf
    contacts = touching(system, near, first, REACH[level], slow)
    m = len(contacts)
    if m < 2:
        return collide(system, first[1], first[2], s, True)
    place, push = np.full(m, -1), np.zeros((2, m))  # impulses in N s, forces in N
    for c in range(m):
        for p in range(len(pushed)):
            if pushed[p][0] == contacts[c][0] and pushed[p][1] == contacts[c][1]:
                place[c], push[1, c] = p, pushed[p][3]
    start, tolerance = push[1].copy(), min(LEEWAY[level], COARSE)
    push_contacts(system, contacts, push, tolerance, s)
    if system.world.friction > 0.0:
        for c in range(m):
            (i, j), rise = contacts[c], max(push[1, c] - start[c], 0.0)
            apply_friction(system, i, j, path_of(system, i, j), push[0, c], rise, s)
        push_contacts(system, contacts, push, tolerance, s)
    for c in range(m):
        i, j = contacts[c]
        p, hold, impulse = int(place[c]), push[1, c], push[0, c] - (push[1, c] - start[c]) * s
        if p >= 0:
            row = pushed[p][2]
            collisions[row] = (k, i, j, collisions[row][3] + impulse)
            pushed[p] = (i, j, row, hold)
        elif impulse > 0.0:
            pushed.append((i, j, len(collisions), hold))
            collisions.append((k, i, j, impulse))
        for d in (i, max(i, j)):
            if mass[d] != inf:
                held[d] = level
                mark_changed(system, near, agenda, d)
    return TOGETHER, 0.0


@compiled
def touching(system: System, near: NeighbourList, first, reach: float, slow: float) -> list:
    """The contacts (i, j) that join the two that meet first and all that touch them in turn: closer
    than `reach` radii, and closing by less than `slow` m/s."""
    mass, s = system.disks.mass, first[0]
    pairs, contacts = near.found[PAIRS], [(0, 0) for _ in range(0)]
    joined, taken = np.zeros(len(mass), np.bool_), np.zeros(pairs + near.found[WALLS], np.bool_)
    count = -1
    for d in (first[1], max(first[1], first[2])):
        joined[d] = mass[d] != inf
    while count != len(contacts) and holds(near):
        count = len(contacts)
        for p in range(len(taken)):
            i = np.int64(near.first[p] if p < pairs else near.disk[p - pairs])
            j = np.int64(near.second[p]) if p < pairs else -1 - np.int64(near.wall[p - pairs])
            if taken[p] or not (joined[i] or joined[max(i, j)]):
                continue
            path = path_of(system, i, j)
            gap, rate, _, _ = contact(path, s)
            if gap < reach * path[8] and -rate < slow:
                taken[p] = True
                contacts.append((int(i), int(j)))
                for d in (i, max(i, j)):
                    joined[d] = mass[d] != inf
    return contacts


@compiled
def push_contacts(system: System, contacts, push, tolerance: float, s: float) -> None:
    """Change the impulses push[0] and then the forces push[1] (m,) of these contacts, from s on."""
    mass, m, h = system.disks.mass, len(contacts), max(-s, EXACT * system.dt)
    normal, weight, open = np.empty((m, 2)), np.empty((m, 2)), np.empty(m)
    for held in range(2):  # by an impulse, by a force
        for c in range(m):
            i, j = contacts[c]
            path = path_of(system, i, j)
            gap, rate, nx, ny = contact(path, s)
            open[c] = rate + max(gap, 0.0) / h
            if held:
                straight = path[4] * nx + path[5] * ny
                open[c] = 2.0 * open[c] / h + straight + opening_acceleration(path, s, nx, ny)
            normal[c, 0], normal[c, 1] = nx, ny
            weight[c, 0], weight[c, 1] = weights(mass, i, j)
        before, scale = push[held].copy(), system.acceleration.strongest * (1.0 if held else h)
        bodies = len(mass) + len(system.world.walls)
        solve_pushes(contacts, weight, normal, open, push[held], bodies, tolerance, scale)
        for c in range(m):
            i, j = contacts[c]
            change, nx, ny = push[held, c] - before[c], normal[c, 0], normal[c, 1]
            J, hold = (0.0, change) if held else (change, 0.0)
            apply_push(system, i, j, nx, ny, J, hold, s)


@compiled
def solve_pushes(
    contacts, weight, normal, open, push, bodies: int, tolerance: float, scale: float
) -> None:
    """Change the pushes (m,) >= 0 of the contacts along their normals until `open` (m,), how fast
    each opens, is 0 where a contact pushes and >= 0 elsewhere, to `tolerance` of the scale.

    It is the minimum of a quadratic function over push >= 0 (the dual of Gauss's least constraint),
    found by conjugate gradients over those that push (Polyak, USSR Comput. Math. 9, 94, 1969): in a
    row or a column none stops to push, and it is exact whatever the masses.
    """
    m, pushes, last = len(push), push > 0.0, 0.0
    along, effect, way = np.zeros(m), np.zeros(m), np.zeros((bodies, 2))
    for c in range(m):
        scale = max(scale, -open[c])
    # No contact pushes more than stops all of them: a row of disks that fills a box from wall to
    # wall could push itself as hard as rounding says.
    most = scale * mass_of(weight)
    for _ in range(TURNS * (m + TURNS)):
        square, closing = 0.0, 0.0
        for c in range(m):
            square += open[c] * open[c] if pushes[c] else 0.0
            closing += open[c] * open[c] if open[c] < 0.0 and not pushes[c] else 0.0
        if max(square, closing) <= tolerance * tolerance * scale * scale:
            break
        join = closing > square
        if join:
            square, last = square + closing, 0.0
        share, curvature = square / last if last > 0.0 else 0.0, 0.0
        for c in range(m):
            pushes[c] = pushes[c] or (join and open[c] < 0.0)
            along[c] = share * along[c] - open[c] if pushes[c] else 0.0
        compute_effect(contacts, weight, normal, along, way, effect)
        for c in range(m):
            curvature += along[c] * effect[c]
        length, last, stops = square / curvature, square, -1
        for c in range(m):
            if push[c] + length * along[c] > most:
                return
            if push[c] + length * along[c] < 0.0:
                length, stops = -push[c] / along[c], c
        for c in range(m):
            push[c] += length * along[c]
            open[c] += length * effect[c]
        if stops >= 0:
            push[stops], pushes[stops], last = 0.0, False, 0.0


@compiled
def mass_of(weight) -> float:
    """kg: of the disks of all contacts, each as often as it touches."""
    mass = 0.0
    for w in weight.reshape(-1):
        mass += 1.0 / w if w > 0.0 else 0.0
    return mass


@compiled
def compute_effect(contacts, weight, normal, push, way, effect) -> None:
    """What pushes (m,) change in how fast each contact opens: effect (m,). Wall w, which never
    moves, is row -1 - w of `way`, so counts from its end."""
    way[:] = 0.0
    for c in range(len(push)):
        i, j = contacts[c]
        for axis in range(2):
            way[i, axis] += weight[c, 0] * push[c] * normal[c, axis]
            way[j, axis] -= weight[c, 1] * push[c] * normal[c, axis]
    for c in range(len(push)):
        i, j = contacts[c]
        x, y = way[i, 0] - way[j, 0], way[i, 1] - way[j, 1]
        effect[c] = normal[c, 0] * x + normal[c, 1] * y


@kernel
def apply_push(
    system: System, i: int, j: int, nx: float, ny: float, J: float, hold: float, s: float
) -> None:
    """From s on, as if the two had left with the impulse J and the force `hold` along n."""
    disks, acceleration = system.disks, system.acceleration.now
    wi, wj = weights(disks.mass, i, j)
    for d, weight in ((i, wi), (j, -wj)):
        if d < 0:
            continue
        for axis, n in enumerate((nx, ny)):
            w = weight * n
            move(disks.position, disks.remainder, d, axis, (hold * (s * s / 2) - J * s) * w)
            disks.velocity[d, axis] += (J - hold * s) * w
            acceleration[d, axis] += hold * w


@kernel
def apply_friction(
    system: System, i: int, j: int, path, normal: float, pressing: float, s: float
) -> None:
    """Coulomb's friction of two that were on this path up to s: by the impulse `normal`, N s, along
    the normal at once, then by the force `pressing`, N, which brakes until the surfaces do not
    slide and from then on keeps them so.

    The slip is that of i against j where they touch, along t = (-ny, nx). It is exact for one
    contact that lasts; of two of the same disk the second does not know that the first turns it.
    """
    disks, acceleration, friction = system.disks, system.acceleration.now, system.world.friction
    most, most_held, (_, _, nx, ny) = friction * normal, friction * pressing, contact(path, s)
    slip = (path[3] + path[5] * s) * nx - (path[2] + path[4] * s) * ny
    growth = path[5] * nx - path[4] * ny  # of the slip in m/s2, as long as nothing brakes
    weight = 0.0
    for k in (i, j):
        if k >= 0:
            radius, turning = disks.radius[k], disks.torque[k] / disks.inertia[k]
            slip -= radius * (disks.angular_velocity[k] + turning * s)
            growth -= radius * turning
            weight += 1.0 / disks.mass[k] + radius * radius / disks.inertia[k]
    J = min(max(-slip / weight, -most), most)

    # the force brakes until `stopped`, and holds from then on
    slip += J * weight
    brake = -most_held if slip > 0.0 else most_held
    slowing = growth + brake * weight
    stopped = s if slip == 0.0 else min(s - slip / slowing, 0.0) if slip * slowing < 0.0 else 0.0
    hold = min(max(-growth / weight, -most_held), most_held) if stopped < 0.0 else brake
    impulse = J + brake * (stopped - s) - hold * stopped
    way = -J * s + (brake * (s * s - stopped * stopped) + hold * stopped * stopped) / 2
    # the end of the step as it is with the impulse, moved by `way` kg m over the mass
    for d, side in ((i, 1.0), (j, -1.0)):
        if d < 0:
            continue
        for axis, t in enumerate((-ny * side, nx * side)):
            move(disks.position, disks.remainder, d, axis, way * t / disks.mass[d])
            disks.velocity[d, axis] += impulse * t / disks.mass[d]
            acceleration[d, axis] += hold * t / disks.mass[d]
        disks.angular_velocity[d] -= impulse * disks.radius[d] / disks.inertia[d]
        disks.angle[d] -= way * disks.radius[d] / disks.inertia[d]


@compiled
def carry_over(x, world: World, i: int) -> None:
    """A centre that is set onto the opposite edge as it leaves and flies on ends a box away."""
    for axis in range(2):
        if x[i, axis] < world.low[axis]:
            x[i, axis] += world.high[axis] - world.low[axis]
        elif x[i, axis] > world.high[axis]:
            x[i, axis] -= world.high[axis] - world.low[axis]
