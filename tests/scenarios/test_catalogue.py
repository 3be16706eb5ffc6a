"""Every scenario of the catalogue is well posed, and answers in the shape it promises."""

from __future__ import annotations

import numpy as np
import pytest

from crosscheck2d.scenarios.catalogue import RANDOM, SCENARIOS, scenario

ANSWERED = [name for name in SCENARIOS if scenario(name).truth]
# Among the hundreds of collisions of a random scene some fall on a step, with every seed.
RESTING = (
    "rest_on_floor",
    "slide_on_incline",
    "column_of_ten",
    "slip_to_roll",
    "backspin_returns",
    "roll_or_slide",
)
MOVING = [name for name in ANSWERED if name not in (*RANDOM, *RESTING)]


def smallest_gap(scene, position):
    a, b = np.triu_indices(scene.n, 1)
    apart = (
        np.hypot(*np.moveaxis(position[:, a] - position[:, b], -1, 0))
        - scene.radius[a]
        - scene.radius[b]
    )
    gaps = [np.full(len(position), np.inf), *apart.T]
    for start, end in scene.walls:
        along = end - start
        share = np.clip((position - start) @ along / (along @ along), 0, 1)[..., None]
        gaps += list((np.linalg.norm(position - start - share * along, axis=-1) - scene.radius).T)
    return np.min(gaps, axis=0)


def test_there_are_at_least_24_and_each_is_listed_under_its_own_name():
    assert len(SCENARIOS) >= 24
    assert [scenario(name).name for name in SCENARIOS] == list(SCENARIOS)
    assert set(SCENARIOS) >= set(RANDOM)


@pytest.mark.parametrize("name", SCENARIOS)
def test_scenario_asks_one_question_and_has_a_truth_or_a_reason_for_none(name):
    run = scenario(name)
    assert run.asks.endswith("?")
    assert run.asks.count("?") == 1
    assert run.source
    assert (run.truth is None) == bool(run.without_truth)
    assert list(run.substeps) == sorted(set(run.substeps))


@pytest.mark.parametrize("name", SCENARIOS)
def test_nothing_overlaps_at_the_start_and_all_is_on_the_page(name):
    scene = scenario(name).scene
    # A unit in the last place of the coordinates: touching disks touch to rounding.
    assert smallest_gap(scene, scene.position[None])[0] >= -1e-15
    assert np.abs(scene.position).max() < 20
    # Radii from 0.1 m, but where the exercise or the unit box of the lesson has smaller ones.
    smallest = {"asteroids": 0.08, "falling_box": 0.03}.get(name, 0.1)
    assert ((scene.radius >= smallest) & (scene.radius <= 1)).all()


@pytest.mark.parametrize("name", ANSWERED)
def test_truth_starts_as_the_scene(name):
    run = scenario(name)
    state, start = run.truth(run.times).at(0), run.scene.state
    for field in ("position", "velocity", "angle", "angular_velocity"):
        # Positions come back from other coordinates (free room, weighted): the last place of 3 m,
        # times 100.
        np.testing.assert_allclose(getattr(state, field), getattr(start, field), rtol=0, atol=5e-14)


@pytest.mark.parametrize("name", ANSWERED)
def test_truth_has_one_state_a_sample_up_to_its_horizon(name):
    run = scenario(name)
    truth, n = run.truth(run.times), run.scene.n
    k = int((run.times <= truth.horizon).sum())
    assert truth.t.tolist() == run.times[:k].tolist()
    assert truth.position.shape == truth.velocity.shape == (k, n, 2)
    assert truth.angle.shape == truth.angular_velocity.shape == (k, n)
    for field in ("position", "velocity", "angle", "angular_velocity"):
        assert np.isfinite(getattr(truth, field)).all()
    collisions = truth.collisions
    assert ((collisions.t >= 0) & (collisions.t <= truth.t[-1])).all()
    assert (
        (collisions.i >= 0)
        & (collisions.i < n)
        & (collisions.j < n)
        & (collisions.j >= -len(run.scene.walls))
    ).all()
    assert (collisions.impulse >= 0).all()


@pytest.mark.parametrize("name", ANSWERED)
def test_truth_never_penetrates(name):
    run = scenario(name)
    truth = run.truth(run.times)
    # The last place of 10 m, and a hundred times that on Galperin's weighted axis.
    assert smallest_gap(run.scene, truth.position).min() >= -1e-12


@pytest.mark.parametrize("name", MOVING)
def test_no_collision_falls_on_a_step(name):
    run = scenario(name)
    collisions = run.truth(run.times).collisions.t
    collisions = collisions[collisions > 0]  # a contact at the start has no phase
    for substeps in run.substeps:
        phase = collisions / run.dt(substeps) % 1
        # Far above the rounding of a clock that adds up steps, 1e5 times 1e-16 of the time.
        assert ((phase > 1e-4) & (phase < 1 - 1e-4)).all()
        if len(collisions) <= 20:  # few collisions, so each one's phase shows in the result
            assert ((phase > 0.04) & (phase < 0.96)).all()


@pytest.mark.parametrize("name", ANSWERED)
def test_thrusts_begin_and_end_at_samples(name):
    run = scenario(name)
    for thrust in run.thrusts:
        samples = np.array([thrust.start, thrust.stop]) / run.sample_interval
        # One rounding of the quotient.
        np.testing.assert_allclose(samples, np.round(samples), rtol=1e-15)


@pytest.mark.parametrize("name", sorted(RANDOM))
def test_same_seed_same_scene_and_another_seed_another(name):
    one, same, other = scenario(name, 3), scenario(name, 3), scenario(name, 4)
    for field in ("position", "velocity", "angular_velocity", "radius", "mass", "inertia"):
        assert getattr(one.scene, field).tobytes() == getattr(same.scene, field).tobytes()
    assert (one.scene.position != other.scene.position).any()
    assert (one.seed, other.seed) == (3, 4)


def test_asteroids_are_drawn_as_the_exercise_says():
    scene = scenario("asteroids", 7).scene
    size, speed = scene.radius[1:], np.abs(scene.velocity[1:])
    assert scene.n == 21
    assert ((size >= 0.08) & (size <= 0.3)).all()
    assert ((speed >= 0.25) & (speed <= 0.5)).all()
    assert (np.abs(scene.angular_velocity) <= 0.5).all()
    np.testing.assert_array_equal(scene.mass[1:], 30 * np.pi * size**2)
    # The exercise's moment of inertia has no density in it.
    np.testing.assert_array_equal(scene.inertia[1:], np.pi / 2 * size**4)
