"""The limits of the pinned versions in the full form, which the quick one must find again.

`crosscheck stability --full --out OUT && python -m tests.reports.stability.kept_limits OUT` makes
the table anew. A stability report of some cases, or engines, replaces their rows and keeps the
others. The engines of npm packages have a file and a table of their own.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Sequence
from functools import cache
from io import StringIO
from math import inf, nan
from pathlib import Path
from typing import NamedTuple

from crosscheck2d.adapters.engines import FETCHED
from crosscheck2d.reports.page import style
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import ONLY_BEYOND, QUICK, Limit, LimitSearch, engines_of

DATA = Path(__file__).parents[3] / "tests" / "data"
FILE = DATA / "stability_limits.csv"
FILE_OF_FETCHED = DATA / "stability_limits_javascript.csv"
COLUMNS = (
    *("engine", "profile", "case", "parameter", "works_at", "fails_at", "unit", "predicate"),
    *("verdict", "monotone", "spacing", "seeds", "form", "reason", "tested"),
)


class Kept(NamedTuple):
    case: str
    engine: str
    form: str
    predicate: str
    verdict: str
    works_at: float
    fails_at: float
    monotone: bool
    reason: str
    tested: str


@cache
def quick_search(case: str, engine: str) -> tuple[LimitSearch, Limit]:
    """The search for a limit in the quick form, which remembers the failing run, and the limit."""
    search = LimitSearch(CASES[case], engine, QUICK)
    return search, search.limit()


def quick_limit(case: str, engine: str) -> Limit:
    return quick_search(case, engine)[1]


def kept(file: Path = FILE) -> list[Kept]:
    return [
        Kept(
            *(row["case"], engine_of(row), row["form"], row["predicate"], row["verdict"]),
            *(float(row["works_at"] or nan), float(row["fails_at"] or nan)),
            *(row["monotone"] == "True", row["reason"], row["tested"]),
        )
        for row in rows_of(file)
    ]


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def engine_of(row: dict[str, str]) -> str:
    return f"{row['engine']}:{row['profile']}"


def reaches(limit: Kept | Limit) -> tuple[float, float]:
    # The bracket on a line on which harsher is larger: from what works to what fails; open where
    # nothing does. What works only beyond a limit fails on the mild side of it: its line runs the
    # other way.
    harsher = CASES[limit.case].harsher * (-1 if limit.verdict == ONLY_BEYOND else 1)
    works = -inf if limit.works_at != limit.works_at else harsher * limit.works_at
    fails = inf if limit.fails_at != limit.fails_at else harsher * limit.fails_at
    return works, fails


def agrees(limit: Kept | Limit, kept: Kept | Limit) -> bool:
    """The same verdict, and brackets that meet: what did not fail may fail beyond in the other."""
    (works, fails), (works_too, fails_too) = reaches(limit), reaches(kept)
    backwards = [row.verdict == ONLY_BEYOND for row in (limit, kept)]
    return backwards[0] == backwards[1] and max(works, works_too) <= min(fails, fails_too)


IN_README = {
    "tunnelling_head_on": "step displacement / radius, head-on collision",
    "tunnelling_thin_wall": "the same, thin wall",
    "slow_collision": "closing speed at e = 1, m/s",
    "scale_down": "a scene made smaller",
    "far_from_origin": "distance from the origin, m",
    "spin": "rotation in a step, rad",
    "bounce_drift": "dt over fall time, ball at e = 1",
    "column": "disks on each other",
    "fast_gas": "step displacement / radius, gas at e = 1",
}
VARIANTS = (
    "reference:exercise",
    "pymunk:matched",
    "box2d:shipped",
    "box2d:matched",
    "box2d_v3:shipped",
    "box2d_v3:matched",
    "event_driven:float64",
)


def readme_table(engines: Sequence[str], rows: Sequence[Kept]) -> str:
    found = {(row.case, row.engine): row for row in rows}
    heads = [engine.replace(":", "<br>") for engine in engines]
    lines = [f"| fails at | {' | '.join(heads)} |", "|---|" + "---|" * len(engines)]
    for case, what in IN_README.items():
        cells = [in_words(found[case, engine]) for engine in engines]
        lines.append(f"| {what} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def in_words(row: Kept) -> str:
    # Where it fails first, to two digits; * where it works again beyond. A spin to three: what is 2
    # % off and what is refused at the cap itself are two limits.
    where = style.number(row.fails_at, 3 if row.case == "spin" else 2)
    refused = "refused from " if row.predicate == "refused" else ""
    words = {"does not fail": "–", "never works": "everywhere"}.get(row.verdict, refused + where)
    return words if row.monotone or row.verdict == "does not fail" else f"{words}*"


def keep(folder: Path) -> None:
    found = rows_of(folder / "limits.csv")
    if not found or {row["form"] for row in found} != {"full"}:
        raise SystemExit(
            f"{folder}: holds no full stability report; make one: crosscheck stability --full --out"
            f" {folder}"
        )
    for path, fetched in ((FILE, False), (FILE_OF_FETCHED, True)):
        here = [row for row in found if (engine_of(row) in FETCHED) == fetched]
        rows = {(row["case"], engine_of(row)): row for row in [*rows_of(path), *here]}
        ordered = [
            rows[key]
            for name, case in CASES.items()
            for engine in (FETCHED if fetched else engines_of(case))
            if (key := (name, engine)) in rows
        ]
        path.write_text(text_of(ordered), encoding="utf-8", newline="\n")


def text_of(rows: Iterable[dict[str, str]]) -> str:
    text = StringIO()
    writer = csv.DictWriter(text, COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


if __name__ == "__main__":
    for folder in sys.argv[1:]:
        keep(Path(folder))
    print(readme_table(VARIANTS, kept()))
    print(readme_table([*FETCHED], kept(FILE_OF_FETCHED)))
