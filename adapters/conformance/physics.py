"""The probes of the physics: an engine that fails one of them follows the protocol, but its physics
differs from the scene.

Those of `LAWS` are of what any solver of these scenes keeps: dt, gravity, the stated e and the
direction of an impulse; a reading names the law that is broken. They allow a hundredth, whatever
the number format: a velocity that is read half a step off differs by dt / (2 t), which is 0.2 %
here. e is read at 10 m/s, ten times the largest threshold that an engine documents, and at several
phases of a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.conformance.probe import (
    DT,
    EXERCISE,
    ROUNDINGS,
    Departure,
    Probe,
    ProbeReading,
    before_and_after,
    head_on,
    largest,
    load_first,
    loaded,
    one_disk,
    scene_of,
    without_spin_and_gravity,
)
from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.scenarios.model import Array, Scene

SPEEDS = (0.01, 0.1, 0.5, 2.0, 10.0, 100.0)  # m/s, on both sides of Box2D's threshold of 1
FRICTION = 0.2  # that the scenes of the probes of friction state
# alpha of explicit Euler, of exact flight or velocity Verlet, of symplectic Euler
ORDERS_OF_UPDATES = (0.0, 0.5, 1.0)
# of sum m v: what an engine in float32 may lose that takes velocities from positions, which round
# by 6e-8 m, over 1/256 s
IN_FLOAT32 = 1e-5


def free_flight(row: EngineRow) -> ProbeReading:
    """The offset of a thrown disk from x0 + v0 t + a t2 / 2 after 1 s, in m; x' = x + v dt + alpha
    a dt2 gives (alpha - 1/2) a dt t. Every step rounds a position and a velocity, and the error of
    the velocity adds to later positions. An engine with unknown alpha, a user's file, may have any
    of `ORDERS_OF_UPDATES`."""
    steps, gravity, speed = 256, 9.81, 4.1
    t = steps * DT
    states = before_and_after(row, one_disk((0.0, speed), gravity=gravity), steps=steps)
    start, end = (float(state.position[0, 1]) for state in states)
    bound = row.rounding * steps * (1.0 + gravity * t * t)
    offset = end - start - (speed * t - gravity * t * t / 2)
    alphas = ORDERS_OF_UPDATES if np.isnan(row.alpha) else (row.alpha,)
    laws = [-(alpha - 0.5) * gravity * DT * t for alpha in alphas]
    return ProbeReading(offset, min(laws, key=lambda law: abs(law - offset)), bound)


def coasting(
    row: EngineRow, steps: int, dt: float = DT, speed: float = 0.0, spin: float = 0.0
) -> ProbeReading:
    """Speed in m/s or spin in rad/s of a free disk: nothing acts on it, and it is not rounded."""
    _, state = before_and_after(row, one_disk((speed, 0.0), spin), steps=steps, dt=dt)
    got = float(state.angular_velocity[0] if spin else state.velocity[0, 0])
    return ProbeReading(got, speed or spin, 2 * row.rounding * (speed or spin))


def spins_freely(row: EngineRow) -> ProbeReading:
    """Angle in rad after 1 s at 20 rad/s; an angle rounds once a step."""
    steps, spin = 256, 20.0
    with loaded(row, one_disk(spin=spin)) as engine:
        for _ in range(8):
            engine.step(steps // 8)
            angle = float(engine.read().angle[0])  # read often: an engine may keep only cos and sin
    return ProbeReading(angle, spin * steps * DT, row.rounding * steps * spin)


def pair_momentum(row: EngineRow) -> ProbeReading:
    """Change of momentum over sum m |v|, in an oblique collision of 1 kg and 7 kg; both velocities
    round once or twice. Where it is no rounding, of 2 kg and 2 kg, too."""
    changes = []
    for masses in ((1.0, 7.0), (2.0, 2.0)):
        scene = scene_of(
            [[-0.52, 0.2], [0.5, -0.1]],
            [[2.0, 0.3], [-1.0, 0.1]],
            mass=masses,
            angular_velocity=[3.0, -2.0],
        )
        states = before_and_after(row, *without_spin_and_gravity(scene))
        before, after = (state.velocity for state in states)
        if np.abs(after - before).max() < 0.1:
            return ProbeReading("no collision", 0.0, departure=Departure.PASSES)
        changes.append(
            largest(scene.mass @ (after - before)) / float(scene.mass @ np.hypot(*before.T))
        )
        if changes[0] <= IN_FLOAT32:
            return ProbeReading(changes[0], 0.0, ROUNDINGS * row.rounding)
    law = Departure.MASSES if changes[1] <= IN_FLOAT32 else Departure.MOMENTUM
    return ProbeReading(changes[0], 0.0, ROUNDINGS * row.rounding, departure=law)


def restitution(row: EngineRow, closing: float) -> ProbeReading:
    before, after = (state.velocity for state in before_and_after(row, head_on(closing)))
    e = float((after[2] - after[1])[0] / (before[1] - before[2])[0])
    return ProbeReading(e, 0.5, ROUNDINGS * row.rounding)


def wall_restitution(row: EngineRow) -> ProbeReading:
    scene = scene_of([[0.0, 0.0]], [2.0, 0.0], mass=7.3, walls=[[[0.53, -2.0], [0.53, 2.0]]])
    _, after = before_and_after(row, scene)
    return ProbeReading(-float(after.velocity[0, 0]) / 2.0, 0.5, ROUNDINGS * row.rounding)


def friction_in_bounce(row: EngineRow, restitution: float, friction: float) -> ProbeReading:
    """Sideways over normal momentum taken up by a disk in a head-on collision of two that spin so
    fast that they slide all through it: the effective coefficient of friction. Where none is
    stated the sideways part is 0, and not even rounded."""
    scene = replace(head_on(2.0, spin=40.0), restitution=restitution, friction=friction)
    before, after = before_and_after(row, scene)
    normal, sideways = (after.velocity - before.velocity)[1]
    got = float(abs(sideways / normal)) if normal else np.nan
    return ProbeReading(got, friction, (ROUNDINGS if friction else 1) * row.rounding)


def friction_at_rest(row: EngineRow) -> ProbeReading:
    """Deceleration over g of a disk that slides on a floor and does not bounce, from 1/8 s to
    3/8 s; a velocity rounds twice a step."""
    steps, gravity, speed = 64, 10.0, 4.0
    scene = scene_of(
        [[0.0, 0.5]],
        [speed, 0.0],
        restitution=0.0,
        friction=FRICTION,
        gravity=[0.0, -gravity],
        walls=[[[-8.0, 0.0], [8.0, 0.0]]],
    )
    with loaded(row, scene) as engine:
        engine.step(steps // 2)  # by then it lies on the floor
        early = float(engine.read().velocity[0, 0])
        engine.step(steps)
        late = float(engine.read().velocity[0, 0])
    bound = row.rounding * ROUNDINGS * steps * speed / (gravity * steps * DT)
    return ProbeReading((early - late) / (gravity * steps * DT), FRICTION, bound)


_Physics = partial(Probe, failure="departs")
PHYSICS: dict[str, Probe] = {
    "free_flight": _Physics(
        "How far is a thrown disk from the parabola after 1 s? (m)", free_flight
    ),
    "slow_flight": _Physics(
        "How fast is a free disk of 3.9 mm/s after 2 s? (m/s)",
        partial(coasting, steps=512, speed=2.0**-8),
    ),
    "fast_flight": _Physics(
        "How fast is a free disk of 512 m/s after 4 steps? (m/s)",  # 16 radii each
        partial(coasting, steps=4, dt=1 / 64, speed=512.0),
    ),
    "fast_spin": _Physics(
        "How fast does a free disk of 300 rad/s spin after 4 steps? (rad/s)",
        partial(coasting, steps=4, dt=1 / 64, spin=300.0),  # three quarters of a turn each
    ),
    "spins_freely": _Physics(
        "What angle has a free disk after 1 s at 20 rad/s? (rad)", spins_freely
    ),
    "pair_momentum": _Physics(
        "How much momentum does a collision of two disks make? (of sum m v)", pair_momentum
    ),
    **{
        f"restitution_{speed:g}": _Physics(
            f"What is e of a pair that closes at {speed:g} m/s, where 0.5 is stated?",
            partial(restitution, closing=speed),
        )
        for speed in SPEEDS
    },
    "restitution_wall": _Physics(
        "What is e of a wall collision at 2 m/s, where 0.5 is stated?", wall_restitution
    ),
    "friction": _Physics(
        "What coefficient of friction acts between two disks, where none is stated?",
        partial(friction_in_bounce, restitution=0.5, friction=0.0),
    ),
    **{
        f"friction_{e:g}": _Physics(
            f"What friction acts in a bounce with e = {e:g}, where {FRICTION} is stated?",
            partial(friction_in_bounce, restitution=e, friction=FRICTION),
        )
        for e in (0.0, 0.5, 1.0)
    },
    "friction_at_rest": _Physics(
        f"What friction brakes a disk that slides on a floor, where {FRICTION} is stated?",
        friction_at_rest,
    ),
}

ALLOWED = 0.01  # of what is expected
# The line of centres of a pair turns by v dt / (2 r) = 0.004 a step; springs touch for a dozen.
TURNED = 0.05
FREE_STEPS, STEPS = 256, 64  # of a free disk; of a collision: disks that stick end at rest
COARSER = 0.01  # s, beside DT
# Of a step, at which a collision happens; negative: the pair is turned by half a turn.
PHASES = (1 / 16, -1 / 4, 1 / 2, -3 / 4)
FREE_SPEEDS = (1.5, 10.0)  # m/s, of a free disk; the second is that of the collisions
GRAVITY = 4.0  # m/s2; not 9.81, which may stand in the code of an engine


class Impact(NamedTuple):
    """Disk 0 strikes disk 1 at rest, or a wall if there is one mass. `ways`: the direction of the
    impulse and the velocity of disk 0, and others to ask if that is refused."""

    masses: Sequence[float]
    ways: Sequence[tuple[Sequence[float], Sequence[float]]]

    def law(self, name: str) -> Departure:
        return Departure["WALL_" * (len(self.masses) == 1) + name]


EQUAL = Impact((1.0, 1.0), [((1.0, 0.0), (10.0, 0.0))])
UNEQUAL = EQUAL._replace(masses=(1.0, 7.0))
OFF_CENTRE = UNEQUAL._replace(ways=[((np.sqrt(0.75), 0.5), (2.0, 0.0))])
WALL = Impact((7.3,), [((1.0, 0.0), (10.0, 6.0)), ((0.0, -1.0), (6.0, -10.0))])  # or a floor


def dt_is_obeyed(row: EngineRow) -> ProbeReading:
    """The speed of a free disk in m/s by its path, at two dt; or its last one, if that differs."""
    for speed in FREE_SPEEDS:
        paths = []
        for dt in (DT, COARSER):
            disk = one_disk((speed, 0.0))
            before, after = before_and_after(row, disk, steps=FREE_STEPS, dt=dt)
            final = float(after.velocity[0, 0])
            if not abs(final - speed) <= ALLOWED * speed:
                return ProbeReading(final, speed, ALLOWED * speed, departure=Departure.SPEED)
            way = float(after.position[0, 0] - before.position[0, 0])
            paths.append(way / (FREE_STEPS * dt))
        worst = max(paths, key=lambda path: abs(path - speed))
        by_step = abs(paths[0] * DT - paths[1] * COARSER) <= ALLOWED * abs(paths[0]) * DT
        law = Departure.DT_IGNORED if by_step and paths[0] else Departure.PATH
        reading = ProbeReading(worst, speed, ALLOWED * speed, departure=law)
        if not reading.kept:
            break
    return reading


def gravity_is_stated(row: EngineRow) -> ProbeReading:
    """The acceleration of a disk from rest by its velocity, in m/s2, at two dt: without gravity,
    then under one to the side, or straight down if that is refused."""
    still, bound = replace(one_disk(), restitution=EXERCISE), ALLOWED * GRAVITY
    _, after = before_and_after(row, still, steps=FREE_STEPS)
    drift = float(np.hypot(*after.velocity[0])) / (FREE_STEPS * DT)
    if not drift <= bound:
        return ProbeReading(drift, 0.0, bound, departure=Departure.GRAVITY_UNSTATED)
    ways = np.multiply(GRAVITY, [(0.6, -0.8), (0.0, -1.0)])
    read = []
    for dt in (DT, COARSER):
        with closing(row.make()) as engine:
            stated = load_first(engine, [replace(still, gravity=way) for way in ways], dt).gravity
            engine.step(FREE_STEPS)
            read.append(engine.read().velocity[0] / (FREE_STEPS * dt))
    worst = max(read, key=lambda vector: float(np.hypot(*(vector - stated))))
    size = float(np.hypot(*worst))
    if np.hypot(*(worst - stated)) <= bound:
        return ProbeReading(size, GRAVITY, bound)
    if size <= bound:
        thrown = replace(one_disk((FREE_SPEEDS[0], 0.0)), gravity=stated)
        before, after = before_and_after(row, thrown, steps=FREE_STEPS)
        falls = np.hypot(*(after.velocity - before.velocity)[0]) > bound
        law = Departure.GRAVITY_AT_REST if falls else Departure.GRAVITY_ABSENT
    elif np.hypot(*(read[0] * DT - read[1] * COARSER)) <= ALLOWED * np.hypot(*read[0]) * DT:
        law = Departure.DT_IGNORED
    else:
        law = Departure.GRAVITY_UPWARD if worst[1] > bound else Departure.GRAVITY
    got, expected = (f"({x:.3g}, {y:.3g})" for x, y in (worst, stated))
    return ProbeReading(got, expected, departure=law)


def scenes_before(impact: Impact, phase: float, e: float) -> list[tuple[Array, Scene]]:
    """The direction of the impulse and the scene of each way, four steps and `phase` of one before
    the impact; a wall is asked as one of four around the disk, then alone."""
    k, scenes = len(impact.masses), list[tuple[Array, Scene]]()
    sign = -1.0 if phase < 0 and k > 1 else 1.0  # a wall is never turned
    for way in impact.ways:
        n, v = sign * np.asarray(way)
        along = np.array([-n[1], n[0]])
        a, b, c, d = (20 * (i * along - j * n) for i, j in ((-1, 0), (1, 0), (1, 1), (-1, 1)))
        box = [[a, b], [b, c], [c, d], [d, a]]
        for walls in [[]] if k > 1 else [box, box[:1]]:
            scene = scene_of(
                [-n / 2 - v * DT * (4 + abs(phase)), n / 2][:k],
                [v, np.zeros(2)][:k],
                mass=impact.masses,
                restitution=e,
                walls=np.reshape(walls, (-1, 2, 2)),
            )
            scenes.append((n, scene))
    return scenes


def strikes(row: EngineRow, impact: Impact, e: float) -> list[tuple[Array, Array, Array]]:
    """For each phase: the direction of the impulse, and the velocity of disk 0 relative to what it
    strikes, before and after."""
    seen = []
    for phase in PHASES:
        scenes = scenes_before(impact, phase, e)
        with closing(row.make()) as engine:
            played = load_first(engine, [scene for _, scene in scenes], DT)
            before = engine.read().velocity
            engine.step(STEPS)
            after = engine.read().velocity
        (normal,) = (n for n, scene in scenes if scene is played)
        seen.append((normal, *(v[0] - v[1:].sum(axis=0) for v in (before, after))))
    return seen


def e_is_stated(row: EngineRow, impacts: Sequence[Impact]) -> ProbeReading:
    """Separation over approach speed, at the phase that is farthest from the stated e."""
    kept: ProbeReading | None = None
    for impact, e in product(impacts, (EXERCISE, 0.5)):
        try:
            values = [
                float(-(after @ n) / (before @ n)) for n, before, after in strikes(row, impact, e)
            ]
        except Unsupported:
            if kept is None:
                raise
            continue  # a solver may have one e
        worst = max(values, key=lambda value: abs(value - e))
        off = sum(not abs(value - e) <= ALLOWED for value in values)
        name = "BY_MASS" if impact is UNEQUAL else "RESTITUTION"
        name = {0.0: "STICKS", -1.0: "PASSES"}.get(round(worst, 2), name)
        note = f"at {off} of {len(PHASES)} phases of a step" if off < len(PHASES) else ""
        reading = ProbeReading(worst, e, ALLOWED, note if off else "", impact.law(name))
        if off:
            return reading
        kept = kept or reading
    assert kept is not None
    return kept


def impulse_is_normal(row: EngineRow, impact: Impact) -> ProbeReading:
    """The share of an impulse across the normal, at the worst phase: 0 without friction."""
    bound, shares = TURNED if len(impact.masses) > 1 else ALLOWED, []
    for normal, before, after in strikes(row, impact, EXERCISE):
        x, y = after - before
        if np.hypot(x, y) <= ALLOWED:
            return ProbeReading("no collision", 0.0, departure=impact.law("PASSES"))
        shares.append(float(abs(x * normal[1] - y * normal[0]) / np.hypot(x, y)))
    return ProbeReading(max(shares), 0.0, bound, departure=impact.law("TANGENTIAL"))


LAWS: dict[str, Probe] = {
    "dt_is_obeyed": _Physics(
        "How fast is a free disk of 1.5 or 10 m/s, at two dt? (m/s)", dt_is_obeyed
    ),
    "gravity_is_stated": _Physics(
        "What is the acceleration under 4 m/s2, at two dt? (m/s2)", gravity_is_stated
    ),
    "pair_keeps_e": _Physics(
        "What is e of a pair that closes at 10 m/s, where 0.9 or 0.5 is stated?",
        partial(e_is_stated, impacts=(EQUAL, UNEQUAL)),
    ),
    "off_centre_is_normal": _Physics(
        "Which share of the impulse of an off-centre collision is tangential?",
        partial(impulse_is_normal, impact=OFF_CENTRE),
    ),
    "wall_keeps_e": _Physics(
        "What is e of a wall collision at 10 m/s, where 0.9 or 0.5 is stated?",
        partial(e_is_stated, impacts=(WALL,)),
    ),
    "wall_is_normal": _Physics(
        "Which share of the impulse of a slanting wall collision is tangential?",
        partial(impulse_is_normal, impact=WALL),
    ),
}
