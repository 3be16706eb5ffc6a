"""What the page says of a solver's own file that is asked in some scenes only, or not scored;
and of a scene of one's own whose exact answer ends early."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.reports.page.findings import early_ends, not_counted, refusals
from crosscheck2d.reports.page.kit import with_lines
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.page.browsing import overhang


def test_who_is_not_counted_is_named_with_the_probe_that_it_missed():
    asked = "Where does a used engine differ from a fresh one after load?"
    row = {"asked": asked, "got": "position after 10 steps", "expected": "nowhere", "note": ""}
    raised = row | {"got": "raised", "note": "NameError: no q"}

    assert not_counted({"b.js:own": raised, "a.js:own": row}) == [
        "Not counted: a.js breaks the protocol of the harness. Where does a used engine differ"
        " from a fresh one after load? Position after 10 steps; expected: nowhere.",
        "Not counted: b.js breaks the protocol of the harness. It raised NameError: no q."
        " The probe was: Where does a used engine differ from a fresh one after load?",
    ]
    assert not_counted({}) == []


def test_each_sentence_has_its_lines():
    assert with_lines(["One.", "Two."], [["line 3: x = 1"], []]) == [
        ("One.", ["line 3: x = 1"]),
        ("Two.", []),
    ]
    assert with_lines(["No fault found."], []) == [("No fault found.", [])]


def test_a_reason_to_refuse_is_said_once_with_its_cells():
    walls, other = "the exercise has no walls", "the file has e = 0.9, the scene needs 0.5"
    refused = [("a.js", walls), ("b.js", walls), ("a.js", walls), ("a.js", other)]
    scene = scenario("head_on_equal_e05")
    runs = [
        Run(file, "own", scene.name, 0.1 / k, "unsupported", why)
        for k, (file, why) in enumerate(refused, 1)
    ]
    runs.append(replace(runs[0], reason="it models none", frictionless=True))

    assert refusals([compare(scene, runs)]) == [
        f"a.js and b.js refused 3 cells: {walls}.",
        f"a.js refused 1 cell: {other}.",
    ]


def test_the_end_of_the_exact_answer_to_a_scene_of_ones_own_is_said():
    known = [scenario("falling_box"), scenario("bouncing_ball_e09")]
    own = [replace(each, name=f"my-{each.name}") for each in known]

    assert early_ends([compare(each, []) for each in known]) == []
    assert early_ends([compare(each, []) for each in own]) == [
        "The exact answer of my-falling_box ends at 0.409 s of 2 s, and no error after that counts:"
        " beyond it the rounding of float64 makes any engine diverge."
    ]


@pytest.mark.parametrize("box", ["p", "li", "summary"])
def test_a_long_path_stays_in_its_box_on_a_phone(browser: Browser, box: str):
    page = browser.new_page(viewport={"width": 400, "height": 800})
    css = (Path(__file__).parents[3] / "reports/page/kit.css").read_text("utf-8")
    named = f"<{box}><span class=who>/home/{'x' * 300}.py<i>:own</i></span></{box}>"
    page.set_content(f"<style>{css}</style><main>{named}</main>")
    wide = overhang(page)
    page.close()

    assert wide <= 0
