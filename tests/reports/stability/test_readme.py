"""What reports/stability/README.md says of limits is what the full form found, for every engine it
names."""

from __future__ import annotations

import re
from pathlib import Path

from crosscheck2d.adapters.engines import FETCHED
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import FULL, QUICK
from crosscheck2d.reports.stability.page import facts
from tests.reports.stability.kept_limits import (
    FILE_OF_FETCHED,
    IN_README,
    VARIANTS,
    in_words,
    kept,
)

TEXT = (Path(__file__).parents[3] / "reports/stability/README.md").read_text("utf-8")
FOUND = {(row.case, row.engine): row for row in kept()}


def cells_of(text: str, table: int = 0) -> dict[tuple[str, str], str]:
    lines = text.split("| fails at |")[1 + table].split("\n\n")[0].splitlines()
    head, _, *rows = [[cell.strip() for cell in line.strip(" |").split("|")] for line in lines]
    engines = [name.replace("<br>", ":") for name in head]
    return {
        (row[0], engine): cell
        for row in rows
        for engine, cell in zip(engines, row[1:], strict=True)
    }


CELLS, CELLS_OF_FETCHED = cells_of(TEXT), cells_of(TEXT, 1)


def test_a_number_of_the_table_is_the_first_failure_of_the_full_form():
    places = [(case, engine) for case in IN_README for engine in VARIANTS]

    assert {place: CELLS[IN_README[place[0]], place[1]] for place in places} == {
        place: in_words(FOUND[place]) for place in places
    }


def test_the_javascript_engines_have_a_table_of_their_own():
    found = {(row.case, row.engine): row for row in kept(FILE_OF_FETCHED)}

    assert {
        (IN_README[case], engine): in_words(row) for (case, engine), row in found.items()
    } == CELLS_OF_FETCHED
    assert {engine for _, engine in CELLS_OF_FETCHED} == set(FETCHED)


def test_the_table_has_no_other_rows_and_no_other_columns():
    assert {row for row, _ in CELLS} == set(IN_README.values())
    assert {engine for _, engine in CELLS} == set(VARIANTS)


def test_a_number_that_is_no_longer_true_is_noticed():
    line = f"| {IN_README['bounce_drift']} |"
    old = CELLS[IN_README["bounce_drift"], VARIANTS[0]]
    wrong = cells_of(TEXT.replace(f"{line} {old} |", f"{line} 0.057 |"))

    differ = [key for key, cell in wrong.items() if cell != CELLS[key]]
    assert differ == [(IN_README["bounce_drift"], VARIANTS[0])]
    assert wrong[differ[0]] != in_words(FOUND["bounce_drift", VARIANTS[0]])


def test_the_number_of_phases_behind_a_limit_is_said():
    most = max(case.runs for case in CASES.values())
    case = CASES["tunnelling_head_on"]
    page = " ".join(facts(case))
    limit = FOUND["tunnelling_head_on", "box2d_v3:matched"]

    assert f"It holds for the phases that were played, {most} at most" in TEXT
    assert most == case.runs == CASES["near_miss"].runs
    assert f"a failure in fewer than one of {most} runs may be missed" in page
    assert f"a step displacement of {limit.works_at:.4g} radii" in " ".join(TEXT.split())


def test_what_is_said_of_the_two_forms_is_what_they_do():
    pattern = r"up to (\d+) runs.{0,200}?to\s+(\d+) %.{0,400}?`--full`.{0,200}?to\s+(\d+) %"
    said = re.search(pattern, " ".join(TEXT.split()))

    assert said is not None
    assert [int(number) for number in said.groups()] == [
        max(case.runs for case in CASES.values()),
        round(100 * (QUICK.ratio - 1)),
        round(100 * (FULL.ratio - 1)),
    ]


def test_what_the_readme_says_is_of_the_full_form():
    assert {FOUND[case, engine].form for case in IN_README for engine in VARIANTS} == {"full"}
