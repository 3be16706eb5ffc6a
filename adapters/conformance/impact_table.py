"""What each engine does with e, as measured by the probes: a row for each engine, kept in
impact_table.csv.

`uv run --extra js python -m adapters.conformance.impact_table` asks all engines again, and writes
the file, the table of adapters/README.md and the short one of README.md; it takes half a minute.
With names of engines behind it, it asks only those, and keeps the rows of all others.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from datetime import date
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from adapters.conformance import physics
from adapters.conformance.probe import DT, collided, head_on, loaded, scene_of
from adapters.engine import Unsupported
from adapters.engine_row import FLOAT32, EngineRow
from adapters.engines import ENGINES, FETCHED
from adapters.friction import Frictionless

KEPT = Path(__file__).with_name("impact_table.csv")
README = Path(__file__).parents[1] / "README.md"
BEGIN, END = "<!-- impact table -->\n", "<!-- end of impact table -->"
FRONT = Path(__file__).parents[2] / "README.md"  # README of the repository, with the short form
SHORT_BEGIN, SHORT_END = "<!-- short form -->\n\n", "\n\n"
SLOWEST, FASTEST = 1e-3, 100.0  # m/s, range in which a threshold is searched
NEAR = 0.05  # of e: a smaller difference from e at `FASTEST` counts as equal
BOUNCES = 5


def threshold(row: EngineRow) -> float:
    """m/s: the closing speed from which on a pair bounces as it does at `FASTEST`, to 1 %; 0 if it
    already does at `SLOWEST`."""

    def restitution(closing: float) -> float:
        return float(physics.restitution(row, closing).got)

    usual, low, high = restitution(FASTEST), SLOWEST, FASTEST
    if abs(restitution(low) - usual) < NEAR:
        return 0.0
    while high > 1.01 * low:
        middle = (low * high) ** 0.5
        low, high = (low, middle) if abs(restitution(middle) - usual) < NEAR else (middle, high)
    return high


def elastic_energy(row: EngineRow) -> float:
    """%, of the height that a disk dropped by 2 m with e = 1 gains in `BOUNCES` bounces, in steps
    of 1/256 s; 0 is exact."""
    gravity, drop = 10.0, 2.0
    fall = (2 * drop / gravity) ** 0.5
    scene = scene_of(
        restitution=1.0,
        position=[[0.0, 0.25 + drop]],
        velocity=[[0.0, 0.0]],
        radius=[0.25],
        mass=[1.0],
        gravity=[0.0, -gravity],
        walls=[[[-8.0, 0.0], [8.0, 0.0]]],
    )
    with loaded(row, scene) as engine:
        engine.step(round((2 * BOUNCES - 0.5) * fall / DT))
        heights = []
        for _ in range(round(fall / DT)):
            engine.step()
            heights.append(float(engine.read().position[0, 1]))
    return 100 * ((max(heights) - 0.25) / drop - 1)


def lever(row: EngineRow) -> float:
    """The lever arm by which friction turns a disk in a bounce, in radii."""
    scene = replace(head_on(2.0, spin=40.0), friction=physics.FRICTION)
    before, after = collided(row, scene)
    taken = scene.mass[1] * float((after.velocity - before.velocity)[1, 1])
    turned = scene.inertia[1] * float((after.angular_velocity - before.angular_velocity)[1])
    return abs(turned / taken) / float(scene.radius[1]) if taken else float("nan")


def scaled(row: EngineRow, scale: float) -> float:
    """e of two equal disks of 0.5 m that close at 2 m/s, where 0.5 is stated, with all lengths
    `scale` times as long."""
    scene = head_on(2.0)
    small = replace(
        scene,
        position=scale * scene.position,
        velocity=scale * scene.velocity,
        radius=scale * scene.radius,
        inertia=scale**2 * scene.inertia,
    )
    return physics.pair_restitution(row, small)


def reading(probe: str) -> Callable[[EngineRow], float]:
    """A function that returns the number read by a probe of the physics."""

    def read(row: EngineRow) -> float:
        got = physics.PHYSICS[probe].read(row).got
        return float("nan") if isinstance(got, str) else got

    return read


class ImpactColumn(NamedTuple):
    """A column of the table: its heading in README, and how it is read; NaN if an engine refuses
    the scene."""

    heading: str
    read: Callable[[EngineRow], float]


COLUMNS: dict[str, ImpactColumn] = {
    "threshold": ImpactColumn("bounces from m/s", threshold),
    "e_slow": ImpactColumn("e at 0.1 m/s", reading("restitution_0.1")),
    "e_2": ImpactColumn("e at 2 m/s", reading("restitution_2")),
    "e_wall": ImpactColumn("e on a wall", reading("restitution_wall")),
    "e_small": ImpactColumn("e of 5 mm disks", partial(scaled, scale=0.01)),
    "energy": ImpactColumn(f"height gained in {BOUNCES} bounces, e = 1", elastic_energy),
    "friction_unasked": ImpactColumn("friction, none stated", reading("friction")),
    "friction_0": ImpactColumn("friction at e = 0", reading("friction_0")),
    "friction_1": ImpactColumn("friction at e = 1", reading("friction_1")),
    "lever": ImpactColumn("lever arm of friction", lever),
    "spin": ImpactColumn("300 rad/s after 4 steps", reading("fast_spin")),
}

SHORT = ("threshold", "energy", "friction_unasked", "friction_1", "spin", "e_small")
ROWS = ENGINES | FETCHED
# the engines from outside this project
OUTSIDE = list(dict.fromkeys(name.partition(":")[0] for name, row in ROWS.items() if row.outside))


def row_of_table(name: str, row: EngineRow) -> dict[str, float | str]:
    """The row of one engine, with the date and its versions."""
    with closing(row.make()) as engine:
        engine.load(head_on(2.0), DT)
        versions = ", ".join(f"{library} {number}" for library, number in engine.versions().items())
    known: dict[str, float | str] = {
        "engine": name,
        "numbers": "float32" if row.rounding == FLOAT32 else "float64",
        "date": date.today().isoformat(),
        "versions": versions,
    }
    return known | {key: asked(column.read, row) for key, column in COLUMNS.items()}


def asked(read: Callable[[EngineRow], float], row: EngineRow) -> float:
    """The result of `read`; NaN if the engine refuses the scene."""
    try:
        return read(row)
    except (Unsupported, Frictionless):
        return float("nan")


def table_of(rows: Mapping[str, EngineRow]) -> pd.DataFrame:
    """A row for each engine: engine, numbers, date, versions, then `COLUMNS`."""
    return pd.DataFrame([row_of_table(name, row) for name, row in rows.items()])


def kept() -> pd.DataFrame:
    """The table as it was last written."""
    return pd.read_csv(KEPT, keep_default_na=False, na_values=["", "nan"])


def in_markdown(table: pd.DataFrame) -> str:
    """The table in the form of README, followed by its date and versions."""
    headings = ["engine", *(column.heading for column in COLUMNS.values()), "numbers"]
    lines = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
    for row in table.to_dict("records"):
        cells = [f"`{row['engine']}`", *(cell(key, row[key]) for key in COLUMNS), row["numbers"]]
        lines.append(f"| {' | '.join(cells)} |")
    versions = dict.fromkeys(", ".join(table.versions).split(", "))
    read = f"Read on {days(table)} with {', '.join(versions)}."
    return "\n".join([*lines, "", *wrap(read, 120)]) + "\n"


def short_form(table: pd.DataFrame) -> str:
    """A row for each outside engine with the columns of `SHORT`: a number for each of its profiles,
    with an arrow between those that differ."""
    headings = [f"read on {days(table)}", *(COLUMNS[key].heading for key in SHORT), "numbers"]
    lines = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
    for engine, rows in table.groupby(table.engine.str.partition(":")[0], sort=False):
        if engine in OUTSIDE:
            lines.append(short_row(str(engine), rows.to_dict("records")))
    return "\n".join(lines)


def short_row(engine: str, profiles: list[dict[Any, Any]]) -> str:
    """The row of an engine in the short form, from those of its profiles."""
    cells = [f"`{engine}` ({profiles[0]['versions'].partition(',')[0]})"]
    for key in SHORT:
        numbers = [cell(key, row[key]) for row in profiles]
        cells.append(" → ".join(numbers) if len({*numbers}) > 1 else numbers[0])
    return f"| {' | '.join([*cells, profiles[0]['numbers']])} |"


def days(table: pd.DataFrame) -> str:
    """The day on which the rows were read, or the first and the last one."""
    return " to ".join(dict.fromkeys((table.date.min(), table.date.max())))


def cell(column: str, value: float) -> str:
    """A number to three digits; "-" for none."""
    if np.isnan(value):
        return "-"
    if column == "energy":
        return f"{round(value, 1) + 0.0:+.1f} %"  # avoids -0.0
    return f"{round(value, 6):.3g}"


def with_table(text: str, table: pd.DataFrame) -> str:
    """The text of adapters/README.md with this table."""
    return placed(text, BEGIN, in_markdown(table), END)


def with_short_form(text: str, table: pd.DataFrame) -> str:
    """The text of the repository's README with the short form of this table."""
    return placed(text, SHORT_BEGIN, short_form(table), SHORT_END)


def placed(text: str, begin: str, what: str, end: str) -> str:
    """The text with `what` between the first `begin` and the `end` that follows it."""
    before, _, rest = text.partition(begin)
    _, _, after = rest.partition(end)
    return before + begin + what + end + after


def with_anew(engines: Sequence[str]) -> pd.DataFrame:
    """The table as it was last written, with new rows of these engines, in the order of `ROWS`."""
    anew = table_of({name: row for name, row in ROWS.items() if name.split(":")[0] in engines})
    was = kept()
    both = pd.concat([was[~was.engine.isin(anew.engine)], anew]).set_index("engine", drop=False)
    return both.loc[[name for name in ROWS if name in both.index]]


def main(*engines: str) -> None:
    """Probe these engines, or all if none is named, and write the file and both tables."""
    if unknown := {*engines} - {name.partition(":")[0] for name in ROWS}:
        sys.exit(f"no engine is called {', '.join(sorted(unknown))}")
    table = with_anew(engines) if engines else table_of(ROWS)
    table.to_csv(KEPT, index=False, float_format="%.10g")
    for path, filled in ((README, with_table), (FRONT, with_short_form)):
        path.write_text(filled(path.read_text(encoding="utf-8"), kept()), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
