"""Rest in the event engine: bounces that come to their end, what lies on a wall, and what takes it
off again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from crosscheck2d.adapters.event_driven import events
from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Scene
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.closed_forms import bouncing
from tests.adapters.event_driven.gases import after
from tests.adapters.event_driven.test_brute_force import plain_kernels

G = 10.0
FLOOR = [[[-50.0, 0.0], [50.0, 0.0]]]


def disks(position, velocity, restitution, **fields):
    n = len(position)
    arrays = {"radius": np.full(n, 0.5), "mass": np.ones(n), "walls": FLOOR, "gravity": [0.0, -G]}
    return Scene(position=position, velocity=velocity, restitution=restitution, **(arrays | fields))


@pytest.mark.parametrize("e", [0.0, 0.1, 0.5, 0.9, 0.99])
def test_a_bouncing_ball_follows_the_closed_form_into_rest(e):
    # At any time, also between bounces a microsecond apart, and for ever after sqrt(2 h / g) (1 +
    # e) / (1 - e).
    end = np.sqrt(2 * 2.0 / G) * (1 + e) / (1 - e)
    engine = EventEngine(disks([[0.0, 2.5]], [[0.25, 0.0]], e))
    times = end * np.sort(
        np.concatenate([np.linspace(0, 1.5, 200), 1 - np.geomspace(1e-1, 1e-9, 60)])
    )
    height, speed = (
        bouncing(2.0, G, e, times[-1]).at(times)
        if e > 0
        else (np.maximum(2 - G * times**2 / 2, 0), None)
    )
    for k, at in enumerate(times):
        engine.advance(at)
        x, v = engine.motion_at(at)
        # A time is rounded at every bounce, 3231 of them at e = 0.99, and moves the ball by 6.3 m/s
        # s.
        assert x[0] == pytest.approx([at / 4, 0.5 + height[k]], abs=2e-11)
        if at > end * (1 + 1e-11):
            assert (x[0, 1], *v[0]) == (0.5, 0.25, 0.0)
        elif speed is not None and abs(height[k]) > 1e-9:
            assert v[0, 1] == pytest.approx(speed[k], abs=1e-9)


def test_bounces_down_an_incline_end_in_a_slide():
    # On the line of slope -3/4: g cos(alpha) across it, g sin(alpha) along it, all the time.
    along, normal = np.array([0.8, -0.6]), np.array([0.6, 0.8])
    scene = disks([1.5 * normal], [[0.0, 0.0]], 0.5, walls=[[-20 * along, 60 * along]])
    end = 3 * np.sqrt(2 * 1.0 / (0.8 * G))
    for at in (0.3, end * 0.9, end * 0.999, end + 1e-9, 3.0):
        x, v = after(scene, at)
        assert x[0] @ along == pytest.approx(0.6 * G * at**2 / 2, abs=1e-12)
        assert v[0] @ along == pytest.approx(0.6 * G * at, abs=1e-12)
        if at > end:
            assert x[0] @ normal == pytest.approx(0.5, abs=1e-14)
            assert v[0] @ normal == pytest.approx(0.0, abs=1e-14)


# A disk of unit speed strikes one that lies on the floor: speeds after A-B, B-floor, A-B, ... until
# nothing closes in.
ON_A_LYING_DISK = {0.8: (0.638, 0.0144), 0.5: (0.21875, 0.046875)}


@pytest.mark.parametrize("e", ON_A_LYING_DISK)
def test_a_collision_on_a_lying_disk_is_the_limit_of_small_gaps(e):
    # By hand for equal masses: at e = 0.8, (-1, 0), (-.1, -.9), (-.1, .72), (.638, -.018), (.638,
    # .0144).
    start = np.sqrt(1 - 2 * G * 0.045)
    engine, at = (
        EventEngine(disks([[0.0, 0.5], [0.0, 1.545]], [[0, 0], [0, -start]], e)),
        (1 - start) / G,
    )
    engine.advance(at + 1e-9)
    _, v = engine.motion_at(at + 1e-9)
    assert v[::-1, 1] == pytest.approx(np.array(ON_A_LYING_DISK[e]) - G * 1e-9, abs=1e-9)
    assert len(engine.collisions) == 5  # and the floor, which bears the lower one from the start


@pytest.mark.parametrize(("e", "mass"), [(0.0, 1.0), (0.1, 1.0), (0.5, 10.0)])
def test_a_collision_on_a_lying_disk_that_does_not_end_is_refused(e, mass):
    scene = disks([[0.0, 0.5], [0.0, 2.0]], [[0, 0], [0, -1.0]], e, mass=[1.0, mass])
    with pytest.raises(
        NoTruth,
        match=r"the collisions of disk [01] on disk [01]( and wall 0)? accumulate at 0\.2316",
    ):
        EventEngine(scene).advance(1.0)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_a_collision_on_a_lying_disk_is_one_on_a_disk_just_above_the_floor(seed):
    draw = np.random.default_rng(seed)
    radius, mass, angle = (
        draw.uniform(0.3, 1, 2),
        draw.uniform(0.5, 2, 2),
        draw.uniform(0.3, np.pi - 0.3),
    )
    toward = np.array([np.cos(angle), np.sin(angle)])
    e, start = draw.uniform(0.7, 1), [0.0, radius[0]]
    # else the other starts below the floor
    assume(start[1] + (radius.sum() + 1e-3) * toward[1] > radius[1])

    def played(lift, gravity):
        position = np.array([start, start + (radius.sum() + 1e-3) * toward]) + [0, lift]
        velocity = [[0.0, 0.0], -5 * toward]
        engine = EventEngine(
            disks(position, velocity, e, radius=radius, mass=mass, gravity=[0.0, -gravity])
        )
        engine.advance(3e-4)
        return engine.motion_at(3e-4)[1]

    # Between two collisions the upper one moves 5 m/s times 1e-12 m over the slow speed of the
    # lower one, some mm/s; and in 3e-4 s gravity changes a speed by 3e-9 m/s.
    assert played(0.0, 1e-5) == pytest.approx(played(1e-12, 0.0), abs=2e-7)


@pytest.mark.parametrize(("speed", "flies"), [(2.3, True), (2.2, False)])
def test_over_the_end_of_its_wall_a_fast_disk_flies_and_a_slow_one_is_refused(speed, flies):
    # It turns about the end, on a circle, if v2 < g r = 5 m2/s2; else its parabola never touches
    # the end again.
    scene = disks([[-1.0, 0.5]], [[speed, 0.0]], 0.5, walls=[[[-5, 0], [0, 0]]])
    if not flies:
        with pytest.raises(
            NoTruth, match=r"disk 0 slides round the end of wall 0 at 0\.4545\d* s: its path there"
        ):
            after(scene, 1.0)
        return
    x, v = after(scene, 1.0)
    fall = 1.0 - 1.0 / speed
    assert x[0] == pytest.approx([speed - 1.0, 0.5 - G * fall**2 / 2], abs=1e-14)
    assert v[0] == pytest.approx([speed, -G * fall], abs=1e-14)


@pytest.mark.parametrize("slope", [0.0, -0.5])
@pytest.mark.parametrize(
    "pieces",
    [[(-4, 0), (0, 4)], [(0, -4), (4, 0)], [(-4, 1), (4, -1)], [(-4, 0), (-4, 0), (0, 4)]],
    ids=["joined", "joined, the other way round", "overlapping", "twice"],
)
def test_a_slow_disk_goes_on_along_the_walls_that_continue_its_own(slope, pieces):
    start = [-1.0, -slope + 0.5 * np.hypot(1, slope) + 0.01]
    one, whole = (
        EventEngine(
            disks(
                [start],
                [[1.0, slope]],
                0.25,
                gravity=[0.0, -1.0],
                walls=[[[x, slope * x] for x in ends] for ends in these],
            )
        )
        for these in (pieces, [(-4, 4)])
    )
    for t in (0.5, 1.75):
        for engine in (one, whole):
            engine.advance(t)
            assert engine.arena.disks[0].wall >= 0
        (x, v), (x_whole, v_whole) = one.motion_at(t), whole.motion_at(t)
        assert x == pytest.approx(x_whole, abs=1e-14)
        assert v == pytest.approx(v_whole, abs=1e-14)
    assert x[0, 0] > 0.5


def test_a_thrust_off_the_floor_lifts_a_lying_disk_and_one_into_it_does_not():
    # 2 m/s2 upward and to the right from 1 s to 2 s; the same twice as strong downward leaves it
    # where it is.
    scene = disks([[0.0, 0.5]], [[0.0, 0.0]], 0.5)
    for upward, height in ((2.0, 1.0), (-4.0, 0.0)):
        engine = EventEngine(scene)
        engine.advance(1.0)
        engine.accelerate(0, 1.0, np.array([2.0, upward]))
        engine.advance(2.0)
        x, v = engine.motion_at(2.0)
        assert x[0] == pytest.approx([1.0, 0.5 + height], abs=1e-14)
        assert v[0] == pytest.approx([2.0, max(upward, 0.0)], abs=1e-14)


def test_lying_disks_collide_along_the_floor_and_stay_on_it():
    scene = disks([[0.0, 0.5], [3.0, 0.5]], [[1.0, 0.0], [-1.0, 0.0]], 0.5)
    x, v = after(scene, 3.0)
    assert x.tolist() == [[0.0, 0.5], [3.0, 0.5]]
    assert v.tolist() == [[-0.5, 0.0], [0.5, 0.0]]


def test_without_mutual_help_nothing_stands_on_a_point_or_on_another_disk():
    pin = disks([[0.0, 2.0]], [[0.0, 0.0]], 0.5, walls=[[[0.0, -1.0], [0.0, 0.0]]])
    pile = disks([[0.0, 0.5], [0.0, 2.0]], [[0.0, 0.0], [0.0, 0.0]], 0.5)
    post = disks([[0.0, 0.5], [0.0, 2.0]], [[0.0, 0.0], [0.0, 0.0]], 0.5, mass=[np.inf, 1.0])
    for scene, words in ((pin, "wall 0"), (pile, "disk [01]( and wall 0)?"), (post, "disk 0")):
        with pytest.raises(NoTruth, match=f"the collisions of disk [01] on {words} accumulate at"):
            EventEngine(scene).advance(9.0)


def rain(seed, restitution, n=21):
    draw = np.random.default_rng(seed)
    radius = draw.uniform(0.08, 0.3, n)
    position = scatter(draw, [0.3, 0.3], [9.7, 5.7], radius)
    return Scene(
        position=position,
        velocity=draw.uniform(-0.5, 0.5, (n, 2)),
        radius=radius,
        mass=30 * radius**2,
        restitution=restitution,
        gravity=[0.0, -G],
        walls=box([0.0, 0.0], [10.0, 6.0]),
    )


@pytest.mark.parametrize("seed", range(3))
def test_while_a_box_settles_energy_only_falls_and_nothing_overlaps(seed):
    scene = rain(seed, 0.5)
    engine, energy, at = EventEngine(scene), np.inf, 0.0
    i, j = np.triu_indices(scene.n, 1)
    with pytest.raises(NoTruth, match="accumulate"):
        EventEngine(scene).advance(99.0)
    while True:
        at += 0.01
        try:
            engine.advance(at)
        except NoTruth:
            break
        x, v = engine.motion_at(at)
        now = scene.mass @ ((v**2).sum(axis=1) / 2 + G * x[:, 1])
        assert now <= energy * (1 + 1e-13)  # rounding of a sum
        energy = now
        assert (np.hypot(*(x[i] - x[j]).T) - scene.radius[i] - scene.radius[j]).min() > -1e-12
        assert (x[:, 1] - scene.radius).min() > -1e-12
    assert (engine.arena.disks.wall >= 0).any()


def test_a_settling_row_does_not_depend_on_order_or_handedness():
    draw = np.random.default_rng(5)
    n = 8
    x = np.column_stack([np.arange(n) * 1.7, draw.uniform(0.6, 1.2, n)])
    v = np.column_stack([draw.uniform(-0.3, 0.3, n), np.zeros(n)])
    scene = disks(x, v, 0.4)
    end, speed = after(scene, 6.0)
    assert (np.abs(end[:, 1] - 0.5) < 1e-15).all()
    order = draw.permutation(n)
    other, _ = after(disks(x[order], v[order], 0.4), 6.0)
    assert other == pytest.approx(end[order], abs=1e-11)
    mirrored, back = after(disks(x * [-1, 1], v * [-1, 1], 0.4), 6.0)
    assert mirrored * [-1, 1] == pytest.approx(end, abs=1e-11)
    assert back * [-1, 1] == pytest.approx(speed, abs=1e-11)


def test_nothing_comes_to_rest_at_restitution_one():
    engine = EventEngine(disks([[0.0, 1.5]], [[0.0, 0.0]], 1.0))
    engine.advance(1790.0)
    x, v = engine.motion_at(1790.0)
    assert len(engine.collisions) == int((1790.0 / np.sqrt(2 / G) + 1) / 2)
    assert v[0, 1] ** 2 / 2 + G * (x[0, 1] - 0.5) == pytest.approx(G, rel=1e-12)
    assert (engine.arena.disks.wall == -1).all()


def play_all():
    test_bounces_down_an_incline_end_in_a_slide()
    test_over_the_end_of_its_wall_a_fast_disk_flies_and_a_slow_one_is_refused(2.3, True)


def test_rest_in_plain_python_is_the_same(monkeypatch):
    monkeypatch.setattr(events, "event_loop", plain_kernels())
    play_all()


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (
            "speed * uy, acceleration * ux, acceleration * uy",
            "speed * uy, a.free_ax, a.free_ay",
        ),  # what lies still falls
        # a wall without an end
        ("if a.wall >= 0:\n        t = end_time", "if False:\n        t = end_time"),
    ],
)
def test_a_planted_bug_in_rest_is_caught(right, wrong, monkeypatch):
    monkeypatch.setattr(events, "event_loop", plain_kernels(right, wrong))
    with pytest.raises((AssertionError, NoTruth)):
        play_all()


@pytest.mark.parametrize("length", [1e-9, 1e-8, 1e-6])
@pytest.mark.parametrize("share", [-1.5, -0.25, 0.25, 0.5, 0.75, 1.25, 2.5])
@pytest.mark.parametrize("angle", [0.0, np.pi / 2, 1.0, 4.0])
def test_a_tiny_wall_has_a_face_and_two_ends(length, share, angle):
    # A disk that comes straight at it: it turns back where its foot lies on the wall, and beyond
    # that by the angle of the nearer end; float64 has one time for all three.
    start, way = np.array([0.25, 0.5]), np.array([np.cos(angle), np.sin(angle)])
    end = start + length * way
    u = (end - start) / np.hypot(*(end - start))  # rounding turns so short a wall by up to 1e-7
    n = np.array([-u[1], u[0]])
    scene = lay_out([start + share * (end - start) + 1.25 * n], [-n], walls=[[start, end]])
    _, v = after(scene, 2.0)

    aside = (scene.position[0] - start) @ u
    tilt = (aside - np.clip(aside, 0, np.hypot(*(end - start)))) / 0.25
    assert v[0] @ u == pytest.approx(2 * tilt, abs=2e-15)
    assert v[0] @ n == pytest.approx(1.0, abs=1e-9)


def test_at_restitution_zero_a_disk_slides_past_both_ends_of_a_wall():
    draw = np.random.default_rng(1)
    for _ in range(40):
        angle, half = draw.uniform(0, 2 * np.pi), 10 ** draw.uniform(-7, -1)
        way, place, speed = (
            [np.cos(angle), np.sin(angle)],
            draw.uniform(-0.5, 0.5, 2),
            draw.normal(),
        )
        walls = np.array([[place - half * np.array(way), place + half * np.array(way)]])
        u = (walls[0, 1] - walls[0, 0]) / np.hypot(*(walls[0, 1] - walls[0, 0]))
        n = np.array([-u[1], u[0]])
        scene = lay_out(
            [place + 0.75 * n - speed / 2 * u], [speed * u - n], restitution=0.0, walls=walls
        )
        engine = EventEngine(scene)
        engine.advance(3.0)
        _, v = engine.motion_at(3.0)

        assert len(engine.collisions) == 1
        assert v[0] == pytest.approx(speed * u, abs=1e-14)


def test_a_turned_floor_of_two_walls_is_a_floor():
    for seed in range(60):
        draw = np.random.default_rng([11, seed])
        angle, joint = draw.uniform(0, 2 * np.pi), draw.uniform(-0.5, 0.8)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        walls = np.array([[[-4, 0], [joint, 0]], [[joint, 0], [4, 0]]]) @ turn.T + 0.7
        two = lay_out(
            [turn @ [-1, 0.25 + draw.uniform(0.01, 0.1)] + 0.7],
            [turn @ [draw.choice([0.5, 1.0, 2.0, 4.0]), 0]],
            restitution=draw.choice([0.0, 0.5, 0.9]),
            friction=draw.choice([0.0, 0.3]),
            walls=walls,
            gravity=turn @ [0, -G],
        )
        one = replace(two, walls=[[walls[0, 0], walls[1, 1]]])
        # some hundred bounces round some 1e-15 each
        for part, whole in zip(after(two, 1.0), after(one, 1.0)):
            assert part == pytest.approx(whole, abs=1e-12)


def test_walls_at_an_angle_share_no_surface_however_short_they_are():
    for kink, length in ((1e-9, 1.0), (1e-5, 1e-6), (1.0, 1e-15)):
        way = length * np.array([np.cos(kink), np.sin(kink)])
        walls = np.array([[[-1.0, 0.5], [0.0, 0.5]], [[0.0, 0.5], [0.0, 0.5] + way]])
        assert len({*events.surfaces(walls)}) == 2


def test_a_fan_of_many_walls_is_sorted_not_compared_in_pairs(monkeypatch: pytest.MonkeyPatch):
    asked, real = [], events.nearly_in_line
    monkeypatch.setattr(
        events, "nearly_in_line", lambda *pair: bool(asked.append(pair)) or real(*pair)
    )
    angle = np.linspace(0, 3, 1000)
    walls = np.stack([np.zeros((1000, 2)), np.stack([np.cos(angle), np.sin(angle)], -1)], 1)

    assert len({*events.surfaces(walls)}) == 1000 == len(asked)


def test_the_line_of_each_wall_is_found_once(monkeypatch: pytest.MonkeyPatch):
    # In rationals all pairs of some thousand walls would take minutes whenever a scene is loaded.
    corners = 10.0 * np.exp(2j * np.pi * np.arange(401) / 400)
    ends = np.stack([corners.real, corners.imag], axis=-1)
    walls, asked = np.stack([ends[:-1], ends[1:]], axis=1), []
    real = events.line_of
    monkeypatch.setattr(events, "line_of", lambda wall: asked.append(wall) or real(wall))

    assert len({*events.surfaces(walls)}) == len(walls) == len(asked)


def test_walls_in_line_are_one_surface_up_to_a_gap():
    along = np.array([[0, 1], [2, 1], [2, 4], [4, 3], [5, 6], [7, 6], [5.5, 5.75]])
    whole, alone = [0, 0, 0, 0, 4, 4, 4], [[[0.5, -9], [1, 9]], [[0, 1], [9, 8]]]
    for way in ([1.0, 0.0], [0.0, 1.0], [0.5, -2.0]):
        walls = np.concatenate([along[..., None] * way, alone])
        number = events.surfaces(walls)
        same = number[:, None] == number
        assert (same == (np.array([*whole, 7, 8])[:, None] == [*whole, 7, 8])).all()
