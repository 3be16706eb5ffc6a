"""The cheapest model that answers a scenario: a closed form, event by event, or step by step."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from reports.compare.order import FINEST
from reports.speed.scored_part import scored
from scenarios.truth.exact import CLOSED_FORM, answered_by

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
    if (model := answered_by(scenario)) != CLOSED_FORM or scenario.truth is None:
        return {"scenario": scenario.name, "truth": model, "closed_us": np.nan}
    best, ends = np.inf, scenario.times[[0, -1]]  # an engine is not read on the way either
    for _ in range(RUNS):
        started = perf_counter()
        scenario.truth(ends)
        best = min(best, perf_counter() - started)
    return {
        "scenario": scenario.name,
        "truth": CLOSED_FORM,
        "closed_us": best / scenario.duration * 1e6,
    }


def cheapest_models(truths: pd.DataFrame, points: pd.DataFrame) -> pd.DataFrame:
    """A row for each scenario: truth, closed_us, and the cheapest engines with an error of at
    most `FINEST` and of at most 1 % of a radius.

    The first are the columns model, engine and cost_us, the second loose_engine and loose_us; ""
    and nan where no engine is that accurate.
    """
    rows = []
    for row in truths.to_dict("records"):
        here = points[(points.scenario == row["scenario"]) & points.cost.notna()]
        fine, loose = (best_of(here[here.error <= bound]) for bound in (FINEST, 0.01))
        model = KINDS.get(fine[0].split(":")[0], STEPS) if fine[0] else ""
        if np.isfinite(row["closed_us"]) and not row["closed_us"] > fine[1]:
            model = CLOSED_FORM
        rows.append(
            row
            | {
                "model": model,
                "engine": fine[0],
                "cost_us": fine[1],
                "loose_engine": loose[0],
                "loose_us": loose[1],
            }
        )
    return pd.DataFrame(rows)


def best_of(points: pd.DataFrame) -> tuple[str, float]:
    """`engine:profile` and cost in µs per simulated second of the cheapest; "" and nan if there
    is none."""
    if points.empty:
        return "", np.nan
    row = points.nsmallest(1, "cost").to_dict("records")[0]
    return f"{row['engine']}:{row['profile']}", float(row["cost"])
