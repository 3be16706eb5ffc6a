"""The first table: who is nearest, in which settings, at what cost, and what is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.page.findings import ranked
from crosscheck2d.reports.page.scene_map import map_section, to_tick
from crosscheck2d.reports.page.scenes import (
    ANGLE,
    CROWDS,
    FLIGHT,
    FRICTION,
    ROWS,
    SINGLE,
    SPIN,
    STACKS,
    scenes_of,
    situations_of,
)
from crosscheck2d.reports.page.summary import WITHOUT, RunTimes, Summary, run_times, summarize
from crosscheck2d.reports.page.trade_offs import cost_against_size, error_against_cost, limits
from crosscheck2d.reports.run.timing import noise_of
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario

NAMES = (
    *("reference:exercise", "reference:ordered", "pymunk:shipped", "pymunk:matched"),
    *("box2d:shipped", "box2d:matched"),
)
SCENES = ("free_fall", "oblique_e09", "slow_collision", "friction_bounce_e1_mu01")
WHERE = {
    "free_fall": [FLIGHT, SPIN],
    "oblique_e09": [SINGLE, SPIN],
    "line_gas": [ROWS],
    "rest_on_floor": [STACKS],
    "gas_of_100": [CROWDS],
    "slip_to_roll": [FRICTION],
}


def played(name: str) -> Comparison:
    one = replace(scenario(name), substeps=scenario(name).substeps[1:3])
    names = [*NAMES, *["reference:coulomb"] * bool(one.scene.friction)]
    dts = [one.dt(k) for k in one.substeps]
    return compare(one, [play(ENGINES[n].make(), n, one, dt) for n in names for dt in dts])


@pytest.fixture(scope="module")
def comparisons() -> list[Comparison]:
    return [played(name) for name in SCENES]


@pytest.fixture(scope="module")
def summary(comparisons: list[Comparison]) -> Summary:
    return summarize(comparisons)


@pytest.mark.parametrize("name", WHERE)
def test_a_scene_belongs_where_its_answer_says(name: str):
    scene = scenario(name)
    assert scene.truth is not None
    kinds = situations_of(scene, scene.truth(scene.times))

    assert kinds[0] == WHERE[name][0]
    assert (SPIN in kinds) == bool(scene.scene.angular_velocity.any() and kinds[0] != FRICTION)


def test_without_an_answer_all_disks_may_meet():
    assert situations_of(scenario("gas_of_100"), None)[0] == CROWDS
    assert situations_of(scenario("head_on_equal_e1"), None)[0] == SINGLE


def test_an_engine_that_orders_collisions_is_ranked_apart_whatever_was_played():
    names = ["pymunk:matched", "reference:exercise", "reference:ordered", "event_driven:float64"]

    assert ranked(Summary([], ["a.js:own", *names])) == names[:2]
    assert ranked(Summary([], names[2:])) == names[2:]


def test_a_library_has_one_profile_the_nearer_in_more_scenes(summary: Summary):
    assert summary.chosen["box2d"][0] == "box2d:matched"
    assert summary.libraries == ["pymunk:matched", "box2d:matched"]
    only = summarize([s.comparison for s in summary.scenes if s.name == "slow_collision"])
    shipped, matched = (only.error(f"box2d:{p}", SINGLE) for p in ("shipped", "matched"))
    assert matched < shipped / 2


def test_within_a_factor_of_two_is_a_tie_and_ours_are_never_nearest(summary: Summary):
    assert all(summary.is_near(name, FLIGHT) for name in summary.libraries)
    assert not summary.is_near("reference:exercise", FLIGHT)
    assert summary.cell("reference:ordered", FLIGHT).text == "exact"


def test_an_error_that_doubles_and_a_bit_ends_the_tie(comparisons: list[Comparison]):
    table = comparisons[0].table.copy()
    worse = (table.engine == "box2d") & (table.metric == "position_max_radii")
    table.loc[worse, "value"] *= 2.1
    changed = summarize([replace(comparisons[0], table=table), *comparisons[1:]])

    assert not changed.is_near("box2d:matched", FLIGHT)
    assert changed.is_near("pymunk:matched", FLIGHT)


def test_failing_one_more_scene_never_lowers_a_median(comparisons: list[Comparison]):
    table = comparisons[1].table.copy()
    mine = (table.engine == "pymunk") & (table.metric == "momentum")
    assert mine.any()
    table.loc[mine, "value"] = 1.0
    before, after = summarize(comparisons), None
    after = summarize([comparisons[0], replace(comparisons[1], table=table), *comparisons[2:]])

    assert after.error("pymunk:matched", WITHOUT) >= before.error("pymunk:matched", WITHOUT)
    cell = after.cell("pymunk:matched", SINGLE)
    assert cell.notes[0].text == "momentum off by 100 %"
    assert cell.notes[0].link == "#oblique_e09"


def test_the_last_row_counts_the_scenes_that_the_rows_and_the_sentence_count(summary: Summary):
    for name in ("box2d:shipped", "pymunk:matched"):
        lost = [s.name for s in summary.situations[WITHOUT] if s.is_lost(name)]
        words = [note.text for note in summary.words(name, WITHOUT)]
        assert (f"lost in {len(lost)} of 3" in words) == bool(lost)
    assert summary.situations[WITHOUT][-1].is_lost("box2d:shipped")  # it does not bounce
    assert not summary.scenes[-1].is_lost("reference:exercise")  # it refuses friction
    assert summary.scenes[-1].refuses("reference:exercise")


def test_scenes_with_friction_count_in_their_own_row_only(summary: Summary):
    assert [scene.name for scene in summary.situations[FRICTION]] == [SCENES[-1]]
    assert SCENES[-1] not in [scene.name for scene in summary.situations[WITHOUT]]
    assert np.isfinite(summary.error("reference:exercise", FRICTION))
    assert np.isinf(summary.scenes[-1].error("reference:exercise"))


def test_spin_is_judged_by_the_angle(summary: Summary):
    scene = summary.situations[SPIN][0]
    errors = [s.error("pymunk:matched", metric=ANGLE) for s in summary.situations[SPIN]]

    assert scene.situations[0] in (FLIGHT, SINGLE)
    assert summary.error("pymunk:matched", SPIN) == np.median(errors)


def test_three_sentences_say_what_the_table_says(summary: Summary):
    first, *rest = (str(sentence) for sentence in summary.sentences())
    near = summary.nearest(WITHOUT)

    assert all(f"<b>{name}</b>" in first for name in near)
    assert ("a tie" in first) == (len(near) > 1 or len(summary.nearest(FRICTION)) > 1)
    assert "href='#settings'" in rest[0]
    assert "is exact in 3 of 3" in rest[-1]


def test_who_breaks_the_protocol_is_not_ranked(comparisons: list[Comparison]):
    summary = summarize(comparisons, {"pymunk:shipped", "pymunk:matched"})
    [table] = map_section(summary).parts

    assert summary.libraries == ["box2d:matched"]
    assert "pymunk:matched" not in summary.columns
    assert any(head.title == "pymunk matched" for head in table.heads)  # type: ignore[union-attr]


def times(comparisons: list[Comparison], pairs: list[float]) -> RunTimes:
    rows = [  # dt has six digits in timings.csv
        (run.scenario, run.engine, run.profile, float(f"{run.dt:.6g}"), 1 / run.dt)
        for comparison in comparisons
        for run in comparison.runs
        if run.status == "ok"
    ]
    columns = ["scenario", "engine", "profile", "dt_s", "cost_us_per_s"]
    return run_times(pd.DataFrame(rows, columns=columns), noise_of(pairs), 1.0)


def test_a_cost_is_that_of_a_step_and_stands_only_where_times_can_be_trusted(
    comparisons: list[Comparison],
):
    quiet = summarize(comparisons, clock=times(comparisons, [1.0, 1.01]))
    busy = summarize(comparisons, clock=times(comparisons, [1.0, 9.0]))

    assert quiet.cost("pymunk:matched", FLIGHT) == pytest.approx(1.0, rel=1e-4)
    assert quiet.cell("pymunk:matched", FLIGHT).side == "1 µs"
    assert busy.cell("pymunk:matched", FLIGHT).side.strip() == ""
    assert "The machine was busy" in str(busy.section().says)
    charts = [error_against_cost(each) for each in (quiet, busy)]
    assert [c is not None and "busy" in str(c.says) for c in charts] == [False, True]
    assert "engine time" in charts[0].parts[0].svg  # type: ignore[union-attr]
    assert "steps in a second" in charts[1].parts[0].svg  # type: ignore[union-attr]


def test_limits_are_the_kept_ones_and_equal_cells_are_one(summary: Summary):
    section = limits(summary)
    assert section is not None
    [table] = section.parts
    rows = {str(label.text).partition(" <")[0]: cells for _, label, cells in table.rows}  # type: ignore[union-attr]

    assert [cell.text for cell in rows["A column stands"]][:2] == ["4", "9"]
    assert rows["Slow disks bounce"][1].notes[0].text == "shipped 1"
    nearly = [c.css for c in rows["A ball keeps its height"]]
    assert nearly[:3] == ["", "", ""]  # within a factor of 2
    assert [c.css for c in rows["Fast disks meet head-on"]][:2] == ["", "best"]


def test_the_chart_of_sizes_has_every_kept_engine_of_the_table(summary: Summary):
    section = cost_against_size(summary)
    assert section is not None

    for label in ("pymunk", "Box2D 2.3", "reference", "ordered"):
        assert f">{label}<" in section.parts[0].svg  # type: ignore[union-attr]


def test_every_situation_has_a_scene_in_the_catalogue():
    kinds = {
        kind
        for one in map(scenario, SCENARIOS)
        for kind in situations_of(one, one.truth(one.times) if one.truth else None)
    }

    assert {FLIGHT, SINGLE, ROWS, STACKS, CROWDS, SPIN, FRICTION} == kinds


def test_the_farthest_engine_that_is_ticked_can_be_seen(summary: Summary):
    [scene] = scenes_of([summary.scenes[2].comparison])
    names = [run.name for run in scene.comparison.middle_runs if run.trajectory is not None]
    ticked, notes = to_tick(scene, summary, names)

    assert ticked[0] == "reference:exercise"
    assert len(ticked) <= 3
    assert sorted(notes.values()) == ["farthest", "nearest library"]
    assert scene.raw_error(ticked[-1]) > scene.raw_error(ticked[1])
