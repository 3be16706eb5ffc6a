"""The event engine against closed forms: what it answers, how long, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from crosscheck2d.adapters.event_driven import events
from crosscheck2d.adapters.event_driven.engine import EventDriven
from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.adapters.play import play
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario, Scene, Thrust
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.exact import OracleTruth
from crosscheck2d.scenarios.truth.horizon import DIVERGED
from tests.adapters.event_driven.gases import collisions_of, gas, state_after

# A thrust in the body frame makes no parabolas; disks that rest on each other are refused.
NOT_FOLLOWED = {"body_frame_thrust", "column_of_ten"}
# s: up to here an answer lists all bounces; then only those 1e-4 s apart
LISTED = {"bouncing_ball_e09": 8.0, "ball_on_supported_ball": 0.48}
ANSWERED = [name for name in SCENARIOS if scenario(name).truth and name not in NOT_FOLLOWED]


@pytest.mark.parametrize("name", ANSWERED)
def test_the_exact_answers_are_met_up_to_their_horizon(name):
    # To a few roundings; those of a start may grow to `DIVERGED` radii, where the answer ends. That
    # is a closed form, or by the oracle in many digits, which shares no algorithm with the engine.
    one, engine = scenario(name), EventDriven()
    exact = one.truth(one.times)
    played = play(engine, "event_driven:float64", one, one.dt(one.substeps[-1])).trajectory
    k = min(len(exact), len(played))
    grown = 10 * DIVERGED * one.scene.radius.min() if isinstance(one.truth, OracleTruth) else 0.0
    for field, tolerance in (
        ("position", 1e-12),
        ("velocity", 2e-12),
        # Nothing changes a spin, but where there is friction or a torque.
        ("angle", 1e-12 if one.scene.friction or one.thrusts else 1e-14),
        ("angular_velocity", 1e-12 if one.scene.friction or one.thrusts else 1e-14),
    ):
        np.testing.assert_allclose(
            getattr(played, field)[:k],
            getattr(exact, field)[:k],
            rtol=0,
            atol=tolerance + grown,
            err_msg=field,
        )
    last = min(exact.t[k - 1], LISTED.get(name, np.inf))
    events, listed = engine.engine, exact.collisions
    impulses = events.collisions[:, 3].tolist()
    reported = ((*pair, J) for pair, J in zip(collisions_of(events), impulses))
    expected = zip(*(getattr(listed, key).tolist() for key in ("t", "i", "j", "impulse")))
    rows = [
        sorted((round(t, 8), *rest) for t, *rest in half if t <= last)
        for half in (reported, expected)
    ]  # sorted: 49 balls collide at once
    assert [row[:3] for row in rows[0]] == [row[:3] for row in rows[1]]
    impulses = [[row[3] for row in half] for half in rows]
    np.testing.assert_allclose(*impulses, rtol=1e-11, atol=1e-12 + grown)


def test_disks_that_come_to_rest_on_each_other_are_refused():
    one = scenario("column_of_ten")
    run = play(EventDriven(), "event_driven:float64", one, one.dt(1))
    assert run.status == "unsupported"
    assert "accumulate" in run.reason


def two(gap=0.5, closing=1.0, **fields):
    arrays = {
        "position": [[0.0, 0.0], [1.0 + gap, 0.0]],
        "velocity": [[closing, 0.0], [0.0, 0.0]],
        "radius": [0.5, 0.5],
        "mass": [1.0, 1.0],
        "restitution": 1.0,
    }
    return Scene(**(arrays | fields))


@pytest.mark.parametrize(
    ("scene", "torus", "words"),
    [
        (
            two(gap=-0.25),
            None,
            r"disks 0 and 1 overlap by 0\.25 m at the start: move one 0\.25 m away",
        ),
        (two(gap=-(2.0**-52)), None, "disks 0 and 1 overlap by 2.22e-16 m"),
        (two(gap=0.0), None, "disks 0 and 1 touch and approach at 1 m/s at the start: leave a gap"),
        (
            two(walls=[[[0, -0.25], [9, -0.25]]]),
            None,
            r"disk 0 overlaps wall 0 by 0\.25 m at the start: move it 0\.25",
        ),
        (
            two(walls=[[[-0.5, -9], [-0.5, 9]]], closing=-1.0),
            None,
            "disk 0 touches wall 0 and moves into it at the start",
        ),
        (
            two(wrap=[[0, -0.4], [9, 0.4]]),
            None,
            r"the box is 0\.8 m wide: its largest disk has a diameter of 1 m",
        ),
        (
            two(),
            [[0, 0], [9, 2.9]],
            r"the torus is 2\.9 m wide: three diameters of its largest disk are 3 m",
        ),
        (two(gap=7.5), [[0, 0], [9, 9]], r"disks 0 and 1 overlap by 0\.5 m"),
    ],
)
def test_a_start_that_is_none_is_refused_and_says_what_would_cure_it(scene, torus, words):
    with pytest.raises(NoTruth, match=words):
        EventEngine(scene, torus)


def test_touching_disks_that_part_are_allowed():
    engine, x, _ = state_after(two(gap=0.0, closing=-1.0), 1.0)
    assert len(engine.collisions) == 0
    assert x.tolist() == [[-1.0, 0.0], [1.0, 0.0]]


def test_accumulation_is_refused_with_time_and_disk():
    # A ball above a static one at e = 0.5: from 1.4 m, over after 3 t1; the answer up to there is
    # given.
    fall = lay_out(
        [[0, 1.6], [0, 0]], radius=0.1, mass=[1.0, np.inf], restitution=0.5, gravity=[0, -9.81]
    )
    end = 3 * np.sqrt(2 * 1.4 / 9.81)
    said = r"the collisions of disk 0 on disk 1 accumulate at 1\.6027"
    with pytest.raises(NoTruth, match=said) as refusal:
        state_after(fall, 3.0)
    assert refusal.value.at == pytest.approx(end, abs=1e-12)


def test_the_wrap_is_an_event_and_a_reentry_on_top_of_a_disk_ends_the_answer():
    box_ = [[-5, -3], [5, 3]]
    for wait, free in ((-4.2, False), (-3.5, True)):
        scene = lay_out([[4.0, 0.0], [wait, 0.0]], [[2.0, 0.0], [0.0, 0.0]], radius=0.5, wrap=box_)
        if free:
            engine, x, v = state_after(scene, 1.0)
            assert collisions_of(engine) == [(0.75, 0, 1)]
            assert x.tolist() == [[-4.5, 0.0], [-3.0, 0.0]]
            assert v.tolist() == [[0.0, 0.0], [2.0, 0.0]]
        else:
            with pytest.raises(NoTruth, match=r"disk 0 re-enters on top of disk 1 at 0\.5 s"):
                state_after(scene, 1.0)


def test_a_disk_under_a_thrust_strikes_a_resting_one_at_the_root_of_the_gap():
    # From rest under 2 m/s2: a gap of 1 m is closed after 1 s at 2 m/s; equal masses swap.
    scene = two(gap=1.0, closing=0.0, restitution=1.0)
    one = Scenario("thrust", "", "", scene, 4.0, 0.125, thrusts=[Thrust(0, 0.5, 1.5, [2.0, 0.0])])
    engine = EventDriven()
    end = play(engine, "event_driven:float64", one, 0.125).trajectory.at(-1)
    assert engine.engine.collisions[:, 0].tolist() == pytest.approx([1.5], abs=1e-15)
    assert end.velocity[1, 0] == pytest.approx(2.0, abs=1e-14)
    assert end.position[1, 0] == pytest.approx(2.0 + 2.0 * 2.5, abs=1e-14)


def test_the_log_and_the_epochs_change_nothing():
    scene, torus = gas(16, 0.05)
    at_once, x, _ = state_after(scene, 5.0, torus)
    often = EventEngine(scene, torus)
    for at in np.linspace(0, 5, 777):
        often.advance(at)
    assert (often.collisions == at_once.collisions).all()
    assert (often.motion_at(5.0)[0] == x).all()
    long, _, end = state_after(scene, 20000.0, torus)
    assert len(long.collisions) > 2 * events.LOG_ROWS
    assert (np.diff(long.collisions[:, 0]) >= 0).all()
    assert (end**2).sum() == pytest.approx((scene.velocity**2).sum(), rel=1e-12)
