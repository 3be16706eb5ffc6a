"""The closed forms, each against something that knows nothing of it. tests/adapters/event_driven/
test_events.py has the event engine beside all of them, test_oracle.py the oracle."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.truth.exact import OracleTruth

ANSWERED = [
    name
    for name in SCENARIOS
    if (truth := scenario(name).truth) and not isinstance(truth, OracleTruth)
]
THRUST = [name for name in ANSWERED if scenario(name).thrusts]
RESTING = ["rest_on_floor", "slide_on_incline", "column_of_ten"]
# What is written here knows no friction; test_sliding.py holds those scenes to two computations.
RUBBING = [name for name in ANSWERED if scenario(name).scene.friction]
FLYING = [name for name in ANSWERED if name not in (*THRUST, *RESTING, *RUBBING)]


def exact(name):
    """A scenario, its truth, and until when collisions can be distinguished (a ball settles after
    infinitely many)."""
    run = scenario(name)
    truth = run.truth(run.times)
    return run, truth, 8.0 if name == "bouncing_ball_e09" else truth.t[-1]


def between(collisions, until):
    """An instant between each two collisions, those that coincide (49 balls on one floor) taken as
    one."""
    apart = np.append(0, collisions)[np.diff(np.append(0, collisions), append=np.inf) > 1e-6]
    return (apart + np.append(apart[1:], until)) / 2


def wall_frames(scene):
    """A point of each wall and its unit normal, (w, 2) each."""
    along = scene.walls[:, 1] - scene.walls[:, 0]
    return (
        scene.walls[:, 0],
        np.stack([-along[:, 1], along[:, 0]], -1) / np.hypot(*along.T)[:, None],
    )


def contact(scene, position, i, j):
    """Gap m and unit normal (2,) from disk i to disk j or to wall -1 - j, at the positions (n, 2)
    m."""
    if j < 0:
        point, across = (a[-1 - j] for a in wall_frames(scene))
        offset = (point - position[i]) @ across
        return abs(offset) - scene.radius[i], across * np.sign(offset)
    r = position[j] - position[i]
    return np.hypot(*r) - scene.radius[i] - scene.radius[j], r / np.hypot(*r)


@pytest.mark.parametrize("name", FLYING)
def test_collisions_lie_at_touching_distance_and_their_impulse_is_the_change_of_momentum(name):
    run, truth, until = exact(name)
    scene, collisions = run.scene, truth.collisions
    gravity = np.where(scene.static[:, None], 0.0, scene.gravity)
    times = between(collisions.t[collisions.t <= until], until)
    around, at = run.truth(times), run.truth(np.append(collisions.t, until))
    for k in np.flatnonzero(collisions.t <= until):
        i, j, step = collisions.i[k], collisions.j[k], np.searchsorted(times, collisions.t[k])
        gap, normal = contact(scene, at.position[k], i, j)
        # Positions and paths of 10 m have a last place of 2e-15; Galperin's weighted axis adds two
        # digits.
        assert abs(gap) < 1e-13
        before, after = (
            around.velocity[s] + gravity * (collisions.t[k] - times[s]) for s in (step - 1, step)
        )
        approach, separating = (((v[j] if j >= 0 else 0) - v[i]) @ normal for v in (before, after))
        # The same of velocities up to 25 m/s.
        assert separating == pytest.approx(-scene.restitution * approach, abs=1e-13)
        for disk, sign in ((i, -1), (j, 1)):
            if disk >= 0:
                kick = sign * collisions.impulse[k] * normal / scene.mass[disk]
                np.testing.assert_allclose(after[disk] - before[disk], kick, rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", ANSWERED)
def test_velocity_is_the_derivative_of_position(name):
    run, truth, until = exact(name)
    h = 1e-4
    times = np.linspace(0.01, until - 0.01, 301)
    edges = np.concatenate(
        [truth.collisions.t, *([thrust.start, thrust.stop] for thrust in run.thrusts), [-1]]
    )
    times = times[np.abs(times[:, None] - edges).min(axis=1) > 2 * h]
    before, now, after = (run.truth(times + shift) for shift in (-h, 0, h))
    # Central differences: jerk h2 / 6 < 5 m/s3 1e-8 / 6 = 1e-8 (0 in a parabola), rounding 15 m
    # 1e-16 / h = 3e-11.
    for moved, rate in (("position", "velocity"), ("angle", "angular_velocity")):
        slope = (getattr(after, moved) - getattr(before, moved)) / (2 * h)
        np.testing.assert_allclose(slope, getattr(now, rate), rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", THRUST)
def test_velocity_and_spin_change_by_the_thrusts_as_quadrature_has_it(name):
    run, truth, _ = exact(name)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    gained, turned = np.zeros_like(truth.velocity), np.zeros_like(truth.angle)
    for k, start in enumerate(truth.t[:-1]):
        width = truth.t[k + 1] - start
        t = start + width * (nodes + 1) / 2
        angle = run.truth(t).angle
        gained[k + 1], turned[k + 1] = gained[k], turned[k]
        for thrust in run.thrusts:
            if not thrust.start - 1e-9 < start < thrust.stop - 1e-9:
                continue
            turn = np.exp(1j * angle[:, thrust.disk]) if thrust.frame == "body" else np.ones(8)
            force = (complex(*thrust.force) * turn * weights).sum() * width / 2
            gained[k + 1, thrust.disk] += (
                np.array([force.real, force.imag]) / run.scene.mass[thrust.disk]
            )
            turned[k + 1, thrust.disk] += thrust.torque * width / run.scene.inertia[thrust.disk]
    # Eight nodes per 1/60 s are exact to rounding: some hundreds of sums of 1e-16.
    np.testing.assert_allclose(truth.velocity, run.scene.velocity + gained, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        truth.angular_velocity, run.scene.angular_velocity + turned, rtol=0, atol=1e-13
    )


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("ping_pong", 4),  # 40 s, a period of 20 s
        ("mass_ratios", 7),
        ("near_miss", 0),
        ("line_gas", 278),
        ("galperin_3", 3),
        ("galperin_31", 31),
        ("galperin_314", 314),
        ("cradle_with_gaps", 6),
        ("simbenchmark_bouncing", 490),
    ],
)
def test_number_of_collisions(name, count):
    # pi, all pairs of a cradle, ten bounces of 49 balls
    _, truth, _ = exact(name)
    assert len(truth.collisions) == count


@pytest.mark.parametrize("name", [name for name in FLYING if scenario(name).scene.restitution == 1])
def test_energy_is_kept_at_restitution_one(name):
    run, truth, _ = exact(name)
    mass, g = np.where(run.scene.static, 0, run.scene.mass), run.scene.gravity
    kinetic = (mass * (truth.velocity**2).sum(axis=2)).sum(axis=1) / 2
    energy = kinetic - (mass * (truth.position @ g)).sum(axis=1)
    # Rounding of one collision's velocities and of a sum of at most 49 terms.
    np.testing.assert_allclose(energy, energy[0], rtol=4e-15)


@pytest.mark.parametrize("name", [name for name in FLYING if not len(scenario(name).scene.walls)])
def test_momentum_is_kept_without_walls(name):
    run, truth, _ = exact(name)
    if run.scene.static.any() or run.scene.gravity.any():
        pytest.skip("something outside takes momentum up")
    momentum = np.einsum("i,kid->kd", run.scene.mass, truth.velocity)
    # A unit in the last place of the largest momentum, 1e6 N s in the heaviest lane.
    np.testing.assert_allclose(momentum - momentum[0], 0, rtol=0, atol=1e-15 * run.scene.mass.sum())


@pytest.mark.parametrize("name", ["galperin_3", "galperin_31", "galperin_314"])
def test_galperin_is_within_its_error_bound_of_rational_arithmetic(name):
    run, truth, _ = exact(name)
    m, r = [Fraction(a) for a in run.scene.mass], [Fraction(a) for a in run.scene.radius]
    x, v = ([Fraction(a) for a in part[:, 0]] for part in (run.scene.position, run.scene.velocity))
    x = [x[0] - r[0], x[1] - 2 * r[0] - r[1]]
    now, sample = Fraction(0), 0
    while sample < len(truth):
        wall = -x[0] / v[0] if v[0] < 0 else None
        pair = (x[1] - x[0]) / (v[0] - v[1]) if v[0] > v[1] else None
        ahead = min((t for t in (wall, pair) if t is not None), default=None)
        while sample < len(truth) and (ahead is None or truth.t[sample] <= now + ahead):
            since = Fraction(truth.t[sample]) - now
            right = [x[0] + v[0] * since + r[0], x[1] + v[1] * since + 2 * r[0] + r[1]]
            # The start data are rounded on their own: 2.4 m to the last place.
            error = [
                abs(float(a - Fraction(b))) for a, b in zip(right, truth.position[sample, :, 0])
            ]
            assert max(error) < truth.error_bound + 1e-15 * max(2.4, truth.position[sample].max())
            sample += 1
        if ahead is None:
            break
        now, x = now + ahead, [x[0] + v[0] * ahead, x[1] + v[1] * ahead]
        if ahead == wall:
            v = [-v[0], v[1]]
        else:
            centre = (m[0] * v[0] + m[1] * v[1]) / (m[0] + m[1])
            v = [2 * centre - v[0], 2 * centre - v[1]]


def test_a_bouncing_ball_rests_from_its_accumulation_point_on():
    run, truth, _ = exact("bouncing_ball_e09")
    height = run.scene.position[0, 1] - run.scene.radius[0]
    rest = np.sqrt(2 * height / 9.81) * 1.9 / 0.1
    later = truth.t > rest
    assert later.any()
    assert (truth.position[later, 0, 1] == run.scene.radius[0]).all()
    assert not truth.velocity[later].any()
    # The last listed bounce lasts 1e-4 s; the rest of the series is ten times that.
    assert truth.collisions.t[-1] == pytest.approx(rest, abs=1.2e-3)


def test_an_offset_grows_between_static_disks_as_the_horizon_assumes():
    # the horizon rests on this factor
    run, truth, _ = exact("disk_between_static_disks")
    scene = run.scene
    along = np.array([0.8, 0.6])
    start = np.array(scene.position)
    start[0] += 1e-7 * np.array([-0.6, 0.8])
    engine, offset = EventEngine(replace(scene, position=start)), list[float]()
    for at in truth.collisions.t[:8]:
        engine.advance(at)
        x = engine.motion_at(at)[0][0]
        offset.append(abs(along[0] * x[1] - along[1] * x[0]))
    # q = 1 + 0.75 / 1.5; after a few bounces only the growing direction is left, while 1e-7 m is
    # still small.
    assert offset[7] / offset[6] == pytest.approx(1.5 + np.sqrt(1.25), rel=1e-3)
    assert truth.horizon < run.duration
    assert truth.t[-1] <= truth.horizon


def test_a_disk_slides_down_the_incline_in_contact_and_does_not_turn():
    run, truth, _ = exact("slide_on_incline")
    point, normal = (a[0] for a in wall_frames(run.scene))
    # A unit in the last place of 10 m.
    np.testing.assert_allclose((truth.position[:, 0] - point) @ normal, 0.625, rtol=0, atol=4e-15)
    np.testing.assert_allclose(np.hypot(*truth.velocity[:, 0].T), 9.81 * 0.6 * truth.t, rtol=1e-14)
    assert not truth.angle.any()


def test_what_rests_stays():
    for name in ("rest_on_floor", "column_of_ten"):
        run, truth, _ = exact(name)
        assert (truth.position == run.scene.position).all()
        assert not truth.velocity.any()
