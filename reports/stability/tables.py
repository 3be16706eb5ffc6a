"""Tables that are no limits: how a reading depends on two parameters at once, and which law an
engine follows in a collision with touching disks.

That law is named, never scored: for touching disks the limit of small gaps does not decide between
the laws; with gaps the exact answer does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from math import ceil, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import ENGINES, changed
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.stability.cases_few import LEAD, RADIUS, disks, flyby
from crosscheck2d.reports.stability.cases_many import column, gas
from crosscheck2d.reports.stability.limits import play_as
from crosscheck2d.reports.stability.predicates import (
    REFUSED,
    RESTITUTION_OFF,
    STANDS,
    Predicate,
    judge,
)
from crosscheck2d.reports.stability.predicates_gas import ENERGY_DRIFTS
from crosscheck2d.scenarios.model import Array, Scenario
from crosscheck2d.scenarios.truth.exact import with_oracle


class Map(NamedTuple):
    """A question with two parameters.

    Attributes:
        asks: the question in one sentence.
        x_name, y_name, x, y: the parameters with their units, and their values.
        scene: (x, y, number of the run) -> the scenario.
        predicate: what is read; the worst of `runs` is shown.
        only: engines that have the parameter; empty: all.
        play: (engine, scenario, y) -> the run.
    """

    asks: str
    x_name: str
    y_name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    scene: Callable[[float, float, int], Scenario]
    predicate: Predicate
    runs: int = 1
    only: tuple[str, ...] = ()
    play: Callable[[str, Scenario, float], Run] = lambda engine, scenario, _y: play_as(
        engine, scenario
    )


@dataclass(frozen=True)
class MapOf:
    name: str
    engine: str
    # x, y, worst reading, whether a run failed, the id of its verdict, what happened
    cells: tuple[tuple[float, float, float, bool, str, str], ...]
    status: str = "ok"


def map_of(name: str, engine: str) -> MapOf:
    grid, cells = MAPS[name], []
    for x, y in product(grid.x, grid.y):
        scenarios = [grid.scene(x, y, run) for run in range(grid.runs)]
        verdicts = [judge(grid.predicate, s, grid.play(engine, s, y)) for s in scenarios]
        worst = max((v.value for v in verdicts if isfinite(v.value)), default=nan)
        first = next(((True, v.id, v.text) for v in verdicts if v.failed), (False, "", ""))
        cells.append((x, y, worst, *first))
    return MapOf(name, engine, tuple(cells))


def with_iterations(engine: str, scenario: Scenario, count: float) -> Run:
    work = ENGINES[engine].work
    assert work is not None
    make = partial(changed, engine, **{work.setting: int(count)})
    return play_once(make, engine, scenario, scenario.dt(1))


MAPS = {
    "dt_and_speed": Map(
        "Is a head-on collision of disks of 0.25 m at e = 1 elastic, whatever the step and the"
        " speed?",
        "dt (1/64 s)",
        "closing speed (m/s)",
        (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0, 8.0),
        (0.01, 0.1, 0.5, 2.0, 8.0, 32.0, 128.0, 512.0),
        # a change of the unit of time alone would give the scene of `flyby`
        lambda x, y, run: flyby(y, run, dt=x / 64),
        RESTITUTION_OFF,
        runs=2,
    ),
    "mass_ratio_and_iterations": Map(
        "How many iterations does a heavy disk need that stands on a light one?",
        "m2 / m1",
        "iterations (Box2D 3.1: substeps)",
        (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4),
        (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0),
        lambda x, _y, _run: column(2, [1.0, x]),
        STANDS,
        only=tuple(name for name, row in ENGINES.items() if row.work),
        play=with_iterations,
    ),
    "packing_and_dt": Map(
        "How much energy does a gas of 36 disks lose or gain in 100 steps?",
        "packing",
        "v dt / R",
        (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75),
        (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0),
        lambda x, y, run: gas(x, run, steps=100, step=y),
        ENERGY_DRIFTS,
    ),
}


# of the incoming speed; an engine whose velocities differ by more from every law follows none
NEAR = 0.02
# m/s, s: a radius in 32 steps, as a late detection tilts the normal; above any threshold
SPEED, DT = 8.0, 1 / 1024
AFTER = 24  # steps after the collision: an engine may need a step for each contact
PAIRS, AT_ONCE = "pair after pair", "all contacts at once"
GAPS = (0.0, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0)  # radii
Laws = dict[str, list[Array]]


class Touching(NamedTuple):
    """A scene at e = 1 in which disk 0 strikes disks that touch each other.

    Attributes:
        asks: what happens, in a sentence.
        position: (n, 2) in radii, all touching; disk 0 comes in along x at speed 1.
        displaced: (n, 2) by how much a disk is moved for each radius of gap.
        laws: name -> velocities (n, 2) in units of the incoming speed; several where the order is
            free.
        source: of the laws.
    """

    asks: str
    position: Array
    displaced: Array
    laws: Laws
    source: str


class AtGap(NamedTuple):
    gap: float  # radii
    law: str  # the nearest, "none" if all are farther off than `NEAR`
    off: float = nan  # from that law, over the incoming speed
    momentum: float = nan  # its change, over the initial momentum
    energy: float = nan  # over the initial energy
    velocity: tuple[tuple[float, float], ...] = ()  # of the disks, over the incoming speed


@dataclass(frozen=True)
class LawOf:
    name: str
    engine: str
    gaps: tuple[AtGap, ...]
    status: str = "ok"


def cradle(n: int) -> Touching:
    row = np.stack([2.0 * np.arange(n) - 2, np.zeros(n)], axis=-1)
    apart = np.stack([np.maximum(0.0, np.arange(n) - 1), np.zeros(n)], axis=-1)
    last, together = np.zeros((n, 2)), np.zeros((n, 2))
    last[-1, 0] = 1.0
    together[:, 0] = 2 / n
    together[0, 0] -= 1
    source = "equal masses swap velocities pair by pair; or e = 1 holds for every contact in one"
    laws = {PAIRS: [last], AT_ONCE: [together]}
    return Touching(f"A disk strikes a row of {n - 1}.", row, apart, laws, f"{source} solve")


BREAK = np.array([[-1 / 8, -sqrt(3) / 8], [3 / 4, sqrt(3) / 4], [3 / 8, -sqrt(3) / 8]])
MIRRORED = BREAK[[0, 2, 1]] * [1, -1]
TOUCHING = {
    "touching_cradle_of_3": cradle(3),
    "touching_cradle_of_5": cradle(5),
    "touching_break": Touching(
        "A disk strikes two, in their middle.",
        np.array([[-sqrt(3), 0], [0, 1], [0, -1]]),
        np.array([[0.0, 0], [0, 0], [sqrt(3) / 2, -1 / 2]]),
        {
            PAIRS: [BREAK, MIRRORED],
            AT_ONCE: [np.array([[-1 / 5, 0], [3 / 5, sqrt(3) / 5], [3 / 5, -sqrt(3) / 5]])],
        },
        "the two limits of small gaps; or e = 1 holds for every contact in one solve",
    ),
}


def scene_of(touching: Touching, gap: float) -> Scenario:
    """Disk 0 flies in and arrives in the middle of its fourth step; the scene lasts until long
    after the last collision."""
    position = (touching.position + gap * touching.displaced) * RADIUS
    position[0, 0] -= SPEED * DT * (LEAD + 0.5)
    scene = disks(position, [[SPEED, 0], *np.zeros((len(position) - 1, 2))])
    crossing = 4 * gap * RADIUS / (SPEED * DT)  # steps: four gaps, or one at a quarter of the speed
    steps = LEAD + 1 + AFTER + ceil(crossing)
    return Scenario("touching", touching.asks, touching.source, scene, steps * DT, DT, (1,))


@cache
def answers(name: str, gap: float) -> Laws:
    """Law -> the velocities (n, 2) that it allows; if the disks do not touch, the exact answer
    is pair after pair."""
    touching = TOUCHING[name]
    if gap == 0:
        return touching.laws
    scenario = with_oracle(scene_of(touching, gap))
    assert scenario.truth is not None
    return touching.laws | {PAIRS: [scenario.truth(scenario.times).velocity[-1] / SPEED]}


def law_of(name: str, engine: str, gaps: tuple[float, ...] = GAPS) -> LawOf:
    results = []
    for gap in gaps:
        run = play_as(engine, scene_of(TOUCHING[name], gap))
        if run.status != "ok" or run.trajectory is None:
            results.append(AtGap(gap, REFUSED if run.status == "unsupported" else run.status))
        else:
            velocity = run.trajectory.velocity[-1] / SPEED
            results.append(named(velocity, gap, answers(name, gap)))
    return LawOf(name, engine, tuple(results))


def named(velocity: Array, gap: float, laws: Laws) -> AtGap:
    off = {law: min(np.abs(velocity - v).max() for v in vs) for law, vs in laws.items()}
    nearest = min(off, key=lambda law: float(off[law]))
    momentum = float(np.linalg.norm(velocity.sum(axis=0) - [1, 0]))
    rows = tuple((float(x), float(y)) for x, y in velocity)
    law = nearest if off[nearest] <= NEAR else "none"
    return AtGap(gap, law, float(off[nearest]), momentum, float((velocity**2).sum()), rows)
