"""The sentence on disks that are fast for their step."""

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.compare.fast_disks import fast_note, plain, rounded_down
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.truth.exact import with_oracle
from tests.reports.compare.answers import run_engine, run_engines

INTERVAL = 0.1  # s
PHASES = np.linspace(0.0, 1.0, 41)  # of a step, at which the disk would touch


def shot(ratio: float, phase: float = 0.5, wall: bool = False) -> Scenario:
    """A disk that moves `ratio` of the distance of touching in a coarse step, towards a disk at
    rest or a wall, which it would touch in its third step."""
    reach = 0.1 if wall else 0.2
    way = ratio * reach
    start, disks = -(2 + phase) * way - reach, 1 if wall else 2
    scene = Scene(
        position=[[start, 0], [0, 0]][:disks],
        velocity=[[way / INTERVAL, 0], [0, 0]][:disks],
        radius=[0.1, 0.1][:disks],
        mass=[1, 1][:disks],
        restitution=1,
        walls=[[[0, -5], [0, 5]]] if wall else np.zeros((0, 2, 2)),
    )
    one = Scenario("shot", "Does it pass through?", "here", scene, 0.6, INTERVAL, (1, 2))
    return replace(one, truth=with_oracle(one).truth)


def played(scenario: Scenario, *engines: str) -> Comparison:
    return compare(scenario, run_engines(scenario, *engines))


def passes_through(scenario: Scenario) -> bool:
    """Whether the disk is beyond the other, or the wall, at the end, in `reference:exercise` at the
    coarsest step."""
    x = run_engine(scenario, "reference:exercise").trajectory.position[-1, :, 0]
    return bool(x[0] > (x[1] if len(x) > 1 else 0.0))


@pytest.mark.parametrize("wall", [False, True])
def test_it_is_said_where_a_solver_passes_through_and_not_where_it_never_does(wall: bool):
    for ratio in (0.5, 0.98, 1.02, 1.5, 5.0):
        missed = any(passes_through(shot(ratio, phase, wall)) for phase in PHASES)
        note = fast_note(played(shot(ratio, wall=wall), "reference:exercise"))
        assert ("(tunnelling)" in note) == missed == (ratio > 1.0), ratio


def test_the_step_that_is_called_safe_is():
    scenario = shot(5.0)

    assert "With steps of 0.02 s it cannot." in fast_note(played(scenario, "reference:exercise"))


def test_a_cap_that_rounding_makes_smaller_is_not_named():
    # 20 m/s in a step of 0.1 s, which float32 makes a little less, are what the disk has.
    assert "allow less" not in fast_note(played(shot(10.0), "reference:exercise", "box2d:shipped"))


@pytest.mark.parametrize(
    ("value", "says"), [(12000.0, "12000"), (1e-6, "0.000001"), (100.0, "100")]
)
def test_numbers_in_the_sentence_have_no_exponent(value: float, says: str):
    assert plain(value) == says


def test_the_caps_below_the_fastest_disk_are_named():
    # Box2D 2.3 moves nothing by more than 2 units in a step, which here are 20 m/s.
    fast, slow = shot(50.0), shot(9.5)  # 100 and 19 m/s

    assert fast_note(played(fast, "reference:exercise", "box2d:shipped")).endswith(
        "The fastest disk has 100 m/s; in steps of 0.1 s some engines allow less: box2d:shipped"
        " 20 m/s."
    )
    assert "allow less" not in fast_note(played(slow, "box2d:shipped"))


def test_without_an_exact_answer_the_speeds_are_those_that_engines_reach():
    scene = replace(shot(0.1).scene, gravity=np.array([0.0, -100.0]))
    falling = replace(shot(0.1), scene=scene, truth=None, without_truth="not asked for here")

    assert "(tunnelling)" in fast_note(played(falling, "reference:exercise"))
    assert fast_note(compare(falling, [])) == ""


@pytest.mark.parametrize(
    ("value", "down"), [(0.0123, 0.01), (0.0099, 0.009), (2.0, 2.0), (37.0, 30.0)]
)
def test_a_safe_step_is_rounded_down(value: float, down: float):
    assert rounded_down(value) == pytest.approx(down)
