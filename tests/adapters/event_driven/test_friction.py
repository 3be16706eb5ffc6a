"""Friction in the event engine and in the oracle: what it keeps, what it loses, when it rolls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crosscheck2d.adapters.event_driven.engine import EventDriven
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust, Trajectory
from crosscheck2d.scenarios.truth.exact import computed
from crosscheck2d.scenarios.truth.oracle.numbers import mpfr

G = 10.0
FLOOR = [[[-64.0, 0.0], [64.0, 0.0]]]
EPS = float(np.finfo(float).eps)


def asked(scene: Scene, duration: float = 2.0, thrusts: tuple[Thrust, ...] = ()) -> Scenario:
    return Scenario("asked", "?", "", scene, duration, duration / 32, thrusts=thrusts)


def played(one: Scenario) -> Run:
    return play(EventDriven(), "event_driven:float64", one, one.sample_interval)


def trajectory(one: Scenario) -> Trajectory:
    run = played(one)
    assert run.status == "ok", run.reason
    assert run.trajectory is not None
    return run.trajectory


def energy(scene: Scene, motion: Trajectory) -> Array:
    """(k,) J, of flight, height and spin."""
    moves = ~scene.static
    m, inertia = scene.mass[moves], scene.inertia[moves]
    v, x, w = (motion.velocity[:, moves], motion.position[:, moves], motion.angular_velocity)
    flies = m @ ((v**2).sum(-1) / 2 - x @ scene.gravity).T
    turns: Array = flies + (w[:, moves] ** 2) @ inertia / 2
    return turns


def gas(seed: int, restitution: float, walls: bool, gravity: float = 0.0) -> Scene:
    draw = np.random.default_rng([5, seed])
    radius = draw.uniform(0.1, 0.4, 6)
    position = scatter(draw, [-1.5, -1.5], [1.5, 1.5], radius)
    return lay_out(
        position=position,
        velocity=draw.normal(size=(6, 2)) - position,
        angular_velocity=draw.normal(size=6) * 20,
        radius=radius,
        mass=draw.uniform(0.3, 5, 6),
        restitution=restitution,
        friction=float(draw.uniform(0.01, 1.0)),
        walls=box([-2, -2], [2, 2]) if walls else np.zeros((0, 2, 2)),
        gravity=[0.0, -gravity],
    )


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6), restitution=st.sampled_from([0.3, 0.9, 1.0]), walls=st.booleans()
)
def test_friction_never_adds_energy(seed: int, restitution: float, walls: bool):
    scene = gas(seed, restitution, walls)
    motion = trajectory(asked(scene, 1.0))
    held = energy(scene, motion)

    # Each collision rounds both energies: a few units in the last place.
    assert (np.diff(held) <= 8 * EPS * held[0] * (1 + len(motion.collisions))).all()
    assert held[-1] < held[0] or not len(motion.collisions)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), restitution=st.sampled_from([0.0, 0.5, 1.0]))
def test_free_disks_keep_momentum_and_angular_momentum(seed: int, restitution: float):
    scene = gas(seed, restitution, walls=False)
    run = played(asked(scene, 1.0))
    motion = run.trajectory
    assert motion is not None
    x, v, w, m = motion.position, motion.velocity, motion.angular_velocity, scene.mass
    around = (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]) @ m + w @ scene.inertia
    size = np.hypot(*np.moveaxis(x, -1, 0)) * np.hypot(*np.moveaxis(v, -1, 0)) @ m
    size += np.abs(w) @ scene.inertia
    collisions = 1 + len(motion.collisions)

    assert np.abs(around - around[0]).max() <= 16 * EPS * size.max() * collisions
    total = np.einsum("ktd,t->kd", v, m)
    assert np.abs(total - total[0]).max() <= 16 * EPS * collisions * (np.abs(v).sum(-1) @ m).max()
    assert collisions == 1 or np.ptp(w, axis=0).max() > 1e-6


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_engine_and_oracle_agree_on_a_box_of_frictional_disks(seed: int, restitution: float):
    scene = gas(seed, restitution, walls=True)
    one = asked(scene, 2.0)
    motion, record = trajectory(one), computed(one)
    exact = record.sampled(scene, (), one.times)
    practical = computed(one, mpfr).sampled(scene, (), one.times)

    assert record.method == "certified"
    assert len(exact) == len(one.times)
    assert len(exact.collisions) > 5
    for name in ("position", "velocity", "angle", "angular_velocity"):
        right = getattr(exact, name)
        # What rounding has grown to within the horizon: 1e-9 of a radius.
        np.testing.assert_allclose(getattr(motion, name), right, rtol=0, atol=1e-8)
        np.testing.assert_allclose(getattr(practical, name), right, rtol=0, atol=1e-12)


ROLL = lay_out(
    position=[[0.0, 0.5]],
    velocity=[3.0, 0.0],
    radius=0.5,
    mass=2.0,
    restitution=0.5,
    friction=0.25,
    walls=FLOOR,
    gravity=[0.0, -G],
)


@pytest.mark.parametrize(
    ("change", "thrust"),
    [
        ({}, None),
        ({"angular_velocity": [25.0]}, None),
        ({"angular_velocity": [-25.0]}, None),
        ({"inertia": [0.125]}, None),
        ({"inertia": [np.inf]}, None),
        ({"position": [[0.0, 1.5]]}, None),
        ({"position": [[0.0, 1.5]], "restitution": 0.0}, None),
        ({"velocity": [[0.0, 0.0]]}, Thrust(0, 0.5, 1.0, [6.0, 0.0])),
        ({"velocity": [[0.0, 0.0]]}, Thrust(0, 0.5, 1.0, [60.0, 0.0], 1.0)),
        ({"velocity": [[0.0, 0.0]]}, Thrust(0, 0.5, 1.0, [0.0, 0.0], 1.0)),
        ({"velocity": [[0.0, 0.0]]}, Thrust(0, 0.5, 1.0, [0.0, 40.0], 1.0)),
        ({"velocity": [[6.0, 0.0]], "walls": [[[-64.0, 0.0], [3.0, 0.0]]]}, None),
        ({"walls": [[[-64.0, 0.0], [0.5, 0.0]], [[64.0, 0.0], [0.5, 0.0]]]}, None),
    ],
)
def test_engine_and_oracle_agree_on_what_slides_and_rolls(change, thrust):
    thrusts = () if thrust is None else (thrust,)
    one = asked(replace(ROLL, **{"inertia": None} | change), 2.0, thrusts)
    motion, record = trajectory(one), computed(one)
    exact = record.sampled(one.scene, thrusts, one.times)

    assert len(exact) == len(one.times), record.reason
    for name in ("position", "velocity", "angle", "angular_velocity"):
        # A handful of roundings of numbers up to 100.
        np.testing.assert_allclose(
            getattr(motion, name), getattr(exact, name), rtol=0, atol=2e-13, err_msg=name
        )


def test_what_rolls_has_no_slip_left_in_any_digit():
    one = asked(ROLL, 4.0)
    for motion in (trajectory(one), computed(one).sampled(ROLL, (), one.times)):
        slip = motion.velocity[:, 0, 0] + 0.5 * motion.angular_velocity[:, 0]
        rolls = one.times > 3.0 / (3 * 0.25 * G)
        assert np.abs(slip[rolls]).max() <= 4 * EPS
        assert slip[~rolls].min() > 0.1


TWO_CONTACTS = {
    "a corner": lay_out(
        position=[[0.5, 0.5]],
        angular_velocity=[5.0],
        radius=0.5,
        restitution=0.0,
        friction=0.25,
        walls=[[[0.0, 0.0], [9.0, 0.0]], [[0.0, 0.0], [0.0, 9.0]]],
        gravity=[0.0, -G],
    ),
    "a disk on another": lay_out(
        position=[[0.0, 0.5], [0.0, 1.5]],
        radius=0.5,
        restitution=0.0,
        friction=0.25,
        walls=FLOOR,
        gravity=[0.0, -G],
    ),
}


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("a corner", "disk 0 is pressed onto wall 1 while it rests on wall 0"),
        ("a disk on another", ""),
    ],
)
def test_two_contacts_that_last_are_refused_by_name(name: str, reason: str):
    # The engine refuses rather than go on; so does the oracle, where friction acts. Without
    # friction, or without the second contact, both have an answer.
    scene = TWO_CONTACTS[name]
    assert reason in computed(asked(scene)).reason
    assert played(asked(scene)).status == "unsupported"
    assert computed(asked(replace(scene, friction=0.0))).reason == ""
    assert (
        computed(asked(replace(scene, walls=FLOOR, position=scene.position * [1, 4]))).horizon > 0
    )


def test_bounces_that_die_out_come_to_rest_with_slip_and_without():
    fall = replace(ROLL, position=[[0.0, 1.5]], velocity=[[1.0, 0.0]])
    ramp = replace(fall, position=[[0.0, 3.0]], walls=[[[-64.0, 32.0], [64.0, -32.0]]])

    assert computed(asked(fall)).reason == ""
    assert computed(asked(ramp, 4.0)).reason == ""


def test_a_bad_friction_is_one_sentence():
    for bad in (-0.5, np.inf, -np.inf, np.nan, "rough", [0.1], True, 1j):
        said = r"^friction is .*, must be (a number )?at least 0 and finite$"
        with pytest.raises(ValueError, match=said):
            replace(ROLL, friction=bad)
    for good in (0, 2, 0.5, np.float32(0.5), np.int64(1)):
        assert replace(ROLL, friction=good).friction == good
