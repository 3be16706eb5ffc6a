"""What friction does is measured after collisions and where a disk rolls, only with friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reports.compare.metrics import METRICS
from scenarios.model import Trajectory
from tests.reports.compare.answers import beside_truth, truth_of

BOTH = ("tangential_velocity_error", "slip_at_rest")


def read(name: str, metric: str, change: float = 0.0, late: int = 0) -> float | None:
    """A metric of the exact answer itself, with so many m/s more along x from the second sample on,
    and all velocities so many samples late."""
    one, truth = truth_of(name)
    velocity = np.roll(truth.velocity, late, axis=0)
    velocity[:late] = truth.velocity[0]
    velocity[1:, :, 0] += change
    played: Trajectory = replace(truth, velocity=velocity)
    found = METRICS[metric].of(beside_truth(one, one.dt(2), played, truth))
    return None if found is None else found.value


@pytest.mark.parametrize("metric", BOTH)
def test_without_friction_there_is_no_such_number(metric: str):
    """In a bounce, a slide along a floor and a crowd."""
    for name in ("oblique_e09", "falling_box", "box_billiard"):
        assert read(name, metric) is None


@pytest.mark.parametrize("name", ["friction_bounce_e1_mu05", "spinning_disks_meet"])
def test_a_wrong_tangential_velocity_after_a_collision_is_seen(name: str):
    """0.1 m/s along the wall; the control is the exact answer, and one step late, which no number
    but the delay counts."""
    error = read(name, "tangential_velocity_error", change=0.1)
    assert error is not None
    # two disks meet at an angle, and x is not the tangent
    assert 0.01 < error <= 0.1 + 1e-12
    assert read(name, "tangential_velocity_error") == 0
    assert read(name, "tangential_velocity_error", late=1) == pytest.approx(0, abs=1e-9)


def test_slip_is_what_a_rolling_disk_should_not_have():
    """0.1 m/s of velocity that the spin does not have; the control is the exact answer, which
    rolls to its rounding."""
    for name in ("slip_to_roll", "backspin_returns"):
        assert read(name, "slip_at_rest", change=0.1) == pytest.approx(0.1, abs=1e-6)
        assert read(name, "slip_at_rest") == pytest.approx(0, abs=1e-8)
    assert read("friction_bounce_e1_mu05", "slip_at_rest") is None
