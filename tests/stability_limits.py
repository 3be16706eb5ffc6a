"""The limits of the pinned versions: `python -m tests.stability_limits OUT` keeps those of a quick atlas in OUT."""

from __future__ import annotations

import csv
import sys
from math import inf, nan
from pathlib import Path
from typing import NamedTuple

from reports import style
from reports.stability.limits import ONLY_BEYOND, Limit

FILE = Path(__file__).with_name("stability_limits.csv")
COLUMNS = ("engine", "profile", "case", "parameter", "works_at", "fails_at", "unit", "predicate", "verdict", "reason",
           "tested")  # fmt: skip
SUITE = "dt_"  # the suite's own scenes are not kept: what they do is judged in their own tests


class Kept(NamedTuple):
    """A row of the file: case, player, verdict, where it works and fails, its reason and how that was tested."""

    case: str
    player: str
    verdict: str
    works_at: float
    fails_at: float
    reason: str
    tested: str


def kept() -> list[Kept]:
    """The file's rows."""
    with FILE.open(newline="") as file:
        return [
            Kept(
                row["case"], f"{row['engine']}:{row['profile']}", row["verdict"], number(row["works_at"]),
                number(row["fails_at"]), row["reason"], row["tested"],
            )
            for row in csv.DictReader(file)
        ]  # fmt: skip


def number(text: str) -> float:
    """A number, or nan for nothing."""
    return float(text) if text else nan


def reaches(limit: Kept | Limit, harsher: int) -> tuple[float, float]:
    """The bracket on a line on which harsher is larger: from what works to what fails; open where nothing does.

    What works only beyond a limit fails on the mild side of it: its line runs the other way.
    """
    harsher = -harsher if limit.verdict == ONLY_BEYOND else harsher
    works = -inf if limit.works_at != limit.works_at else harsher * limit.works_at
    fails = inf if limit.fails_at != limit.fails_at else harsher * limit.fails_at
    return works, fails


IN_README = {
    "tunnelling_head_on": "way in a step over radius, head-on hit",
    "tunnelling_thin_wall": "the same, thin wall",
    "slow_hit": "closing speed at e = 1, m/s",
    "scale_down": "a scene made smaller",
    "far_from_origin": "distance from the origin, m",
    "spin": "turn in a step, rad",
    "bounce_drift": "dt over fall time, ball at e = 1",
    "column": "disks on each other",
    "fast_gas": "way in a step over radius, gas at e = 1",
}
PLAYERS = ("reference:exercise", "pymunk:matched", "box2d:shipped", "box2d:matched", "box2d_v3:shipped",
           "box2d_v3:matched", "event_driven:float64")  # fmt: skip


def readme_table() -> str:
    """The table of README.md: where players fail; a dash: not as far as was tried."""
    found = {(row.case, row.player): row for row in kept()}
    heads = [player.replace(":", "<br>") for player in PLAYERS]
    lines = [f"| fails at | {' | '.join(heads)} |", "|---|" + "---|" * len(PLAYERS)]
    for case, what in IN_README.items():
        cells = [in_words(found[case, player]) for player in PLAYERS]
        lines.append(f"| {what} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def in_words(row: Kept) -> str:
    """Where it fails, to two digits."""
    return {"does not fail": "–", "never works": "everywhere"}.get(row.verdict, style.number(row.fails_at, 2))


def keep(folder: Path) -> None:
    """Write the file from the limits.csv of a folder."""
    with (folder / "limits.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if not row["case"].startswith(SUITE)]
    if not rows or {row["form"] for row in rows} != {"quick"}:
        raise SystemExit(f"{folder}: holds no atlas in its quick form; make one: crosscheck stability --out {folder}")
    with FILE.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    keep(Path(sys.argv[1]))
    print(readme_table())
