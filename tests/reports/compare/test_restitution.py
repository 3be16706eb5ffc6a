"""Restitution is read off what stands above the rounding of an engine, when the collision is over;
under gravity it is known no better than the instant of the collision."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.engine_row import FLOAT32, FLOAT64
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.restitution import (
    FLOOR,
    Reader,
    Restitutions,
    effective_restitution,
)
from crosscheck2d.reports.compare.view import SLOWEST, Value
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Array, Collisions, Scene, Trajectory
from tests.reports.compare.answers import beside_truth, one_disk, run_alone, truth_of

G, SAMPLE = 9.81, 0.05  # m/s2, s
ROUNDING = 1e-12  # of some ten operations in float64


def read(name: str, engine: str, substeps: int) -> tuple[Value, Value]:
    """The two metrics of restitution of a run."""
    view = run_alone(scenario(name), engine, substeps)
    return METRICS["restitution"].of(view), METRICS["restitution_error"].of(view)


def moving(t: Array, velocity: Array, collision: tuple[float, int, int, float]) -> Trajectory:
    still = np.zeros(velocity.shape[:2])
    return Trajectory(t, 0 * velocity, velocity, still, still, Collisions.of([collision]))


# The floor.


def sliding(change: float, speed: float = 0.5, e: float = 0.5) -> tuple[Trajectory, Scene]:
    """A disk that slides along a floor at `speed` m/s and has one collision with it, of a `change`
    in m/s."""
    down, up = -change / (1 + e), change * e / (1 + e)
    velocity = np.array([[[speed, down]], [[speed, down]], [[speed, up]], [[speed, up]]])
    scene = one_disk([0, 0.1], [speed, 0], e, walls=[[[-10.0, 0.0], [10.0, 0.0]]])
    return moving(np.arange(4.0), velocity, (1.5, 0, -1, np.nan)), scene


@pytest.mark.parametrize("rounding", [FLOAT32, FLOAT64])
@pytest.mark.parametrize("speed", [0.5, 500.0])
def test_the_floor_is_the_rounding_of_the_velocities(rounding: float, speed: float):
    floor = FLOOR * rounding * 2 * speed  # before and after
    for factor, counts in ((10, (1, 0)), (0.1, (0, 1))):
        found = effective_restitution(*sliding(factor * floor, speed), 1.0, 0.0, rounding)

        assert (len(found.values), found.below) == counts
        # The normal is that of the change, with a sliver of the rounding of nothing else: e as it
        # was put in.
        assert found.values == pytest.approx([0.5] * counts[0], rel=1e-9)


def test_a_heavy_disk_that_hardly_notices_is_read():
    # Its own speed is what its change stands above: a millionth of the light disk's.
    scene = Scene(
        position=[[0, 0], [1, 0]],
        velocity=[[0, 0], [-1, 0]],
        radius=[0.1] * 2,
        mass=[1e7, 1],
        restitution=1,
    )
    light, heavy = [-1.0, -1.0, 1.0, 1.0], [0.0, 0.0, -2e-7, -2e-7]
    velocity = np.array([[[a, 0], [b, 0]] for a, b in zip(heavy, light)])
    played = moving(np.arange(4.0), velocity, (1.5, 0, 1, 2.0))
    found = effective_restitution(played, scene, 1.0, 0.0, FLOAT32)

    assert found.below == 0
    # 2e-7, by which the heavy one is faster than at rest
    assert found.values == pytest.approx([1.0], abs=1e-6)


@pytest.mark.parametrize(
    ("name", "substeps"), [("gas_of_100", 1), ("box_billiard", 1), ("box_billiard", 2)]
)
def test_a_contact_that_lasts_is_no_collision(name: str, substeps: int):
    # Box2D 3.1 as shipped lets a slow disk stick to a wall (e = 0), and reports a collision
    # whenever it comes nearer again; the noise of a contact has e = -1, an error of 2
    assert read(name, "box2d_v3:shipped", substeps)[1].value < 1.5


def test_without_the_floor_it_would_be_read_as_minus_one(monkeypatch: pytest.MonkeyPatch):
    # The control: of most of the collisions that are read nothing is left of the velocity but its
    # sign.
    monkeypatch.setattr("crosscheck2d.reports.compare.restitution.FLOOR", 0.0)
    assert read("gas_of_100", "box2d_v3:shipped", 1)[1].value > 1.99


def test_what_is_below_the_floor_is_counted_in_the_note():
    for value in read("gas_of_100", "box2d_v3:shipped", 1):
        assert " below the floor" in value.note
    matched, _ = read("gas_of_100", "box2d_v3:matched", 1)
    assert matched.note.endswith(" collisions read")
    galperin, _ = read("galperin_31", "box2d_v3:shipped", 1)
    assert galperin.note == "2 collisions read, 1 below the floor"


# Gravity.


def fallen(e: float, stated: float, speed: float, share: float, substeps: int) -> Restitutions:
    """A disk meets a floor at `speed` m/s, `share` of a step before the end of the step that
    reports it, and leaves it at `e` times that speed; the scene states another e."""
    dt, t = SAMPLE / substeps, SAMPLE * np.arange(4.0)
    end = t[1] + dt
    at = end - share * dt
    v = np.where(t < at, -speed - G * (t - at), e * speed - G * (t - at))
    scene = one_disk([0, 0.1], [0, v[0]], stated, gravity=[0, -G], walls=[[[-9, 0], [9, 0]]])
    velocity = np.stack([0 * v, v], axis=-1)[:, None]
    played = moving(t, velocity, (end, 0, -1, np.nan))
    return effective_restitution(played, scene, dt, SLOWEST * G * SAMPLE, FLOAT64)


SPEEDS = st.floats(1.5 * SLOWEST * G * SAMPLE, 1000.0)
LAW = {"speed": SPEEDS, "share": st.floats(0, 0.99), "substeps": st.integers(1, 16)}


@given(e=st.floats(0, 1), **LAW)
def test_whoever_has_the_stated_e_reads_as_exact(
    e: float, speed: float, share: float, substeps: int
):
    assert fallen(e, e, speed, share, substeps).values == pytest.approx([e], abs=ROUNDING)


@given(e=st.floats(0, 1), stated=st.floats(0, 1), **LAW)
def test_another_e_is_read_to_the_fall_of_a_step(
    e: float, stated: float, speed: float, share: float, substeps: int
):
    # (1 + e) g dt / v, to second order; and never on the far side of what is stated.
    found = fallen(e, stated, speed, share, substeps)
    fall = G * SAMPLE / substeps / speed

    assert abs(found.values[0] - e) <= found.spread[0] + ROUNDING
    assert found.spread[0] == pytest.approx((1 + e) * fall, rel=2 * fall)
    assert min(e, stated) - ROUNDING <= found.values[0] <= max(e, stated) + ROUNDING


@given(**LAW)
def test_an_e_that_a_step_of_falling_cannot_explain_is_seen(
    speed: float, share: float, substeps: int
):
    # 0.3 for 0.9 stays 0.3 to the spread, which is far smaller
    assert abs(fallen(0.3, 0.9, speed, share, substeps).values[0] - 0.9) > 0.4


@pytest.mark.parametrize("engine", ["event_driven:float64", "reference:ordered"])
def test_who_follows_a_ball_exactly_has_its_e(engine: str):
    # They read 0.889 while the end of a step was taken for the time of the collision.
    value, error = read("bouncing_ball_e09", engine, 4)

    assert value.value == pytest.approx(0.9, abs=ROUNDING)
    assert value.note == "4 collisions read, e known to 0.02"
    assert error.value < ROUNDING


# Collisions that take several steps.


def nothing_approaches(*given: Any) -> np.ndarray:
    """In place of `approach`: no pair is followed to a later sample."""
    return np.zeros(len(given[2]), bool)


def met(
    *after: float, e: float = 1.0, others: tuple[tuple[float, int, int], ...] = ()
) -> Restitutions:
    """Two equal disks that close at 2 m/s and touch at the third sample, where the collision is
    reported.

    `after`: m/s at which each flies away from the other in the samples from then on, negative as
    long as they approach. `others`: more collisions (s, i, j) that are reported.
    """
    speed = np.array([-1.0, -1.0, *after])
    t = SAMPLE * np.arange(len(speed))
    way = np.cumsum(np.append(0.0, speed[1:])) * SAMPLE
    way += 0.1 - way[2]
    still = np.zeros((len(t), 2))
    position = np.stack([np.stack([side * way, still[:, 0]], 1) for side in (1, -1)], 1)
    velocity = np.stack([np.stack([side * speed, still[:, 0]], 1) for side in (1, -1)], 1)
    scene = Scene(
        position=position[0],
        velocity=velocity[0],
        radius=[0.1] * 2,
        mass=[1] * 2,
        restitution=e,
        walls=[[[-9.0, 5.0], [9.0, 5.0]]],  # far away
    )
    collisions = Collisions.of([(2 * SAMPLE, 0, 1, 1.0), *((*other, 1.0) for other in others)])
    played = Trajectory(t, position, velocity, still, still, collisions)
    return effective_restitution(played, scene, SAMPLE, 0.0, FLOAT64)


def test_a_soft_contact_is_read_when_the_two_part(monkeypatch: pytest.MonkeyPatch):
    # Stopped and thrown back over three samples: it is over as soon as they no longer approach, at
    # 0.5. Without looking on, the control, e is negative.
    found = met(-0.6, -0.1, 0.5, 0.8, 0.8)
    assert found.values == pytest.approx([0.5])
    assert (found.below, found.unfinished) == (0, 0)

    monkeypatch.setattr(Reader, "approach", nothing_approaches)
    assert met(-0.6, -0.1, 0.5, 0.8, 0.8).values == pytest.approx([-0.6])


def test_a_collision_that_is_over_at_once_is_read_as_before():
    for e in (0.0, 0.3, 1.0):
        assert met(e, e, e).values == pytest.approx([e])


def test_a_law_that_lets_two_pass_more_slowly_is_read_with_a_negative_e():
    found = met(*[-0.5] * 30)

    assert found.values == pytest.approx([-0.5])
    assert found.unfinished == 0


def test_a_collision_that_is_cut_off_is_counted_and_not_read():
    end = met(-0.6, -0.1)
    another = met(-0.6, -0.1, 0.5, 0.8, others=((4 * SAMPLE, 1, -1),))
    assert (len(end.values), end.below, end.unfinished) == (0, 0, 1)
    assert (len(another.values), another.unfinished) == (0, 1)


def test_who_lets_disks_pass_as_if_nothing_were_there_is_caught():
    # e = -1: nothing changes, so there is nothing to read; overlap and velocity tell
    one, truth = truth_of("head_on_equal_e1")
    ghost = replace(
        truth,
        position=one.scene.position + truth.t[:, None, None] * one.scene.velocity,
        velocity=np.broadcast_to(one.scene.velocity, truth.velocity.shape).copy(),
    )
    passed, sound = (beside_truth(one, one.dt(1), played, truth) for played in (ghost, truth))
    limits = {"penetration_radii": 0.5, "velocity_max": 0.5, "position_max_radii": 1.0}
    for metric, least in limits.items():
        assert METRICS[metric].of(passed).value > least
        assert METRICS[metric].of(sound).value < 1e-9


@pytest.mark.parametrize("substeps", [1, 2])
def test_box2d_is_not_read_while_two_still_approach(substeps: int, monkeypatch: pytest.MonkeyPatch):
    # Its slow collisions have e = 0 as shipped, not e = -0.84, which is what the first sample says.
    _, error = read("line_gas", "box2d_v3:shipped", substeps)

    assert error.value == pytest.approx(1.0, abs=1e-6)  # float32
    assert error.note.endswith(" not over")
    monkeypatch.setattr(Reader, "approach", nothing_approaches)
    assert read("line_gas", "box2d_v3:shipped", substeps)[1].value > 1.1


def test_a_disk_that_is_pressed_through_the_floor_has_no_restitution():
    # In a column that the lesson's solver cannot carry gravity does more than the collision; the
    # overlap is seen. Only the one that jumps out and lands beside it is read.
    view = run_alone(scenario("column_of_ten"), "reference:lesson")
    value = METRICS["restitution"].of(view)

    assert value.note.startswith("1 collisions read, ")
    assert value.note.endswith(" 7 not over")
    assert METRICS["penetration_radii"].of(view).value > 0.5
    assert METRICS["disks_tunnelled"].of(view).value > 0
