"""`reference:coulomb` and `reference:ordered` with friction: the impact law of two disks, and one
disk that slides and rolls."""

from __future__ import annotations

from dataclasses import replace
from math import atan, cos, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.reference_impl import coulomb, exercise, ordered
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scene

ROUNDING = 2.0**-53
FLOOR = [[[-8.0, 0.0], [8.0, 0.0]]]


def after(scene, t, dt, variant):
    engine = Reference(variant)
    engine.load(scene, dt)
    engine.step(round(t / dt))
    return engine.read()


@pytest.mark.parametrize("name", ["gas_of_100", "box_billiard", "disk_between_static_disks"])
def test_with_friction_0_it_is_the_exercise_to_the_bit(name):
    scene = scenario(name)
    one, other = (
        play(Reference(variant), "one:run", scene, scene.dt(2)).trajectory
        for variant in (exercise, coulomb)
    )
    for what in ("position", "velocity", "angle", "angular_velocity"):
        assert getattr(one, what).tobytes() == getattr(other, what).tobytes()
    assert one.collisions.impulse.tobytes() == other.collisions.impulse.tobytes()


def thrown(e, mu):
    return lay_out([[-4.0, 1.0]], [[5.0, -5.0]], restitution=e, friction=mu, walls=FLOOR)


@pytest.mark.parametrize("variant", [coulomb, ordered])
@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 0.5, 2.0])
def test_a_bounce_takes_up_coulombs_impulse(variant, e, mu):
    # mu (1 + e) m v_n while it slides, v_t / (1/m + r2/I) = v_t / 3 if it ends rolling; turning
    # clockwise.
    end = after(thrown(e, mu), 0.5, 1 / 60, variant)
    J = min(mu * (1 + e) * 5.0, 5.0 / 3)
    # The normal of a floor of 16 m is known to some roundings of 16 m over a radius, and turns
    # velocities and the impulse by as much.
    tilt = 8 * ROUNDING * 16 / 0.25
    assert end.velocity[0] == pytest.approx([5.0 - J, 5.0 * e], abs=10 * tilt)
    assert end.angular_velocity[0] == pytest.approx(-J * 0.25 / (1 / 32), abs=80 * tilt)


@given(
    e=st.floats(0.1, 1),  # at 0 they stay together, and touch again and again by rounding
    mu=st.floats(0, 3),
    spins=st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
    offset=st.floats(-0.6, 0.6),
    masses=st.tuples(st.floats(0.1, 10), st.floats(0.1, 10)),
)
def test_two_disks_that_rub_keep_momentum_and_angular_momentum_and_make_no_energy(
    e, mu, spins, offset, masses
):
    scene = Scene(
        position=[[-0.65, offset / 2], [0.65, -offset / 2]],
        velocity=[[3.0, 0.0], [-2.0, 0.5]],
        angular_velocity=spins,
        radius=[0.25, 0.5],
        mass=masses,
        restitution=e,
        friction=mu,
    )
    engine = Reference(ordered)
    engine.load(scene, 1.0)
    engine.step()
    before, end = scene.state, engine.read()
    assert len(engine.collisions()) == 1
    # Some twenty products of up to 10 kg, 5 m/s and 50 rad/s.
    digits = 200 * ROUNDING
    assert quantities(scene, end) == pytest.approx(quantities(scene, before), rel=digits, abs=1e-12)
    assert energy(scene, end) <= energy(scene, before) * (1 + digits)

    taken = scene.mass[0] * (end.velocity[0] - before.velocity[0])
    normal = engine.collisions()[0].impulse
    along = np.sqrt(max(taken @ taken - normal**2, 0.0))
    assert along <= mu * normal * (1 + 1e-6) + 1e-6  # the root of a difference halves the digits


def quantities(scene, state):
    x, v, m = state.position, state.velocity, scene.mass
    turning = m * (x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]) + scene.inertia * state.angular_velocity
    return [*(m @ v), turning.sum()]


def energy(scene, state):
    speed2 = (state.velocity**2).sum(axis=1)
    return float((scene.mass @ speed2 + scene.inertia @ state.angular_velocity**2) / 2)


def placed(mu, slope=0.0, speed=0.0, spin=0.0, e=0.0):
    return lay_out(
        [[0.0, 0.25]],
        [[speed, 0.0]],
        angular_velocity=[spin],
        restitution=e,
        friction=mu,
        gravity=[10 * sin(slope), -10 * cos(slope)],
        walls=FLOOR,
    )


@pytest.mark.parametrize("e", [0.0, 0.5])
@pytest.mark.parametrize("rate", [16, 60, 960])
def test_ordered_slides_and_then_rolls_as_the_closed_form(e, rate):
    # -mu g for v0 / (3 mu g) = 1/2 s, then 2/3 v0, whether that is a whole number of steps or not.
    scene = placed(0.2, speed=3.0, e=e)
    for t in (0.25, 1.0):
        end, slid = after(scene, t, 1 / rate, ordered), min(t, 0.5)
        # Each of 960 steps rounds places of metres, and a normal of a floor of 16 m.
        assert end.position[0, 0] == pytest.approx(
            3 * slid - slid**2 + 2 * (t - slid), abs=rate * 100 * ROUNDING
        )
        assert end.velocity[0, 0] == pytest.approx(3 - 2 * slid, abs=rate * 100 * ROUNDING)
        assert end.angular_velocity[0] == pytest.approx(-16 * slid, abs=rate * 800 * ROUNDING)


def test_ordered_changes_from_sliding_to_rolling_within_a_step():
    end = after(placed(0.2, speed=3.0), 1.0, 1 / 15, ordered)
    assert end.position[0, 0] == pytest.approx(2.25, abs=100 * ROUNDING)
    assert end.angle[0] == pytest.approx(-(8 * 0.25 + 8 * 0.5), abs=800 * ROUNDING)


@pytest.mark.parametrize("variant", [coulomb, ordered])
def test_backspin_brings_a_disk_back(variant):
    # At 1 m/s with 20 rad/s of backspin it ends rolling at (2 v0 - r w) / 3 = -1 m/s.
    end = after(placed(0.2, speed=1.0, spin=20.0), 2.0, 1 / 60, variant)
    assert end.velocity[0, 0] == pytest.approx(-1.0, abs=1e-10)
    assert end.angular_velocity[0] == pytest.approx(4.0, abs=1e-9)


@pytest.mark.parametrize("variant", [coulomb, ordered])
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_on_a_slope_a_disk_rolls_up_to_three_times_the_friction(variant, share):
    # tan(angle) <= mu (1 + m r2/I): g sin / (1 + 1/2) down to there, g (sin - mu cos) beyond.
    mu = 0.2
    slope = atan(share * 3 * mu)
    end = after(placed(mu, slope), 0.5, 1 / 60, variant)
    rolling, sliding = sin(slope) / 1.5, sin(slope) - mu * cos(slope)
    speed = 5 * (rolling if share < 1 else sliding)
    spin = -speed / 0.25 if share < 1 else -5 * mu * cos(slope) * 8
    assert end.velocity[0, 0] == pytest.approx(speed, abs=1e-11)
    assert end.angular_velocity[0] == pytest.approx(spin, abs=1e-10)


def test_a_static_disk_is_rubbed_but_does_not_turn():
    scene = Scene(
        position=[[0.0, 0.0], [1.2, 0.1]],
        velocity=[[0.0, 0.0], [-2.0, 1.0]],
        radius=[0.5, 0.5],
        mass=[np.inf, 1.0],
        restitution=0.5,
        friction=0.4,
    )
    for variant in (coulomb, ordered):
        end = after(scene, 0.5, 1 / 64, variant)
        assert end.angular_velocity[0] == 0.0
        assert (end.position[0] == 0.0).all()
        assert end.angular_velocity[1] != 0.0


def test_a_torque_turns_a_disk_on_a_floor_into_motion():
    # What rolls under a torque M moves at a = M r / (I + m r2).
    engine = ENGINES["reference:ordered"].make()
    engine.load(placed(0.5), 1 / 64)
    for _ in range(64):
        engine.apply_force(0, np.zeros(2), 0.3)
        engine.step()
    end = engine.read()
    speed = -0.3 * 0.25 / (1 / 32 + 1 / 16)
    # 64 steps round
    assert end.velocity[0, 0] == pytest.approx(speed, abs=1e-12)
    assert end.angular_velocity[0] == pytest.approx(-speed / 0.25, abs=1e-11)


@pytest.mark.parametrize("variant", [coulomb, ordered])
def test_friction_does_not_turn_a_static_disk_whose_inertia_is_finite(variant):
    scene = Scene(
        position=[[0.0, 0.0], [1.0, 0.1]],
        velocity=[[0.0, 0.0], [-1.0, 0.0]],
        radius=[0.25, 0.25],
        mass=[np.inf, 1.0],
        inertia=[1.0, 0.03],
        restitution=0.0,
        friction=0.3,
    )
    still, turned = after(scene, 1.0, 0.01, variant).angular_velocity
    assert still == 0.0
    assert abs(turned) > 0.1  # rad/s


def sunk_by(scene, disks, steps=90, dt=1 / 120):
    """(d,) m, how deep each of these disks of `roll_or_slide` sinks into its incline at most, if
    only these are there."""
    of_disks = ("position", "velocity", "radius", "mass", "angle", "angular_velocity", "inertia")
    parts = {name: getattr(scene, name)[disks] for name in (*of_disks, "walls")}
    engine, deepest = Reference(ordered), np.zeros(len(disks))
    engine.load(replace(scene, **parts), dt)
    start, end = parts["walls"][:, 0], parts["walls"][:, 1]
    along = (end - start) / np.hypot(*(end - start).T)[:, None]
    for _ in range(steps):
        engine.step()
        away = engine.read().position - start
        height = along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]
        deepest = np.maximum(deepest, parts["radius"] - height)
    return deepest


def test_disks_at_rest_take_no_collisions_of_a_step_from_each_other():
    # Each meets its incline again and again at the same instant, by the rounding of the force that
    # holds it: after `MOST` times that is no collision. Else one would fall freely for a step, by g
    # cos(angle) dt2 / 2 or more.
    scene = scenario("roll_or_slide").scene
    together = sunk_by(scene, np.arange(scene.n))
    # some hundred steps round a height of up to 4 m, and `EXACT` of a radius may be left
    assert (together < 1e3 * ROUNDING * 4 + ordered.EXACT * scene.radius).all()
