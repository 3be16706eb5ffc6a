"""Collisions without an end in the event engine: rest in a corner, a refusal by name, and never an
endless loop."""

from __future__ import annotations

import signal
from time import perf_counter

import numpy as np
import pytest

from crosscheck2d.adapters.event_driven import events
from crosscheck2d.adapters.event_driven import loop as event_loop
from crosscheck2d.adapters.event_driven.disks import GOES_ON, LEFT
from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.families.rows import counting_pi
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.closed_forms import bouncing
from crosscheck2d.scenarios.truth.exact import computed
from tests.adapters.event_driven.gases import after, gas
from tests.adapters.event_driven.test_brute_force import plain_kernels

CROSS = [[[-1.0, -1.0], [1.0, 1.0]], [[-1.0, 1.0], [1.0, -1.0]]]


def disk(position, velocity=(0.0, 0.0), restitution=0.0, **fields):
    arrays = {"radius": [0.25], "mass": [1.0], "walls": CROSS, "gravity": [0.0, -2.0]}
    return Scene(
        position=[position], velocity=[velocity], restitution=restitution, **(arrays | fields)
    )


@pytest.mark.parametrize("e", [0.0, 0.02, 0.5, 0.9])
def test_a_disk_comes_to_rest_between_crossing_walls(e):
    # At radius times sqrt(2) above where they cross: it touches both, and lies still for good.
    x, v = after(disk([0.0, 2.0], [0.25, 0.0], e), 60.0)
    assert x[0] == pytest.approx([0.0, 0.25 * np.sqrt(2)], abs=1e-14)
    assert v.tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize("half", [0.2, 0.7, 1.3])
@pytest.mark.parametrize("e", [0.0, 0.3, 0.7])
def test_a_disk_comes_to_rest_in_a_wedge(half, e):
    # Of any angle: at radius / sin of half of it from the tip.
    walls = [[[0.0, 0.0], [3 * side * np.sin(half), 3 * np.cos(half)]] for side in (1, -1)]
    x, v = after(disk([0.03, 1.9], [0.02, 0.0], e, walls=walls), 60.0)
    assert x[0] == pytest.approx([0.0, 0.25 / np.sin(half)], abs=1e-13)
    assert v.tolist() == [[0.0, 0.0]]


def test_into_a_right_angle_both_axes_bounce_on_their_own():
    e, acceleration = 0.5, np.array([3.0, 8.0])
    engine = EventEngine(
        disk([1.25, 1.75], [0.0, 0.0], e, walls=box([0, 0], [9, 9]), gravity=-acceleration)
    )
    for at in np.linspace(0.02, 6.0, 300):
        engine.advance(at)
        x, _ = engine.motion_at(at)
        for axis, height in enumerate((1.0, 1.5)):
            there, _ = bouncing(height, acceleration[axis], e, 6.0).at(np.array([at]))
            assert x[0, axis] == pytest.approx(0.25 + there[0], abs=1e-12)
    assert engine.motion_at(6.0)[1].tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize(
    ("acceleration", "moves"),
    [
        ((2.0, -8.0), (2.0, 0.0)),  # off the side wall, along the floor
        ((-2.0, 8.0), (0.0, 8.0)),  # up the side wall
        ((2.0, 8.0), (2.0, 8.0)),  # off both
        ((-9.0, -1.0), (0.0, 0.0)),  # deeper into the corner
    ],
)
def test_a_change_of_acceleration_takes_a_disk_out_of_its_corner(acceleration, moves):
    # Which wall still bears it decides how it goes: a t2 / 2 along what is left of the
    # acceleration.
    engine = EventEngine(
        disk([0.25, 0.25], walls=box([0, 0], [20, 20]), gravity=[-3.0, -8.0], restitution=0.5)
    )
    engine.advance(1.0)
    assert engine.motion_at(1.0)[1].tolist() == [[0.0, 0.0]]
    engine.accelerate(0, 1.0, np.array(acceleration))
    engine.advance(2.0)
    assert engine.motion_at(2.0)[0][0] == pytest.approx(0.25 + np.array(moves) / 2, abs=1e-13)


@pytest.mark.parametrize("side", [1, -1])
def test_in_an_obtuse_wedge_a_disk_slides_up_the_wall_that_holds_it_no_more(side):
    walls = [[[0.0, 0.0], [3 * way * np.sin(np.pi / 3), 3 * np.cos(np.pi / 3)]] for way in (1, -1)]
    engine = EventEngine(disk([0.01, 1.0], walls=walls, gravity=[0.0, -8.0], restitution=0.5))
    engine.advance(5.0)
    assert engine.motion_at(5.0)[1].tolist() == [[0.0, 0.0]]
    engine.accelerate(0, 5.0, 8 * np.sqrt(0.5) * np.array([side, -1.0]))
    engine.advance(5.5)
    up = np.array([side * np.sin(np.pi / 3), np.cos(np.pi / 3)])
    way = 8 * np.cos(np.deg2rad(75)) * 0.5**2 / 2 * up
    assert engine.motion_at(5.5)[0][0] == pytest.approx(
        [0.0, 0.25 / np.sin(np.pi / 3)] + way, abs=1e-12
    )


@pytest.mark.parametrize(
    ("place", "speed"), [((2.0, 0.25), (-3.0, 0.0)), ((0.25, 2.25), (0.0, -2.5))]
)
def test_a_collision_takes_a_disk_out_of_its_corner_as_the_exact_answer_has_it(place, speed):
    scene = Scene(
        position=[[0.25, 0.25], place],
        velocity=[[0.0, 0.0], speed],
        radius=[0.25, 0.25],
        mass=[1.0, 2.0],
        restitution=0.8,
        walls=box([0, 0], [9, 9]),
        gravity=[-0.5, -4.0],
    )
    one = Scenario("cornered", "?", "", scene, 1.0, 1 / 16)
    exact, engine = computed(one).sampled(scene, (), one.times), EventEngine(scene)
    assert len(exact) == 17
    for at, there in zip(one.times, exact.position):
        engine.advance(at)
        assert engine.motion_at(at)[0] == pytest.approx(there, abs=1e-10)
    assert np.abs(exact.position[-1, 0] - 0.25).max() > 0.05


def test_at_restitution_one_what_lies_at_the_start_stays():
    for gravity, speed in (((0.0, -8.0), 0.0), ((-3.0, -8.0), 0.0), ((0.0, -8.0), 1.0)):
        scene = disk([0.25, 0.25], [speed, 0.0], 1.0, walls=box([0, 0], [9, 9]), gravity=gravity)
        x, v = after(scene, 2.0)
        assert x.tolist() == [[0.25 + 2 * speed, 0.25]]
        assert v.tolist() == [[speed, 0.0]]


SETTLING = Scene(
    position=[
        [0.22170989031017796, 0.6013981985012808],
        [-0.424888005478246, 0.7941739535426513],
        [-1.5862809070458073, -1.0599378169489908],
        [-1.0797970968313831, 0.8208738459921847],
    ],
    velocity=[
        [-2.6618486511730426, 0.20747975734562682],
        [0.8698842186396099, 0.6954040844930676],
        [-0.2561115136170485, -2.937868626715388],
        [1.046069020054338, -1.4544114048545322],
    ],
    radius=[0.17519097523155064, 0.26211645165017655, 0.20488243366158748, 0.19370006047168187],
    mass=[2.7591325550447965, 2.003588078050509, 2.1215280851993, 0.510568267924179],
    restitution=0.5,
    gravity=[0.0, -7.713535421586903],
    walls=box([-2.0, -1.5], [2.0, 1.5]),
)


def test_collisions_that_accumulate_are_refused_where_the_exact_answer_ends_too():
    record = computed(Scenario("settling", "?", "", SETTLING, 3.0, 0.05))
    engine = EventEngine(SETTLING)
    with pytest.raises(
        NoTruth, match=r"the collisions of disk \d on disk \d and wall 1 accumulate at"
    ) as refusal:
        engine.advance(3.0)
    assert "disk 1 rolls over disk 2" in record.reason
    # A bounce that rounding hides takes some 1e-7 s.
    assert refusal.value.at == pytest.approx(record.horizon, abs=1e-6)
    assert engine.spent < 10_000


def test_a_disk_driven_into_a_wall_by_another_is_refused():
    scene = lay_out([[0.25, 0.0], [1.2, 0.0]], restitution=0.6, walls=[[[0.0, -5.0], [0.0, 5.0]]])
    engine = EventEngine(scene)
    engine.accelerate(1, 0.0, np.array([-5.0, 0.0]))
    with pytest.raises(
        NoTruth, match=r"the collisions of disk 0 on disk 1( and wall 0)? accumulate at 0\.\d+ s"
    ):
        engine.advance(9.0)
    assert engine.spent < 10_000


def test_a_bounce_off_the_end_of_a_wall_is_not_one_off_its_face():
    # After it the disk is behind the line of the face, by more than rounding, until it has gone
    # past the end.
    scene = disk(
        [1.5, 1.0], [-1.5, -1.0], 0.5, walls=[[[-4.0, 0.0], [1.0, 0.0]]], gravity=[0.0, -9.0]
    )
    one = Scenario("end", "?", "", scene, 1.5, 1 / 16)
    exact = computed(one).sampled(scene, (), one.times)
    engine = EventEngine(scene)
    for at, there in zip(one.times, exact.position):
        engine.advance(at)
        assert engine.motion_at(at)[0] == pytest.approx(there, abs=1e-12)


def test_more_collisions_than_can_be_followed_are_refused():
    gap = 1e-9
    scene = disk(
        [0.25 + gap / 2, 0.0],
        [1.0, 0.0],
        1.0,
        gravity=None,
        walls=[[[0.0, -1.0], [0.0, 1.0]], [[0.5 + gap, -1.0], [0.5 + gap, 1.0]]],
    )
    engine = EventEngine(scene)
    with pytest.raises(
        NoTruth, match=r"\d+ events from 0 s to 0\.0004\d+ s are too many to follow up to 1 s"
    ):
        engine.advance(1.0)
    assert engine.spent < 1.1 * events.MOST


def test_many_collisions_in_a_short_time_are_followed():
    one = counting_pi(31415, 1e8, 31.0, (1,))
    engine = EventEngine(one.scene)
    engine.advance(31.0)
    assert len(engine.collisions) == 31415


def test_what_would_take_for_ever_is_refused_though_it_is_no_collision():
    engine = EventEngine(lay_out([[0.0, 0.0]]))
    engine.accelerate(0, 0.0, np.array([1e160, 0.0]))
    with pytest.raises(NoTruth, match="are too many to follow up to 1 s"):
        engine.advance(1.0)


def test_the_loop_comes_back_to_python_and_goes_on_as_if_it_had_not(monkeypatch):
    scene, torus = gas(100, 0.3)
    whole, parts = EventEngine(scene, torus), EventEngine(scene, torus)
    parts.arena.counters[LEFT] = 10
    assert event_loop.advance(parts.arena, parts.scenery, 5.0) == GOES_ON
    assert parts.arena.counters[LEFT] == 0
    whole.advance(5.0)
    monkeypatch.setattr(events, "EVENTS", 7)
    parts.advance(5.0)
    assert len(whole.collisions) > 500
    assert (whole.collisions == parts.collisions).all()


def test_ctrl_c_is_taken_within_a_moment():
    scene, torus = gas(1000, 0.3)
    engine = EventEngine(scene, torus)
    engine.advance(0.1)
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.3)
        started = perf_counter()
        with pytest.raises(KeyboardInterrupt):
            engine.advance(1e4)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert perf_counter() - started < 3.0


def all_in_plain_python():
    test_a_disk_comes_to_rest_between_crossing_walls(0.5)
    test_a_disk_comes_to_rest_in_a_wedge(0.7, 0.0)
    test_a_change_of_acceleration_takes_a_disk_out_of_its_corner((2.0, -8.0), (2.0, 0.0))
    test_in_an_obtuse_wedge_a_disk_slides_up_the_wall_that_holds_it_no_more(1)
    test_in_an_obtuse_wedge_a_disk_slides_up_the_wall_that_holds_it_no_more(-1)
    test_collisions_that_accumulate_are_refused_where_the_exact_answer_ends_too()
    test_a_bounce_off_the_end_of_a_wall_is_not_one_off_its_face()


@pytest.mark.slow
def test_accumulation_in_plain_python_is_the_same(monkeypatch):
    monkeypatch.setattr(events, "event_loop", plain_kernels())
    all_in_plain_python()


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("if held == 0.0 or", "if True or"),  # nothing lies still in a corner
        # What rattles is not noticed, and a wall's end lifts a disk to its face: both rattle on for
        # seconds.
        pytest.param("if run.collisions < COLLISIONS:", "if True:", marks=pytest.mark.long),
        pytest.param("if abs(gap) < rounding:", "if gap < rounding:", marks=pytest.mark.long),
        # it is left to the first of its two walls
        pytest.param("acceleration_into(walls, a, w, k) > 0.0", "False", marks=pytest.mark.slow),
    ],
)
def test_a_planted_bug_in_accumulation_is_caught(right, wrong, monkeypatch):
    monkeypatch.setattr(events, "event_loop", plain_kernels(right, wrong))
    monkeypatch.setattr(events, "MOST", 600)
    monkeypatch.setattr(events, "EVENTS", 200)
    with pytest.raises((AssertionError, NoTruth)):
        all_in_plain_python()
