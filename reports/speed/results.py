"""All tables of a measurement in one place, for the page and for the files."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from crosscheck2d.reports.compare.accuracy import pooled
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.timing import Noise, noise_of
from crosscheck2d.reports.speed import budget, tables
from crosscheck2d.reports.speed.measure import Measured
from crosscheck2d.reports.speed.plan import SpeedPlan

TABLES = ["pooled", "orders", "reached", "sizes", "pile", "options", "driving", "bindings"]
TABLES += ["noise", "models", "sweeps", "explained", "versus"]
QUIET = 0.05  # how far from 1 the middle half of an engine against itself may read


@dataclass
class Results:
    """What was measured, which must be an error at least, and the tables made from it.

    Attributes, beside the tables that a function of `tables` of the same name describes:
        asks: scenario -> its question, for the measured scenarios in the order in which they were
            asked for.
        points: as of `tables`; and idle, what as many steps cost where there is nothing to do, µs
            per simulated s.
        pooled: see `pooling.pooled`; of scenes without friction, as is `pooled_reached`, unless
            every scene has friction.
        versus, models, explained: see `tables.against_own`, `tables.cheapest_models`,
            `budget.explain`.
    """

    plan: SpeedPlan
    measured: Measured

    def __post_init__(self) -> None:
        measured, seed = self.measured, self.plan.seed
        scenarios = [open_scene(scene, seed) for scene in self.plan.scenes]
        asked = {scenario.name: scenario for scenario in scenarios}
        self.bindings = tables.bindings(measured)
        self.driving = tables.driving(self.bindings)
        points = tables.points(measured, seed)
        self.points = points.assign(idle=tables.idle(self.bindings, points, asked))
        self.asks = {name: asked[name].asks for name in asked if name in {*points.scenario}}
        self.orders = tables.orders(measured, seed)
        self.reached = tables.reached(self.points, self.orders)
        rough = [scenario.name for scenario in scenarios if scenario.scene.friction]
        if set(rough) >= set(self.asks):
            rough = []
        smooth = self.reached[~self.reached.scenario.isin(rough)]
        self.pooled = pooled(self.points[~self.points.scenario.isin(rough)])
        self.pooled_reached = tables.pooled_reached(smooth, self.reached)
        self.sizes = tables.sizes(measured)
        self.growth = tables.growth(self.sizes, measured.stopped)
        self.pile = tables.pile(measured)
        self.sweeps = tables.sweeps(measured, seed)
        self.pooled_sweeps = tables.pooled_sweeps(self.sweeps)
        self.options = tables.options(measured)
        self.versus = tables.against_own(self.points, self.options)
        self.models = tables.cheapest_models(measured.truths, self.points)
        self.explained = budget.explain(measured.budget)
        self.noise = tables.noise(measured)

    @property
    def scenes(self) -> list[str]:
        return list(self.asks)

    def noise_floor(self, scene: str = "") -> Noise:
        # of an engine against itself, in one scene or in all
        ratios = self.noise[self.noise.scenario == scene].ratio if scene else self.noise.ratio
        return noise_of(ratios.to_numpy(float))

    @property
    def noise_sentence(self) -> str:
        noise = self.noise_floor()
        if not noise.pairs:
            return "No engine was timed against itself, so the noise floor is not known."
        sentence = (
            "Noise floor: the time of an engine over its own time again, in the same rounds, is"
            f" {noise.median:.3f}; for half of {noise.pairs} pairs it is from {noise.low:.3f} to"
            f" {noise.high:.3f}, at worst {noise.least:.3f} and {noise.most:.3f}."
        )
        if noise.floor > QUIET:
            sentence += (
                f" It must stay between {1 - QUIET:g} and {1 + QUIET:g}: differences of time below"
                " this floor mean nothing. Measure again while nothing else runs before you quote"
                " a time."
            )
        return sentence

    @property
    def files(self) -> dict[str, pd.DataFrame]:
        measured = ("samples", "errors", "budget")
        tables = {"speed": self.points} | {f"speed_{name}": getattr(self, name) for name in TABLES}
        tables |= {f"speed_{name}": getattr(self.measured, name) for name in measured}
        return {f"{name}.csv": table for name, table in tables.items()}
