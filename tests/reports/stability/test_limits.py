"""The quick form finds every limit of the full form again: a hidden failure, or another engine,
shows up here. And what reports/stability/README.md says of limits is what the full form found."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from math import isfinite, isnan
from pathlib import Path
from typing import Any

import pytest

from crosscheck2d.adapters.engines import ENGINES, FETCHED, UNASKED
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import (
    DRIVEN_ENGINES,
    FULL,
    NEVER_FAILS,
    QUICK,
    LimitSearch,
    engines_of,
)
from crosscheck2d.reports.stability.page import facts
from tests.measured import MEASURED
from tests.reports.stability.kept_limits import (
    FILE,
    FILE_OF_FETCHED,
    IN_README,
    VARIANTS,
    Kept,
    agrees,
    in_words,
    kept,
    quick_limit,
    rows_of,
    text_of,
)

KEPT = kept()
KEPT_LIMITS = {(row.case, row.engine): row for row in KEPT}
THRESHOLD = KEPT_LIMITS["slow_collision", "box2d:shipped"]
FAST = (
    "slow_collision",
    "scale_up",
    "scale_down",
    "far_from_origin",
    "spin",
    "near_miss",
    "restitution",
    "tunnelling_head_on",
    "tunnelling_thin_wall",
)
# Every third: each of these cases, and each engine, is among them.
SOME = [row for row in KEPT if row.case in FAST][::3]
# Of the rest every fourth is searched in the long test, and all of the engines that play in few
# cases, and where some seeds may fail by chance: how many do may hang on the seventh digit of a
# value. Of the others, whose search would take minutes, the two ends of the bracket are played.
REST = [row for row in KEPT if row not in SOME]
CASES_OF = Counter(row.engine for row in KEPT)
SEARCHED = [
    row
    for k, row in enumerate(REST)
    if k % 4 == 0
    or CASES_OF[row.engine] < 8
    or (CASES[row.case].by_chance and isfinite(row.works_at) and isfinite(row.fails_at))
]
CHANGED = (
    "the quick form is wrong, or an engine or a case has changed: look at it, then keep the new"
    " limits: crosscheck stability CASE --full --out OUT && python -m"
    " tests.reports.stability.kept_limits OUT"
)


def assert_agrees(row: Kept) -> None:
    limit = quick_limit(row.case, row.engine)
    assert agrees(limit, row), (
        f"{limit.verdict}, {limit.works_at} to {limit.fails_at}, for {row}: {CHANGED}"
    )


def name_of(row: Kept) -> str:
    return f"{row.case}-{row.engine}"


def some_of(rows: list[Kept]) -> list[Any]:
    # Every twentieth is for the gate, the others are for the long run; begun where none of them is
    # a gas of a million steps, which takes 8 s.
    return [
        pytest.param(row, marks=[] if k % 20 == 1 else [pytest.mark.long])
        for k, row in enumerate(rows)
    ]


@pytest.mark.parametrize("row", SOME, ids=name_of)
def test_the_quick_form_finds_the_limit_of_the_full_one(row: Kept):
    assert_agrees(row)


@pytest.mark.slow
@pytest.mark.parametrize("row", some_of(SEARCHED), ids=name_of)
def test_the_quick_form_finds_a_limit_of_the_full_one_in_every_case(row: Kept):
    assert_agrees(row)


# one that gives the bits of another in all cases has its limits, too
SEARCHABLE = {
    name
    for name in DRIVEN_ENGINES
    if name.split("+")[0] in MEASURED and (name in UNASKED or name not in ENGINES)
}


def test_every_case_and_every_engine_is_searched():
    assert {row.case for row in (*SOME, *SEARCHED)} == set(CASES)
    assert {row.engine for row in (*SOME, *SEARCHED)} == SEARCHABLE


def wrong_ends(row: Kept) -> list[float]:
    # Where it fails though it is said to work, and works though it is said to fail: there and a
    # hundredth away from the edge. The file keeps six digits, and which bounce comes too low may
    # hang on the seventh; a hundredth is the width of a bracket of the full form.
    search = LimitSearch(CASES[row.case], row.engine, QUICK)
    away = FULL.ratio if row.fails_at > row.works_at else 1 / FULL.ratio
    ends = [(row.works_at, True, 1 / away), (row.fails_at, False, away)]
    return [
        value
        for value, works, factor in ends
        if not isnan(value)
        and all(search.trial(x).works is not works for x in (value, value * factor))
    ]


@pytest.mark.slow
@pytest.mark.parametrize("row", some_of([row for row in REST if row not in SEARCHED]), ids=name_of)
def test_a_limit_of_the_full_form_works_and_fails_where_it_says(row: Kept):
    assert wrong_ends(row) == []


def moved(limit: Any, factor: float) -> dict[str, float]:
    return {"works_at": limit.works_at * factor, "fails_at": limit.fails_at * factor}


def test_an_end_that_has_moved_is_noticed():
    off = [THRESHOLD._replace(**moved(THRESHOLD, factor)) for factor in (0.95, 1.05)]

    assert wrong_ends(THRESHOLD) == []
    assert [len(wrong_ends(row)) for row in off] == [1, 1]


def test_every_case_and_engine_is_kept():
    asked = {
        (name, engine)
        for name, case in CASES.items()
        for engine in engines_of(case)
        if engine.split("+")[0] in MEASURED
    }

    assert {(row.case, row.engine) for row in KEPT} == asked
    assert {row.engine for row in KEPT} == SEARCHABLE


def test_every_limit_has_a_reason_and_an_untested_one_is_called_likely():
    for row in KEPT:
        if row.verdict == NEVER_FAILS:
            assert row.reason == ""
        else:
            assert row.reason
            unknown = row.reason.startswith("not known")
            assert unknown or row.reason.startswith("likely: ") == (row.tested == ""), row


@pytest.mark.parametrize("file", [FILE, FILE_OF_FETCHED], ids=lambda file: file.stem)
def test_the_kept_limits_are_as_they_are_written(file: Path):
    assert text_of(rows_of(file)).encode() == file.read_bytes()


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_an_engine_that_fails_earlier_or_later_is_noticed(factor: float):
    now = quick_limit(THRESHOLD.case, THRESHOLD.engine)

    assert agrees(now, THRESHOLD)
    assert not agrees(replace(now, **moved(now, factor)), THRESHOLD)
    assert not agrees(quick_limit(THRESHOLD.case, "reference:exercise"), THRESHOLD)


@pytest.mark.parametrize(
    "engine",
    [
        "reference:exercise",
        pytest.param("reference:lesson", marks=pytest.mark.slow),
        pytest.param("box2d:shipped", marks=pytest.mark.slow),
    ],
)
def test_a_limit_is_the_first_failure_between_the_values_scanned_as_well(engine: str):
    # At values, heights and phases that no form has played, the ball comes back wherever it is said
    # to. Each of these loses or gains up to |v| dt of height a bounce, 2 dt over the fall time: 1 %
    # from 0.005 on.
    found = quick_limit("bounce_drift", engine)
    case = CASES["bounce_drift"]
    others = [0.0021, 0.0026, 0.0034, 0.0039, 0.0043, 0.0046]
    search = LimitSearch(
        replace(case, scene=lambda x, run: case.scene(x, run + 100), runs=8), engine, QUICK
    )

    assert found.works_at <= 0.0053
    assert all(search.trial(x, 8).works for x in others if x < found.works_at)
    assert not search.trial(1.1 * found.fails_at, 8).works


README = (Path(__file__).parents[3] / "reports/stability/README.md").read_text("utf-8")


def cells_of(text: str, table: int = 0) -> dict[tuple[str, str], str]:
    lines = text.split("| fails at |")[1 + table].split("\n\n")[0].splitlines()
    head, _, *rows = [[cell.strip() for cell in line.strip(" |").split("|")] for line in lines]
    engines = [name.replace("<br>", ":") for name in head]
    return {
        (row[0], engine): cell
        for row in rows
        for engine, cell in zip(engines, row[1:], strict=True)
    }


CELLS, CELLS_OF_FETCHED = cells_of(README), cells_of(README, 1)


@pytest.mark.parametrize(
    ("cells", "rows", "engines"),
    [
        (CELLS, [KEPT_LIMITS[case, name] for case in IN_README for name in VARIANTS], VARIANTS),
        (CELLS_OF_FETCHED, kept(FILE_OF_FETCHED), FETCHED),
    ],
    ids=["python", "javascript"],
)
def test_a_table_of_readme_has_the_first_failures_of_the_full_form(cells, rows, engines):
    assert cells == {(IN_README[row.case], row.engine): in_words(row) for row in rows}
    assert {row.engine for row in rows} == set(engines)
    assert {row.form for row in rows} == {"full"}


def test_a_number_that_is_no_longer_true_is_noticed():
    line = f"| {IN_README['bounce_drift']} |"
    old = CELLS[IN_README["bounce_drift"], VARIANTS[0]]
    wrong = cells_of(README.replace(f"{line} {old} |", f"{line} 0.057 |"))

    differ = [key for key, cell in wrong.items() if cell != CELLS[key]]
    assert differ == [(IN_README["bounce_drift"], VARIANTS[0])]
    assert wrong[differ[0]] != in_words(KEPT_LIMITS["bounce_drift", VARIANTS[0]])


def test_the_number_of_phases_behind_a_limit_is_said():
    most = max(case.runs for case in CASES.values())
    case = CASES["tunnelling_head_on"]
    page = " ".join(facts(case))
    limit = KEPT_LIMITS["tunnelling_head_on", "box2d_v3:matched"]

    assert f"It holds for the phases that were played, {most} at most" in README
    assert most == case.runs == CASES["near_miss"].runs
    assert f"a failure in fewer than one of {most} runs may be missed" in page
    assert f"a step displacement of {limit.works_at:.4g} radii" in " ".join(README.split())


def test_what_is_said_of_the_two_forms_is_what_they_do():
    pattern = r"up to (\d+) runs.{0,200}?to\s+(\d+) %.{0,400}?`--full`.{0,200}?to\s+(\d+) %"
    said = re.search(pattern, " ".join(README.split()))

    assert said is not None
    assert [int(number) for number in said.groups()] == [
        max(case.runs for case in CASES.values()),
        round(100 * (QUICK.ratio - 1)),
        round(100 * (FULL.ratio - 1)),
    ]
