"""The horizon: the derivative that it carries along is that of the motion, and it ends where moved
starts part."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path as File

import numpy as np
import pytest

from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust
from crosscheck2d.scenarios.truth import horizon as of_horizon
from crosscheck2d.scenarios.truth.exact import computed
from crosscheck2d.scenarios.truth.horizon import DIVERGED, EPS, TangentVectors, roundings
from crosscheck2d.scenarios.truth.oracle.events import trace
from crosscheck2d.scenarios.truth.oracle.numbers import mpfr
from crosscheck2d.scenarios.truth.oracle.path import Path
from crosscheck2d.scenarios.truth.order import float64_horizon
from crosscheck2d.scenarios.truth.record import record_of
from tests.scenarios.exercise_box import boxed

NEAR = 1e-7
"""m, m/s: how far starts are moved to measure a derivative; the second order is as much smaller
than the first."""


def path_of(one: Scenario) -> Path:
    return trace(one.scene, [p for p in one.thrusts if p.force.any()], one.duration, mpfr(300))


def asked(scene: Scene, duration: float, thrusts: tuple[Thrust, ...] = ()) -> Scenario:
    return Scenario("asked", "?", "", scene, duration, duration / 50, thrusts=thrusts)


def moved(scene: Scene, by: tuple[Array, Array, Array], k: int, scale: float) -> Scene:
    return replace(
        scene,
        position=scene.position + scale * by[0][:, k],
        velocity=scene.velocity + scale * by[1][:, k],
        angular_velocity=scene.angular_velocity + scale * by[2][:, k],
    )


def carried(one: Scenario) -> Array:
    """(n, d, 2) m, what each rounding makes of each position at the end, to first order."""
    path = path_of(one)
    tangents = TangentVectors(one, path)
    for event in path.events:
        if float(event.impulse):
            tangents.collide(event)
    for i in tangents.moving:
        tangents.carry(i, one.duration)
    return tangents.dx


def ends(one: Scenario) -> Array:
    free = replace(record_of(one, path_of(one), 0.0, 300, ""), float64_horizon=np.inf)
    assert not free.reason
    return free.sampled(one.scene, one.thrusts, np.array([0.0, one.duration])).position[-1]


FLOOR = [[[-9.0, 0.0], [9.0, 0.0]]]
DOWN = [0.0, -9.8125]
RAMP = [[[-1.0, 0.5], [1.0, -0.25]]]
TWO = dict(
    position=[[-1, 0.125], [1, 0]],
    velocity=[[2, 0.25], [-1.5, 0]],
    radius=[0.25, 0.375],
    mass=[1.0, 2.5],
)
ALONE = dict(position=[[0.25, 1.5]], velocity=[[0.75, -0.5]], radius=[0.25], mass=[1.5])
SPUN = dict(**TWO, angular_velocity=[6.0, -1.5])
SLID = dict(
    position=[[0.25, 0.5]],
    velocity=[[1.5, 0.0]],
    radius=[0.5],
    mass=[2.0],
    angular_velocity=[4.0],
)
FALLING = dict(**ALONE, gravity=DOWN)
END = [[[1.0, -1.0], [1.0, 0.875]]]
CORNER = [*FLOOR, [[1.5, -1.0], [1.5, 3.0]]]
ONTO_STATIC = dict(position=[[0.125, 1.5], [0, 0]], velocity=[[0.0, 0.5], [0, 0]])
ONTO_LYING = dict(position=[[-0.125, 1.5], [0, 0.5]], velocity=[[0, -1], [0, 0]])
LIFTED = Thrust(0, 1.25, 1.75, [1.0, 30.0])
LYING_ON = dict(radius=[0.25, 0.5], gravity=DOWN)
OVER = FALLING | dict(velocity=[[4, 0]], walls=[[[-9, 0], [4.5, 0]]])
WRAPPED = TWO | dict(position=[[-1, 0.125], [1, -0.25]], wrap=[[-2, -3], [2, 3]])
SLIDING = dict(**SLID, gravity=DOWN, walls=FLOOR)
# of each the restitution, the duration, the fields of its scene, and its thrusts
ROWS: dict[str, tuple[float, float, dict, *tuple[Thrust, ...]]] = {
    "a flight": (1.0, 0.5, FALLING),
    "two disks": (0.75, 1.5, TWO),
    "two disks that stick": (0.0, 1.5, TWO),
    "two falling disks": (0.75, 1.5, TWO | dict(gravity=DOWN)),
    "a static disk under gravity": (1.0, 1.0, ONTO_STATIC | LYING_ON | dict(mass=[1, np.inf])),
    "a wall": (0.5, 1.0, FALLING | dict(walls=RAMP)),
    "the end of a wall": (0.5, 1.5, ALONE | dict(walls=END)),
    "a corner": (0.875, 1.25, FALLING | dict(walls=CORNER)),
    "bounces that die out on a ramp": (0.25, 1.2, FALLING | dict(walls=[[[-9, 4], [9, -5]]])),
    "a slide over the end of a wall": (0.25, 1.5, OVER),
    "a disk that is thrust off the floor": (0.125, 2.0, FALLING | dict(walls=FLOOR), LIFTED),
    "a collision on a disk that lies": (0.9375, 0.75, ONTO_LYING | LYING_ON | dict(walls=FLOOR)),
    "a wrap": (1.0, 1.6, WRAPPED),
    "two disks that slide on each other": (0.5, 1.5, SPUN | dict(friction=0.05)),
    "two disks that grip each other": (0.5, 1.5, SPUN | dict(friction=2.0)),
    "a bounce on the end of a wall, with friction": (
        0.5,
        1.5,
        ALONE | dict(friction=0.25, walls=END),
    ),
    "a slide that becomes a roll": (0.5, 1.5, SLIDING | dict(friction=0.25)),
    "a bounce in which a slide ends": (0.5, 2.0, FALLING | dict(walls=FLOOR, friction=0.5)),
}
CHANGES = {
    name: asked(lay_out(**fields, restitution=restitution), duration, tuple(thrusts))
    for name, (restitution, duration, fields, *thrusts) in ROWS.items()
}
CHANGES["many"] = asked(boxed(3), 3.0)
CHANGES["many with friction"] = asked(replace(boxed(3), friction=0.25), 2.0)
LYING = {"a collision on a disk that lies": 1, "a slide that becomes a roll": 0}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * name.startswith("many")) for name in CHANGES],
)
def test_what_a_rounding_becomes_is_the_derivative_of_the_motion(name: str):
    one = CHANGES[name]
    by, found = roundings(one.scene), carried(one)
    for k in range(by[0].shape[1]):
        if name in LYING and (by[0][LYING[name], k, 1] or by[1][LYING[name], k, 1]):
            continue  # it is kept on the floor
        size = NEAR / max(each[:, k].max() for each in by)
        there, here = (
            ends(replace(one, scene=moved(one.scene, by, k, sign * size))) for sign in (1, -1)
        )
        expected, off = (there - here) / (2 * size), found[:, k]
        largest = max(np.abs(expected).max(), EPS)
        np.testing.assert_allclose(
            off / largest, expected / largest, rtol=0, atol=1e-4, err_msg=f"number {k}"
        )


def test_the_derivatives_of_these_motions_pass_every_kind_of_change():
    paths = {name: path_of(one) for name, one in CHANGES.items()}
    assert {name for name, path in paths.items() if not path.events} == {"a flight"}
    assert any(leg.y == -3 for leg in paths["a wrap"].legs[0])
    assert any(leg.hop for leg in paths["bounces that die out on a ramp"].legs[0])
    assert [bool(leg.held) for leg in paths["a slide over the end of a wall"].legs[0]][-2:] == [
        True,
        False,
    ]
    assert [bool(leg.held) for leg in paths["a disk that is thrust off the floor"].legs[0]].count(
        True
    ) == 1
    assert not all(event.new for event in paths["a collision on a disk that lies"].events)
    assert len(paths["many"].events) > 10


@pytest.mark.parametrize(
    "name",
    [
        "asteroids",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("gas_of_100", "falling_box")),
    ],
)
def test_at_the_horizon_moved_starts_are_as_far_off_as_it_says(name: str):
    # Each number a unit in the last place up or down. Twelve samples show the root mean square to
    # 20 %, and the largest of many is taken.
    one = scenario(name)
    until = float(computed(one).float64_horizon)
    one = replace(one, duration=until, sample_interval=until)
    here, dx, off = ends(one), roundings(one.scene), []
    for number in range(12):
        signs = np.random.default_rng(number).choice([-1.0, 1.0], dx[0].shape[1])
        there = replace(
            one.scene,
            position=one.scene.position + signs @ dx[0],
            velocity=one.scene.velocity + signs @ dx[1],
        )
        off.append(((ends(replace(one, scene=there)) - here) ** 2).sum(axis=1))
    assert 0.5 < (np.sqrt(np.mean(off, axis=0)) / (DIVERGED * one.scene.radius)).max() < 2


ROW = lay_out(
    [[-3, 0.125], [-1.5, 0.0], [-0.5, 0.0], [0.5, 0.0], [2.5, 0.25], [2.5, -1.0]],
    [[3, 0.125], [0, 0], [0, 0], [0, 0], [-1, -0.5], [0.25, 1]],
    radius=[0.5, 0.5, 0.5, 0.5, 0.375, 0.25],
    walls=box([-4, -2], [4, 2]),
)


def test_what_touches_at_the_start_has_the_horizon_of_small_gaps():
    # it had none, since a start moved by a rounding overlaps
    touching = computed(asked(ROW, 12.0)).float64_horizon
    apart = replace(
        ROW,
        position=ROW.position
        + np.outer(np.arange(6) > 1, [1e-9, 0]) * [[0], [0], [1], [2], [0], [0]],
    )

    assert 2.0 < touching < 12.0
    assert computed(asked(apart, 12.0)).float64_horizon == pytest.approx(touching, rel=0.02)


def test_motions_that_are_not_chaotic_are_followed_to_their_end():
    for name in (
        "bouncing_ball_e09",
        "rest_on_floor",
        "column_of_ten",
        "galperin_31",
        "cradle_touching",
        "line_gas",
    ):
        one = scenario(name)
        assert float64_horizon(one, path := path_of(one)) == (np.inf, path)


def test_the_horizon_is_shorter_beside_a_disk_far_away_that_nothing_meets():
    # as the rounding is that of the largest coordinate in the scene (horizon.py)
    position = np.array([[x, y] for x in (-1.0, 0.0, 1.0) for y in (-0.7, 0.8)])
    velocity = np.random.default_rng(4).normal(0, 3, (6, 2))
    walls = [[[-2, -2], [2, -2]], [[2, -2], [2, 2]], [[2, 2], [-2, 2]], [[-2, 2], [-2, -2]]]

    def followed(far: float, y: float = 0.0) -> float:
        scene = lay_out([*position, [far, y]], [*velocity, [0.0, 0.0]], radius=0.3, walls=walls)
        return computed(asked(scene, 10.0)).float64_horizon

    near, middle, far = map(followed, (3.0, 30.0, 300.0))
    assert far < middle < near < 10
    assert followed(3.0, y=1.5) == near


def test_the_exact_answer_shares_no_code_with_the_event_engine():
    folder = File(of_horizon.__file__).parent
    ours = list(folder.rglob("*.py"))
    imported = {
        node.module
        for file in ours
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom)
    }
    assert len(ours) > 10
    assert not {
        name for name in imported if name and {"adapters", "reference_impl"} & {*name.split(".")}
    }
