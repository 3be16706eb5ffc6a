"""Which engine for what: where a scene belongs, who is ranked, and what the first screen says."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import plotly.graph_objects as go
import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.commands.report import medians, never_played
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.compare.view import cut
from crosscheck2d.reports.page import charts, findings, overview, situations
from crosscheck2d.reports.page.cost_points import NO_CLOCK, RunTimes, with_times
from crosscheck2d.reports.page.first_screen import early_ends, situated
from crosscheck2d.reports.page.links import PAGES, neighbours
from crosscheck2d.reports.page.overview import OverviewCell
from crosscheck2d.reports.page.own_solvers import with_lines
from crosscheck2d.reports.page.page_tables import summaries
from crosscheck2d.reports.page.pooled import SCORES, by_situation, flukes, scores
from crosscheck2d.reports.page.sections import sections_of
from crosscheck2d.reports.page.situations import (
    CROWDS,
    FLIGHT,
    FRICTION,
    ROWS,
    SINGLE,
    SPIN,
    STACKS,
)
from crosscheck2d.reports.page.style import PATHS, TRUTH, Look, look, looks_of, mark_of, number
from crosscheck2d.reports.run.timing import noise_of
from crosscheck2d.reports.run.timing_pass import COLUMNS as TIMED
from crosscheck2d.reports.run.timing_pass import SCENES
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.page.browsing import opened
from tests.reports.page.small import ASTEROIDS, HEAD_ON, ORBIT, write_small

WHERE = {
    "free_fall": [FLIGHT, SPIN],
    "near_miss": [FLIGHT],
    "head_on_equal_e09": [SINGLE],
    "mass_ratios": [SINGLE],
    "disk_between_static_disks": [SINGLE],
    "galperin_31": [ROWS],
    "cradle_with_gaps": [ROWS],
    "column_of_ten": [STACKS],
    "gas_of_100": [CROWDS],
    "asteroids": [CROWDS, SPIN],
    "spin_under_torque": [FLIGHT, SPIN],
}


@pytest.mark.parametrize("name", WHERE)
def test_a_scene_belongs_where_its_answer_says(name: str):
    """By what collides with what in the exact answer, weight, and what turns."""
    scene = scenario(name)
    assert scene.truth is not None

    found = situations.situations_of(scene, scene.truth(scene.times))

    assert found[0] == WHERE[name][0]
    assert found[1:] == ([SPIN] if scene.scene.angular_velocity.any() or scene.thrusts else [])


def test_without_an_answer_all_disks_may_meet():
    """Twenty disks are then a crowd, two are not."""
    assert situations.situations_of(scenario("gas_of_100"), None)[0] == CROWDS
    assert situations.situations_of(scenario("head_on_equal_e1"), None)[0] == SINGLE


@pytest.fixture(scope="module")
def with_friction() -> tuple[list[Comparison], list[Comparison]]:
    """Comparisons of two scenes without friction and of two with it, each through two engines."""

    def compared(name: str) -> Comparison:
        names = ["reference:exercise", "pymunk:matched"]
        names += ["reference:coulomb"] if scenario(name).scene.friction else []
        one = replace(scenario(name), substeps=(1, 2))
        runs = [
            play(ENGINES[row].make(), row, one, dt) for row in names for dt in map(one.dt, (1, 2))
        ]
        return compare(one, runs)

    smooth = [compared("head_on_equal_e09"), compared("oblique_e09")]
    return smooth, [compared("friction_bounce_e1_mu01"), compared("slip_to_roll")]


def test_who_models_no_friction_is_not_shown_as_failed(with_friction):
    """In the map and at the scene it says "no friction"; another refusal stays a failure."""
    _, rough = with_friction
    row = overview.heat_map(rough, ["reference:exercise", "pymunk:matched"])["slip_to_roll"]

    assert (row[0].text, row[0].failed) == (overview.NO_FRICTION, False)
    assert {each.outcome for each in overview.failures(rough[0])} == {overview.NO_FRICTION}
    assert overview.outcome_cell(("refused", "collisions accumulate")).failed


def test_a_refusal_of_friction_is_no_failure_unless_the_engine_was_asked_for(with_friction):
    """In a run of scenes with friction alone: not in the findings, nor in the exit status."""
    _, rough = with_friction
    said = " ".join(findings.findings(rough, set()))

    assert "reference:exercise" not in said
    assert "every cell was played to its end" in said
    assert never_played(rough, by_name=False) == []
    assert never_played(rough, by_name=True) == ["reference:exercise"]


def test_an_exact_answer_of_less_than_a_tenth_of_a_scene_ranks_nobody(with_friction):
    """In so short a part of a pile nothing has come to rest."""
    [whole, _], _ = with_friction
    least = math.ceil(0.1 * whole.scenario.intervals)
    ends_early, enough = (replace(whole, truth=cut(whole.truth, k + 1)) for k in (least - 1, least))

    assert scores([ends_early]).empty
    assert situations.answers(with_times(scores([ends_early]), NO_CLOCK), {}, set()) == []
    assert "so no engine is scored" in findings.findings([ends_early], set())[0]
    assert not scores([enough]).empty


def test_an_error_far_above_both_neighbouring_step_sizes_is_marked():
    """Of the middle step size only, and only if it is wrong at all."""

    def at(errors: list[float], name: str) -> list[tuple]:
        steps = enumerate(errors)
        return [("a", name, error, np.nan, 0.1 / 2**k, k, k == 2) for k, error in steps]

    chance = at([0.165, 0.098, 6.1, 0.023], "pymunk:matched")
    falls = at([8.0, 4.0, 2.0, 1.0], "pymunk:shipped")
    rises = at([0.1, 0.1, 6.0, 6.0], "box2d:matched")
    right = at([1e-15, 1e-15, 1e-13, 1e-15], "event_driven:float64")
    found = pd.DataFrame([*chance, *falls, *rises, *right], columns=SCORES)

    assert flukes(found) == [("a", "pymunk:matched")]


def test_an_engine_with_nothing_in_a_scene_has_no_column_there(with_friction):
    """One that was not asked, or models no friction; in the map it has."""
    smooth, rough = with_friction
    first, *_, last = sections_of([*smooth, *rough])

    assert "reference:coulomb" not in first.columns
    assert "reference:exercise" in first.columns
    assert last.columns == ["pymunk:matched", "reference:coulomb"]
    assert all(len(cells) == 2 for *_, cells in last.table)


@pytest.mark.parametrize(
    ("metric", "remark", "says"),
    [
        ("collisions_missed", "43 of 86 collisions judged", "43 of 86 judged"),
        ("collisions_missed", "86 of 86 collisions judged", ""),
        ("collision_count_error", "48 of 86", "48 of 86"),
        ("energy_error", "43 of 86 samples", ""),
    ],
)
def test_of_how_many_collisions_a_count_speaks_stands_below_it(metric, remark, says):
    """-38 too few beside none missed: those that a step cannot resolve are not judged."""
    assert overview.share_of(metric, remark) == says


def test_the_end_of_the_exact_answer_stands_beside_the_name():
    """Where it ends before the scene."""
    pile = SimpleNamespace(name="pile", duration=3.0)
    ends = [SimpleNamespace(scenario=pile, truth=SimpleNamespace(horizon=h)) for h in (0.244, 3.0)]

    assert early_ends(ends[:1]) == {"pile": "up to 0.24 of 3 s"}
    assert early_ends(ends[1:]) == {}


def test_the_terminal_names_who_models_no_friction_below_the_numbers_with_units(with_friction):
    """It has no row there, so that its words widen no column; of scenes without friction it has."""
    smooth, rough = with_friction
    headings, rows, without = medians(rough, set())

    assert without == ["reference:exercise"]
    assert without[0] not in [row[0] for row in rows]
    assert headings[1] == "Position\nradii"
    assert all("\n" in heading for heading in headings[1:])
    assert medians(smooth, set())[2] == []
    refused = [replace(each, runs=[x for x in each.runs if x.name in without]) for each in rough]
    assert medians(refused, set())[1:] == ([], without)  # where no other engine was played
    assert "reference:exercise" in [row[0] for row in medians(smooth, set())[1]]


def test_an_engine_stands_in_one_group_whatever_was_played():
    """That it orders collisions is said in its row, and not read off errors, which may be
    infinite."""
    names = ["pymunk:matched", "reference:exercise", "reference:ordered", "event_driven:float64"]
    groups = situations.grouped(names)

    assert groups == {
        situations.ENGINE: names[:1],
        situations.OWN: names[1:2],
        situations.EXACT: names[2:],
    }


def test_scenes_with_friction_leave_every_other_median_as_it_is(with_friction):
    """Summary, situations and findings of a run without them are to the letter those of one with
    them; what they add stands behind."""
    smooth, rough = with_friction
    alone, both = (summaries(each, apart, set()) for each, apart in ((smooth, []), with_friction))
    assert both[0] == alone[0]
    assert [table.scenes for table in both] == [2, 2]
    assert both[1].rows["reference:exercise"][-1] == overview.OverviewCell(overview.NO_FRICTION)
    assert "Momentum" in [column.title for column in both[0].columns]
    assert "Momentum" not in [column.title for column in both[1].columns]
    assert situations.by_friction([*smooth, *rough]) == with_friction
    assert situations.by_friction(rough) == (rough, [])

    whole = [*smooth, *rough]
    rows, few = (
        situations.answers(with_times(scores(each), NO_CLOCK), situated(each), set())
        for each in (whole, smooth)
    )
    assert rows[-1].title == FRICTION
    assert rows[:-1] == few
    assert situations.whole(rows) == few[-1]

    said, less = (findings.findings(each, set()) for each in (whole, smooth))
    assert said[:-1] == less
    assert said[-1].startswith("Scenes with friction, which are not counted above. Closest to")
    # the control: in one heap, the medians would be others
    names = overview.names_of(smooth)
    heap = overview.summary(whole, names, set())
    assert heap["pymunk:matched"][0].value != alone[0].rows["pymunk:matched"][0].value


def score(errors: dict[str, list[float]]) -> pd.DataFrame:
    """Scores of scenes a, b, c, ... by `engine:profile`."""
    rows = [
        (scene, name, error, np.nan, 100.0, 0.01)
        for name, mine in errors.items()
        for scene, error in zip("abcde", mine)
    ]
    return pd.DataFrame(rows, columns=situations.COLUMNS)


ERRORS = {
    "reference:exercise": [1e-3, 1e-3, 1e-3],
    "reference:ordered": [1e-14, 1e-14, 1e3],
    "pymunk:shipped": [0.02, 0.02, 0.02],
    "pymunk:matched": [0.01, 0.01, 50.0],
    "box2d:matched": [0.03, 0.03, np.inf],
}
PLACES = {scene: [SINGLE] for scene in "abcde"}


def test_engines_are_ranked_among_themselves_and_the_next_is_another_engine():
    """By medians, which one scene does not drown; own solvers and exact references stand apart."""
    [row] = situations.answers(score(ERRORS), PLACES, set())

    assert (row.title, row.best.name, row.best.median) == (SINGLE, "pymunk:matched", 0.01)
    assert (row.best.worst, row.best.worst_in, row.best.fails) == (50.0, "c", {"c": 50.0})
    assert [(one.name, one.fails) for one in row.others] == [("box2d:matched", {"c": np.inf})]
    assert row.own is not None
    assert row.own.name == "reference:exercise"
    assert [one.name for one in row.exact] == ["reference:ordered"]


def test_a_solvers_file_is_yours_and_not_ranked_among_the_engines():
    """It stands first, though it is nearer than all of them; without it nothing is yours."""
    with_mine = score(ERRORS | {"mine.py:own": [1e-3, 2.0, 1e-9]})
    [row] = situations.answers(with_mine, PLACES, set())
    [alone] = situations.answers(score({"mine.py:own": [1e-3, 2.0]}), PLACES, set())
    groups = situations.grouped(dict.fromkeys(with_mine.name))

    assert [one.name for one in row.yours] == ["mine.py:own"]
    assert (row.yours[0].right, row.yours[0].fails) == (1, {"b": 2.0})
    assert row.best.name == "pymunk:matched"
    assert next(iter(groups)) == situations.YOURS
    assert (alone.best.name, alone.yours) == ("mine.py:own", [])


def test_findings_rank_engines_and_say_in_how_many_scenes_the_others_are_right():
    """What orders collisions by time is neither first nor in the list of who fails; your file's
    sentence is the first."""
    errors = score(ERRORS | {"mine.py:own": [1e-3, 2.0, 1e-9]})
    off = errors.pivot(index="scenario", columns="name", values="error")

    assert findings.unranked_sentence("reference:ordered", off, situations.RIGHT, {}) == (
        "reference:ordered is within 10⁻⁶ radii of the exact answer in 2 of 3 scenes, off by 1000"
        " radii in c. It is not ranked among the engines."
    )
    mine = findings.unranked_sentence("mine.py:own", off, situations.FAR_OFF, {})
    assert "mine.py is within 1 radius of the exact answer in 2 of 3 scenes, off by 2" in mine
    box2d = findings.unranked_sentence("box2d:matched", off, situations.FAR_OFF, {})
    assert "in 2 of 3 scenes, without a result in c." in box2d


def test_one_scene_is_described_without_counts_of_scenes():
    """Unbeaten in 1, and closer in 1 (farther in 0) of 1 scene: that says nothing. The scene, the
    engines and the way they moved are named."""
    errors = {
        "reference:exercise": [0.1],
        "reference:ordered": [1e-9],
        "pymunk:shipped": [0.5],
        "pymunk:matched": [0.2],
        "box2d:shipped": [0.3],
        "box2d:matched": [2.0],
        "box2d_v3:shipped": [0.4],
        "box2d_v3:matched": [0.4],
    }
    off = score(errors).pivot(index="scenario", columns="name", values="error")
    engines = off.drop(columns="reference:ordered")

    assert findings.closest(engines) == (
        "Closest of the ranked engines to the exact answer of a, by the largest deviation in radii:"
        " reference:exercise (0.1), then pymunk:matched (0.2), box2d:shipped (0.3), last"
        " box2d:matched (2)."
    )
    assert findings.worth_of_settings(engines) == [
        "In a the matched settings bring pymunk closer to the exact answer, take box2d"
        " farther from it and make no difference of more than 1 % to box2d_v3."
    ]
    assert findings.worth_of_settings(engines[["box2d:shipped", "box2d:matched"]]) == [
        "In a the matched settings take box2d farther from the exact answer."
    ]
    assert findings.where_it_fails(engines, ["ok"]) == (
        "More than one radius off, or failed: box2d:matched; every cell was played to its end."
    )
    assert findings.unranked_sentence("reference:ordered", off, situations.RIGHT, {}) == (
        "reference:ordered is within 10⁻⁶ radii of the exact answer. It is not ranked among the"
        " engines."
    )


def test_of_scenes_in_which_as_many_engines_fail_the_hardest_is_that_of_the_largest_error():
    """Of the engine that is nearest there; a scene without any result is harder still."""
    both = pd.DataFrame({"a:b": [2.0, 3.0], "c:d": [9.0, 4.0]}, index=["one", "two"])

    assert "In the hardest scene, two, 2 of 2" in findings.where_it_fails(both, ["ok"])
    both.loc["one"] = np.inf
    assert "In the hardest scene, one, 2 of 2" in findings.where_it_fails(both, ["ok"])


def test_findings_and_summary_have_one_median(comparisons: list[Comparison]):
    """Of every engine, one without any result included: it is infinitely far off in both."""
    names = overview.names_of(comparisons)
    found = scores(comparisons)
    middle = found[found.middle]
    off = findings.position_errors(middle, comparisons)
    rows = overview.summary(comparisons, names, set())

    assert {name: rows[name][0].value for name in names} == off.median().to_dict()
    assert rows["box2d_v3:shipped"][0].worst == "not played"


@pytest.mark.slow
def test_no_mark_is_left_out_however_many_situations_there_are(
    comparisons: list[Comparison], browser: Browser
):
    """Every number is drawn, also of more situations than the marks that `figure_of` puts on a line
    unless told otherwise. The control: with that many, plotly leaves out marks."""
    found = with_times(scores(comparisons), NO_CLOCK)
    rows = situations.answers(found[found.middle], situated(comparisons), set())
    figure = by_situation(found, [rows[-1]] * 8).figure
    assert figure is not None
    numbers = int(sum(np.isfinite(np.array(trace["y"], float)).sum() for trace in figure["data"]))

    def drawn() -> int:
        page = browser.new_page()
        page.set_content(go.Figure(figure).to_html(include_plotlyjs=True))
        count = page.locator(".scatterlayer .point").count()
        page.close()
        return count

    assert drawn() == numbers
    for trace in figure["data"]:
        trace["marker"]["maxdisplayed"] = 7
    assert drawn() < numbers


MARKS = {name: look(*name.split(":")) for name in (*ENGINES, *FETCHED)}


def test_every_engine_is_told_without_colour():
    """By its mark, where there are marks only; by its dash, where an engine has several lines."""
    for one, other in combinations(MARKS, 2):
        first, second = MARKS[one], MARKS[other]
        assert first.symbol != second.symbol, (one, other)
        assert one.split(":")[0] != other.split(":")[0] or first.dash != second.dash, (one, other)
    assert {each.shape for each in MARKS.values()} <= set(PATHS)
    # the control: with the shape of its engine alone, one of reference's would be another's mark
    alike = {(mark_of(name.split(":")[0]).shape, each.filled) for name, each in MARKS.items()}
    assert len(alike) < len(MARKS)


def test_a_solvers_file_is_drawn_alike_everywhere_and_unlike_its_neighbour(
    monkeypatch: pytest.MonkeyPatch,
):
    """damped.js and gravity.js, whose names stand for the same mark: however many engines are
    beside them, in the game, where a file is a row of `ENGINES`, too, and from any folder."""
    files = ["damped.js:own", "gravity.js:own"]
    two = looks_of([*files, "pymunk:shipped", TRUTH])
    elsewhere = looks_of(f"/home/anna/{name}" for name in reversed(files))
    for name in files:
        monkeypatch.setitem(ENGINES, name, ENGINES["reference:exercise"])
    in_the_game = looks_of([*files, *ENGINES])

    def drawn(found: dict[str, Look]) -> list[Look]:
        return [each for name, each in found.items() if name.endswith(":own")]

    assert drawn(two) == drawn(in_the_game) == drawn(elsewhere)[::-1]
    assert len({each.light for each in drawn(two)}) == len({each.path for each in drawn(two)}) == 2
    # the control: each alone on its page would have the same mark
    assert {looks_of([name])[name] for name in files} == {two[files[0]]}


def test_equal_medians_are_ordered_by_the_worst_scene_and_who_breaks_the_protocol_is_left_out():
    """Two engines of the same median; and the better one untrusted."""
    equal = score({"pymunk:matched": [0.1, 0.1, 9.0], "box2d:matched": [0.1, 0.1, 0.2]})
    [row] = situations.answers(equal, PLACES, set())
    [other] = situations.answers(equal, PLACES, {"box2d:matched"})

    assert row.best.name == "box2d:matched"
    assert (other.best.name, other.others) == ("pymunk:matched", [])


def test_where_no_engine_was_played_our_own_solvers_are_ranked():
    """A run of them alone still has an answer; a run of nothing has none."""
    own = score({name: ERRORS[name] for name in ("reference:exercise", "reference:ordered")})
    [row] = situations.answers(own, PLACES, set())

    assert (row.best.name, row.own) == ("reference:exercise", None)
    assert situations.answers(own.head(0), PLACES, set()) == []


@pytest.mark.slow  # a page of its own in Chromium
def test_the_table_of_the_page_is_that_of_the_scores(
    browser: Browser, path: Path, comparisons: list[Comparison]
):
    """The best engine is that with the lowest median; it is named on the first screen at 1280 px,
    above the picture."""
    page, heard = opened(browser, path.as_uri(), viewport={"width": 1280, "height": 900})
    table = page.locator(".which")
    nearest = page.locator(".nearest")
    top, named = nearest.bounding_box(), nearest.locator("span").first.inner_text()
    says = nearest.inner_text()
    rows = [row.locator("td").first.inner_text().split() for row in table.locator("tbody tr").all()]
    scene = table.locator("tbody th").first.inner_text()
    page.context.close()
    found = scores(comparisons)
    middle = found[found.middle & found.name.isin(["pymunk:matched", "box2d:shipped"])]
    best = middle.groupby("name").error.median().idxmin()

    assert top is not None
    assert top["y"] < 450
    assert scene.startswith(SINGLE)
    assert rows[0][0] == best
    assert named.split() == [*f"{SINGLE}:".split(), best]
    assert says.startswith("The library nearest to the exact answer, at a step of ")
    assert "\u00a0ms:" in says
    assert "crosscheck advise my_scene.toml --error 1%" in says
    assert heard == []


def test_every_engine_of_the_table_has_its_worst_scene(
    browser: Browser, path: Path, comparisons: list[Comparison]
):
    """The largest error of those in the median, and the scene it is in, with a link; the heads say
    what the numbers are. A situation of one scene has no worst."""
    page, _ = opened(browser, path.as_uri(), viewport={"width": 1280, "height": 900})
    heads = " ".join(page.locator(".which thead").inner_text().split())
    rows = {
        row.locator("th").inner_text().split("\n")[0]: [
            " ".join(worst.inner_text().split()) for worst in row.locator(".worst").all()
        ]
        for row in page.locator(".which tbody tr").all()
    }
    box = "document.querySelector('.which').parentNode"
    cut = page.evaluate(f"{box}.scrollWidth > {box}.clientWidth")
    page.context.close()
    found = scores(comparisons)
    placed = situated(comparisons)
    asked = situations.answers(found[found.middle].assign(cost=np.nan), placed, set())

    assert "median error of the scenes" in heads
    assert "off by more than 1 radius: by how many" in heads
    for row in asked:
        shown = [row.best, *(row.others if row.best.median <= 1 else []), *filter(None, [row.own])]
        said = [
            f"worst {number(one.worst, 2).replace('∞', 'fails')} in {one.worst_in}" for one in shown
        ]
        assert rows[row.title] == (said if len(row.scenes) > 1 else [])
    assert any(rows.values())
    assert not cut


@pytest.mark.slow  # a page of its own in Chromium
def test_bold_is_the_best_of_a_column_of_its_group(browser: Browser, path: Path):
    """Read off the page: the bold cells are those with the lowest number."""
    page, _ = opened(browser, path.as_uri())
    groups = page.evaluate(
        """() => [...document.querySelectorAll('.summary tbody')].map(body =>
          [...body.querySelectorAll('tr:not(.group)')].map(row => [...row.querySelectorAll('td')]
            .map(td => [td.firstChild.textContent.trim(), td.classList.contains('best')])))"""
    )
    page.context.close()
    checked = 0
    for rows in groups:
        for column in zip(*rows):
            numbers = {
                text: as_number(text)
                for text, _ in column
                if text not in ("–", "breaks", "not played")
            }
            lowest = min(numbers.values(), default=None)
            for text, bold in column:
                assert bold == (text in numbers and numbers[text] == lowest), column
                checked += 1
    assert checked >= 5 * 6


def as_number(text: str) -> float:
    """A number as `style.number` writes it, or the first of "1 of 3"."""
    plain = text.split(" of ")[0].replace("−", "-").replace("fails", "inf")
    plain = plain.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    if plain.startswith("10-"):
        plain = f"1×{plain}"
    return float(plain.replace("×10", "e"))


def test_where_no_engine_is_within_a_radius_none_is_called_best(
    comparisons: list[Comparison], tmp_path: Path
):
    """All positions 50 radii off. The control: as they were played, an engine is named."""
    page = tmp_path / "report.html"
    said = []
    for error in (None, 50.0):
        table = comparisons[0].table.copy()
        if error is not None:
            table.loc[table.metric == "position_max_radii", "value"] = error
        write_small(page, [replace(comparisons[0], table=table)])
        said.append("<b>none within 1 radius</b>" in page.read_text(encoding="utf-8"))

    assert said == [False, True]


def test_without_times_to_trust_the_table_has_no_costs(
    comparisons: list[Comparison], tmp_path: Path
):
    """A busy machine, and no timing: the reason stands where the cost is explained. The control: of
    a quiet clock the table has the column."""
    page = tmp_path / "report.html"
    times = pd.DataFrame(
        [
            (r.scenario, r.engine, r.profile, r.dt, 1.0, 3, 9.0, 9.0, 9.0, 1.0, 2.0, 0.0, np.nan)
            for r in comparisons[0].runs
        ],
        columns=TIMED,
    )
    said = []
    for spread, asked in (([0.7, 1.0, 1.3], 12.0), ([1.0, 1.0, 1.0], 0.0), ([1.0, 1.0, 1.0], 12.0)):
        clock = RunTimes(times, noise_of(spread), asked)
        write_small(page, comparisons[:1], clock=clock)
        text = page.read_text(encoding="utf-8")
        said.append((f"No costs: {clock.fault}" in text, 'class="cost"' in text))

    assert said == [(True, False), (True, False), (False, True)]


def test_a_cost_is_that_of_the_timing_pass_and_not_of_the_run(comparisons: list[Comparison]):
    """A run hears of every collision, which takes an engine in C much longer than its steps. Where
    a scene was not timed, or the clock is at fault, there is no cost."""
    runs = [run for each in comparisons[:2] for run in each.runs]
    rows = [
        (r.scenario, r.engine, r.profile, r.dt, 1.0, 3, 9.0, 9.0, 9.0, 1.0, 2.0, 0.0, np.nan)
        for r in comparisons[0].runs
    ]
    quiet, busy = (
        RunTimes(pd.DataFrame(rows, columns=TIMED), noise_of(spread), 12.0)
        for spread in ([1.0, 1.0, 1.0], [0.7, 1.0, 1.3])
    )
    found = with_times(scores(comparisons[:2]), quiet)

    assert {run.scenario for run in runs} == set(found.scenario)
    assert set(found.cost[found.scenario == comparisons[0].scenario.name]) == {9.0}
    assert found.cost[found.scenario != comparisons[0].scenario.name].isna().all()
    assert with_times(scores(comparisons[:2]), busy).cost.isna().all()


def test_every_situation_has_a_timed_scene():
    """So none is without a cost, in the main job."""
    timed = {
        situation
        for name in SCENES
        for situation in situations.situations_of(
            scenario(name), scenario(name).truth(scenario(name).times)
        )
    }

    assert timed == set(situations.SITUATIONS) - {situations.ALL}


def test_your_solver_comes_before_the_engines(comparisons: list[Comparison], tmp_path: Path):
    """What `check` says of the file, then its column, then the engines; without a file neither."""
    page, one = tmp_path / "report.html", comparisons[0]
    whose = {"engine": "mine.py", "profile": "own"}
    runs = [replace(run, **whose) if run.name == "reference:exercise" else run for run in one.runs]
    table = one.table.copy()
    table.loc[table.engine == "reference", list(whose)] = list(whose.values())
    write_small(page, [one])
    without = page.read_text(encoding="utf-8")
    said = {"mine.py:own": with_lines(["No fault found."], [])}
    write_small(page, [replace(one, runs=runs, table=table)], said=said)
    text = page.read_text(encoding="utf-8")
    places = [text.index(word) for word in ("No fault found", ">Your solver<", ">Best engine")]

    assert places == sorted(places)
    assert ">Your solver<" not in without


def test_one_scene_does_not_drown_a_column():
    """601 wrong collisions in one of three scenes: the median is 0, and the scene is named."""
    cells = {
        "a:b": [OverviewCell("0", value=0.0, worst="601", worst_in="column_of_ten")],
        "c:d": [OverviewCell("1", value=1.0)],
    }
    marked = overview.mark_best(cells, set())

    assert (marked["a:b"][0].best, marked["c:d"][0].best) == (True, False)
    assert not overview.mark_best(cells, {"a:b"})["a:b"][0].best


@pytest.mark.slow
def test_a_link_to_another_page_is_there_only_if_the_page_is(
    comparisons: list[Comparison], tmp_path: Path
):
    """None beside a page alone; a link that leads somewhere once the other is made."""
    page = tmp_path / "latest" / "report.html"
    page.parent.mkdir()
    write_small(page, comparisons[:1])
    alone = page.read_text(encoding="utf-8")
    speed = tmp_path / "speed" / "speed.html"
    speed.parent.mkdir()
    speed.touch()
    write_small(page, comparisons[:1])

    assert 'href="../' not in alone
    assert "crosscheck speed" in alone
    assert 'href="../speed/speed.html"' in page.read_text(encoding="utf-8")
    assert neighbours(speed, "speed")[0].href == "../latest/report.html"
    assert len(neighbours(speed, "speed")) == len(PAGES) - 1


def test_rounding_noise_takes_less_than_a_third_of_an_axis():
    """Where engines are off by 1e-3 to 1 and others by rounding; a plain axis gives it most."""
    values = np.array([1e-3, 1e-2, 1.0, 1e-16, 3e-15, 0.0])
    axis, floor = charts.broken_axis(values, charts.NOISE)
    low, high = axis["range"]

    def share(range_of: list[float]) -> float:
        return (np.log10(1e-3) - range_of[0]) / (range_of[1] - range_of[0])

    assert share([low, high]) < 1 / 3
    assert share(charts.decades(values)["range"]) > 0.7
    assert 10**low < floor < 1e-3
    assert axis["ticktext"][-1] == "< 10<sup>−9</sup>"


def test_a_broken_axis_is_struck_through_at_the_break():
    """Two strokes at the upper edge of the grey band, so that the jump is seen."""
    axis, floor = charts.broken_axis(np.array([0.1, 1.0, 1e-9]), 1e-6)
    band, *strokes = charts.marked_break(axis, floor)["shapes"]

    assert [stroke["type"] for stroke in strokes] == ["line", "line"]
    assert strokes[0]["y0"] < band["y1"] < strokes[0]["y1"]


def test_an_axis_of_rounding_alone_is_not_broken():
    """There is nothing larger to make room for."""
    axis, floor = charts.broken_axis(np.array([1e-16, 2e-15]), charts.NOISE)

    assert floor == charts.ZERO
    assert axis == charts.decades(np.array([1e-16, 2e-15]))


@pytest.mark.slow  # a page of its own in Chromium
def test_what_is_said_of_the_end_of_the_truth_is_not_clipped(browser: Browser, path: Path):
    """Its words end inside the chart, also where the truth ends near the end of the scene."""
    page, _ = opened(browser, path.as_uri(), reduced_motion="reduce")
    plot = page.locator(f"#s-{ORBIT} .plot[data-chart=deviation]")
    plot.scroll_into_view_if_needed()
    text = plot.locator(".annotation-text").first
    text.wait_for()
    words, whole = text.bounding_box(), plot.locator(".main-svg").first.bounding_box()
    page.context.close()

    assert words is not None
    assert whole is not None
    assert words["x"] >= whole["x"]
    assert words["x"] + words["width"] <= whole["x"] + whole["width"]


@pytest.mark.slow  # a page of its own in Chromium
def test_no_table_is_cut_at_1280(browser: Browser, path: Path):
    """All that stand on the page show all of their columns; at 400 px some scroll."""
    cut = []
    for width in (1280, 400):
        page, _ = opened(browser, path.as_uri(), viewport={"width": width, "height": 900})
        cut.append(
            page.evaluate(
                """() => [...document.querySelectorAll('.scroll')]
                  .filter(box => box.scrollWidth > box.clientWidth + 1 && !box.closest('details'))
                  .map(box => box.firstElementChild.className)"""
            )
        )
        page.context.close()

    assert cut[0] == []
    assert cut[1] != []


@pytest.mark.slow
def test_a_box_that_scrolls_is_reached_by_keyboard_and_has_a_name(browser: Browser, path: Path):
    """At 400 px; what shows all of itself is passed over."""
    page, heard = opened(browser, path.as_uri(), viewport={"width": 400, "height": 900})
    page.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
    page.wait_for_function(
        """() => [...document.querySelectorAll('details .scroll')]
          .every(box => box.tabIndex === 0)"""
    )
    boxes = page.evaluate(
        """() => [...document.querySelectorAll('.scroll')].filter(box => box.clientWidth).map(box =>
          [box.scrollWidth > box.clientWidth + 1, box.tabIndex, box.getAttribute('aria-label')])"""
    )
    reached = page.evaluate(
        """() => [...document.querySelectorAll('.scroll[tabindex]')].every(box => {
          box.focus(); return document.activeElement === box; })"""
    )
    page.context.close()

    assert {scrolls for scrolls, _, _ in boxes} == {True, False}
    for scrolls, index, label in boxes:
        assert (index, bool(label)) == ((0, True) if scrolls else (-1, False))
    assert reached
    assert heard == []


def test_the_scenes_of_the_page_are_three(comparisons: list[Comparison]):
    """One without an answer has no score."""
    found = scores(comparisons)

    assert set(found.scenario) == {HEAD_ON, ORBIT}
    assert ASTEROIDS not in set(found.scenario)
    assert found[found.middle].groupby("scenario").name.nunique().eq(5).all()
    assert np.isinf(found[found.name == "box2d_v3:shipped"].error).all()


def test_an_engine_alone_that_breaks_the_protocol_has_its_row(comparisons: list[Comparison]):
    """As a faulty solver's file has that is played by itself: nothing is the best of its group."""
    names = overview.names_of(comparisons)

    rows = overview.summary(comparisons, names, set(names))

    assert {len(cells) for cells in rows.values()} == {len(overview.SUMMARY)}
    assert not any(cell.best for cells in rows.values() for cell in cells)


def test_a_scene_that_a_file_refuses_is_not_counted_as_not_played(comparisons: list[Comparison]):
    """It is written for another restitution: nobody asked. What crashes in it was asked, and so was
    an engine that refuses."""
    name = "a.js:own"

    def refusals(status: str) -> list[Comparison]:
        return [
            replace(
                each,
                runs=[
                    *each.runs,
                    replace(each.middle_runs[0], engine="a.js", profile="own", status=status),
                ],
            )
            for each in comparisons[:2]
        ]

    asked = overview.summary([refusals("unsupported")[0], comparisons[1]], [name], set())
    refused = overview.summary(refusals("unsupported"), [name], set())
    crashed = overview.summary(refusals("crashed"), [name], set())

    assert asked[name][-1].text == "0 of 1"
    assert refused[name][-1].text == "not asked"
    assert crashed[name][-1].text == "2 of 2"
    assert not overview.refused_by_file("pymunk:matched", {"pymunk:matched": ("refused", "")})
    assert name not in set(scores(refusals("unsupported")).name)
    assert set(scores(refusals("crashed")).error[lambda e: np.isinf(e)]) == {np.inf}


def test_where_everything_is_refused_nothing_was_played_to_its_end():
    """An own engine's refusals are no failures, so none of its cells is counted."""
    assert findings.played_to_the_end([]) == "every cell was refused."
    assert findings.played_to_the_end(["ok"]) == "every cell was played to its end."
    assert (
        findings.played_to_the_end(["ok", "timeout"]) == "1 of 2 cells was not played to the end."
    )
