"""Two parameters at once: a grid for every engine of how its reading depends on both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from math import isfinite, nan
from typing import Any

from crosscheck2d.adapters.engines import ENGINES, changed
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.stability.cases_gas import gas
from crosscheck2d.reports.stability.cases_stacks import column
from crosscheck2d.reports.stability.predicates import RESTITUTION_OFF, Predicate, judge
from crosscheck2d.reports.stability.predicates_crowds import STANDS
from crosscheck2d.reports.stability.predicates_gas import ENERGY_DRIFTS
from crosscheck2d.reports.stability.scenes import flyby
from crosscheck2d.reports.stability.variants import play_as
from crosscheck2d.scenarios.model import Scenario


@dataclass(frozen=True)
class Map:
    """A question with two parameters.

    Attributes:
        asks: the question in one sentence.
        x_name, y_name, x, y: the parameters with their units, and their values.
        scene: (x, y, number of the run) -> the scenario.
        predicate: what is read; the worst of `runs` is shown.
        only: engines that have the parameter; empty: all.
        play: (engine, scenario, x, y) -> the run.
    """

    name: str
    asks: str
    x_name: str
    y_name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    scene: Callable[[float, float, int], Scenario]
    predicate: Predicate
    runs: int = 2
    only: tuple[str, ...] = ()
    play: Callable[[str, Scenario, float, float], Run] = lambda engine, scenario, _x, _y: play_as(
        engine, scenario
    )

    def engines(self, asked: Sequence[str]) -> list[str]:
        """Those asked for that have both parameters."""
        return [name for name in asked if name in (self.only or ENGINES)]


@dataclass(frozen=True)
class MapOf:
    """A map on one engine: rows (x, y, worst reading, whether a run failed, the id of its verdict,
    what happened), and the processor time in s that it took."""

    name: str
    engine: str
    cells: tuple[tuple[float, float, float, bool, str, str], ...]
    status: str = "ok"
    seconds: float = nan

    @staticmethod
    def from_record(record: dict[str, Any]) -> MapOf:
        """From the value of its row."""
        cells = tuple((x, y, float(value), *failure) for x, y, value, *failure in record["cells"])
        return MapOf(record["name"], record["engine"], cells, record["status"])


def map_of(name: str, engine: str) -> MapOf:
    """Play a map's grid on an engine."""
    grid, cells = MAPS[name], []
    for x, y in product(grid.x, grid.y):
        scenarios = [grid.scene(x, y, run) for run in range(grid.runs)]
        verdicts = [judge(grid.predicate, s, grid.play(engine, s, x, y)) for s in scenarios]
        worst = max((v.value for v in verdicts if isfinite(v.value)), default=nan)
        first = next(((True, v.id, v.text) for v in verdicts if v.failed), (False, "", ""))
        cells.append((x, y, worst, *first))
    return MapOf(name, engine, tuple(cells))


def with_iterations(engine: str, scenario: Scenario, _ratio: float, count: float) -> Run:
    """Play with this many iterations, or substeps if the engine has those instead."""
    work = ENGINES[engine].work
    assert work is not None
    return play_once(
        partial(changed, engine, **{work.setting: int(count)}), engine, scenario, scenario.dt(1)
    )


def collision_at(x: float, y: float, run: int) -> Scenario:
    """x = dt over 1/64 s, y = closing speed in m/s. A change of the unit of time alone would
    give the scene of `flyby`."""
    return flyby(y, run, dt=x / 64)


COLLISIONS_X = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0, 8.0)
COLLISIONS_Y = (0.01, 0.1, 0.5, 2.0, 8.0, 32.0, 128.0, 512.0)

MASSES, COUNTS = (
    (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4),
    (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0),
)
PACKINGS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75)
MOVES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
GRIDS = (
    Map(
        "dt_and_speed",
        "Is a head-on collision of disks of 0.25 m at e = 1 elastic, whatever the step and the"
        " speed?",
        "dt (1/64 s)",
        "closing speed (m/s)",
        COLLISIONS_X,
        COLLISIONS_Y,
        collision_at,
        RESTITUTION_OFF,
    ),
    Map(
        "mass_ratio_and_iterations",
        "How many iterations does a heavy disk need that stands on a light one?",
        "m2 / m1",
        "iterations (Box2D 3.1: substeps)",
        MASSES,
        COUNTS,
        lambda x, _y, _run: column(2, [1.0, x]),
        STANDS,
        runs=1,
        only=tuple(name for name, row in ENGINES.items() if row.work),
        play=with_iterations,
    ),
    Map(
        "packing_and_dt",
        "How much energy does a gas of 36 disks lose or gain in 100 steps?",
        "packing",
        "v dt / R",
        PACKINGS,
        MOVES,
        lambda x, y, run: gas(x, run, steps=100, step=y),
        ENERGY_DRIFTS,
        runs=1,
    ),
)
MAPS = {grid.name: grid for grid in GRIDS}
