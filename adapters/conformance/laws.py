"""The probes of the laws, which any solver of these scenes keeps: dt, gravity, the stated e and the
direction of an impulse. A reading names the law that is broken.

A hundredth is allowed, whatever the number format: a velocity that is read half a step off differs
by dt / (2 t), which is 0.2 % here. e is read at 10 m/s, ten times the largest threshold that an
engine documents, and at several phases of a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.conformance.probe import (
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
from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.scenarios.model import Array, Scene

ALLOWED = 0.01  # of what is expected
# The line of centres of a pair turns by v dt / (2 r) = 0.004 a step; springs touch for a dozen.
TURNED = 0.05
FREE_STEPS, STEPS = 256, 64  # of a free disk; of a collision: disks that stick end at rest
COARSER = 0.01  # s, beside DT
# Of a step, at which a collision happens; negative: the pair is turned by half a turn.
PHASES = (1 / 16, -1 / 4, 1 / 2, -3 / 4)
SPEEDS = (1.5, 10.0)  # m/s, of a free disk; the second is that of the collisions
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
    for speed in SPEEDS:
        paths = []
        for dt in (DT, COARSER):
            with loaded(row, one_disk((speed, 0.0)), dt=dt) as engine:
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
        reading = ProbeReading(worst, speed, ALLOWED * speed, departure=law)
        if not reading.kept:
            break
    return reading


def gravity_is_stated(row: EngineRow) -> ProbeReading:
    """The acceleration of a disk from rest by its velocity, in m/s2, at two dt: without gravity,
    then under one to the side, or straight down if that is refused."""
    still, bound = replace(one_disk(), restitution=EXERCISE), ALLOWED * GRAVITY
    with loaded(row, still) as engine:
        engine.step(FREE_STEPS)
        drift = float(np.hypot(*engine.read().velocity[0])) / (FREE_STEPS * DT)
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
        with loaded(
            row, replace(one_disk(), gravity=stated, velocity=np.array([[SPEEDS[0], 0.0]]))
        ) as engine:
            engine.step(FREE_STEPS)
            falls = float(np.hypot(*(engine.read().velocity[0] - [SPEEDS[0], 0.0]))) > bound
        law = Departure.GRAVITY_AT_REST if falls else Departure.GRAVITY_ABSENT
    elif np.hypot(*(read[0] * DT - read[1] * COARSER)) <= ALLOWED * np.hypot(*read[0]) * DT:
        law = Departure.DT_IGNORED
    else:
        law = Departure.GRAVITY_UPWARD if worst[1] > bound else Departure.GRAVITY
    got, expected = (f"({x:.3g}, {y:.3g})" for x, y in (worst, stated))
    return ProbeReading(got, expected, departure=law)


def scene_before(impact: Impact, way: int, boxed: bool, phase: float, e: float) -> Scene:
    """The scene of an impact, four steps and `phase` of one before it; `boxed`: the wall is one of
    four around the disk."""
    k = len(impact.masses)
    normal, velocity = turn(impact, phase) * np.asarray(impact.ways[way])
    start, along = -normal / 2 - velocity * DT * (4 + abs(phase)), np.array([-normal[1], normal[0]])
    a, b, c, d = (20 * (i * along - j * normal) for i, j in ((-1, 0), (1, 0), (1, 1), (-1, 1)))
    box = [[a, b], [b, c], [c, d], [d, a]]
    fields: dict[str, Any] = {} if k > 1 else {"walls": box if boxed else box[:1]}
    return scene_of(
        e,
        position=np.stack([start, normal / 2])[:k],
        velocity=np.stack([velocity, np.zeros(2)])[:k],
        radius=[0.5] * k,
        mass=impact.masses,
        **fields,
    )


def turn(impact: Impact, phase: float) -> float:
    # The sign of the impact's directions at a phase: a wall is never turned.
    return -1.0 if phase < 0 and len(impact.masses) > 1 else 1.0


def strikes(row: EngineRow, impact: Impact, e: float) -> list[tuple[Array, Array, Array]]:
    """For each phase: the direction of the impulse, and the velocity of disk 0 relative to what it
    strikes, before and after."""
    seen = []
    for phase in PHASES:
        kinds = list(product(range(len(impact.ways)), (True, False)))
        scenes = [scene_before(impact, *kind, phase, e) for kind in kinds]
        with closing(row.make()) as engine:
            played = load_first(engine, scenes, DT)
            before = engine.read().velocity
            engine.step(STEPS)
            after = engine.read().velocity
        way, _ = kinds[[scene is played for scene in scenes].index(True)]
        normal = turn(impact, phase) * np.asarray(impact.ways[way][0])
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
    "dt_is_obeyed": Probe(
        "How fast is a free disk of 1.5 or 10 m/s, at two dt? (m/s)", dt_is_obeyed, "departs"
    ),
    "gravity_is_stated": Probe(
        "What is the acceleration under 4 m/s2, at two dt? (m/s2)", gravity_is_stated, "departs"
    ),
    "pair_keeps_e": Probe(
        "What is e of a pair that closes at 10 m/s, where 0.9 or 0.5 is stated?",
        partial(e_is_stated, impacts=(EQUAL, UNEQUAL)),
        "departs",
    ),
    "off_centre_is_normal": Probe(
        "Which share of the impulse of an off-centre collision is tangential?",
        partial(impulse_is_normal, impact=OFF_CENTRE),
        "departs",
    ),
    "wall_keeps_e": Probe(
        "What is e of a wall collision at 10 m/s, where 0.9 or 0.5 is stated?",
        partial(e_is_stated, impacts=(WALL,)),
        "departs",
    ),
    "wall_is_normal": Probe(
        "Which share of the impulse of a slanting wall collision is tangential?",
        partial(impulse_is_normal, impact=WALL),
        "departs",
    ),
}
