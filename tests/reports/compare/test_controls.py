"""No perfect score of nothing: who freezes, doubles its speed or gains energy is caught in every
scene of the suite."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.scales import top_speeds
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.model import Scenario, Trajectory
from tests.adapters.broken_engines import DoublesSpeed, Exact, Freezes, GainsEnergy
from tests.reports.compare.answers import beside_truth, truth_of

STILL = {"rest_on_floor", "column_of_ten"}
"""Scenes whose truth stands still: to freeze is right there, and twice no speed is none, so nothing
is to be caught."""
MOVING = [name for name in SCENARIOS if name not in STILL]
FEW = {"free_fall", "falling_box", "ship_thrust", "asteroids"}
VELOCITIES = (
    *("velocity_max", "velocity_rms", "momentum_deviation"),
    *("energy_error", "energy_deviation", "energy_loss_error"),
)


def scaled(factor: float) -> Callable[[Trajectory], Trajectory]:
    def corrupt(truth: Trajectory) -> Trajectory:
        size = np.append(1.0, np.full(len(truth) - 1, factor))
        spin = truth.angular_velocity * size[:, None]
        return replace(truth, velocity=truth.velocity * size[:, None, None], angular_velocity=spin)

    return corrupt


CONTROLS = {
    "freezes": scaled(0.0),
    "doubles its speed": scaled(2.0),
    "gains 2 % of energy": scaled(1.01),
}


def largest(one: Scenario, dt: float, played: Trajectory, truth: Trajectory) -> float:
    beside = beside_truth(one, dt, played, truth)
    found = {name: METRICS[name].of(beside) for name in VELOCITIES}
    fastest = top_speeds(one)[0].max() or 1.0
    relative = [
        abs(one.value) / (fastest if "velocity" in name else 1)
        for name, one in found.items()
        if one
    ]
    return float(np.nanmax(relative))


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("name", MOVING)
def test_a_wrong_velocity_is_caught_at_every_step_size_even_where_all_positions_are_right(
    name: str, control: str
):
    one, truth = truth_of(name)
    assert truth.velocity.any() or truth.angular_velocity.any()
    for substeps in one.substeps:
        dt = one.dt(substeps)

        # An energy off by 2 % is a hundredth of a speed; a scene's fastest is as fast as it can
        # get, not as it is.
        assert largest(one, dt, CONTROLS[control](truth), truth) > 1e-3
        assert largest(one, dt, truth, truth) == 0


@pytest.mark.parametrize("name", sorted(STILL))
def test_what_stands_still_is_not_to_be_caught(name: str):
    _, truth = truth_of(name)

    assert not truth.velocity.any()
    assert not truth.angular_velocity.any()


@pytest.mark.parametrize("make", [Freezes, DoublesSpeed, GainsEnergy])
@pytest.mark.parametrize(
    "name", [name if name in FEW else pytest.param(name, marks=pytest.mark.long) for name in MOVING]
)
def test_an_engine_that_does_so_is_caught_in_the_tables(name: str, make: type[Exact]):
    one = replace(scenario(name), substeps=(scenario(name).substeps[0],))
    dt = one.dt(one.substeps[0])
    tables = [
        compare(one, [play(each(), "reference:exercise", one, dt)]).table for each in (make, Exact)
    ]
    wrong, sound = (
        table.drop_duplicates("metric", keep="last").set_index("metric").value for table in tables
    )
    excess = wrong.abs() - sound.abs()

    # 10 % of the energy, of what is at hand in the whole scene: least in a fall that has just
    # begun.
    assert excess[["energy_error", "energy_deviation", "momentum_deviation"]].max() > 1e-3
    assert np.isfinite(wrong["velocity_max"])


# Spins.

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

        # what is near the end is not judged
        assert wrong.value > 0.9 * abs(factor - 1) * np.abs(spin[1:-4]).max()
        assert wrong.note == right.note == read[0].carried(read[0].judged_spin)
        assert (right.value, blind.value) == (0, 0)


def test_a_spin_is_judged_as_the_velocity_is():
    for name in ("falling_box", "head_on_equal_e05", "spin_under_torque"):
        one, truth = truth_of(name)
        view = beside_truth(one, one.dt(1), truth, truth)
        assert METRICS["angular_velocity_max"].of(view) == METRICS["velocity_max"].of(view)
