"""What an accuracy costs, and how fast an error falls with the step: the order of convergence with
an interval, or why there is none; all scenes in one number, and how much any one scene changes it;
the points that no other point beats, and the cost of an accuracy."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from crosscheck2d.scenarios.model import Array

# radii: the finest accuracy asked for; below it a rising or constant error is rounding
FINEST = 1e-6
# of the error at the coarsest step: more than that left at the finest step is no improvement
NEARER = 0.9
RISE = 1.1  # an error that grows by more than this from a step to a finer one is not monotone
# of the remaining error: at order p the last halving of dt moves the answer by 2^p - 1 times that
STANDSTILL = 0.25
RESAMPLES = 1000

ORDER, UNCLEAR, EXACT, UNSTEADY, ELSEWHERE, UNKNOWN = (
    "falls",
    "no clear order",
    "exact",
    "not monotone",
    "converges to something else",
    "too few points",
)

# Two-sided 95 % of Student's t for 1, 2, 3, ... degrees of freedom; past the end 2.
STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23)


class Order(NamedTuple):
    """The slope of log error over log dt, its 95 % interval, and the verdict: one of the words
    above."""

    slope: float
    low: float
    high: float
    verdict: str


def order_of(dt: Array, errors: Array, changes: Array, seed: int = 0) -> Order:
    """The order from dt (k,) s, coarse to fine, errors (seeds, k) in radii, and changes (seeds, k),
    see `ladder`.

    Points at `FINEST` or below say nothing about the order and are left out. With many seeds the
    slope is that of the median error, and the interval is bootstrapped over the seeds; with one
    seed the interval is that of the straight line (Student).
    """
    middle = np.median(errors, axis=0)
    verdict = verdict_of(middle, np.median(changes, axis=0))
    used = np.isfinite(middle) & (middle > FINEST)
    if used.sum() < 3:
        return Order(np.nan, np.nan, np.nan, verdict if verdict != ORDER else UNKNOWN)
    x = np.log(dt[used])
    fitted, low, high = line_interval(x, np.log(middle[used]))
    if len(errors) > 1:
        logs = np.log(np.maximum(errors[:, used], FINEST))
        low, high = bootstrap(logs, lambda sample: slope(x, np.median(sample, axis=0)), seed)
    if verdict == ORDER and not low > 0:  # it falls, but the interval of the slope includes 0
        verdict = UNCLEAR
    return Order(fitted, low, high, verdict)


def verdict_of(errors: Array, changes: Array) -> str:
    """How errors (k,) change towards finer steps; changes (k,) is how far the answer itself moved
    at each step."""
    known = np.isfinite(errors)
    errors, changes = errors[known], changes[known]
    if len(errors) < 3:
        return UNKNOWN
    if errors.max() <= FINEST:
        return EXACT
    if errors[-1] > FINEST and (changes[-2:] < STANDSTILL * errors[-2:]).all():
        return ELSEWHERE
    rising = (errors[1:] > RISE * errors[:-1]) & (errors[1:] > FINEST)
    return UNSTEADY if rising.any() else ORDER


def slope(x: Array, y: Array) -> float:
    x = x - x.mean()
    return float(x @ y / (x @ x))


def line_interval(x: Array, y: Array) -> tuple[float, float, float]:
    """Slope, low and high end of its 95 % interval from the scatter of the points about the
    line."""
    fitted, free = slope(x, y), len(x) - 2
    rest = y - y.mean() - fitted * (x - x.mean())
    spread = float(np.sqrt(rest @ rest / free / ((x - x.mean()) @ (x - x.mean()))))
    reach = (STUDENT[free - 1] if free <= len(STUDENT) else 2.0) * spread
    return fitted, fitted - reach, fitted + reach


def bootstrap(
    values: Array, statistic: Callable[[Array], float], seed: int = 0
) -> tuple[float, float]:
    """The 95 % interval of `statistic` of values (m, ...), sampled again along the first axis
    (Efron's percentiles)."""
    rng = np.random.default_rng(seed)
    picks = rng.integers(len(values), size=(RESAMPLES, len(values)))
    low, high = np.percentile([statistic(values[pick]) for pick in picks], [2.5, 97.5])
    return float(low), float(high)


def median_interval(values: Array, seed: int = 0) -> tuple[float, float]:
    """The bootstrap interval of the median of values (m,); the value twice where there is only
    one."""
    if len(values) == 1:
        return float(values[0]), float(values[0])
    rng = np.random.default_rng(seed)
    samples = values[rng.integers(len(values), size=(RESAMPLES, len(values)))]
    # failed ones are inf
    low, high = np.percentile(np.median(samples, axis=1), [2.5, 97.5], method="nearest")
    return float(low), float(high)


# All scenes in one number.

WHO = ["engine", "profile"]
POOLED = "pooled"
QUARTERS = (0.25, 0.75)
LEAST = 2.0**-53  # an error of 0 counts as one of rounding: it has no logarithm
# of a cost: what is left of it without idle steps is not known better than the noise that times may
# have, and a mean of logarithms must not be carried by what is nearly nothing
UNSURE = 0.1


def middle_half(values: Array) -> float:
    """The geometric mean of the middle half of values (m,), each an equal share of the whole; nan
    of none.

    The interquartile mean, here of logarithms. Like a median it ignores a quarter of the values at
    either end, infinite ones among them; but half of the values decide it, not one or two. A value
    that a quartile cuts counts in part. See Agarwal et al., "Deep reinforcement learning at the
    edge of the statistical precipice", 2021, section 4.3.
    """
    if not len(values):
        return float("nan")
    edges = np.arange(len(values) + 1) / len(values)
    weights = np.minimum(edges[1:], QUARTERS[1]) - np.maximum(edges[:-1], QUARTERS[0])
    inside = weights > 0
    logs = np.log(np.maximum(np.sort(values), LEAST))
    return float(np.exp(np.average(logs[inside], weights=weights[inside])))


def moved(values: Array, floor: float = 0.0) -> Array:
    """(m,) the factor, 1 or more, by which `middle_half` changes if one of values (m,) is left out;
    values below `floor` count as `floor`. inf if only one of the two means is infinite, 1 if both
    are.
    """
    whole = max(middle_half(values), floor)
    others = np.maximum([middle_half(np.delete(values, k)) for k in range(len(values))], floor)
    if np.isinf(whole):
        return np.where(np.isinf(others), 1.0, np.inf)
    return np.maximum(others / whole, whole / others)


def pooled(found: pd.DataFrame) -> pd.DataFrame:
    """A row for each engine and step size that all scenarios have: error and cost, each
    `middle_half` over the scenarios.

    Columns besides: error_low, error_high, low, high (quartiles); bare, of the cost less that of as
    many idle steps; of (how many scenarios), failed (in how many it did), timed (how many carry the
    cost); moved and cost_moved (by which factor leaving out one scenario changes error and cost at
    most), moved_by and cost_moved_by (which one). A scenario that an engine failed counts as
    infinite error and infinite cost. One that it played without being timed is left out of the
    cost, and `timed` says so.
    """
    step_sizes = found.groupby("scenario").step_size.max().min()
    rows = []
    for (engine, profile, step_size), group in found[found.step_size <= step_sizes].groupby(
        [*WHO, "step_size"], sort=False
    ):
        scenes, error = group.scenario.to_numpy(str), group.error.to_numpy(float)
        priced = group[group.cost.notna() | (group.failed > 0)]
        cost = priced.cost.fillna(np.inf).to_numpy(float)
        bare = without_idle(cost, priced.idle.to_numpy(float))
        quartiles = np.percentile(error, [25, 75], method="nearest")
        prices = np.percentile(cost, [25, 75], method="nearest") if len(cost) else [np.nan] * 2
        rows.append(
            {
                "scenario": POOLED,
                "engine": engine,
                "profile": profile,
                "step_size": step_size,
                "dt_s": np.nan,
                "error": middle_half(error),
                "error_low": quartiles[0],
                "error_high": quartiles[1],
                "cost": finite_or_nan(middle_half(cost)),
                "low": finite_or_nan(prices[0]),
                "high": finite_or_nan(prices[1]),
                "bare": finite_or_nan(middle_half(bare)) if not np.isnan(bare).any() else np.nan,
                "of": len(group),
                "seeds": len(group),
                "failed": int((group.failed > 0).sum()),
                "timed": len(priced),
                **largest_factor("moved", scenes, moved(error, FINEST)),
                **largest_factor("cost_moved", priced.scenario.to_numpy(str), moved(cost)),
                **{"status": "ok", "reason": "", "best": np.nan, "wrapping": np.nan},
                "idle": np.nan,
            }
        )
    return pd.DataFrame(rows)


def without_idle(cost: Array, idle: Array) -> Array:
    """Costs minus those of the same number of idle steps, at least `UNSURE` of the cost; nan where
    the idle cost is not known."""
    return np.maximum(cost - idle, UNSURE * cost)


def finite_or_nan(value: float) -> float:
    return float(value) if np.isfinite(value) else float("nan")


def largest_factor(name: str, scenes: Array, factors: Array) -> dict[str, float | str]:
    """`name`: the largest factor, `name`_by: its scenario; nan and "" if there are no factors."""
    if not len(factors):
        return {name: float("nan"), f"{name}_by": ""}
    k = int(np.argmax(factors))
    return {name: float(factors[k]), f"{name}_by": str(scenes[k])}


def said_of_pool(found: pd.DataFrame) -> str:
    """A sentence on how much one scene can move a point of `pooled`, and one on what failed."""
    failed = found[found.failed > 0].groupby(WHO, sort=False).failed.max().reset_index()
    lost = ", ".join(f"{row.engine}:{row.profile} {row.failed}" for row in failed.itertuples())
    failures = f"Scenes failed: {lost}." if lost else "No engine failed a scene."
    if found.of.max() < 2:
        return f"One scene, so nothing is pooled. {failures}"
    worst, cost = found.iloc[int(found.moved.to_numpy(float).argmax())], found.cost_moved.max()
    said = (
        f"Leaving out one of the {found.of.max()} scenes changes a pooled error by a factor of"
        f" {worst.moved:.2g} at most ({worst.engine}:{worst.profile} without {worst.moved_by})"
    )
    return f"{said}{f', a pooled cost by {cost:.2g}' if np.isfinite(cost) else ''}. {failures}"


# The cost of an accuracy.

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
