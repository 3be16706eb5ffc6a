"""The points that no other point beats, and the cost of an accuracy."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from crosscheck2d.reports.compare.order import ELSEWHERE
from crosscheck2d.reports.compare.pooling import middle_half
from crosscheck2d.scenarios.model import Array

NEAR = 0.1  # radii: the accuracy that sentences speak of
ACCURACIES = {"10 %": 0.1, "1 %": 0.01, "0.1 %": 0.001, "1e-6": 1e-6}  # of a radius
UNREACHABLE = "unreachable at any dt"
NOT_REACHED = "not reached"
NOT_TIMED = "not timed"
FAILED = "failed"


class Reached(NamedTuple):
    """The cost of an accuracy: µs per simulated second, at dt in s; or nan, and why it is not
    reached."""

    cost: float
    dt: float
    why: str = ""


def front(cost: Array, error: Array) -> list[int]:
    """Indices, cheapest first, of the points of the Pareto front: no other point is better in one
    of the two and at least as good in the other."""
    best, kept = np.inf, []
    for k in np.lexsort((error, cost)):
        if np.isfinite(cost[k]) and error[k] < best:
            best = error[k]
            kept.append(int(k))
    return kept


def kept_from(error: Array, accuracy: float) -> NDArray[np.bool_]:
    """(k,) bool, from coarse to fine: whether this error and every finer one is at most
    `accuracy`."""
    kept: NDArray[np.bool_] = np.logical_and.accumulate((error <= accuracy)[::-1])[::-1]
    return kept


def cost_to_reach(accuracy: float, dt: Array, cost: Array, error: Array, verdict: str) -> Reached:
    """The cheapest measured dt whose error, and that of every finer one, is at most `accuracy`
    radii.

    dt, cost and error (k,) go from coarse to fine; error is inf where a run failed. Nothing is
    interpolated or extrapolated. A dt with a larger error at a finer one does not count: it was
    luck.
    """
    if not np.isfinite(error).any():
        return Reached(np.nan, np.nan, FAILED)
    held = kept_from(error, accuracy)
    priced = held & np.isfinite(cost)
    if priced.any():
        k = int(np.flatnonzero(priced)[np.argmin(cost[priced])])
        return Reached(float(cost[k]), float(dt[k]))
    if held.any():
        return Reached(np.nan, np.nan, NOT_TIMED)
    return Reached(np.nan, np.nan, UNREACHABLE if verdict == ELSEWHERE else NOT_REACHED)


YARDSTICK = "reference:exercise"


def yardstick_of(reached: pd.DataFrame) -> pd.DataFrame:
    """The rows of the engine `YARDSTICK` in a table of scenario, engine, profile, accuracy and
    cost; if it is not there, those of the first engine."""
    names = reached.engine + ":" + reached.profile
    return reached[names == (YARDSTICK if (names == YARDSTICK).any() else names.iloc[0])]


def said_of_cheaper(pooled: pd.DataFrame) -> str:
    """Why a smaller error seems to cost less than a larger one, in a sentence; "" if none does.

    Args:
        pooled: engine, profile, accuracy, cost from `paired_cost`, nan where there is none, and got
            of `of` scenarios, for each of `ACCURACIES`. Each accuracy is a mean over the scenarios
            that engine and yardstick both reach with it: other ones for each accuracy.
    """
    for name, mine in pooled.groupby(pooled.engine + ":" + pooled.profile, sort=False):
        priced = mine.dropna(subset="cost")
        for (_, loose), (_, strict) in pairwise(priced.iterrows()):
            if strict.cost < loose.cost:
                own = yardstick_of(pooled)
                reach = ", ".join(f"{row.accuracy} in {row.got}" for row in own.itertuples())
                return (
                    "The costs of two errors come from different scenes, so compare engines at one"
                    f" error: {name} seems to reach {strict.accuracy} for less than"
                    f" {loose.accuracy}. {own.iloc[0].engine}:{own.iloc[0].profile}, with which all"
                    f" are compared, reaches {reach} of {own.iloc[0].of} scenes. In one scene a"
                    " smaller error never costs less."
                )
    return ""


def paired_cost(mine: pd.DataFrame, own: pd.DataFrame) -> float:
    """What an accuracy costs an engine: that of the yardstick, `middle_half` over its scenarios,
    times that of the ratios to it in the scenarios where both get there.

    Two engines of which one costs less in every scenario that both reach are thus in that order,
    whichever scenarios either reaches besides. nan where they have none in common.
    """
    both = mine.merge(own, on="scenario", suffixes=("", "_own")).dropna(subset=["cost", "cost_own"])
    ratios = (both.cost / both.cost_own).to_numpy(float)
    return middle_half(own.cost.dropna().to_numpy(float)) * middle_half(ratios)
