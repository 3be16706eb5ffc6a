"""The bits of every engine in every scene: one hash each, kept in the repository, so that another
machine can say where it has others."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from adapters.engine_row import EngineRow
from reports.run.cells import Cell
from reports.run.playing import LOADING, Begun, play_cell
from reports.run.worker_process import allow
from scenarios.model import Scenario, Trajectory

KEPT = Path(__file__).parents[1] / "bits.csv"
COLUMNS = ["scenario", "engine", "profile", "dt_s", "status", "bits", "until"]
DIGITS = 4  # hex digits of a hash in `until`


class Difference(NamedTuple):
    """A row whose bits are not the kept ones: the last sample at which they still are, the first at
    which they are known not to be; both -1 if it did not play to its end in one of the two."""

    scenario: str
    name: str
    same: int
    other: int


def bits_here(cell: Cell, row: EngineRow, scenario: Scenario) -> dict[str, Any]:
    """In a worker: play the cell; the row of the table."""
    allow(LOADING)
    run = play_cell(cell, row, scenario, Begun())
    bits, until = ("", "") if run.trajectory is None else bits_of(run.trajectory)
    what = (scenario.name, *cell.names, f"{scenario.dt(cell.substeps):.9g}", run.status)
    return dict(zip(COLUMNS, (*what, bits, until)))


def bits_of(played: Trajectory) -> tuple[str, str]:
    """16 hex digits of a hash over all states, and `DIGITS` each of the hashes over the states up
    to sample 0, 1, 2, 4, 8 ... and the last."""
    digest, marks = hashlib.sha256(), []
    arrays = (played.position, played.velocity, played.angle, played.angular_velocity)
    for k in range(len(played)):
        for array in arrays:
            digest.update(array[k].astype("<f8").tobytes())
        if k in samples_of(len(played)):
            marks.append(digest.hexdigest()[:DIGITS])
    return digest.hexdigest()[:16], " ".join(marks)


def samples_of(count: int) -> list[int]:
    """The samples whose hashes `until` holds, of so many."""
    return [0, *(2**p for p in range(count.bit_length()) if 2**p < count - 1), count - 1]


def written(rows: list[dict[str, Any]], about: Mapping[str, str]) -> str:
    """The table as CSV, below comment lines that say by what it was made."""
    lines = "".join(f"# {key}: {value}\n" for key, value in about.items())
    return lines + pd.DataFrame(rows, columns=COLUMNS).to_csv(index=False)


def read(text: str) -> pd.DataFrame:
    """The table of `written`, every cell as text."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return pd.read_csv(io.StringIO("\n".join(lines)), dtype=str, keep_default_na=False)


def about_of(text: str) -> dict[str, str]:
    """The comment lines of `written`."""
    lines = [line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# ")]
    return {key: value for key, value in lines}


def differences(kept: pd.DataFrame, now: pd.DataFrame) -> tuple[list[Difference], pd.DataFrame]:
    """The rows of both tables whose bits differ; and all rows that both have, with the suffixes
    _kept and _now."""
    both = kept.merge(now, on=COLUMNS[:4], suffixes=("_kept", "_now"))
    found = []
    for row in both[both.bits_kept != both.bits_now].to_dict("records"):
        name = f"{row['engine']}:{row['profile']}"
        samples = first_other(row["until_kept"], row["until_now"])
        found.append(Difference(row["scenario"], name, *samples))
    return found, both


def first_other(one: str, other: str) -> tuple[int, int]:
    """The last sample that is the same by both columns `until`, and the next one that was hashed;
    (-1, -1) if they are not of as many samples."""
    mine, theirs = one.split(), other.split()
    if not mine or len(mine) != len(theirs):
        return -1, -1
    at = next(k for k in range(len(mine)) if mine[k] != theirs[k])
    # all but the last stand at 0, 1, 2, 4 ...
    samples = [0, *(2**p for p in range(len(mine)))]
    return (samples[at - 1] if at else -1), samples[at]
