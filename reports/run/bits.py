"""`crosscheck run --bits`: a hash of the bits of every engine in every scene. The repository keeps
them, so that another machine can find where its bits differ."""

from __future__ import annotations

import hashlib
import io
import platform
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from crosscheck2d.reports.run.cells import versions
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.terminal.console import Console, print_list, print_table
from crosscheck2d.reports.terminal.counts import counted, listed
from crosscheck2d.scenarios.model import Trajectory

KEPT = Path(__file__).parents[1] / "bits.csv"
COLUMNS = ["scenario", "engine", "profile", "dt_s", "status", "bits", "until"]
DIGITS = 4  # hex digits of a hash in `until`
BITS = "bits.csv"  # in the folder of a run
SHOWN = 12  # differences


def rows_of(results: RunResults) -> list[dict[str, Any]]:
    """A row of the table for each scene and engine of a run, at the middle of the step sizes; none
    for another seed than that of the kept bits, 0, which gives random scenes other starts."""
    rows = []
    for record in results.records:
        substeps = results.sources[record["scene"]].substeps
        if record["seed"] == 0 and record["substeps"] == substeps[len(substeps) // 2]:
            trajectory = results.trajectory(record)
            bits = ("", "") if trajectory is None else bits_of(trajectory)
            what = [record[key] for key in COLUMNS[:3]]
            row = (*what, f"{record['dt_s']:.9g}", record["status"], *bits)
            rows.append(dict(zip(COLUMNS, row)))
    return rows


def bits_of(played: Trajectory) -> tuple[str, str]:
    """16 hex digits of a hash over all states; and for samples 0, 1, 2, 4, 8 ... and the last,
    `DIGITS` digits of the hash over the states up to there."""
    digest, marks, last = hashlib.sha256(), [], len(played) - 1
    hashed = {0, *(2**p for p in range(len(played).bit_length()) if 2**p < last), last}
    arrays = (played.position, played.velocity, played.angle, played.angular_velocity)
    for k in range(len(played)):
        for array in arrays:
            digest.update(array[k].astype("<f8").tobytes())
        if k in hashed:
            marks.append(digest.hexdigest()[:DIGITS])
    return digest.hexdigest()[:16], " ".join(marks)


def written(rows: list[dict[str, Any]], about: Mapping[str, str]) -> str:
    lines = "".join(f"# {key}: {value}\n" for key, value in about.items())
    return lines + pd.DataFrame(rows, columns=COLUMNS).to_csv(index=False)


def read(text: str) -> pd.DataFrame:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    return pd.read_csv(io.StringIO("\n".join(lines)), dtype=str, keep_default_na=False)


def differences(kept: pd.DataFrame, now: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows that both tables have, with the `name` of the engine, and those of them whose bits
    differ."""
    both = kept.merge(now, on=COLUMNS[:4], suffixes=("_kept", "_now"))
    both["name"] = both.engine + ":" + both.profile
    return both, both[both.bits_kept != both.bits_now]


def first_other(one: str, other: str) -> tuple[int, int]:
    """The last sample whose hashes agree, and the next hashed sample; (-1, -1) if the two columns
    `until` have different lengths."""
    pairs = list(zip(one.split(), other.split()))
    if not pairs or len(one.split()) != len(other.split()):
        return -1, -1
    at = next(k for k, (kept, now) in enumerate(pairs) if kept != now)
    # the hashes are those of samples 0, 1, 2, 4 ... and the last
    samples = [-1, 0, *(2**p for p in range(len(pairs)))]
    return samples[at], samples[at + 1]


def sentence_on(row: Mapping[Any, Any]) -> str:
    """What differs in a row: up to which sample the bits are known to be equal, and from which
    known to differ."""
    same, other = first_other(row["until_kept"], row["until_now"])
    where = f"the same bits up to sample {same}, others by sample {other}"
    if other < 0:
        where = "it did not play to the same sample"
    elif same < 0:
        where = "other bits from the start on"
    return f"{row['name']} in {row['scenario']}: {where}"


def write_bits(results: RunResults) -> None:
    system = {"system": platform.system(), "architecture": platform.machine()}
    made_by = {**system, "Python": platform.python_version(), **versions()}
    results.store.export(BITS, written(rows_of(results), made_by))


def kept_bits(folder: Path) -> bool:
    """Print how the bits of a run differ from the kept ones; whether there are any, and none do."""
    texts = [path.read_text(encoding="utf-8") for path in (KEPT, folder / BITS)]
    kept, now = map(read, texts)
    before, made_by = (
        dict(line[2:].split(": ", 1) for line in text.splitlines() if line.startswith("# "))
        for text in texts
    )
    both, changed = differences(kept, now)
    counts, other = Counter(both.name.tolist()), Counter(changed.name.tolist())
    rows = [[name, str(n - other[name]), str(n)] for name, n in counts.items()]
    console = Console()
    title = "In how many scenes the bits are those kept in reports/bits.csv"
    print_table(console, ["engine", "the same", "of"], rows, title)
    console.print()
    print_list(console, map(sentence_on, changed[:SHOWN].to_dict("records")))
    if len(changed) > SHOWN:
        console.print(f"and {counted(len(changed) - SHOWN, 'more difference')}")
    if new := {*(now.engine + ":" + now.profile)} - {*counts}:
        names = listed(sorted(new))
        console.print(f"No bits are kept of {names} in these scenes and steps.", highlight=False)
    others = [
        f"{key} {value} (here {made_by.get(key)})"
        for key, value in before.items()
        if made_by.get(key) != value
    ]
    if others:
        console.print(f"The kept bits were made with {', '.join(others)}.", highlight=False)
    console.print()
    return changed.empty and not both.empty
