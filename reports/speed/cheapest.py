"""The cheapest model that answers a scenario: a closed form, event by event, or step by step."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.order import FINEST
from crosscheck2d.reports.speed.scored_part import scored
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM, answered_by

KINDS = {"event_driven": "collision to collision, float64"}
STEPS = "step by step"
RUNS = 20


def closed_form(scene: str, seed: int) -> dict[str, Any]:
    """Rows of scenario, truth (the kind of exact answer) and closed_us: µs per simulated second
    to compute a closed form.

    An answer computed in many digits is cached on disk, so its cost cannot be measured by asking
    again.
    """
    scenario = scored(scene, seed).scenario
    model, cost = answered_by(scenario), np.nan
    if model == CLOSED_FORM and scenario.truth is not None:
        ends = scenario.times[[0, -1]]  # an engine is not read on the way either
        best = np.inf
        for _ in range(RUNS):
            started = perf_counter()
            scenario.truth(ends)
            best = min(best, perf_counter() - started)
        cost = best / scenario.duration * 1e6
    return {"scenario": scenario.name, "truth": model, "closed_us": cost}


def cheapest_models(truths: pd.DataFrame, points: pd.DataFrame) -> pd.DataFrame:
    """A row for each scenario: truth, closed_us, and the cheapest engines with an error of at
    most `FINEST` and of at most 1 % of a radius.

    The first are the columns model, engine and cost_us, the second loose_engine and loose_us; ""
    and nan where no engine is that accurate.
    """
    rows = []
    for row in truths.to_dict("records"):
        here = points[(points.scenario == row["scenario"]) & points.cost.notna()]
        engine, cost = best_of(here[here.error <= FINEST])
        loose_engine, loose_cost = best_of(here[here.error <= 0.01])
        model = KINDS.get(engine.split(":")[0], STEPS) if engine else ""
        if np.isfinite(row["closed_us"]) and not row["closed_us"] > cost:
            model = CLOSED_FORM
        row |= {"model": model, "engine": engine, "cost_us": cost}
        rows.append(row | {"loose_engine": loose_engine, "loose_us": loose_cost})
    return pd.DataFrame(rows)


def best_of(points: pd.DataFrame) -> tuple[str, float]:
    """`engine:profile` and cost in µs per simulated second of the cheapest; "" and nan if there
    is none."""
    if points.empty:
        return "", np.nan
    row = points.nsmallest(1, "cost").to_dict("records")[0]
    return f"{row['engine']}:{row['profile']}", float(row["cost"])
