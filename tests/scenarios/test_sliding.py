"""Closed forms with friction, against the oracle and numbers known beforehand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.friction import FRICTION
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import Legs
from crosscheck2d.scenarios.truth.exact import OracleTruth, computed
from crosscheck2d.scenarios.truth.sliding import bounced, slide

NAMES = [one.name for one in FRICTION if not isinstance(one.truth, OracleTruth)]


def truth_of(one: Scenario) -> Trajectory:
    assert one.truth is not None
    return one.truth(one.times)


@pytest.mark.parametrize("name", NAMES)
def test_closed_forms_with_friction_are_what_the_oracle_finds(name: str):
    one = scenario(name)
    expected, record = truth_of(one), computed(one)
    exact = record.sampled(one.scene, one.thrusts, one.times)

    assert record.reason == ""
    for field in ("position", "velocity", "angle", "angular_velocity"):
        # Some roundings of numbers up to 100.
        np.testing.assert_allclose(
            getattr(exact, field), getattr(expected, field), rtol=0, atol=2e-13, err_msg=field
        )
    for column in ("t", "i", "j", "impulse"):
        np.testing.assert_allclose(
            getattr(exact.collisions, column), getattr(expected.collisions, column), atol=1e-12
        )


@pytest.mark.parametrize("name", NAMES)
def test_a_wrong_friction_would_be_seen(name: str):
    one = scenario(name)
    # Where friction is more than enough, a little less is so, too.
    share = 0.5 if name == "spin_to_flight_and_back" else 0.999
    less = replace(one.scene, friction=one.scene.friction * share)
    wrong = computed(replace(one, scene=less)).sampled(less, (), one.times)

    assert np.abs(wrong.angle - truth_of(one).angle).max() > 1e-6


@pytest.mark.parametrize(
    ("restitution", "friction", "speed", "spin"),
    [(0.0, 0.1, 4.5, 4.0), (0.5, 0.1, 4.25, 6.0), (1.0, 0.1, 4.0, 8.0), (1.0, 0.5, 10 / 3, 40 / 3)],
)
def test_a_bounce_has_the_speed_and_spin_worked_out_by_hand(restitution, friction, speed, spin):
    # a solid disk of 0.25 m at (5, -5) m/s; the last one sticks
    v, w = bounced(
        np.array([[5.0, -5.0]]),
        np.zeros(1),
        np.array([0.25]),
        np.array([2.0]),
        restitution,
        friction,
    )

    np.testing.assert_allclose(v, [[speed, 5 * restitution]], rtol=1e-15)
    np.testing.assert_allclose(w, [-spin], rtol=1e-15)


def ways(legs: Legs, t: float) -> tuple[float, float]:
    speed, spin = legs.at(np.array([t]))[1][0]
    return float(speed), float(spin)


def test_a_slide_becomes_a_roll_at_two_thirds_of_its_speed():
    # at v / (3 mu g), for a solid disk; a hoop keeps half of it
    legs = slide(3.0, 0.0, 0.5, 2.0, 0.2, 0.0, 10.0)
    assert legs.start[1] == pytest.approx(0.5, rel=1e-15)
    assert ways(legs, 0.6) == pytest.approx((2.0, -4.0), rel=1e-15)
    assert ways(slide(3.0, 0.0, 0.5, 1.0, 0.2, 0.0, 10.0), 9.0) == pytest.approx((1.5, -3.0))


@pytest.mark.parametrize(("k", "tangent"), [(2.0, 0.75), (1.0, 0.5), (2.5, 0.875)])
def test_a_disk_slides_on_slopes_steeper_than_mu_times_one_plus_k(k: float, tangent: float):
    # friction 1/4; k = m r2 / I of a solid disk, a hoop, a ball
    for by, slips in ((0.999, False), (1.001, True)):
        legs = slide(0.0, 0.0, 0.5, k, 0.25, 10.0 * tangent * by, 10.0)
        speed, spin = ways(legs, 1.0)
        assert (abs(speed + 0.5 * spin) > 1e-4) == slips


def test_the_oracle_slides_from_the_same_slope_on():
    for mu, slips in ((0.2501, False), (0.2499, True)):
        scene = lay_out(
            [[0.1875, 0.25]],
            radius=0.3125,
            walls=[[[-4, 3], [4, -3]]],
            gravity=[0.0, -10.0],
            restitution=0.5,
            friction=mu,
        )
        record = computed(Scenario("slope", "?", "", scene, 0.5, 0.5))
        end = record.sampled(scene, (), np.array([0.0, 0.5])).at(1)
        slip = np.hypot(*end.velocity[0]) + 0.3125 * end.angular_velocity[0]
        assert record.method == "certified"
        assert (abs(slip) > 1e-5) == slips
