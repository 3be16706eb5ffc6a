"""A disk that leaves a torus goes on from the opposite edge, x - L, in every engine but the
exercise."""

from __future__ import annotations

from math import isnan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.advance import onto_torus
from crosscheck2d.adapters.engines import FETCHED, UNASKED, row_of
from crosscheck2d.adapters.mechanisms.ablated import AblatedReference
from crosscheck2d.adapters.mechanisms.table import EDGES, mechanisms_of, with_mechanisms
from crosscheck2d.adapters.npm_packages import missing
from crosscheck2d.adapters.play import play, play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.laws import deviation
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.truth.exact import with_oracle
from tests.reports.compare.answers import beside_truth

SPEED, SIDE, END, SAMPLE = 3.1, 4.0, 5.0, 0.02
# `UNASKED` is what plays by default. matter as shipped has friction of the air.
ENGINES = [name for name in (*UNASKED, *FETCHED) if name != "matter:shipped"]


def torus(**changed: object) -> Scenario:
    # A disk in free flight on a torus of 4 m, as `torus_flight.toml`.
    disks = {
        "position": [[0.3, -0.4]],
        "velocity": [[SPEED, -1.7]],
        "angular_velocity": [1.0],
        "radius": [0.25],
        "mass": [1.0],
        "restitution": 1.0,
        "wrap": [[-SIDE / 2, -SIDE / 2], [SIDE / 2, SIDE / 2]],
    }
    scene = Scene(**(disks | changed))  # type: ignore[arg-type]
    return with_oracle(Scenario("torus", "Where is it?", "", scene, END, SAMPLE, (1, 2, 4)))


def run_of(name: str, scenario: Scenario, substeps: int) -> Run:
    if name in FETCHED and (reason := missing(FETCHED[name].package)):
        pytest.skip(reason)
    run = play_once(row_of(name).make, name, scenario, scenario.dt(substeps))
    if run.status == "unsupported":
        pytest.skip(run.reason)
    assert run.trajectory is not None, run.reason
    return run


@pytest.mark.parametrize("substeps", [1, 2, 4])
@pytest.mark.parametrize("name", ENGINES)
def test_free_flight_on_a_torus_is_exact_at_every_step_size(name: str, substeps: int):
    flight = torus()
    assert flight.truth is not None
    path, steps = run_of(name, flight, substeps).trajectory, END / SAMPLE * substeps
    assert path is not None
    off = deviation(path, flight.truth(flight.times), flight.scene).max()
    drift = max(np.ptp(path.velocity, axis=0).max(), np.ptp(path.angular_velocity))
    # matter's velocities are differences of positions
    assert drift <= (1e-6 if name.startswith("matter") else 0.0)

    if name == "reference:exercise":
        # At every edge it loses what it flew on beyond, at most a step of either coordinate.
        crossings = (SPEED + 1.7) * END / SIDE + 2
        assert 0.01 < off <= crossings * SPEED * flight.dt(substeps)
    else:
        # A step rounds a coordinate of at most 2 m, and its length; Rapier does so four times.
        once = 2 * SIDE / 2 * row_of(name).rounding
        assert off <= 4 * steps * once * np.sqrt(2)


@pytest.mark.parametrize("substeps", [1, 2, 4])
@pytest.mark.parametrize("name", ["reference:exercise", "pymunk:matched", "box2d:matched"])
def test_a_collision_after_an_edge_is_judged_as_any_other(name: str, substeps: int):
    scenario = torus(
        position=[[1.5, 0.0], [-1.0, 0.05]],
        velocity=[[2.03, 0.1], [0.0, 0.0]],
        angular_velocity=[0.0, 0.0],
        radius=[0.25, 0.25],
        mass=[1.0, 2.0],
        restitution=0.9,
    )
    assert scenario.truth is not None
    run = run_of(name, scenario, substeps)
    view = beside_truth(scenario, run.dt, run.trajectory, scenario.truth(scenario.times))  # type: ignore[arg-type]
    read = {
        metric: METRICS[metric].of(view)
        for metric in ("restitution_error", "collisions_missed", "collisions_spurious")
    }

    assert {name: value.value for name, value in read.items() if value} == {
        "restitution_error": pytest.approx(0, abs=1e-6),  # the velocities of float32
        "collisions_missed": 0,
        "collisions_spurious": 0,
    }


@given(st.floats(-1e6, 1e6), st.floats(-100, 100), st.floats(0.1, 100))
def test_a_coordinate_is_shifted_by_whole_boxes_until_it_is_inside(
    x: float, low: float, side: float
):
    high = low + side
    there = onto_torus(x, low, high)
    rounding = 4 * 2.0**-53 * (abs(x) + abs(low) + side) * max(1.0, abs(x - low) / side)

    assert low - rounding <= there <= high + rounding
    boxes = (x - there) / (high - low)
    assert abs(boxes - round(boxes)) * side <= rounding
    assert onto_torus(there, low, high) == there or not low <= there <= high


@pytest.mark.parametrize("x", [float("inf"), float("-inf"), float("nan")])
def test_what_is_no_number_is_left_to_be_found_as_such(x: float):
    assert isnan(onto_torus(x, -2.0, 2.0))


def test_the_cut_at_the_edge_is_a_mechanism_of_the_exercise_alone():
    flight = torus()
    ours = run_of("reference:exercise", flight, 1)
    mechanisms = mechanisms_of("reference:exercise", {}, flight.scene, ours.dt)
    explained, without = (
        play(with_mechanisms(some), "reference:ablated", flight, ours.dt).trajectory
        for some in (mechanisms, [m for m in mechanisms if m.name != EDGES])
    )
    assert ours.trajectory is not None
    assert explained is not None
    assert without is not None
    assert flight.truth is not None

    assert np.array_equal(explained.position, ours.trajectory.position)
    # 250 steps of at most 2 m, each rounded twice
    off = deviation(without, flight.truth(flight.times), flight.scene).max()
    assert off <= 250 * 4 * 2 * 2.0**-53
    assert "onto_edge" in AblatedReference().settings()
