"""The table that a run prints: the median of each metric over the scenes, for each engine."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.page.scenes import SceneScores, values
from crosscheck2d.reports.page.style import number

MAPPED = "position_max_radii"


class Column(NamedTuple):
    """A column, lower is better: heading, unit in nine letters, and the metrics whose sum it is."""

    title: str
    unit: str
    metrics: tuple[str, ...]


COLUMNS = (
    Column("Position", "radii", (MAPPED,)),
    Column("Momentum", "of Σ m|v|", ("momentum_error",)),
    Column("Energy", "of energy", ("energy_error",)),
    Column("Restitution", "in e", ("restitution_error",)),
    Column("Wrong collisions", "number", ("collisions_missed", "collisions_spurious")),
)
COUNTED = (Column("Fails", "scenes", ()), Column("Not played", "scenes", ()))


def medians(
    scenes: Sequence[SceneScores], names: Sequence[str], untrusted: Set[str]
) -> tuple[list[str], list[list[str]], list[str]]:
    """The headings and rows of the table, the last with the numbers of scenes, and the engines
    without a row because they do not model friction.

    A scene that an engine fails or does not play counts as infinitely far off; one that a solver's
    own file refuses does not count, as the exercise does not ask for it. Engines in `untrusted`
    broke the protocol or a law, and are not scored.
    """
    without = [name for name in names if all(name in s.frictionless for s in scenes)]
    names = [name for name in names if name not in without]
    pools = {(name, column): pool(scenes, name, column) for name in names for column in COLUMNS}
    columns = [column for column in COLUMNS if any(pools[name, column] for name in names)]
    rows = []
    for name in names:
        asked = [s for s in scenes if not (name.endswith(OWN) and name in s.refused)]
        refused = sum(name in scene.refused for scene in asked)
        fails = sum(bool(scene.verdicts(name)) for scene in scenes)
        played = sum(name not in scene.refused for scene in scenes)
        failure = "fails" if fails else "not played"
        cells = [median_text(pools[name, column], failure) for column in columns]
        cells.append(f"{fails} of {played}" if played else "–")
        if name in untrusted:
            cells = ["breaks"] * len(cells)
        cells.append(f"{refused} of {len(asked)}" if asked else "not asked")
        rows.append([name, *cells])
    if rows and len(scenes) > 1:
        counts = [[len(pools[name, column]) for name in names] for column in columns]
        rows.append(["in scenes", *map(numbers_of_scenes, counts), "", ""])
    return ["engine", *map(heading, [*columns, *COUNTED])], rows, without


def pool(scenes: Sequence[SceneScores], name: str, column: Column) -> list[float]:
    """The value in each scene in which it is judged; wrong collisions are the missed and the
    spurious ones together, without collisions in the exact answer the spurious ones."""
    pooled = []
    for scene in scenes:
        found = values(scene.comparison)
        own = [found[name, metric] for metric in column.metrics if (name, metric) in found]
        judged = [value.value for value in own if value.judged]
        applies = any(metric in column.metrics and v.judged for (_, metric), v in found.items())
        refused = name in scene.refused and not name.endswith(OWN)
        lost = bool(scene.verdicts(name)) or refused
        if lost and (applies or (column.metrics == (MAPPED,) and bool(scene.verdicts(name)))):
            pooled.append(np.inf)
        elif judged:
            pooled.append(float(sum(judged)))
    return pooled


def median_text(pooled: Sequence[float], failure: str) -> str:
    if not pooled:
        return "–"
    median = float(np.median(pooled))
    return failure if np.isinf(median) else number(median)


def numbers_of_scenes(counts: Sequence[int]) -> str:
    """Of how many scenes the medians of a column are: "9", "5–8", or "" if there is none."""
    counts = sorted({count for count in counts if count})
    return "–".join(map(str, dict.fromkeys((*counts[:1], *counts[-1:]))))


def heading(column: Column) -> str:
    title = column.title.replace(" ", "\n").replace("collisions", "colli-\nsions")
    return f"{title}\n{column.unit}"
