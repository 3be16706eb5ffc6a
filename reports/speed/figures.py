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
from crosscheck2d.reports.compare.accuracy import WHO, YARDSTICK
from crosscheck2d.reports.speed.tables import Results, names_of
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
    pile = results.pile.melt(["name", "n"], var_name="at", value_name="cost")
    pile[WHO] = pile.name.str.split(":", expand=True).reindex(columns=[0, 1])

    def part(table: pd.DataFrame, figure: str, value: str, unit: str, **more: Any) -> pd.DataFrame:
        columns = {"figure": figure, "value": table[value], "unit": unit} | more
        return table.assign(**columns).reindex(columns=COLUMNS)

    def cheaper(figure: str, count: str) -> pd.DataFrame:
        # the ratio of a cost to that of `YARDSTICK`, and the scenes in which it costs less
        rows = results.versus[results.versus[count].notna()]
        scenes = rows.scenes.map(" of {}: ".format) + rows[f"{count}_in"]
        note = rows[count].map("{:.0f}".format) + scenes
        return part(rows, figure, "ratio", "1", at=rows.change, note=note)

    unknown = {"low": np.nan, "high": np.nan}
    at, disks = {"at": pooled.step_size}, {"at": sizes.n}
    failed = pooled.failed.map("failed in {}".format) + pooled.of.map(" of {}".format)
    errors = {"low": pooled.error_low, "high": pooled.error_high, "note": failed}
    worst = part(sizes, "worst step", "worst", "us", **disks)
    notes = {"at": growth.most, "note": growth.stopped}
    parts = [
        part(pooled, "pooled error", "error", "radii", **at, **errors),
        part(pooled, "pooled cost", "cost", "us/s", **at),
        part(pooled, "pooled cost less idle steps", "bare", "us/s", **at, **unknown),
        part(reached, "cost at accuracy", "cost", "us/s", at=reached.accuracy, note=reached.why),
        part(sizes, "cost of a step", "cost", "us", **disks),
        worst.assign(low=np.nan, high=np.nan, best=np.nan),
        part(pile, "step of a settled pile", "cost", "us", note=pile.n.map("{} disks".format)),
        part(growth, "exponent", "exponent", "1", **notes),
        part(driving, "idle step", "step_us", "us"),
        part(driving, "read-out", "read_us", "us"),
        part(driving, "idle call", "call_us", "us"),
        cheaper(AGAINST, "cheaper"),
        cheaper(AGAINST_BARE, "bare_cheaper").assign(value=np.nan, **unknown),
    ]
    table = pd.concat(parts, ignore_index=True)
    # what friction costs where there is none has a benchmark of its own: tests/bench/friction.py
    return table[~names_of(table).isin([n for n, row in ENGINES.items() if row.adds_friction])]


def write(path: Path, results: Results, header: Mapping[str, Any]) -> None:
    noise = results.noise_floor()
    about = {
        "command": header["command"],
        "seed": header["seed"],
        "started": header["started"],
        **header["machine"],
        **header["versions"],
        "busy cores": f"{header['load']:.2f}",
        "an engine against itself": (f"{noise.median:.3f} ({noise.low:.3f} to {noise.high:.3f})"),
        "scenes": len(results.asks),
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
        table[names_of(table).isin(DISTINCT)].to_csv(path, index=False, float_format="%.4g")


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
    disks = rows["at"].astype(float).astype(int)
    best = dict(zip(zip(names_of(rows), disks), rows.best.astype(float)))
    return {
        (name, n): cost / best[YARDSTICK, n]
        for (name, n), cost in best.items()
        if n in GATED and name != YARDSTICK and (YARDSTICK, n) in best
    }


def drifted(
    kept: Mapping[tuple[str, int], float], fresh: Mapping[tuple[str, int], float]
) -> list[str]:
    sentences = [
        f"{name}, {n} disks: only one of the two has it"
        for name, n in sorted(set(kept) ^ set(fresh))
    ]
    for name, n in sorted(set(kept) & set(fresh)):
        change = fresh[name, n] / kept[name, n]
        if not 1 / LOOSE <= change <= LOOSE:
            sentences.append(
                f"{name}, {n} disks: a step costs {fresh[name, n]:.3g} times that of"
                f" {YARDSTICK}, kept is {kept[name, n]:.3g}; allowed is a factor of"
                f" {LOOSE:g}"
            )
    return sentences
