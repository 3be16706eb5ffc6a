"""The error budget as tables: the largest contribution in each scene, and all contributions of
one scene side by side."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.mechanisms.table import NAMES
from crosscheck2d.reports.compare.pooling import WHO
from crosscheck2d.reports.speed.budget import ALL, INTERPLAY, RESIDUAL, SUM, TIME, TOTAL
from crosscheck2d.reports.speed.explained import LEAST, TO

EXPLAINED = TO[0]  # of the engine's error: a residual below it is said to be none
FULL, DECADES = 1.0, 6  # radii of a full bar; how many decades below it a bar is empty


class BudgetCell(NamedTuple):
    """A number, and the length of its bar from 0 to 1; nan, and no bar, where an engine has no such
    mechanism."""

    value: float
    bar: float


class BudgetTable(NamedTuple):
    """Rows of cells by `engine:profile`, and the notes of those that could not be explained.

    until, horizon, duration: s, up to where the scene was evaluated, its exact answer goes, and it
        lasts.
    """

    scenario: str
    until: float
    horizon: float
    duration: float
    columns: list[str]
    rows: dict[str, list[BudgetCell]]
    notes: dict[str, str]


def of_scene(budget: pd.DataFrame, scenario: str) -> BudgetTable:
    """Root mean squares in radii, a row for each engine: engine, the residual, the contributions,
    sum and all."""
    here = budget[budget.scenario == scenario]
    contributions = [
        contribution
        for contribution in causes(budget)
        if here[here.contribution == contribution].position_radii.max() > LEAST
    ]  # of anybody
    columns = [TOTAL, RESIDUAL, *contributions, INTERPLAY, SUM, ALL]
    rows: dict[str, list[BudgetCell]] = {}
    notes: dict[str, str] = {}
    for (engine, profile), group in here.groupby(WHO, sort=False):
        found = group.set_index("contribution").position_radii
        rows[f"{engine}:{profile}"] = [cell(float(found.get(column, np.nan))) for column in columns]
        notes |= {f"{engine}:{profile}": note for note in group.note if note}
    until, horizon, duration = (
        float(here[name].iloc[0]) for name in ("until_s", "horizon_s", "duration_s")
    )
    return BudgetTable(scenario, until, horizon, duration, columns, rows, notes)


def causes(budget: pd.DataFrame) -> list[str]:
    """The contributions that are causes, of any engine."""
    found = set(budget.contribution)
    return [TIME, *(name for name in NAMES if name in found)]


def cell(value: float) -> BudgetCell:
    """With a bar on a logarithmic scale."""
    if not value > 0:
        return BudgetCell(value, 0.0)
    return BudgetCell(value, float(np.clip(1 + np.log10(value / FULL) / DECADES, 0.0, 1.0)))


def overview(budget: pd.DataFrame) -> BudgetTable:
    """In how many scenes an engine was played, has an error, has it explained but for `EXPLAINED`,
    and in how many each contribution is the largest; bars of all scenes, and every engine has its
    row, also one that failed them all.
    """
    columns = ["played", "errors", "explained", *causes(budget)]
    count = budget.scenario.nunique()
    rows = {}
    for (engine, profile), group in budget.groupby(WHO, sort=False):
        played = group[group.note == ""]
        scenes = played.pivot(index="scenario", columns="contribution", values="position_radii")
        scenes = scenes.reindex(columns=[TOTAL, RESIDUAL, *causes(budget)]).fillna(0.0)
        off = scenes[scenes[TOTAL] > LEAST]
        known = scenes[causes(budget)]
        largest = known[known.max(axis=1) > LEAST].idxmax(axis=1)
        explained = int((off[RESIDUAL] <= EXPLAINED * off[TOTAL]).sum())
        counts = [
            len(scenes),
            len(off),
            explained,
            *(int((largest == contribution).sum()) for contribution in known.columns),
        ]
        rows[f"{engine}:{profile}"] = [BudgetCell(number, number / count) for number in counts]
    return BudgetTable("", np.nan, np.nan, np.nan, columns, rows, {})


def ablated_in_both(budget: pd.DataFrame) -> list[dict[Hashable, Any]]:
    """Every mechanism that can be disabled in the engine, where that changes anything: the
    change in both."""
    changed = budget[["off_engine_radii", "off_reference_radii"]].max(axis=1) > LEAST
    return budget[changed].to_dict("records")
