"""All tables of a measurement in one place, for the page and for the files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from reports.compare.pareto import (
    ACCURACIES,
    FAILED,
    NOT_TIMED,
    UNREACHABLE,
    paired_cost,
    yardstick_of,
)
from reports.compare.pooling import POOLED, pooled
from reports.run.scenes import open_scene
from reports.run.timing import Noise, noise_of
from reports.speed import cheapest, explained, tables, versus
from reports.speed.measure import Measured
from reports.speed.plan import SpeedPlan
from reports.terminal.foreign_text import put_text
from scenarios.model import Scenario

NOT_GOT = {"never": UNREACHABLE, "failed": FAILED, "untimed": NOT_TIMED}  # how it is counted -> why
QUIET = 0.05  # how far from 1 the middle half of an engine against itself may read


@dataclass
class Results:
    """What was measured, and the tables made from it on demand."""

    plan: SpeedPlan
    measured: Measured

    @property
    def names(self) -> list[str]:
        """`engine:profile` of every engine, in the order of `ENGINES`."""
        return list(self.plan.engines)

    @property
    def left_out(self) -> list[tuple[str, str]]:
        """(what, why) of what could not be measured."""
        return self.measured.left_out

    @cached_property
    def asked(self) -> dict[str, Scenario]:
        """The scenarios that were asked for, by name."""
        opened = [open_scene(scene, self.plan.seed) for scene in self.plan.scenes]
        return {scenario.name: scenario for scenario in opened}

    @cached_property
    def asks(self) -> dict[str, str]:
        """Scenario -> its question, for the measured scenarios in the order in which they were
        asked for."""
        measured = set(self.points.scenario)
        return {name: one.asks for name, one in self.asked.items() if name in measured}

    @property
    def scenes(self) -> list[str]:
        """The measured scenarios."""
        return list(self.asks)

    @cached_property
    def points(self) -> pd.DataFrame:
        """See `tables.points`; and idle, what as many steps cost where there is nothing to do, µs
        per simulated s."""
        points = tables.points(self.measured, self.plan.seed)
        return points.assign(idle=tables.idle(self.bindings, points, self.asked))

    @cached_property
    def orders(self) -> pd.DataFrame:
        """See `tables.orders`."""
        return tables.orders(self.measured, self.plan.seed)

    @cached_property
    def reached(self) -> pd.DataFrame:
        """See `tables.reached`."""
        return tables.reached(self.points, self.orders)

    def poolable(self, table: pd.DataFrame) -> pd.DataFrame:
        """The rows of scenes without friction, which alone are pooled; all rows if every scene
        has friction."""
        rough = table.scenario.isin(
            [name for name, one in self.asked.items() if one.scene.friction]
        )
        return table if rough.all() else table[~rough]

    @cached_property
    def pooled(self) -> pd.DataFrame:
        """See `pooling.pooled`; of the `poolable` rows."""
        return pooled(self.poolable(self.points))

    @cached_property
    def sweeps(self) -> pd.DataFrame:
        """See `tables.sweeps`."""
        return tables.sweeps(self.measured, self.plan.seed)

    @cached_property
    def pooled_sweeps(self) -> pd.DataFrame:
        """See `tables.pooled_sweeps`."""
        return tables.pooled_sweeps(self.sweeps)

    @cached_property
    def pooled_reached(self) -> pd.DataFrame:
        """As `reached`, one cost for all scenarios where an engine gets there in more than half of
        them: `paired_cost`, and how many do and do not.

        A median over all of them would be that of other scenarios for each engine; with many out
        of reach, of the dearest. Columns besides: of, how many scenarios; got, in how many it gets
        there; never, at no dt; failed; untimed; in the others it does not down to the finest dt.
        lost: half or more are never or failed.
        """
        rows = []
        own = yardstick_of(self.reached)
        for (engine, profile, accuracy), group in self.poolable(self.reached).groupby(
            ["engine", "profile", "accuracy"], sort=False
        ):
            got = int(group.cost.notna().sum())
            others = {name: int((group.why == why).sum()) for name, why in NOT_GOT.items()}
            said = [f"{got} of {len(group)}"]
            said += [f"{name} in {count}" for name, count in others.items() if count]
            most = 2 * got > len(group)
            rows.append(
                {
                    "scenario": POOLED,
                    "engine": engine,
                    "profile": profile,
                    "accuracy": accuracy,
                    "cost": paired_cost(group, own[own.accuracy == accuracy]) if most else np.nan,
                    "dt_s": np.nan,
                    "why": ", ".join(said),
                    "lost": 2 * int(group.lost.sum()) >= len(group),
                    "of": len(group),
                    "got": got,
                    **others,
                }
            )
        return pd.DataFrame(rows)

    @cached_property
    def noise(self) -> pd.DataFrame:
        """See `tables.noise`."""
        return tables.noise(self.measured)

    def noise_floor(self, scene: str = "") -> Noise:
        """That of an engine against itself, in one scene or in all; quiet up to `QUIET`."""
        ratios = self.noise[self.noise.scenario == scene].ratio if scene else self.noise.ratio
        return noise_of(ratios.to_numpy(float))

    @cached_property
    def driving(self) -> pd.DataFrame:
        """See `tables.driving`."""
        return tables.driving(self.bindings)

    @cached_property
    def bindings(self) -> pd.DataFrame:
        """See `tables.bindings`."""
        return tables.bindings(self.measured)

    @cached_property
    def sizes(self) -> pd.DataFrame:
        """See `tables.sizes`."""
        return tables.sizes(self.measured)

    @cached_property
    def growth(self) -> pd.DataFrame:
        """See `tables.growth`."""
        return tables.growth(self.sizes, self.measured.stopped)

    @cached_property
    def options(self) -> pd.DataFrame:
        """See `tables.options`."""
        return tables.options(self.measured)

    @cached_property
    def explained(self) -> pd.DataFrame:
        """See `explained.explained`."""
        return explained.explained(self.measured.budget)

    @cached_property
    def versus(self) -> pd.DataFrame:
        """See `versus.against_own`."""
        return versus.against_own(self.points, self.options)

    @cached_property
    def models(self) -> pd.DataFrame:
        """See `cheapest.cheapest_models`."""
        return cheapest.cheapest_models(self.measured.truths, self.points)

    def order_table(self, scene: str) -> pd.DataFrame:
        """A row for each engine: order with interval and verdict, and for every accuracy (cost, dt,
        why) as columns."""
        orders = self.orders[self.orders.scenario == scene]
        reached = self.reached[self.reached.scenario == scene]
        got = dict(
            zip(
                zip(reached.engine, reached.profile, reached.accuracy),
                zip(reached.cost, reached.dt_s, reached.why),
            )
        )
        who = list(zip(orders.engine, orders.profile))
        wide = orders.copy()
        for accuracy in ACCURACIES:
            wide[accuracy] = [got[*each, accuracy] for each in who]
        beside = self.bindings[self.bindings.scenario == scene].drop(columns="scenario")
        wide = wide.merge(beside, on=["engine", "profile"], how="left")
        return wide.assign(name=wide.engine + ":" + wide.profile)

    @cached_property
    def files(self) -> dict[str, pd.DataFrame]:
        """The tables, by the names of their CSV files."""
        tables = {
            "speed_samples": self.measured.samples,
            "speed_errors": self.measured.errors,
            "speed": self.points,
            "speed_pooled": self.pooled,
            "speed_orders": self.orders,
            "speed_reached": self.reached,
            "speed_sizes": self.sizes,
            "speed_options": self.options,
            "speed_driving": self.driving,
            "speed_bindings": self.bindings,
            "speed_noise": self.noise,
            "speed_models": self.models,
            "speed_sweeps": self.sweeps,
            "speed_budget": self.measured.budget,
            "speed_explained": self.explained,
            "speed_versus": self.versus,
        }
        return {f"{name}.csv": table for name, table in tables.items()}

    def write(self, folder: Path) -> None:
        """The tables as CSV files."""
        for name, table in self.files.items():
            put_text(folder / name, table.to_csv(index=False))
