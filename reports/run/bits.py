"""A hash of the bits of every engine in every scene. The repository keeps them, so that another
machine can find where its bits differ."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from reports.run.archive import Archive, stored_trajectory
from scenarios.model import Trajectory

KEPT = Path(__file__).parents[1] / "bits.csv"
COLUMNS = ["scenario", "engine", "profile", "dt_s", "status", "bits", "until"]
DIGITS = 4  # hex digits of a hash in `until`


class ChangedBits(NamedTuple):
    """A row whose bits differ from the kept ones: the last sample known to be equal, and the first
    known to differ; both -1 if the two runs have different lengths."""

    scenario: str
    name: str
    same: int
    other: int


def rows_of(archive: Archive) -> list[dict[str, Any]]:
    """A row of the table for each scene and engine of a run, at the middle of the step sizes; none
    for another seed than that of the kept bits, 0, which gives random scenes other starts."""
    steps: dict[str, set[int]] = {}
    for record in archive.records:
        steps.setdefault(record["scene"], set()).add(record["substeps"])
    middle = {scene: sorted(sizes)[len(sizes) // 2] for scene, sizes in steps.items()}
    order = [list(archive.header[name]) for name in ("scenes", "engines")]
    rows = {}
    for record in archive.records:
        if record["seed"] == 0 and record["substeps"] == middle[record["scene"]]:
            name = f"{record['engine']}:{record['profile']}"
            trajectory = stored_trajectory(archive.folder, record)
            bits = ("", "") if trajectory is None else bits_of(trajectory)
            what = [record[key] for key in ("scenario", "engine", "profile")]
            row = (*what, f"{record['dt_s']:.9g}", record["status"], *bits)
            rows[order[0].index(record["scene"]), order[1].index(name)] = dict(zip(COLUMNS, row))
    return [rows[place] for place in sorted(rows)]


def bits_of(played: Trajectory) -> tuple[str, str]:
    """16 hex digits of a hash over all states; and for samples 0, 1, 2, 4, 8 ... and the last,
    `DIGITS` digits of the hash over the states up to there."""
    digest, marks = hashlib.sha256(), []
    arrays = (played.position, played.velocity, played.angle, played.angular_velocity)
    for k in range(len(played)):
        for array in arrays:
            digest.update(array[k].astype("<f8").tobytes())
        if k in samples_of(len(played)):
            marks.append(digest.hexdigest()[:DIGITS])
    return digest.hexdigest()[:16], " ".join(marks)


def samples_of(count: int) -> list[int]:
    """The samples whose hashes the column `until` holds, if there are `count`."""
    return [0, *(2**p for p in range(count.bit_length()) if 2**p < count - 1), count - 1]


def written(rows: list[dict[str, Any]], about: Mapping[str, str]) -> str:
    """The table as CSV, below comment lines on the machine and versions that made it."""
    lines = "".join(f"# {key}: {value}\n" for key, value in about.items())
    return lines + pd.DataFrame(rows, columns=COLUMNS).to_csv(index=False)


def read(text: str) -> pd.DataFrame:
    """The table that `written` made, with every cell as text."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return pd.read_csv(io.StringIO("\n".join(lines)), dtype=str, keep_default_na=False)


def about_of(text: str) -> dict[str, str]:
    """The comment lines of `written`."""
    lines = [line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# ")]
    return {key: value for key, value in lines}


def differences(kept: pd.DataFrame, now: pd.DataFrame) -> tuple[list[ChangedBits], pd.DataFrame]:
    """The rows of both tables whose bits differ; and all rows that both have, with the suffixes
    _kept and _now."""
    both = kept.merge(now, on=COLUMNS[:4], suffixes=("_kept", "_now"))
    found = []
    for row in both[both.bits_kept != both.bits_now].to_dict("records"):
        name = f"{row['engine']}:{row['profile']}"
        samples = first_other(row["until_kept"], row["until_now"])
        found.append(ChangedBits(row["scenario"], name, *samples))
    return found, both


def first_other(one: str, other: str) -> tuple[int, int]:
    """The last sample whose hashes agree, and the next hashed sample; (-1, -1) if the two columns
    `until` have different lengths."""
    mine, theirs = one.split(), other.split()
    if not mine or len(mine) != len(theirs):
        return -1, -1
    at = next(k for k in range(len(mine)) if mine[k] != theirs[k])
    # the hashes are those of samples 0, 1, 2, 4 ... and the last
    samples = [0, *(2**p for p in range(len(mine)))]
    return (samples[at - 1] if at else -1), samples[at]
