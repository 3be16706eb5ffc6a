"""Every sentence of a lesson that states a number or a trend is true of the curves beside it, at
every setting."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.engines import DISTINCT, ENGINES
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.lesson import Claim, Curve, Lesson, Shown
from crosscheck2d.reports.lessons.limits import SEEN, limits_of
from crosscheck2d.reports.lessons.pages import FILES, answer_json, lesson_page
from crosscheck2d.reports.page.style import TRUTH
from crosscheck2d.reports.stability.limits import LIMIT, QUICK
from tests.reports.lessons.browsing import opened_lesson

COSTLY = ("box", "crowd", "horizon", "limits")  # a second or more for each setting
EVERY = [pytest.param(name, marks=pytest.mark.long if name in COSTLY else ()) for name in LESSONS]
TIMED = "crowd"  # its curves are times, which a busy machine disturbs


def ends(lesson: Lesson) -> list[tuple[int, ...]]:
    """Where the sliders begin, and every combination of their two ends."""
    corners = product(*({0, len(slider.values) - 1} for slider in lesson.sliders))
    return sorted({lesson.start, *corners})


@cache
def shown_at(name: str, places: tuple[int, ...]) -> Shown:
    """What a lesson shows there; one run for all tests of this file."""
    return LESSONS[name].at(places)


def false_claims(shown: Shown) -> list[str]:
    """The sentences that the curves contradict."""
    return [claim.text for claim in shown.claims if not claim.holds(shown)]


@pytest.mark.parametrize("name", EVERY)
def test_every_claim_holds_at_the_ends_of_all_sliders(name: str):
    """And where they begin. Times are taken up to three times: what disturbs them does not last."""
    for places in ends(LESSONS[name]):
        wrong = false_claims(shown_at(name, places))
        for _ in range(2 if name == TIMED and wrong else 0):
            wrong = min(wrong, false_claims(LESSONS[name].at(places)), key=len)
        assert wrong == [], places


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in LESSONS if name not in (TIMED, "limits")])
def test_every_claim_holds_at_every_setting(name: str):
    """Between the ends, too."""
    for places in LESSONS[name].grid:
        assert false_claims(LESSONS[name].at(places)) == [], places


@pytest.mark.long
@pytest.mark.parametrize("case", range(len(LESSONS["limits"].sliders[0].values)))
def test_every_claim_on_a_limit_holds_for_every_engine(case: int):
    """In each case; a case without an engine has none."""
    for engine in range(len(DISTINCT)):
        assert false_claims(LESSONS["limits"].at((case, engine, 0))) == []


def distorted(shown: Shown) -> Iterator[Shown]:
    """The same sentences over other curves: of the engines only, each larger by another factor; of
    all, upside down, scattered, steeper, with the values of the neighbour, standing still, 0."""

    def others(change: Callable[[int, Curve, np.ndarray, np.ndarray], np.ndarray]) -> Shown:
        charts = []
        for chart in shown.charts:
            ys = [np.asarray(curve.y, float) for curve in chart.curves]
            curves = []
            for k, (curve, y) in enumerate(zip(chart.curves, ys)):
                y = change(k, curve, y, ys[k - 1][: len(y)])
                curves.append(replace(curve, x=np.asarray(curve.x)[: len(y)], y=y))
            charts.append(replace(chart, curves=curves))
        return replace(shown, charts=charts)

    yield others(lambda k, curve, y, _: y if curve.name == TRUTH else (1.5 + 9 * k) * y + 1 + k)
    yield others(lambda _, __, y, ___: -y)
    yield others(lambda _, __, y, ___: y + np.cos(np.arange(len(y))))
    yield others(lambda _, __, y, ___: y * np.geomspace(1, 1e3, len(y)))
    yield others(lambda _, __, ___, neighbour: neighbour)
    yield others(lambda _, __, y, ___: np.full(len(y), y[0]))
    yield others(lambda _, __, y, ___: np.zeros(len(y)))


def refuted(claim: Claim, shown: Shown) -> bool:
    """Whether these curves contradict it; curves that it cannot be read off do not."""
    try:
        return not claim.holds(shown)
    except (IndexError, ValueError):
        return False


@pytest.mark.parametrize("name", EVERY)
def test_every_claim_can_be_false(name: str):
    """There are curves that contradict it; a sentence that none contradicts would claim nothing."""
    for places in ends(LESSONS[name]):
        shown = shown_at(name, places)
        for claim in shown.claims:
            assert any(refuted(claim, other) for other in distorted(shown)), claim.text


def test_an_engine_that_does_otherwise_makes_its_claims_false(monkeypatch: pytest.MonkeyPatch):
    """The sentences do not follow the engines: what plays as pymunk, but moves last, is caught."""
    monkeypatch.setitem(ENGINES, "pymunk:matched", ENGINES["reference:exercise"])
    wrong = false_claims(LESSONS["order"].at(LESSONS["order"].start))

    assert [re.split("[.:]( |$)", text)[0] for text in wrong] == [
        "pymunk:matched moves first",
        "The distance between these two is g dt t, the sum of both offsets",
        "With this setting the ablated reference does not lie on pymunk:matched",
    ]


@pytest.mark.slow
def test_the_page_marks_a_sentence_that_its_curves_contradict(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """On another machine, with other versions, the reader is told."""
    monkeypatch.setitem(ENGINES, "pymunk:matched", ENGINES["reference:exercise"])
    lesson = LESSONS["order"]
    path = tmp_path / "order.html"
    path.write_text(lesson_page(lesson, answer_json("order", lesson.start), FILES))
    page, heard = opened_lesson(browser, path.as_uri())
    marked = page.locator(".claims b").all_inner_texts()
    page.context.close()

    assert marked == ["Not in this run:"] * 3
    assert heard == []


STATES = re.compile(
    r"\d|%|½|²|\b(half|halves|twice|times|fewer|less|more|most|least|larger|smaller|longer|shorter"
    r"|higher|lower|faster|slower|farther|grows?|falls|rises?|gains?|loses?|keeps?|always|never"
    r"|every|each|all|none|same|equal|exact|exactly|level|late|early)\b"
)
"""What a sentence that states a number or a trend is made of."""
NO_CLAIM = {
    "particle": {"In the last part a step may": "says what comes; part 3 claims it"},
    "thrust": {
        "Write the step as": "defines α",
        "Velocity first is α = 1": "defines α",
    },
    "box": {
        "In a collision of a disk": "the law; e² follows from the formula in it",
        "Between two collisions the sum": "the law; the first claim says who breaks it",
        "The exact answer ends": "defines where; lesson 7 claims it",
    },
    "meeting": {"Find the impulse": "defines e"},
    "crowd": {
        "Among n disks": "counts pairs",
        "The exercise tests each": "says what reference:exercise does",
        "Both give the same": "tests/reference_impl/test_neighbours.py holds it",
        "A time is the shortest": "says how it is measured",
    },
    "threshold": {
        "Raise it": "an instruction; the last claim says whether it is done",
    },
    "mixing": {
        "But an engine keeps": "defines a rule",
        "One of them is that of": "the claims name the rule of each",
        "Two disks with different": "says why there is no exact answer",
    },
    "order": {"With the same gravity": "says what the scene is"},
    "gravity": {
        "Box2D plays twice": "says who plays; a claim says at which dt it is needed",
        "Pymunk plays without": "says who plays; a claim has its height",
    },
    "correction": {
        "Box2D removes a share": "defines the slop; the second claim has its numbers",
        "Here a disk starts": "says what the scene is",
        "Continuous collision": "says who plays",
    },
    "substeps": {"Box2D 3.1 divides": "defines n; both claims have its numbers"},
    "digits": {
        "A float32 number": "test_a_float32_number_has_24_binary_digits",
        "The farther a disk": "the first claim has its numbers",
    },
    "cap": {"Box2D limits": "defines the cap"},
    "row": {
        "A solver of simultaneous": "defines the method",
        "E times its closing": "defines the method",
        "Then it goes": "defines an iteration",
        "All contacts": "says what the scene is",
        "The exact answer takes": "says how it is found; the second claim has what comes of it",
        "It tries every order": "test_a_row_whose_outcome_depends_on_the_order_has_no_exact_answer",
        "The masses are equal": "says what the scene is",
    },
    "horizon": {
        "There the exact answer ends": "the first claim says when",
        "What stays comparable": "the last claim",
    },
    "limits": {
        "In the names of the cases": "defines letters",
        "It misses": "says what failing is",
        "Then it halves": "test_a_limit_is_bracketed_as_closely_as_the_text_says",
        "A reason counts": "defines what tested means",
        "The command": "names a command",
        "As matched, Box2D": "test_bullets_are_where_the_text_says",
        "Box2D sweeps": "test_box2d_sweeps_disks_against_walls_and_only_bullets_against_disks",
        "+16_substeps": "names what is changed",
    },
    "friction": {
        "Jₙ = (1 + e) m vₙ": "defines both; the first claim has its number",
        "An impulse of |slip|": "defines to stick; the list below has its numbers",
        "Coulomb's law allows": "defines the cone; a claim says where the impulse lies",
        "See": "names other lessons",
    },
    "cone": {
        "Box2D 3.1 solves": "says what the mechanism is; the last claims show it on and off",
        "In the first": "the same; the third claim has its numbers",
        "The friction cone is": "the third claim",
        "The ablated reference plays": "says who plays",
        "The disk is so fast": "follows from the second claim: the impulse is on the edge",
    },
    "lever": {
        "A wall of Box2D": "defines the skin; the second claim has what becomes of it",
        "It matters most": "the second claim has its numbers",
    },
    "float32": {
        "Box2D 2.3 computes": "names its numbers; test_float32.py plays both",
        "Planck is Box2D 2.3": "says what planck is",
        "Both have the same settings": "test_planck_differs_from_box2d_by_float32_alone",
        "The error of Box2D minus": "defines the share; the first claim has it",
        "A share below 0": "defines its sign; the first claim has it",
        "A smaller step makes": "says why; the claim on half the step has it",
        "It also makes more steps": "counts steps; the claim on their number has what comes of it",
    },
    "javascript": {
        "Planck is Box2D 2.3": "says what planck is; its threshold is a claim",
        "Matter-js differs": "test_javascript_bounces.py disables each",
        "The matched profiles": "the claims say that they give e",
        "Matter's disks then": "test_javascript_bounces.py holds it",
    },
    "rolling": {
        "From then on": "defines to roll; the second claim says when",
        "A disk with back spin": "the second claim says whether it does",
        "An engine keeps": "says what mixing is",
        "Pymunk multiplies": "test_two_different_coefficients_are_mixed_as_the_text_says",
        "See": "names another lesson",
    },
}
"""Sentences of the text with such a word that are no statement about a curve -> why not."""


def sentences(lesson: Lesson) -> list[str]:
    """Of its paragraphs, without their markup, each with a capital letter."""
    plain = re.sub(r"<[^>]*>|\[\w+\]", "", " ".join(lesson.paragraphs))
    return [each[:1].upper() + each[1:] for each in re.split(r"(?<=[.?!:;]) ", plain)]


@pytest.mark.parametrize("name", LESSONS)
def test_what_the_text_states_in_numbers_is_a_claim(name: str):
    """The text itself defines and explains; what it says beyond that of the curves must be a claim.
    A sentence that is no longer there must not be excused either."""
    excused = NO_CLAIM.get(name, {})
    stating = [each for each in sentences(LESSONS[name]) if STATES.search(each)]

    assert [each for each in stating if not each.startswith(tuple(excused))] == []
    assert [start for start in excused if not any(each.startswith(start) for each in stating)] == []


def test_a_float32_number_has_24_binary_digits():
    """23 that are stored and the first."""
    assert np.finfo(np.float32).nmant + 1 == 24


@pytest.mark.slow
@pytest.mark.parametrize(
    "cases", [1, pytest.param(None, marks=pytest.mark.long)], ids=["the first", "all"]
)
def test_a_limit_is_bracketed_as_closely_as_the_text_says(cases: int | None):
    """The ratio of what works to what fails, of all limits of the cases of lesson 8."""
    assert f"{QUICK.ratio - 1:.0%} apart" in LESSONS["limits"].paragraphs[0]
    for seen in list(SEEN.values())[:cases]:
        for limit in limits_of(seen.case):
            if limit.verdict == LIMIT:
                pair = sorted([limit.works_at, limit.fails_at])
                # A bracket is left where its middle, of three digits, would be one of its ends.
                assert pair[1] / pair[0] <= QUICK.ratio + 1e-9, (seen.case, limit.engine)
