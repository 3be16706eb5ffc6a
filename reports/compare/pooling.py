"""All scenarios in one number: the geometric mean of the middle half, and how much any one scenario
changes it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.order import FINEST
from crosscheck2d.scenarios.model import Array

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
                "status": "ok",
                "reason": "",
                "best": np.nan,
                "wrapping": np.nan,
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
