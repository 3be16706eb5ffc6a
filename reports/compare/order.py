"""The order of convergence with an interval, or why there is none."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

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
    if len(errors) == 1:
        fitted, low, high = line_interval(x, np.log(middle[used]))
        return Order(fitted, low, high, confirmed(verdict, low))
    logs = np.log(np.maximum(errors[:, used], FINEST))
    low, high = bootstrap(logs, lambda sample: slope(x, np.median(sample, axis=0)), seed)
    return Order(slope(x, np.log(middle[used])), low, high, confirmed(verdict, low))


def confirmed(verdict: str, low: float) -> str:
    """The verdict; `UNCLEAR` if the error falls but the interval of the slope includes 0."""
    return UNCLEAR if verdict == ORDER and not low > 0 else verdict


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
