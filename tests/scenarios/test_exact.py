"""An exact answer is as exact as it says, in any unit, or ends; and what it may cost is bounded."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.reports.run.comparing import record_of
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Scenario, Thrust
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth import exact as oracle
from crosscheck2d.scenarios.truth import record as oracle_record
from crosscheck2d.scenarios.truth.exact import computed, with_oracle
from crosscheck2d.scenarios.truth.horizon import DIVERGED
from crosscheck2d.scenarios.truth.record import TruthRecord
from tests.reports.compare.metamorphic import Change
from tests.scenarios.exercise_box import boxed, lasting


def under_thrust(force: float, away: float = 0.0, duration: float = 2.0) -> Scenario:
    scene = lay_out([[away, 0.0]], [2.0, 0.0], restitution=0.9)
    return with_oracle(
        Scenario(
            "thrust", "?", "", scene, duration, 0.02, thrusts=[Thrust(0, 0.0, 1.0, [force, 0.0])]
        )
    )


def keeps_its_promise(one: Scenario, record: TruthRecord) -> bool:
    """The error bound is what engines are held to at most; a last place for the sum that it is."""
    return record.error_bound <= DIVERGED * one.scene.radius.min() * (1 + 1e-12)


@pytest.mark.parametrize(
    ("force", "away"), [(1e6, 0.0), (9e5, 1e3), (1.0, 1e5), (0.0, 1e5), (1e3, 2e5)]
)
def test_an_answer_ends_where_float64_cannot_tell_it_any_more(force: float, away: float):
    one = under_thrust(force, away, 20.0)
    record = record_of(one)
    assert keeps_its_promise(one, record)
    if record.horizon < one.duration:
        assert (
            "the rounding of float64 is more than 1e-09 of the smallest radius from t = "
            in record.reason
        )


def test_where_nothing_can_be_proved_there_is_no_answer():
    # At 10^6 m a rounding is 10^-10 m, and a few of them too much.
    with pytest.raises(NoTruth, match="the rounding of float64 is more than"):
        record_of(under_thrust(0.0, away=1e6))


def test_without_the_rule_the_promise_is_broken(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(oracle_record, "within_float64", lambda _scenario, path, _error: path)
    one = under_thrust(1e6, 0.0, 20.0)
    assert not keeps_its_promise(one, computed(one))


@pytest.mark.parametrize("force", [1e10, 1e99, 1e100, 1e125, 1e150, 1e154, 1e160, 1e300])
def test_a_thrust_out_of_scale_is_refused_at_once(force: float):
    # it went on for ever from 1e154 N on
    with pytest.raises(NoTruth, match="the largest acceleration by a thrust is"):
        record_of(under_thrust(force))


@pytest.mark.parametrize("length", [1e-300, 1e-165, 1e-10, 1e-9])
def test_a_wall_whose_square_is_nothing_is_refused_and_a_short_one_is_met(length: float):
    # it was a division by 0
    scene = lay_out([[0, 0]], [1, 0], radius=0.5, walls=[[[1, 0], [1, length]]])
    one = Scenario("short", "?", "", scene, 1.0, 0.1)
    if length < 1e-9:
        with pytest.raises(NoTruth, match="too short to follow exactly"):
            computed(one)
    else:
        record = computed(one)
        assert (record.events[:, 0].tolist(), record.reason) == ([0.5], "")


@given(
    st.floats(-1e6, 1e6),
    st.floats(-1e5, 1e5),
    st.floats(1e-4, 10.0),
    st.floats(0.1, 1e4),
    st.tuples(st.floats(-30, 30), st.floats(-30, 30)),
)
def test_no_record_breaks_its_promise(
    force: float, away: float, radius: float, duration: float, gravity: tuple
):
    scene = lay_out(
        [[away, 0.0], [away, 40.0]],
        [[1.0, 0.0], [0.0, -1.0]],
        radius=[radius] * 2,
        mass=[1.0, 2.0],
        gravity=gravity,
    )
    thrust = Thrust(0, 0.0, duration / 2, [force, 0.0])
    one = with_oracle(Scenario("any", "?", "", scene, duration, duration / 10, thrusts=[thrust]))
    try:
        record = record_of(one)
    except NoTruth:
        return
    assert keeps_its_promise(one, record)
    assert len(record.sampled(scene, one.thrusts, one.times)) > 1


UNITS = {
    "lengths x 1000": Change(length=1e3),
    "lengths / 1000": Change(length=1e-3),
    "times / 10": Change(time=0.1),
    "times x 1000": Change(time=1e3),
    "feet, minutes, pounds": Change(length=3.28084, time=1 / 60, mass=2.20462),
}


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("seed", [1, 2])
def test_the_horizon_and_the_end_of_an_answer_are_the_same_in_other_units(units: str, seed: int):
    change, one = UNITS[units], with_oracle(lasting(boxed(seed), 12.0))
    new = with_oracle(replace(change.scenario(replace(one, truth=None)), truth=None))
    before, after = computed(one), computed(new)
    # The derivatives of a motion whose start is off by 1e-16, and that is followed until this is
    # 1e-9.
    assert after.float64_horizon == pytest.approx(change.time * before.float64_horizon, rel=1e-6)
    assert after.horizon == pytest.approx(change.time * before.horizon)
    assert after.reason == before.reason == ""
    early = before.events[:, 0] < before.float64_horizon
    times, impulses = before.events[early][:, [0, 3]].T
    found = after.events[: early.sum()]
    np.testing.assert_array_equal(found[:, 1:3], before.events[early][:, 1:3])
    np.testing.assert_allclose(found[:, 0], change.time * times, rtol=1e-8)
    np.testing.assert_allclose(
        found[:, 3], change.mass * change.length / change.time * impulses, rtol=1e-7
    )
    assert before.float64_horizon < 12.0
    assert keeps_its_promise(new, after)


def test_a_horizon_by_metres_is_caught(monkeypatch: pytest.MonkeyPatch):
    change, one = UNITS["lengths x 1000"], with_oracle(lasting(boxed(1), 12.0))
    monkeypatch.setattr(
        "crosscheck2d.scenarios.truth.horizon.DIVERGED", 1e-9 / one.scene.radius.max()
    )
    before = computed(one)
    monkeypatch.setattr(
        "crosscheck2d.scenarios.truth.horizon.DIVERGED", 1e-12 / one.scene.radius.max()
    )  # of radii a thousand times as large
    after = computed(with_oracle(change.scenario(replace(one, truth=None))))
    assert after.float64_horizon < 0.99 * before.float64_horizon


def test_the_answer_up_to_the_bound_of_work_is_kept_and_says_so(monkeypatch: pytest.MonkeyPatch):
    scene = lay_out([[0, 0]], [-2.19, 2.08], radius=0.3, walls=box([-0.5] * 2, [0.5] * 2))
    one = with_oracle(Scenario("long", "?", "", scene, 1e6, 1.0, (1,)))
    monkeypatch.setattr(oracle, "WORK", 400)
    record = computed(one)
    assert record.reason.startswith("the work allowed for an answer in ")
    assert 10 < record.horizon < 100
    truth = record.sampled(scene, (), one.times)
    assert truth.t[-1] == np.floor(record.horizon)
    assert keeps_its_promise(one, record)
