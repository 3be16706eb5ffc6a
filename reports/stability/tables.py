"""Tables that are no limits: how a reading depends on two parameters at once, and which law an
engine follows in a collision with touching disks.

That law is named, never scored: for touching disks the limit of small gaps does not decide between
the laws; with gaps the exact answer does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import product
from math import ceil, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import ENGINES, changed
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.stability.cases import OF_MAPS, PREDICATES
from crosscheck2d.reports.stability.cases_few import LEAD, RADIUS, flyby
from crosscheck2d.reports.stability.cases_many import column, gas
from crosscheck2d.reports.stability.limits import DrivenEngine, play_as, played
from crosscheck2d.reports.stability.predicates import (
    REFUSED,
    Predicate,
    judge,
)
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario
from crosscheck2d.scenarios.truth.exact import with_oracle


class Map(NamedTuple):
    """A question with two parameters."""

    asks: str  # in one sentence
    x_name: str  # with its unit
    y_name: str
    x: Sequence[float]
    y: Sequence[float]
    scene: Callable[[float, float, int], Scenario]  # of x, y and the number of the run
    predicate: Predicate  # the worst of its readings is shown
    runs: int = 1
    # engine, scenario, y -> the run, where y is a parameter of engines; only those with it play
    play: Callable[[str, Scenario, float], Run] | None = None


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
        runs = [grid.play(engine, s, y) if grid.play else play_as(engine, s) for s in scenarios]
        verdicts = [judge(grid.predicate, *pair) for pair in zip(scenarios, runs)]
        worst = max((v.value for v in verdicts if isfinite(v.value)), default=nan)
        first = next(((True, v.id, v.text) for v in verdicts if v.failed), (False, "", ""))
        cells.append((x, y, worst, *first))
    return MapOf(name, engine, tuple(cells))


def with_iterations(engine: str, scenario: Scenario, count: float) -> Run:
    work = ENGINES[engine].work
    assert work is not None
    make = partial(changed, engine, **{work.setting: int(count)})
    return played(DrivenEngine(engine, make), scenario)


# a change of the unit of time alone would give the scene of `flyby`
MAP_SCENES: dict[str, Callable[[float, float, int], Scenario]] = {
    "dt_and_speed": lambda x, y, run: flyby(y, run, dt=x / 64),
    "mass_ratio_and_iterations": lambda x, _y, _run: column(2, [1.0, x]),
    "packing_and_dt": lambda x, y, run: gas(x, run, steps=100, step=y),
}
MAP_PLAYS = {"mass_ratio_and_iterations": with_iterations}
MAPS = {
    name: Map(
        **{key: value for key, value in row.items() if key != "fails"},
        scene=MAP_SCENES[name],
        predicate=PREDICATES[row["fails"]],
        play=MAP_PLAYS.get(name),
    )
    for name, row in OF_MAPS.items()
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
    """A scene at e = 1 in which disk 0 strikes disks that touch each other."""

    asks: str  # what happens, in a sentence
    position: Array  # (n, 2) radii, all touching; disk 0 comes in along x at speed 1
    displaced: Array  # (n, 2) by how much a disk is moved for each radius of gap
    # name -> velocities (n, 2) in units of the incoming speed; several where the order is free
    laws: Laws
    source: str  # of the laws


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
    scene = lay_out(position, [[SPEED, 0], *np.zeros((len(position) - 1, 2))])
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
            results.append(nearest_law(velocity, gap, answers(name, gap)))
    return LawOf(name, engine, tuple(results))


def nearest_law(velocity: Array, gap: float, laws: Laws) -> AtGap:
    off = {law: min(float(np.abs(velocity - v).max()) for v in vs) for law, vs in laws.items()}
    law = min(off, key=off.__getitem__)
    momentum = float(np.linalg.norm(velocity.sum(axis=0) - [1, 0]))
    rows = tuple((float(x), float(y)) for x, y in velocity)
    name = law if off[law] <= NEAR else "none"
    return AtGap(gap, name, off[law], momentum, float((velocity**2).sum()), rows)
