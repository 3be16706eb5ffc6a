"""What friction does is measured in collisions, where a disk begins to roll and where it rolls;
only with friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.reports.compare.friction_metrics import end_of_slip
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.scenarios.model import Trajectory
from crosscheck2d.scenarios.truth.sliding import slide
from tests.reports.compare.answers import beside_truth, truth_of

IN_COLLISIONS = (
    "tangential_velocity_error",
    "friction_impulse_error",
    "friction_loss_error",
    "restitution_loss_error",
)
ROLLING = ("slip_at_rest", "time_to_roll_error_s")


def measured(name: str, metric: str, **changed: np.ndarray) -> float | None:
    """A metric of the exact answer itself with some arrays changed."""
    one, truth = truth_of(name)
    played: Trajectory = replace(truth, **changed)
    found = METRICS[metric].of(beside_truth(one, one.dt(2), played, truth))
    return None if found is None else found.value


def read(name: str, metric: str, change: float = 0.0, late: int = 0) -> float | None:
    """`measured` with so many m/s more along x from the second sample on, and all velocities and
    spins so many samples late."""
    _, truth = truth_of(name)
    velocity, spin = (
        np.concatenate([series[:1].repeat(late, axis=0), series[: len(series) - late]])
        for series in (truth.velocity, truth.angular_velocity)
    )
    velocity[1:, :, 0] += change
    return measured(name, metric, velocity=velocity, angular_velocity=spin)


@pytest.mark.parametrize("metric", [*IN_COLLISIONS, *ROLLING])
def test_without_friction_there_is_no_such_number(metric: str):
    for name in ("oblique_e09", "falling_box", "box_billiard"):
        assert read(name, metric) is None


def test_where_nothing_collides_or_nothing_rolls_the_number_is_left_out():
    for metric in IN_COLLISIONS:
        assert read("slip_to_roll", metric) is None
    for metric in ROLLING:
        assert read("friction_bounce_e1_mu05", metric) is None


@pytest.mark.parametrize("name", ["friction_bounce_e1_mu05", "spinning_disks_meet"])
def test_a_wrong_tangential_velocity_after_a_collision_is_seen(name: str):
    error = read(name, "tangential_velocity_error", change=0.1)
    # two disks meet at an angle, and x is not the tangent
    assert 0.01 < error <= 0.1 + 1e-12
    assert read(name, "tangential_velocity_error") == 0
    assert read(name, "tangential_velocity_error", late=1) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("metric", IN_COLLISIONS[1:])
@pytest.mark.parametrize("name", ["friction_bounce_e05_mu05", "spinning_disks_meet"])
def test_a_collision_a_step_late_is_no_error_of_friction(name: str, metric: str):
    assert read(name, metric) == 0
    assert read(name, metric, late=1) == pytest.approx(0, abs=1e-12)


def test_a_tenth_of_the_spin_that_friction_gives_is_missed_is_a_tenth_of_its_impulse():
    # m r w / 2 of a solid disk: without spin at first it turns at 2 J / (m r) afterwards.
    name = "friction_bounce_e1_mu05"
    _, truth = truth_of(name)
    start = truth.angular_velocity[0]
    less = start + 0.9 * (truth.angular_velocity - start)
    biggest = np.abs(truth.angular_velocity[-1] - start).max() * 0.25 / 2

    error = measured(name, "friction_impulse_error", angular_velocity=less)
    assert error == pytest.approx(0.1 * biggest)


def test_the_loss_by_friction_and_that_by_restitution_are_told_apart():
    name = "friction_bounce_e05_mu05"
    one, truth = truth_of(name)
    spin = np.broadcast_to(truth.angular_velocity[0], truth.angular_velocity.shape)
    slower = truth.velocity.copy()
    slower[..., 1] = np.where(slower[..., 1] > 0, 0.9 * slower[..., 1], slower[..., 1])
    kinetic = one.scene.mass @ (one.scene.velocity**2).sum(axis=1) / 2
    kinetic += one.scene.inertia @ one.scene.angular_velocity**2 / 2
    # 6 disks of 1 kg that leave at 2 m/s
    lost = 6 * (1 - 0.9**2) * 2.0**2 / 2 / kinetic

    assert abs(measured(name, "friction_loss_error", angular_velocity=spin) or 0) > 0.01
    assert measured(name, "restitution_loss_error", angular_velocity=spin) == 0
    assert measured(name, "restitution_loss_error", velocity=slower) == pytest.approx(lost)
    # the tangent is off the floor by rounding
    assert measured(name, "friction_loss_error", velocity=slower) == pytest.approx(0, abs=1e-12)


def test_a_slide_with_a_tenth_less_friction_is_late_by_a_ninth_of_its_time():
    # v0 / (3 mu g); a slide forwards, and one with back spin; the control is the exact answer.
    for name, speed, spin in (("slip_to_roll", 3.0, 0.0), ("backspin_returns", 1.5, 30.0)):
        _, truth = truth_of(name)
        _, rate = slide(speed, spin, 0.25, 2.0, 0.18, 0.0, 9.81).at(truth.t)
        velocity = truth.velocity.copy()
        velocity[:, 0, 0] = rate[:, 0]
        error = measured(
            name, "time_to_roll_error_s", velocity=velocity, angular_velocity=rate[:, 1:]
        )

        takes = (speed + 0.25 * spin) / (3 * 0.2 * 9.81)
        assert error == pytest.approx(takes / 9)
        assert read(name, "time_to_roll_error_s") == 0


def test_a_slide_that_never_ends_is_late_up_to_the_end_of_the_run():
    one, truth = truth_of("slip_to_roll")
    still = replace(truth, angular_velocity=np.zeros_like(truth.angular_velocity))
    error = METRICS["time_to_roll_error_s"].of(beside_truth(one, one.dt(2), still, truth))

    assert error.value == pytest.approx(truth.t[-1] - 3.0 / (3 * 0.2 * 9.81))
    assert error.note == "at least: it slips to the end"


def test_the_end_of_a_slip_is_found_between_two_samples():
    t = np.arange(9.0)
    assert end_of_slip(t, np.maximum(5.25 - t, 0)) == pytest.approx(5.25)
    assert end_of_slip(t, np.minimum(2 * t - 10.5, 0)) == pytest.approx(5.25)
    assert end_of_slip(t, 20.0 - t) == np.inf


def test_slip_is_what_a_rolling_disk_should_not_have():
    # 0.1 m/s of velocity that the spin does not have; the control is the exact answer, which rolls
    # to its rounding.
    for name in ("slip_to_roll", "backspin_returns"):
        assert read(name, "slip_at_rest", change=0.1) == pytest.approx(0.1, abs=1e-6)
        assert read(name, "slip_at_rest") == pytest.approx(0, abs=1e-8)
