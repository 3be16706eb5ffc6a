"""The ablated reference: with no mechanism on it is the exercise, with all it is an engine, and
each does what its formula says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.adapters.mechanisms.ablated import BOX2D, BOX2D_V3, PYMUNK, AblatedReference
from crosscheck2d.adapters.mechanisms.table import (
    END_OF_STEP,
    FLIGHT,
    IMPULSE,
    MECHANISMS,
    POSITION_CORRECTION,
    RESTITUTION,
    mechanisms_of,
    with_mechanisms,
)
from crosscheck2d.adapters.play import play, play_once
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.reference_impl import exercise
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario
from tests.reference_impl.test_compiled import printed

FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53
ORDERS = {"pymunk": PYMUNK, "box2d": BOX2D, "box2d_v3": BOX2D_V3}


def positions(engine: Any, scene: Scenario, dt: float) -> Array:
    """(k, n, 2) m."""
    run = play(engine, "reference:ablated", scene, dt)
    assert run.trajectory is not None, run.reason
    return run.trajectory.position


@pytest.mark.parametrize(
    "name", ["oblique_e09", "falling_box", "asteroids", "ship_thrust", "disk_between_static_disks"]
)
def test_with_nothing_enabled_it_is_the_exercise_to_the_bit(name: str):
    scene = scenario(name)
    plain, ablated = (
        play(engine, "one:run", scene, scene.dt(scene.substeps[1])).trajectory
        for engine in (Reference(exercise), AblatedReference())
    )

    assert plain is not None
    assert ablated is not None
    assert np.array_equal(plain.position, ablated.position)
    assert np.array_equal(plain.angle, ablated.angle)
    assert np.array_equal(plain.collisions.impulse, ablated.collisions.impulse)


@pytest.mark.parametrize("order", [END_OF_STEP["order"], *ORDERS.values()])
@pytest.mark.parametrize("alpha", [0.0, 0.5, 0.625, 1.0])
def test_free_flight_is_off_by_its_closed_form_in_any_order(order: tuple[str, ...], alpha: float):
    # (alpha - 1/2) a dt t, whichever stage comes first and however many moves there are.
    scene = scenario("free_fall")
    dt = scene.dt(2)
    assert scene.truth is not None
    off = (
        positions(AblatedReference(order, alpha=alpha), scene, dt)[:, 0]
        - scene.truth(scene.times).position[:, 0]
    )
    expected = (alpha - 0.5) * dt * scene.times[:, None] * scene.scene.gravity

    # 720 moves that each round a height of up to 10 m.
    assert np.abs(off - expected).max() <= 720 * 10 * FLOAT64


def test_a_late_collision_is_off_by_the_change_of_velocity_times_its_delay():
    # Equal disks head-on: each goes on for tau, so that it is (v' - v) tau off for ever after.
    scene = scenario("head_on_equal_e1")
    dt, (a, b) = scene.dt(2), scene.scene.position
    closing = scene.scene.velocity[0] - scene.scene.velocity[1]
    at = (np.linalg.norm(b - a) - scene.scene.radius.sum()) / np.linalg.norm(closing)
    delay = np.ceil(at / dt) * dt - at
    assert scene.truth is not None
    off = positions(AblatedReference(**END_OF_STEP), scene, dt) - scene.truth(scene.times).position

    assert delay > dt / 10
    assert off[-1, 0] == pytest.approx(closing * delay, abs=1e-13)
    assert off[-1, 1] == pytest.approx(-closing * delay, abs=1e-13)


@pytest.mark.parametrize(("order", "gain"), [(PYMUNK, 0.0), (BOX2D, 1.0)])
def test_a_ball_gains_speed_times_dt_of_height_where_it_bounces_off_a_velocity_after_gravity(
    order: tuple[str, ...], gain: float
):
    # A gain per bounce, with the flight of such an engine; none off a velocity before gravity.
    scene = scenario("bouncing_ball_e1")
    dt, g = scene.dt(4), -scene.scene.gravity[1]
    fall = scene.scene.position[0, 1] - scene.scene.radius[0]
    heights = positions(AblatedReference(order), scene, dt)[:, 0, 1]
    collision = int(np.sqrt(2 * fall / g) / scene.sample_interval)
    apex = heights[collision + 2 : 3 * collision].max() - heights[: collision // 2].max()
    speed = np.sqrt(2 * g * fall)

    # The apex is read off samples, and off a step that is up to a whole one away from it.
    assert apex / (speed * dt) == pytest.approx(gain, abs=0.1)


@pytest.mark.parametrize(
    ("name", "scene", "samples", "bound"),
    [
        # Bounds of rounding, in m: of float64 where the engine keeps that, else of so many steps of
        # up to some metres. 135 collisions, or 351, hand on what rounding does
        ("reference:exercise", "falling_box", 25, 1e-11),
        # Ten iterations end before the impulses do, so that the order of the contacts decides the
        # last digits.
        ("pymunk:matched", "gas_of_100", 58, 1e-5),
        ("pymunk:shipped", "oblique_e09", 240, 1e-12),
        ("pymunk:matched", "bouncing_ball_e09", 600, 1e-12),
        ("box2d:shipped", "box_billiard", 1200, 4800 * 4 * FLOAT32),
        ("box2d:shipped", "rest_on_floor", 300, 1200 * FLOAT32),
        ("box2d:matched", "bouncing_ball_e1", 600, 2400 * FLOAT32),
        ("box2d_v3:shipped", "slow_collision", 240, 960 * FLOAT32),
        ("box2d_v3:matched", "oblique_e09", 240, 960 * FLOAT32),
        ("box2d_v3:matched", "bouncing_ball_e1", 600, 2400 * FLOAT32),
    ],
)
def test_with_all_its_mechanisms_the_reference_is_the_engine(
    name: str, scene: str, samples: int, bound: float
):
    played = scenario(scene)
    played = replace(played, duration=samples * played.sample_interval)
    dt = played.dt(4)
    run = play_once(ENGINES[name].make, name, played, dt)
    assert run.trajectory is not None
    mechanisms = mechanisms_of(name, run.settings, played.scene, dt)
    everything = positions(with_mechanisms(mechanisms), played, dt)
    k = len(run.trajectory)

    assert np.abs(everything - run.trajectory.position)[:k].max() <= bound
    plain = positions(with_mechanisms([]), played, dt)
    assert np.abs(plain - run.trajectory.position)[:k].max() > 40 * bound


@pytest.mark.parametrize(
    ("name", "scene", "mechanism"),
    [
        ("pymunk:shipped", "oblique_e09", RESTITUTION),
        ("pymunk:matched", "bouncing_ball_e09", POSITION_CORRECTION),
        ("box2d_v3:shipped", "slow_collision", RESTITUTION),
        ("box2d:shipped", "box_billiard", "friction"),
    ],
)
def test_what_is_disabled_in_the_engine_is_what_is_left_out_in_the_reference(
    name: str, scene: str, mechanism: str
):
    played = scenario(scene)
    dt = played.dt(4)
    mechanisms = mechanisms_of(
        name, play_once(ENGINES[name].make, name, played, dt).settings, played.scene, dt
    )
    left_out = next(each for each in mechanisms if each.name == mechanism)
    assert left_out.without is not None
    engine = left_out.without()
    without = positions(engine, played, dt)
    others = positions(
        with_mechanisms([each for each in mechanisms if each is not left_out]), played, dt
    )
    everything = positions(with_mechanisms(mechanisms), played, dt)

    assert np.abs(without - others).max() <= 2000 * 4 * FLOAT32
    assert np.abs(without - everything).max() > 0.001


def test_every_engine_with_mechanisms_is_known_and_flies_as_its_row_says():
    assert set(MECHANISMS) < {*ENGINES, *FETCHED}
    scene = scenario("head_on_equal_e09")
    for name in filter(ENGINES.__contains__, MECHANISMS):
        mechanisms = {
            each.name: each
            for each in mechanisms_of(
                name,
                play_once(ENGINES[name].make, name, scene, 0.1 / 6).settings,
                scene.scene,
                0.1 / 6,
            )
        }
        assert mechanisms[FLIGHT].parameters == {"alpha": ENGINES[name].alpha}
        assert name.startswith("reference") or "order" in mechanisms[IMPULSE].parameters


PLAIN = """
import sys, numpy as np
from crosscheck2d.adapters.mechanisms.ablated import BOX2D, BOX2D_V3, EXERCISE, PYMUNK
from crosscheck2d.adapters.mechanisms.ablated import AblatedReference
from crosscheck2d.scenarios.families.placing import box, lay_out
grid = np.stack(np.meshgrid(np.arange(3), np.arange(3)), -1).reshape(-1, 2) * 1.0
n = np.arange(9)
velocity = np.where(n == 4, 0, 1)[:, None] * np.stack([np.sin(1.0 + n), np.cos(2.0 * n)], -1)
scene = lay_out(
    position=grid, velocity=velocity, radius=0.3 + 0.1 * np.sin(n),
    mass=np.where(n == 4, np.inf, 1.0 + n % 3),
    walls=box([-0.6, -0.6], [2.6, 2.6]), restitution=0.8, gravity=[0.1, -0.7],
    angular_velocity=np.where(n == 4, 0, 1.0),
)
on = {"friction": 0.3, "correction_share": 0.1, "slop": 0.01}
on |= {"correction_speed": 3.0, "margin": 0.01}
rapier = {
    "recycled": 0.02, "fattened": 0.02, "tangent": True, "rebounds": False,
    "rub_biased": False,
}
for order, more in (*((o, {}) for o in (EXERCISE, BOX2D, PYMUNK, BOX2D_V3)), (BOX2D_V3, rapier)):
    engine = AblatedReference(order, **on, **more)
    engine.load(scene, 0.01)
    engine.step(150)
    assert len(engine.collisions()) > 20
    sys.stdout.buffer.write(engine.read().position.tobytes() + engine.read().velocity.tobytes())
"""


@pytest.mark.slow
def test_plain_python_gives_the_same_bits_as_the_compiled_solver():
    compiled = printed(PLAIN, compiled=True)
    assert len(compiled) == 5 * 2 * 9 * 2 * 8
    assert compiled == printed(PLAIN, compiled=False)


ROW = lay_out(
    position=[[x, 0.5] for x in (0.0, 1.0, 2.0, 5.0, 6.0)],
    velocity=[[0.0, -1.0]] * 5,
    radius=0.5,
    walls=[[[-2.0, 0.0], [9.0, 0.0]]],
    restitution=0.0,
)


def found(stage: str) -> list[tuple[int, int]]:
    # The contacts of `ROW`, three disks and two, all on a floor, as a stage orders them.
    engine = AblatedReference(("accelerate", "detect", stage, "move"), touching=True, margin=0.01)
    engine.load(ROW, 0.001)
    engine.step(1)
    return [(int(row.i), int(row.j)) for row in engine.kept.rows[: engine.kept.found[0]]]


def test_colours_never_hold_a_moving_disk_twice_and_what_stands_comes_after_the_first():
    assert found("by_colour") == [
        (0, 1),
        (3, 4),
        (1, 2),
        (0, -1),
        (3, -1),
        (4, -1),
        (1, -1),
        (2, -1),
    ]


def test_islands_come_from_the_last_disk_on_and_the_floor_joins_none():
    assert found("by_island") == [
        (4, -1),
        (3, 4),
        (3, -1),
        (2, -1),
        (1, 2),
        (1, -1),
        (0, 1),
        (0, -1),
    ]
