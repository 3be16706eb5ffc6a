"""The probes of the laws, which any solver of these scenes keeps: dt, gravity, the stated e and the
direction of an impulse. A reading names the law that is broken.

A hundredth is allowed, whatever the number format: a velocity that is read half a step off differs
by dt / (2 t), which is 0.2 % here. e is read at 10 m/s, ten times the largest threshold that an
engine documents, and at several phases of a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from adapters.conformance.probe import (
    DT,
    EXERCISE,
    Departure,
    Probe,
    ProbeReading,
    load_first,
    loaded,
    one_disk,
    scene_of,
)
from adapters.engine import Unsupported
from adapters.engine_row import EngineRow
from scenarios.model import Array, Scene

ALLOWED = 0.01  # of what is expected
# The line of centres turns by v dt / (2 r) = 0.004 a step, and springs touch for a dozen steps.
TURNED = 0.05
FREE_STEPS, STEPS = 256, 64  # of a free disk; of a collision: disks that stick end at rest
COARSER = 0.01  # s, beside DT
PHASES = (1 / 16, 1 / 4, 1 / 2, 3 / 4)  # of a step, at which a collision happens
GRAVITY = 4.0  # m/s2; not 9.81, which may stand in the code of an engine
OBLIQUE = np.pi / 6

Impact = tuple[Scene, Array]  # disk 0 strikes disk 1 or wall 0, and the direction of the impulse


def free_disk(velocity: ArrayLike = (0.0, 0.0), gravity: ArrayLike = (0.0, 0.0)) -> Scene:
    """A disk far from everything."""
    start = replace(one_disk(), velocity=np.array([velocity]), gravity=np.array(gravity))
    return replace(start, restitution=EXERCISE)


def dt_is_obeyed(row: EngineRow) -> ProbeReading:
    """The speed of a free disk in m/s by its path, at two dt; or its last one, if that differs."""
    speed, paths = 1.5, []
    for dt in (DT, COARSER):
        with loaded(row, free_disk((speed, 0.0)), dt=dt) as engine:
            start = engine.read().position[0, 0]
            engine.step(FREE_STEPS)
            state = engine.read()
        final = float(state.velocity[0, 0])
        if not abs(final - speed) <= ALLOWED * speed:
            return ProbeReading(final, speed, ALLOWED * speed, departure=Departure.SPEED)
        paths.append(float(state.position[0, 0] - start) / (FREE_STEPS * dt))
    worst = max(paths, key=lambda path: abs(path - speed))
    by_step = abs(paths[0] * DT - paths[1] * COARSER) <= ALLOWED * abs(paths[0]) * DT
    law = Departure.DT_IGNORED if by_step and paths[0] else Departure.PATH
    return ProbeReading(worst, speed, ALLOWED * speed, departure=law)


def gravity_is_stated(row: EngineRow) -> ProbeReading:
    """The acceleration of a disk from rest by its velocity, in m/s2, at two dt: without gravity,
    then under one to the side, or straight down if that is refused."""
    with loaded(row, free_disk()) as engine:
        engine.step(FREE_STEPS)
        drift = float(np.hypot(*engine.read().velocity[0])) / (FREE_STEPS * DT)
    bound = ALLOWED * GRAVITY
    if not drift <= bound:
        return ProbeReading(drift, 0.0, bound, departure=Departure.GRAVITY_UNSTATED)
    scenes = [free_disk(gravity=np.multiply(GRAVITY, way)) for way in ((0.6, -0.8), (0.0, -1.0))]
    read = []
    for dt in (DT, COARSER):
        with closing(row.make()) as engine:
            stated = load_first(engine, scenes, dt).gravity
            engine.step(FREE_STEPS)
            read.append(engine.read().velocity[0] / (FREE_STEPS * dt))
    worst = max(read, key=lambda vector: float(np.hypot(*(vector - stated))))
    size = float(np.hypot(*worst))
    if np.hypot(*(worst - stated)) <= bound:
        return ProbeReading(size, GRAVITY, bound)
    if size <= bound:
        law = Departure.GRAVITY_ABSENT
    elif np.hypot(*(read[0] * DT - read[1] * COARSER)) <= ALLOWED * np.hypot(*read[0]) * DT:
        law = Departure.DT_IGNORED
    elif worst[1] > bound:
        law = Departure.GRAVITY_UPWARD
    elif abs(worst[0] * stated[1] - worst[1] * stated[0]) > bound * size:
        law = Departure.GRAVITY_DIRECTION
    else:
        law = Departure.GRAVITY_SIZE
    got, expected = (f"({x:.3g}, {y:.3g})" for x, y in (worst, stated))
    return ProbeReading(got, expected, departure=law)


def pair(
    e: float, phase: float, masses: Sequence[float] = (1, 1), speed: float = 10.0, turn: float = 0.0
) -> list[Impact]:
    """A disk strikes one at rest, along x; the line of centres is `turn` rad off."""
    normal, velocity = np.array([np.cos(turn), np.sin(turn)]), np.array([speed, 0.0])
    scene = scene_of(
        e,
        position=np.stack([-normal - velocity * DT * (4 + phase), np.zeros(2)]),
        velocity=np.stack([velocity, np.zeros(2)]),
        radius=[0.5, 0.5],
        mass=masses,
    )
    return [(scene, normal)]


def wall(e: float, phase: float) -> list[Impact]:
    """A disk strikes an upright wall at 10 m/s and slides at 6 m/s; or a floor at y = 0."""
    impacts = []
    for normal, along in (((1.0, 0.0), (0.0, 1.0)), ((0.0, -1.0), (1.0, 0.0))):
        n, t = np.array(normal), np.array(along)
        velocity = 10.0 * n + 6.0 * t
        scene = scene_of(
            e,
            position=[-0.5 * n - velocity * DT * (4 + phase)],
            velocity=[velocity],
            radius=[0.5],
            mass=[7.3],
            walls=[[-20 * t, 20 * t]],
        )
        impacts.append((scene, n))
    return impacts


def strike(row: EngineRow, impacts: Sequence[Impact]) -> tuple[Array, Array, Array]:
    """The direction of the impulse, and the velocity of disk 0 relative to what it strikes, before
    and after, in the first of these scenes that is not refused."""
    with closing(row.make()) as engine:
        played = load_first(engine, [scene for scene, _ in impacts], DT)
        before = engine.read().velocity
        engine.step(STEPS)
        after = engine.read().velocity
    normal = next(normal for scene, normal in impacts if scene is played)
    return normal, before[0] - before[1:].sum(axis=0), after[0] - after[1:].sum(axis=0)


def restitution_is_stated(
    row: EngineRow,
    impacts: Sequence[Callable[[float, float], list[Impact]]],
    laws: Sequence[Departure],
) -> ProbeReading:
    """Separation over approach speed, at the phase that is farthest from the stated e; `laws`: of
    disks that stick, that pass through, and of another e in each of `impacts`."""
    sticks, passes, *wrong = laws
    kept: ProbeReading | None = None
    for (impact, law), e in product(zip(impacts, wrong), (EXERCISE, 0.5)):
        try:
            strikes = [strike(row, impact(e, phase)) for phase in PHASES]
        except Unsupported:
            if kept is None:
                raise
            continue  # a solver may have one e
        values = [float(-(after @ n) / (before @ n)) for n, before, after in strikes]
        worst = max(values, key=lambda value: abs(value - e))
        off = sum(not abs(value - e) <= ALLOWED for value in values)
        found = sticks if abs(worst) <= ALLOWED else passes if abs(worst + 1) <= ALLOWED else law
        note = f"at {off} of {len(PHASES)} phases of a step" if 0 < off < len(PHASES) else ""
        reading = ProbeReading(worst, e, ALLOWED, note, found)
        if off:
            return reading
        kept = kept or reading
    assert kept is not None
    return kept


def impulse_is_normal(
    row: EngineRow,
    impact: Callable[[float, float], list[Impact]],
    passes: Departure,
    law: Departure,
) -> ProbeReading:
    """The share of an impulse across the normal, at the worst phase: 0 without friction."""
    shares = []
    for phase in PHASES:
        normal, before, after = strike(row, impact(EXERCISE, phase))
        change = after - before
        size = float(np.hypot(*change))
        if size <= ALLOWED:
            return ProbeReading("no collision", 0.0, departure=passes)
        shares.append(float(abs(change[0] * normal[1] - change[1] * normal[0])) / size)
    return ProbeReading(max(shares), 0.0, TURNED, departure=law)


_Law = partial(Probe, failure="departs")
UNEQUAL = partial(pair, masses=(1, 7))
LAWS: dict[str, Probe] = {
    "dt_is_obeyed": _Law("How fast is a free disk of 1.5 m/s, at two dt? (m/s)", dt_is_obeyed),
    "gravity_is_stated": _Law(
        "How large is the acceleration under 4 m/s2, at two dt? (m/s2)", gravity_is_stated
    ),
    "pair_keeps_e": _Law(
        "What is e of a pair that closes at 10 m/s, where 0.9 or 0.5 is stated?",
        partial(
            restitution_is_stated,
            impacts=(pair, UNEQUAL),
            laws=(
                Departure.STICKS,
                Departure.PASSES,
                Departure.RESTITUTION,
                Departure.RESTITUTION_BY_MASS,
            ),
        ),
    ),
    "off_centre_is_normal": _Law(
        "Which share of the impulse of an off-centre collision is tangential?",
        partial(
            impulse_is_normal,
            impact=partial(UNEQUAL, speed=2.0, turn=OBLIQUE),
            passes=Departure.PASSES,
            law=Departure.TANGENTIAL,
        ),
    ),
    "wall_keeps_e": _Law(
        "What is e of a wall collision at 10 m/s, where 0.9 or 0.5 is stated?",
        partial(
            restitution_is_stated,
            impacts=(wall,),
            laws=(Departure.WALL_STICKS, Departure.WALL_PASSES, Departure.WALL_RESTITUTION),
        ),
    ),
    "wall_is_normal": _Law(
        "Which share of the impulse of a slanting wall collision is tangential?",
        partial(
            impulse_is_normal,
            impact=wall,
            passes=Departure.WALL_PASSES,
            law=Departure.WALL_TANGENTIAL,
        ),
    ),
}
