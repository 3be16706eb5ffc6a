"""The figures that the repository keeps, with machine and versions, and the test whether a new
measurement agrees with them."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import DISTINCT, ENGINES
from crosscheck2d.reports.compare.pareto import YARDSTICK
from crosscheck2d.reports.compare.pooling import WHO
from crosscheck2d.reports.speed.results import Results
from crosscheck2d.reports.terminal.foreign_text import put_text

KEPT = Path(__file__).parent / "figures.csv"
# of the same run, errors only
ORDERS, EXPLAINED = KEPT.with_name("orders.csv"), KEPT.with_name("explained.csv")
PICTURE = KEPT.with_name("speed.svg")  # of `page.write_picture`
COLUMNS = ["figure", "engine", "profile", "at", "value", "low", "high", "best", "unit", "note"]
AGAINST, AGAINST_BARE = f"cost over {YARDSTICK}", "the same less idle steps"
GATED = (10, 100, 1000)  # disks
# the largest factor by which a ratio may differ from the kept one: compilers and processors differ
# by less, a lost optimisation by more
LOOSE = 3.0


def figures(results: Results) -> pd.DataFrame:
    """Columns `COLUMNS`: the pooled points, the cost of each accuracy, the cost by number of
    disks with its worst step and exponent, that of a settled pile, and what a call costs."""
    pooled, reached, sizes = results.pooled, results.pooled_reached, results.sizes
    growth, driving = results.growth, results.driving
    of_worst = [*WHO, "figure", "at", "value", "unit"]
    failed = pooled.failed.map("failed in {}".format) + pooled.of.map(" of {}".format)
    parts = [
        pooled.assign(
            figure="pooled error",
            at=pooled.step_size,
            value=pooled.error,
            low=pooled.error_low,
            high=pooled.error_high,
            unit="radii",
            note=failed,
        ),
        pooled.assign(figure="pooled cost", at=pooled.step_size, value=pooled.cost, unit="us/s"),
        pooled.assign(
            figure="pooled cost less idle steps",
            at=pooled.step_size,
            value=pooled.bare,
            low=np.nan,
            high=np.nan,
            unit="us/s",
        ),
        reached.assign(
            figure="cost at accuracy",
            at=reached.accuracy,
            value=reached.cost,
            note=reached.why,
            unit="us/s",
        ),
        sizes.assign(figure="cost of a step", at=sizes.n, value=sizes.cost, unit="us"),
        sizes.assign(figure="worst step", at=sizes.n, value=sizes.worst, unit="us")[of_worst],
        settled(results.pile),
        growth.assign(
            figure="exponent", at=growth.most, value=growth.exponent, note=growth.stopped, unit="1"
        ),
        driving.assign(figure="idle step", value=driving.step_us, unit="us"),
        driving.assign(figure="read-out", value=driving.read_us, unit="us"),
        driving.assign(figure="idle call", value=driving.call_us, unit="us"),
        cheaper(results.versus, AGAINST, "cheaper"),
        cheaper(results.versus, AGAINST_BARE, "bare_cheaper").assign(
            value=np.nan, low=np.nan, high=np.nan
        ),
    ]
    table = pd.concat([part.reindex(columns=COLUMNS) for part in parts], ignore_index=True)
    # what friction costs where there is none has a benchmark of its own: tests/bench/friction.py
    names = table.engine + ":" + table.profile
    return table[~names.isin([name for name, row in ENGINES.items() if row.adds_friction])]


def settled(pile: pd.DataFrame) -> pd.DataFrame:
    """A row for each engine and option: the cost of a step of a settled pile."""
    rows = pile.melt(["name", "n"], var_name="at", value_name="value")
    names = rows.name.str.split(":", expand=True).reindex(columns=[0, 1])
    note = rows.n.map("{} disks".format)
    figure = "step of a settled pile"
    return rows.assign(figure=figure, engine=names[0], profile=names[1], note=note, unit="us")


def cheaper(versus: pd.DataFrame, figure: str, count: str) -> pd.DataFrame:
    """A row for each engine and change of `versus`: the ratio of its cost to that of `YARDSTICK`,
    and the scenes in which it costs less."""
    rows = versus[versus[count].notna()]
    said = (
        rows[count].map("{:.0f}".format) + rows.scenes.map(" of {}: ".format) + rows[f"{count}_in"]
    )
    return rows.assign(figure=figure, at=rows.change, value=rows.ratio, note=said, unit="1")


def write(path: Path, results: Results, header: Mapping[str, Any]) -> None:
    """Write the figures as CSV, below comment lines with the machine, the versions and how quiet
    the machine was."""
    noise = results.noise_floor()
    about = {
        "command": header["command"],
        "seed": header["seed"],
        "started": header["started"],
        **header["machine"],
        **header["versions"],
        "busy cores": f"{header['load']:.2f}",
        "an engine against itself": (f"{noise.median:.3f} ({noise.low:.3f} to {noise.high:.3f})"),
        "scenes": len(results.scenes),
    }
    lines = "".join(f"# {key}: {value}\n" for key, value in about.items())
    table = figures(results).to_csv(index=False, float_format="%.4g")
    put_text(path, lines + table)


def keep(folder: Path) -> None:
    """Keep the figures, the orders of convergence and the explained share of the errors of the
    measurement in `folder`.

    The last two hold no times: the same versions give the same rows on every machine of a kind.
    An engine that gives another's bits has no rows of its own.
    """
    KEPT.write_bytes((folder / "speed_figures.csv").read_bytes())
    for path in (ORDERS, EXPLAINED):
        table = read(folder / f"speed_{path.name}")
        distinct = (table.engine + ":" + table.profile).isin(DISTINCT)
        table[distinct].to_csv(path, index=False, float_format="%.4g")


def read(path: Path = KEPT) -> pd.DataFrame:
    """A table without its header; an empty cell is "" in a column of words and nan in one of
    numbers."""
    lines = [
        line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")
    ]
    table = pd.read_csv(io.StringIO("\n".join(lines)), dtype={"at": str, "note": str})
    return table.fillna({word: "" for word in ("at", "note") if word in table})


def ratios(kept: pd.DataFrame) -> dict[tuple[str, int], float]:
    """(`engine:profile`, disks) -> the cost of a step over that of `YARDSTICK`, each from its
    fastest round."""
    rows = kept[kept.figure == "cost of a step"]
    best = {
        (f"{row['engine']}:{row['profile']}", int(float(row["at"]))): float(row["best"])
        for row in rows.to_dict("records")
    }
    return {
        (name, n): cost / best[YARDSTICK, n]
        for (name, n), cost in best.items()
        if n in GATED and name != YARDSTICK and (YARDSTICK, n) in best
    }


def drifted(
    kept: Mapping[tuple[str, int], float], fresh: Mapping[tuple[str, int], float]
) -> list[str]:
    """A sentence for every ratio that differs from the kept one by more than `LOOSE`, or that
    only one of the two tables has."""
    said = [
        f"{name}, {n} disks: only one of the two has it"
        for name, n in sorted(set(kept) ^ set(fresh))
    ]
    for name, n in sorted(set(kept) & set(fresh)):
        change = fresh[name, n] / kept[name, n]
        if not 1 / LOOSE <= change <= LOOSE:
            said.append(
                f"{name}, {n} disks: a step costs {fresh[name, n]:.3g} times that of"
                f" {YARDSTICK}, kept is {kept[name, n]:.3g}; allowed is a factor of"
                f" {LOOSE:g}"
            )
    return said
