"""Late costs nothing, wrong is seen: velocities, momenta and energies against the truth within the
detection delay."""

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.collisions import WINDOW
from crosscheck2d.reports.compare.delays import (
    distance_to_range,
    jumps_of,
    nearest,
    nearest_velocity,
)
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.model import Scenario, Trajectory
from tests.reports.compare.answers import beside_truth, truth_of

HELD = ("velocity_max", "velocity_rms", "momentum_deviation", "energy_deviation")


def values(one: Scenario, dt: float, played: Trajectory, truth: Trajectory) -> list[float]:
    beside = beside_truth(one, dt, played, truth)
    return [found.value for name in HELD if (found := METRICS[name].of(beside)) is not None]


def late(one: Scenario, truth: Trajectory, delay: float) -> Trajectory:
    return replace(truth, velocity=one.truth(np.maximum(truth.t - delay, 0.0)).velocity)


@pytest.mark.parametrize(
    "name", ["head_on_unequal_e05", "oblique_e09", "box_billiard", "asteroids", "gas_of_100"]
)
@pytest.mark.parametrize("steps", [0.3, 1.0, 2.7])
def test_to_be_late_by_less_than_three_steps_costs_nothing(name: str, steps: float):
    one, truth = truth_of(name)
    dt = one.dt(one.substeps[-1])

    # Rounding of velocities of up to 5 m/s; the energies and momenta are sums over 100 disks.
    assert max(values(one, dt, late(one, truth, steps * dt), truth)) < 1e-13


@pytest.mark.parametrize(
    "name", ["head_on_unequal_e05", "oblique_e09", "box_billiard", "asteroids", "gas_of_100"]
)
def test_to_be_late_by_more_than_that_is_seen(name: str):
    # The control: at four samples of the coarse step a whole collision is missing.
    one, truth = truth_of(name)

    assert values(one, one.dt(1), late(one, truth, 4 * one.dt(1)), truth)[0] > 0.1


def test_gravity_hides_no_error_of_an_integrator():
    one, truth = truth_of("bouncing_ball_e1")
    dt = one.dt(1)
    gravity = np.linalg.norm(one.scene.gravity)
    collisions = truth.collisions.t
    played = replace(truth, velocity=truth.velocity - one.scene.gravity * dt)
    apart = beside_truth(one, dt, played, truth).velocity_deviation[1:, 0]
    near = np.abs(truth.t[1:, None] - collisions).min(axis=1) < WINDOW * dt

    assert near.sum() > 20
    # digits of v - g dt
    np.testing.assert_allclose(apart[near & np.isfinite(apart)], gravity * dt, rtol=1e-9)


@pytest.mark.parametrize("steps", [0.0, 0.4])
def test_a_disk_that_is_late_may_keep_falling(steps: float):
    one, truth = truth_of("bouncing_ball_e1")
    dt = one.dt(1)
    velocity = truth.velocity.copy()
    for collision, impulse in zip(truth.collisions.t, truth.collisions.impulse):
        since = truth.t - collision
        # `steps` dt after the bounce the engine has not met the floor.
        velocity[(since >= 0) & (since <= steps * dt), 0, 1] -= impulse / one.scene.mass[0]

    # Rounding of 10 m/s, ten bounces.
    assert values(one, dt, replace(truth, velocity=velocity), truth)[0] < 1e-12


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_sample_at_the_instant_of_a_collision_may_have_the_velocity_before_it_or_after_it(
    name: str,
):
    one, truth = truth_of(name)
    jumps = jumps_of(truth, one)
    collisions = jumps.t[np.diff(jumps.t, prepend=-1) > 1e-6]
    if not len(collisions):
        pytest.skip("nothing collides here")
    at = one.truth(collisions)
    for shift in (-1e-9, 1e-9):  # s
        played = replace(at, velocity=one.truth(collisions + shift).velocity)
        apart = np.abs(nearest_velocity(played, at, jumps, 1e-7) - played.velocity)
        assert apart.max() < 1e-7  # m/s: gravity for a nanosecond
    wrong = replace(at, velocity=at.velocity * 1.01 + 0.01)
    assert np.abs(nearest_velocity(wrong, at, jumps, 1e-7) - wrong.velocity).max() > 1e-3


@pytest.mark.parametrize(
    "name",
    [
        "falling_box",
        "gas_of_100",
        "oblique_e09",
        "asteroids",
        "galperin_31",
        "frictional_box",
        "spinning_disks_meet",
        "spin_to_flight_and_back",
    ],
)
def test_collisions_take_the_energy_and_the_walls_the_momentum_that_the_truth_loses(name: str):
    one, truth = truth_of(name)
    jumps = jumps_of(truth, one)
    past = np.searchsorted(jumps.t, truth.t, side="right")
    lost = np.append(0.0, np.cumsum(jumps.energy))[past]
    taken = np.concatenate([np.zeros((1, 2)), np.cumsum(jumps.impulse, axis=0)])[past]
    energy, momentum = laws.energy(truth, one.scene), laws.momentum(truth, one.scene)
    weight = laws.moving_mass(one.scene).sum() * np.outer(truth.t, one.scene.gravity)

    # Sums of a few hundred terms of the size of the scale.
    np.testing.assert_allclose(energy, energy[0] - lost, rtol=0, atol=1e-12 * scales.energy(one))
    np.testing.assert_allclose(
        momentum, momentum[0] + weight + taken, rtol=0, atol=1e-12 * scales.momentum(one)
    )
    assert len(jumps.t) > 0


def test_of_two_collisions_at_one_instant_either_may_come_first():
    # A ball in the middle of a row receives an impulse and gives one; mirrored, the list has the
    # two the other way round.
    t, when = np.array([1.0]), np.array([1.0, 1.0])
    receive, give = np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    still = np.zeros((1, 1, 2))
    limits = np.array([0, 2])
    for change in (np.array([receive, give]), np.array([give, receive])):
        for met in (receive, give, np.zeros(2)):
            assert np.array_equal(
                nearest(t, met[None, None], still, limits, when, change, 0.1)[0, 0], met
            )
    # the control: one after the other, to give before it receives is wrong
    apart = np.array([1.0, 1.01])
    found = nearest(
        t + 0.02, give[None, None], still, limits, apart, np.array([receive, give]), 0.1
    )[0, 0]
    assert not np.array_equal(found, give)


def test_the_distance_to_a_range_of_sums_is_that_to_a_parallelogram():
    rng = np.random.default_rng(1)
    for _ in range(200):
        turn = rng.uniform(0, 2 * np.pi)
        c, s = np.cos(turn), np.sin(turn)
        turned = np.array([[c, s], [-s, c]])
        # together [-1, 1.5] x [0, 2]
        parts = np.array([[1.0, 0.0], [0.0, 2.0], [0.5, 0.0], [-1.0, 0.0]])
        point = rng.uniform(-4, 4, 2)
        expected = np.hypot(*(point - np.clip(point, [-1, 0], [1.5, 2])))

        # Rounding of four subtractions of numbers up to 4.
        assert distance_to_range(point @ turned, parts @ turned) == pytest.approx(
            expected, abs=1e-12
        )


def test_a_point_within_a_range_of_many_impulses_has_no_distance():
    rng = np.random.default_rng(2)
    for _ in range(50):
        parts = rng.normal(size=(20, 2))
        # The shares are found one after the other, in at most `SWEEPS` rounds: to 1e-6 of the
        # impulses at hand.
        assert distance_to_range(rng.uniform(size=20) @ parts, parts) < 1e-6
