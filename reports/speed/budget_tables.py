"""The error budget as tables: in which scenes which part is the largest, and all parts of one scene side by side."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from adapters.habits import NAMES
from reports.speed.budget import ALL, INTERPLAY, SUM, TIME, TOTAL, UNEXPLAINED

EXPLAINED = 0.01  # of the engine's error: what is left over below it is said to be none
LEAST = 1e-9  # radii: a part that is smaller for everybody has no column
FULL, DECADES = 1.0, 6  # radii of a full bar; how many decades below it a bar is empty
WHO = ["engine", "profile"]


class Cell(NamedTuple):
    """A number, and the length of its bar from 0 to 1; nan, and no bar, where an engine has no such habit."""

    value: float
    bar: float


class Table(NamedTuple):
    """Rows of cells by `engine:profile`, and the notes of those that could not be explained."""

    scenario: str
    until: float
    columns: list[str]
    rows: dict[str, list[Cell]]
    notes: dict[str, str]


def of_scene(budget: pd.DataFrame, scenario: str) -> Table:
    """Root mean squares in radii, a row a player: engine, what is left unexplained, the parts, sum and all."""
    here = budget[budget.scenario == scenario]
    parts = [part for part in causes(budget) if here[here.part == part].position_radii.max() > LEAST]
    columns = [TOTAL, UNEXPLAINED, *parts, INTERPLAY, SUM, ALL]
    rows: dict[str, list[Cell]] = {}
    notes: dict[str, str] = {}
    for (engine, profile), group in here.groupby(WHO, sort=False):
        found = group.set_index("part").position_radii
        rows[f"{engine}:{profile}"] = [cell(float(found.get(column, np.nan))) for column in columns]
        notes |= {f"{engine}:{profile}": note for note in group.note if note}
    return Table(scenario, float(here.until_s.iloc[0]), columns, rows, notes)


def causes(budget: pd.DataFrame) -> list[str]:
    """The parts that are causes, of any player."""
    return [TIME, *(part for part in NAMES if part in set(budget.part))]


def cell(value: float) -> Cell:
    """With a bar on a logarithmic scale."""
    if not value > 0:
        return Cell(value, 0.0)
    return Cell(value, float(np.clip(1 + np.log10(value / FULL) / DECADES, 0.0, 1.0)))


def overview(budget: pd.DataFrame) -> Table:
    """In how many scenes each part is the largest, and in how many all but `EXPLAINED` is explained; bars of all."""
    columns = ["explained", *causes(budget)]
    rows = {}
    for (engine, profile), group in budget[budget.note == ""].groupby(WHO, sort=False):
        scenes = group.pivot(index="scenario", columns="part", values="position_radii")
        known = scenes.reindex(columns=causes(budget)).fillna(0.0)
        largest = known[known.max(axis=1) > LEAST].idxmax(axis=1)
        explained = int((scenes[UNEXPLAINED] <= EXPLAINED * scenes[TOTAL]).sum())
        counts = [explained, *(int((largest == part).sum()) for part in known.columns)]
        rows[f"{engine}:{profile}"] = [Cell(count, count / len(scenes)) for count in counts]
    return Table("", np.nan, columns, rows, {})


def switched_off(budget: pd.DataFrame) -> list[dict[str, Any]]:
    """Every habit that the engine lets one switch off, where that changes anything: the change in both."""
    rows = budget[budget[["off_engine_radii", "off_reference_radii"]].max(axis=1) > LEAST]
    return [{str(key): value for key, value in row.items()} for row in rows.to_dict("records")]
