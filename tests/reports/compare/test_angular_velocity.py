"""A spin that is reported wrong is seen, though every angle is right."""

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.scenarios.catalogue import SCENARIOS
from tests.reports.compare.answers import beside_truth, truth_of

SPINNING = ("spin_under_torque", "body_frame_thrust", "ship_thrust")


@pytest.mark.parametrize("name", SPINNING)
@pytest.mark.parametrize("factor", [0.0, 1.01, 2.0])
def test_a_wrong_angular_velocity_is_caught_even_where_all_angles_are_right(
    name: str, factor: float
):
    one, truth = truth_of(name)
    spin = truth.angular_velocity
    for dt in map(one.dt, one.substeps):
        read = [
            beside_truth(one, dt, each, truth)
            for each in (replace(truth, angular_velocity=spin * factor), truth)
        ]
        wrong, right = (METRICS["angular_velocity_max"].of(view) for view in read)
        blind = METRICS["angle_max"].of(read[0])

        assert wrong is not None
        assert right is not None
        assert blind is not None
        # what is near the end is not judged
        assert wrong.value > 0.9 * abs(factor - 1) * np.abs(spin[1:-4]).max()
        assert wrong.note == right.note == read[0].carried(read[0].judged_spin)
        assert (right.value, blind.value) == (0, 0)


def test_it_is_judged_as_the_velocity_is():
    for name in ("falling_box", "head_on_equal_e05", "spin_under_torque"):
        assert name in SCENARIOS
        one, truth = truth_of(name)
        view = beside_truth(one, one.dt(1), truth, truth)
        spin, velocity = (
            METRICS[metric].of(view) for metric in ("angular_velocity_max", "velocity_max")
        )

        assert spin == velocity
