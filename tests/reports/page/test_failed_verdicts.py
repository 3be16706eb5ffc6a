"""A failed verdict counts as the worst value, wherever engines are ranked, and is named there."""

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.compare.pareto import cost_to_reach
from crosscheck2d.reports.compare.pooling import middle_half, pooled
from crosscheck2d.reports.page import findings, overview, situations
from crosscheck2d.reports.page.pooled import scored, scores
from crosscheck2d.scenarios.files.scene_file import read_scene_file

CASES = Path(__file__).parents[3] / "tests" / "data" / "scenes"
NAMES = ("reference:exercise", "reference:ordered", "pymunk:matched", "box2d_v3:matched")
SCENES = ("a", "b", "c", "d", "e")


@cache
def compared(name: str, *names: str) -> Comparison:
    one = read_scene_file(CASES / f"{name}.toml")
    dts = [one.dt(k) for k in one.substeps]
    names = names or NAMES
    return compare(one, [play(row_of(who).make(), who, one, dt) for who in names for dt in dts])


ERROR = st.floats(0, 1e6) | st.just(np.inf)
TABLE = st.fixed_dictionaries({name: st.tuples(*[ERROR] * len(SCENES)) for name in NAMES})


def places(errors: dict[str, list[float]]) -> list[dict[str, float]]:
    """The place of each engine in the ranking of the situations, in the median of the findings, and
    in the pooled picture; a smaller one is better."""
    rows = [
        (scene, name, error, np.nan, 1.0, 0.01)
        for name, values in errors.items()
        for scene, error in zip(SCENES, values)
    ]
    table = pd.DataFrame(rows, columns=situations.COLUMNS)
    ranks = [situations.rank(name, table[table.name == name]) for name in NAMES]
    parts = table.name.str.split(":", expand=True)
    points = table.assign(
        engine=parts[0], profile=parts[1], step_size=0, idle=0.0, cost=1.0,
        failed=np.isinf(table.error).astype(int),
    )  # fmt: skip
    points.loc[points.failed > 0, "cost"] = np.nan
    both = pooled(points)
    values = [
        {each.name: (each.median, each.worst) for each in ranks},
        table.pivot(index="scenario", columns="name", values="error").median().to_dict(),
        dict(zip(both.engine + ":" + both.profile, both.error)),
    ]
    return [
        {name: sum(other < value for other in each.values()) for name, value in each.items()}
        for each in values
    ]


@given(TABLE, st.sampled_from(NAMES), st.integers(0, len(SCENES) - 1))
def test_failing_one_more_scene_never_raises_a_rank(errors, name: str, scene: int):
    errors = {who: list(values) for who, values in errors.items()}
    before = places(errors)
    errors[name][scene] = np.inf
    after = places(errors)
    assert all(late[name] >= early[name] for early, late in zip(before, after))


@given(st.lists(ERROR, min_size=2, max_size=6), st.integers(0, 5), st.sampled_from([1e-3, 1, 1e3]))
def test_failing_one_more_step_size_never_makes_an_accuracy_cheaper(errors, k: int, accuracy):
    dt, cost = 0.1 / 2 ** np.arange(len(errors)), 2.0 ** np.arange(len(errors))
    before = cost_to_reach(accuracy, dt, cost, np.array(errors), "")
    errors[k % len(errors)] = np.inf
    after = cost_to_reach(accuracy, dt, cost, np.array(errors), "")
    assert np.isnan(after.cost) or after.cost >= before.cost


def test_of_a_failed_cell_every_score_and_every_median_is_infinite():
    heavy = compared("heavy_on_light")
    found = scores([heavy])
    failing = found[found.name == "reference:exercise"]
    assert np.isinf(failing[["error", "angle"]]).all(axis=None)
    rows = overview.summary([heavy], NAMES, set())
    for column, cell in zip(overview.SUMMARY, rows["reference:exercise"]):
        if column not in overview.COUNTED and not np.isnan(rows["box2d_v3:matched"][0].value):
            assert not np.isfinite(cell.value), column
    assert rows["reference:exercise"][-2].text == "1 of 1"
    assert middle_half(np.array([np.inf])) == np.inf


@pytest.mark.parametrize("name", ["heavy_on_light", "swapped"])
def test_no_solver_whose_disk_is_through_the_floor_is_closest_or_ranked_first(name: str):
    heavy = compared(name)
    first, broken, *rest = findings.findings([heavy], set())
    assert "Closest" in first
    assert "box2d_v3:matched" in first
    assert "reference:exercise" not in first
    assert "reference:exercise tunnels" in broken
    assert any(said.startswith("reference:ordered ") for said in rest)
    middle = scores([heavy]).query("middle").assign(cost=np.nan)
    for row in situations.answers(middle, {heavy.scenario.name: [situations.STACKS]}, set()):
        assert row.best.name == "box2d_v3:matched"
    cells = overview.heat_map([heavy], NAMES)[heavy.scenario.name]
    assert (cells[0].text, cells[0].failed) == ("tunnels", True)
    table = {key: cells for key, *_, cells in overview.scenario_table(heavy, NAMES)}
    assert [cell.failed for cell in table["tunnelled"]][::3] == [True, False]


def test_a_scene_without_an_exact_answer_is_judged_too():
    """Beside a scene that has one: the engines that fail have failed in it, no other has a row."""
    stack = compared("disk_onto_two", "reference:lesson", "pymunk:matched")
    heavy = compared("heavy_on_light")
    assert not scored(stack)
    found = scores([heavy, stack])
    failing = set(found[found.scenario == stack.scenario.name].name)
    assert "reference:lesson" in failing
    assert np.isinf(found[found.scenario == stack.scenario.name].error).all()
    assert scores([stack]).empty
    said = findings.findings([stack], set())
    assert any("reference:lesson" in each for each in said)
