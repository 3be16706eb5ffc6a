"""A failed verdict counts as the worst value, wherever engines are ranked, and is named there."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.commands.run import medians
from crosscheck2d.reports.compare.accuracy import cost_to_reach, middle_half
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.page.findings import findings, nearest
from crosscheck2d.reports.page.scenes import scenes_of
from crosscheck2d.reports.page.summary import summarize
from crosscheck2d.scenarios.files.scene_file import read_scene_file

CASES = Path(__file__).parents[3] / "tests" / "data" / "scenes"
NAMES = ("reference:exercise", "reference:ordered", "pymunk:matched", "box2d_v3:matched")
ERROR = st.floats(0, 1e6) | st.just(np.inf)


@cache
def compared(name: str, *names: str) -> Comparison:
    one = read_scene_file(CASES / f"{name}.toml")
    dts = [one.dt(k) for k in one.substeps]
    names = names or NAMES
    return compare(one, [play(row_of(who).make(), who, one, dt) for who in names for dt in dts])


@given(st.lists(ERROR, min_size=2, max_size=6), st.integers(0, 5), st.sampled_from([1e-3, 1, 1e3]))
def test_failing_one_more_step_size_never_makes_an_accuracy_cheaper(errors, k: int, accuracy):
    dt, cost = 0.1 / 2 ** np.arange(len(errors)), 2.0 ** np.arange(len(errors))
    before = cost_to_reach(accuracy, dt, cost, np.array(errors), "")
    errors[k % len(errors)] = np.inf
    after = cost_to_reach(accuracy, dt, cost, np.array(errors), "")
    assert np.isnan(after.cost) or after.cost >= before.cost


def test_of_a_failed_cell_every_error_and_every_median_is_infinite():
    [heavy] = scenes_of([compared("heavy_on_light")])
    assert np.isinf(heavy.error("reference:exercise"))
    headings, rows, _ = medians([heavy], NAMES, set())
    failing = dict(zip(headings, rows[0]))
    assert failing["Position\nradii"] == "fails"
    assert failing["Fails\nscenes"] == "1 of 1"
    assert middle_half(np.array([np.inf])) == np.inf


@pytest.mark.parametrize("name", ["heavy_on_light", "swapped"])
def test_no_solver_whose_disk_is_through_the_floor_is_nearest(name: str):
    summary = summarize([compared(name)])
    first = nearest(summary)
    assert "pymunk:matched" in first
    assert "reference:exercise" not in first
    assert any("reference:exercise tunnels" in said for said in findings(summary))
    kind = summary.scenes[0].situations[0]
    assert summary.best(kind) == summary.error("pymunk:matched", kind)
    cell = summary.cell("reference:exercise", kind)
    assert cell.text == "fails"
    assert cell.notes[0].text == "tunnels"
    assert cell.notes[0].link == f"#{summary.scenes[0].name}"


def test_a_scene_without_an_exact_answer_is_judged_too():
    names = ("reference:lesson", "pymunk:shipped", "pymunk:matched")
    summary = summarize([compared("disk_onto_two", *names)])
    [scene] = summary.scenes
    assert not scene.counts
    assert np.isinf(scene.error("reference:lesson"))
    assert np.isnan(scene.error("pymunk:matched"))
    assert any("reference:lesson" in sentence for sentence in findings(summary))
    assert summary.libraries == ["pymunk:matched"]  # though no scene decides between the two
