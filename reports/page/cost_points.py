"""The points of error against cost: the error and the cost of each engine in every scene, at every
step size."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.order import FINEST, NEARER
from crosscheck2d.reports.compare.pooling import WHO, without_idle
from crosscheck2d.reports.page import style
from crosscheck2d.reports.run.timing import Noise, noise_of
from crosscheck2d.reports.run.timing_pass import BUSY, COLUMNS
from crosscheck2d.scenarios.model import Array


class RunTimes(NamedTuple):
    """The times of a run.

    Attributes:
        table: timings.csv.
        noise: the ratios of two timings of one engine.
        asked: the time limit of the timing pass, s.
        again: the command that takes the times.
    """

    table: pd.DataFrame
    noise: Noise
    asked: float
    again: str = ""

    @property
    def fault(self) -> str:
        """Why no time is shown, as a sentence; "" if times are shown."""
        take = f" To take them: {self.again}" if self.again else ""
        if self.table.empty and not self.asked:
            return f"No times were taken.{take}"
        if self.table.empty or not self.noise.pairs:
            return f"The engines could not be timed within {self.asked:g} s.{take}"
        if self.noise.floor > BUSY:
            return (
                "The machine was busy: an engine timed twice differs from itself by"
                f" {style.number(100 * self.noise.floor, 2)} %, so no times are shown.{take}"
            )
        return ""


NO_CLOCK = RunTimes(pd.DataFrame(columns=COLUMNS), noise_of([]), 0.0)


def points(scores: pd.DataFrame, clock: RunTimes) -> pd.DataFrame:
    """A row for each scenario, engine and step size that was timed, or without times for each that
    was played: error in radii, and the columns of `with_times`; without times the cost is the
    number of steps per simulated second.
    """
    found = with_times(scores, clock).assign(failed=(~np.isfinite(scores.error)).to_numpy(int))
    if clock.fault:
        played = found.error.map(np.isfinite)
        return found.assign(cost=(1 / found.dt_s).where(played), idle=0.0)
    timed = found[found.scenario.isin(clock.table.scenario)]
    return timed.assign(idle=timed.idle.where(timed.cost.notna(), 0.0))


def with_times(scores: pd.DataFrame, clock: RunTimes) -> pd.DataFrame:
    """The rows of `scores` with engine, profile, cost and idle (what of it is the binding's), in µs
    per simulated second, and read, µs of a read-out: nan where that was not timed, or where no time
    is shown."""
    names = scores.name.str.split(":", n=1)
    keys = ["scenario", *WHO, "dt_s"]
    times = clock.table.head(0 if clock.fault else len(clock.table)).rename(
        columns={"cost_us_per_s": "cost", "binding_us_per_s": "idle", "read_us": "read"}
    )
    numbers = ["dt_s", "cost", "idle", "read"]
    times = times[[*keys, *numbers[1:]]].astype(dict.fromkeys(numbers, float))
    found = scores.assign(engine=names.str[0], profile=names.str[1]).astype({"dt_s": float})
    return found.merge(times, on=keys, how="left")


def bare(found: pd.DataFrame) -> Array:
    """µs per simulated second without the binding's part, of a scene or pooled."""
    cost = found.cost.to_numpy(float)
    left = (
        found.bare.to_numpy(float) if "bare" in found else without_idle(cost, found.idle.to_numpy())
    )
    return np.where(np.isfinite(left), left, cost)


def by_engine(table: pd.DataFrame) -> Iterator[tuple[str, str, pd.DataFrame]]:
    """(engine, profile, its rows), in the order of appearance."""
    for (engine, profile), group in table.groupby(WHO, sort=False):
        yield str(engine), str(profile), group


def no_nearer(fine: pd.DataFrame) -> bool:
    """Whether the error of an engine falls by less than a tenth from the coarsest to the finest
    step, and is not yet below `FINEST`."""
    error = fine.error.to_numpy(float)
    return len(error) > 1 and error[-1] > max(FINEST, NEARER * error[0])
