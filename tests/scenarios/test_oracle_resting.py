"""What comes to rest, what rests, and collisions on what rests: against closed forms, simulations,
and symmetries."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Scenario, Scene, Thrust
from crosscheck2d.scenarios.truth.exact import ACCURACY, computed
from crosscheck2d.scenarios.truth.oracle import contact_finder
from crosscheck2d.scenarios.truth.oracle import resting as oracle_resting
from crosscheck2d.scenarios.truth.oracle.contact_finder import collinear, points_in_line
from crosscheck2d.scenarios.truth.oracle.events import trace
from crosscheck2d.scenarios.truth.oracle.numbers import mpfr
from crosscheck2d.scenarios.truth.record import TruthRecord
from tests.adapters.event_driven.test_symmetries import changed
from tests.scenarios.exercise_box import boxed, lasting
from tests.scenarios.test_catalogue import smallest_gap
from tests.scenarios.test_oracle import asked, sampled, states

FLOOR = [[[-9, 0], [9, 0]]]
KINDS = [None, mpfr]


def falling(position, velocity=(0, 0), restitution=0.5, walls=FLOOR, **fields) -> Scene:
    return lay_out(
        position, velocity, restitution=restitution, walls=walls, gravity=[0, -9.81], **fields
    )


def rests(record: TruthRecord) -> list[tuple[float, int, int]]:
    return [(t, int(i), int(j)) for t, i, j, kick, _ in record.events.tolist() if kick == 0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "name", ["bouncing_ball_e09", "rest_on_floor", "slide_on_incline", "column_of_ten"]
)
def test_what_has_a_closed_form_is_found_to_the_bound_claimed(name: str, kind):
    one = scenario(name)
    record = computed(one, kind)
    expected, found = one.truth(one.times), states(one, record)

    assert (len(found), record.reason) == (len(expected), "")
    np.testing.assert_allclose(found.position, expected.position, rtol=0, atol=record.error_bound)
    # The closed form of a geometric series rounds as often as it has terms.
    np.testing.assert_allclose(found.velocity, expected.velocity, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.collisions.t, expected.collisions.t, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        found.collisions.impulse, expected.collisions.impulse, rtol=0, atol=1e-14
    )
    if kind is None:
        assert record.method == "certified"


@given(
    restitution=st.floats(0.0, 0.99),
    height=st.floats(0.01, 5),
    slope=st.floats(-1.2, 1.2),
    speed=st.floats(-2, 2),
)
@settings(max_examples=25, deadline=None)
def test_a_ball_on_a_slope_rests_when_its_bounces_end_and_slides_from_then_on(
    restitution, height, slope, speed
):
    # at t_1 (1 + e) / (1 - e) with g cos(slope), along the slope with g sin(slope) all the time
    along, up = np.array([np.cos(slope), np.sin(slope)]), np.array([-np.sin(slope), np.cos(slope)])
    scene = falling(
        [(0.5 + height) * up],
        [speed * along],
        radius=0.5,
        mass=2.0,
        walls=[[-5000 * along, 5000 * along]],
        restitution=restitution,
    )
    fall, slide = 9.81 * np.cos(slope), -9.81 * np.sin(slope)
    still = np.sqrt(2 * height / fall) * (1 + restitution) / (1 - restitution)
    one = asked(scene, min(still * 1.3, 12.0))
    record = computed(one)
    truth, t = states(one, record), one.times

    # The walls are 5 km long: their float64 ends turn the slope by 1e-16, and that by 1 km is 1e-13
    # m.
    np.testing.assert_allclose(
        truth.position[:, 0] @ along, speed * t + slide * t**2 / 2, rtol=0, atol=1e-9
    )
    assert (truth.position[:, 0] @ up).min() > 0.5 - 1e-11
    if still < one.duration:
        assert rests(record) == [(pytest.approx(still, rel=1e-9), 0, -1)]
        np.testing.assert_allclose(truth.position[t > still, 0] @ up, 0.5, rtol=0, atol=1e-10)


@given(
    degrees=st.floats(1, 80),
    friction=st.sampled_from([0.0, 0.1, 0.5]),
    lift=st.sampled_from([0, 1e-14, 1e-9]),
)
@settings(max_examples=25, deadline=None)
def test_a_ball_placed_on_a_slope_is_followed_to_the_end(degrees, friction, lift):
    # g sin less friction, or 2/3 g sin
    a = np.radians(degrees)
    along, up = np.array([np.cos(a), -np.sin(a)]), np.array([np.sin(a), np.cos(a)])
    scene = lay_out(
        [-3 * along + (0.2 + lift) * up],
        radius=0.2,
        gravity=[0, -10],
        walls=[[-4 * along, 80 * along]],
        restitution=0.0,
        friction=friction,
    )
    one = asked(scene, 2.0)
    record = computed(one)
    rolls = 2 / 3 * np.sin(a) if friction else 0.0
    pull = 10 * max(rolls, np.sin(a) - friction * np.cos(a))

    assert (record.reason, min(record.float64_horizon, 2.0)) == ("", 2.0)
    truth = states(one, record)
    # What friction does while it lies, its impulse does at the landing: to first order in the fall.
    expected = pull * truth.t**2 / 2 - 3
    np.testing.assert_allclose(
        truth.position[:, 0] @ along, expected, rtol=0, atol=1e-12 + 10 * lift
    )


@pytest.mark.parametrize("height", [0.3, 0.9])
def test_what_overlaps_by_a_rounding_touches(height: float):
    # 0.9 - 0.6 and 0.3 differ by 5e-17, 0.3 - 0.1 and 0.2 by 3e-17
    floor = 0.6 if height > 0.5 else 0.0
    scene = lay_out(
        [[0, height], [0, height + 0.4]],
        radius=[0.3, 0.1],
        gravity=[0, -10],
        walls=[[[-9, floor], [9, floor]]],
        restitution=0.5,
    )
    record = computed(asked(scene))
    assert record.reason == ""
    assert rests(record) == [(0.0, 0, -1), (0.0, 0, 1)]


@pytest.mark.parametrize(
    ("restitution", "upper", "lower"),
    [(1.0, 1.0, 0.0), (0.8, 0.638, 0.0144), (0.5, 0.21875, 0.046875)],
)
def test_a_collision_on_a_resting_disk_is_the_limit_of_small_gaps(
    restitution: float, upper: float, lower: float
):
    # the two alternate with the floor until they part
    scene = lay_out(
        [[0, 0.25], [0, 1.5]],
        [[0, 0], [0, -1]],
        restitution=restitution,
        walls=FLOOR,
        gravity=[0, -1e-3],
    )
    record = computed(asked(scene, 1.0))
    collision = record.events[record.events[:, 3] > 0][0, 0]
    after = [
        record.legs[(record.legs[:, 0] == i) & (record.legs[:, 1] >= collision - 1e-9)][0]
        for i in range(2)
    ]
    speed = np.sqrt(1 + 2 * 1e-3 * 0.75)

    assert rests(record)[0] == (0.0, 0, -1)
    np.testing.assert_allclose(
        [leg[5] + leg[10] for leg in after], [lower * speed, upper * speed], rtol=0, atol=1e-15
    )
    # The same with a gap of 1e-9 m and nothing to accelerate the lower disk downwards: event by
    # event, no contact lasts.
    gapped = asked(replace(scene, position=[[0, 0.25 + 1e-9], [0, 1.5]], gravity=[0, 0]), 1.0)
    limit = states(gapped, computed(gapped))
    np.testing.assert_allclose(limit.velocity[-1, :, 1], [lower, upper], rtol=0, atol=1e-15)


@pytest.mark.slow
@given(seed=st.integers(0, 10**6), restitution=st.sampled_from([0.3, 0.5, 0.7]))
@settings(max_examples=8, deadline=None)
def test_energy_falls_nothing_overlaps_and_mirror_and_order_do_not_matter(
    seed: int, restitution: float
):
    scene = sampled(seed, 3, restitution, -9.81)
    one = asked(scene, 2.0)
    record = computed(one)
    truth = states(one, record)
    energy = (scene.mass * ((truth.velocity**2).sum(-1) / 2 + 9.81 * truth.position[..., 1])).sum(
        axis=1
    )

    assert (np.diff(energy) < 1e-11).all()
    assert smallest_gap(scene, truth.position).min() > -ACCURACY
    flip, order = np.array([-1.0, 1.0]), [2, 0, 1]
    for other, back, turn in (
        (changed(scene, flip=flip), [0, 1, 2], flip),
        (changed(scene, order), np.argsort(order), [1.0, 1.0]),
    ):
        found = states(asked(other, 2.0), computed(asked(other, 2.0)))
        k = min(len(found), len(truth))
        assert k >= len(truth) - 1
        np.testing.assert_allclose(
            found.position[:k, back] * turn, truth.position[:k], rtol=0, atol=1e-11
        )


def test_a_tail_that_something_can_reach_is_not_cut_short(monkeypatch: pytest.MonkeyPatch):
    # the planted bug: rule Z1 taken for granted
    scene = falling([[0, 0.5], [0.1, 1.2]], restitution=0.9)
    one = asked(scene, 1.0)
    right = states(one, computed(one))
    monkeypatch.setattr(oracle_resting, "untouched", lambda *_: True)
    wrong = states(one, computed(one))

    assert smallest_gap(scene, right.position).min() > -ACCURACY
    assert smallest_gap(scene, wrong.position).min() < -0.1


def test_a_resting_disk_slides_off_its_wall_or_on_to_the_next():
    # at 2 m/s off the edge: a parabola, as 4 > r g
    scene = falling(
        [[-1, 0.25]], [2, 0], walls=[[[-3, 0], [0, 0]], [[1, 0], [0, 0]], [[-9, -9], [9, -9]]]
    )
    one = asked(scene, 1.5)
    truth, t = states(one, computed(one)), one.times
    fallen = np.where(t > 1, 9.81 * (t - 1) ** 2 / 2, 0)

    np.testing.assert_allclose(
        truth.position[:, 0], np.stack([2 * t - 1, 0.25 - fallen], -1), rtol=0, atol=1e-14
    )
    slow = asked(replace(scene, velocity=[[1.5, 0]]), 1.5)
    turns = "disk 0 slides off the end of wall 1 so slowly that it turns about it at t = 1.33333333"
    assert turns in computed(slow).reason
    overlap = replace(scene, walls=[[[-3, 0], [0.5, 0]], [[1, 0], [-0.5, 0]]])
    assert turns in computed(asked(replace(overlap, velocity=[[1.5, 0]]), 1.5)).reason


def pieces(length: float, both: bool) -> list[list[list[float]]]:
    """A floor of walls that begin 1 m apart, every other one the other way round; `both`: each wall
    also the other way round."""
    walls = [[[x, 0], [x + length, 0]] for x in range(-4, 4)]
    turned = [wall[::-1] for wall in walls]
    return walls + turned if both else walls[::2] + turned[1::2]


@pytest.mark.parametrize(("length", "both"), [(1.0, False), (1.375, False), (1.0, True)])
def test_a_floor_of_pieces_is_a_floor(length: float, both: bool):
    for x, u in ((0.0, 0.0), (-1.25, 0.75)):
        scene = falling([[x, 1.25]], [u, 0])
        whole, apart = (
            asked(replace(scene, walls=walls), 2.0) for walls in (FLOOR, pieces(length, both))
        )
        expected, found = states(whole, computed(whole)), states(apart, computed(apart))

        assert len(found) == len(whole.times)
        np.testing.assert_allclose(found.position, expected.position, rtol=0, atol=1e-14)


@pytest.mark.parametrize("turned", [False, True])
def test_a_disk_that_passes_a_joint_in_its_bounces_rests_on_the_wall_beyond(turned: bool):
    second = [[4, 0], [0, 0]] if turned else [[0, 0], [4, 0]]
    scene = falling([[-1, 0.3125]], [4, 0], walls=[[[-4, 0], [4, 0]]])
    whole, apart = (
        asked(replace(scene, walls=walls), 2.0)
        for walls in (scene.walls, [[[-4, 0], [0, 0]], second])
    )
    expected, found = states(whole, computed(whole)), states(apart, computed(apart))

    assert len(found) == len(whole.times)
    np.testing.assert_allclose(found.position, expected.position, rtol=0, atol=1e-14)
    assert found.position[-1, 0, 1] < -1
    places = -1 + 4 * found.collisions.t
    assert (found.collisions.j == np.where(places < 0, -1, -2)).all()
    assert {*found.collisions.j.tolist()} == {-1, -2}


def test_a_truth_that_ends_at_a_joint_says_that_the_walls_are_not_in_line():
    # A joint one unit in the last place off the line: a slow disk turns about it. Below the line it
    # bounces off the next wall to its rest.
    joint = float(np.nextafter(0.7, np.inf))
    scene = falling(
        [[-1, 1]], [1, 0], walls=[[[-4, 0.7], [0.25, joint]], [[0.25, joint], [4, 0.7]]]
    )
    reason = computed(asked(scene, 2.0)).reason
    one = replace(scene, walls=[[[-4, 0.7], [4, 0.7]]])

    assert "slides off the end of wall 0" in reason
    assert reason.endswith("; walls 0 and 1 are in line but for rounding: write them as one wall")
    assert computed(asked(one, 2.0)).reason == ""
    low = float(np.nextafter(0.7, -np.inf))
    below = replace(scene, walls=[[[-4, 0.7], [0.25, low]], [[0.25, low], [4, 0.7]]])
    assert computed(asked(below, 2.0)).reason == ""


def test_what_lies_in_a_wedge_or_on_a_static_disk_stays():
    wedge = falling([[0, 0.625]], radius=0.5, walls=[[[-4, 3], [0, 0]], [[0, 0], [4, 3]]])
    balanced = lay_out(
        [[0, 0], [0, 0.75], [0, 1.5]],
        radius=[0.5, 0.25, 0.5],
        mass=[np.inf, 1, 1],
        gravity=[0, -9.81],
        restitution=0.5,
    )
    for scene in (wedge, balanced):
        record = computed(asked(scene, 2.0))
        assert (record.reason, len(rests(record))) == ("", 2)
        assert (states(asked(scene, 2.0), record).position == scene.position).all()
    aside = replace(balanced, position=[[0, 0], [0.03125, 0.75], [0, 3]])
    assert "disk 1 rolls over disk 0 at t = 0.0345703839 s" in computed(asked(aside, 0.1)).reason


def test_a_thrust_lifts_a_resting_disk_and_lets_it_fall():
    scene = falling([[0, 0.25]], mass=2)
    one = asked(scene, 5.0, thrusts=[Thrust(0, 1.0, 1.5, [0.0, 4 * 9.81])])
    record = computed(one)
    truth, t = states(one, record), one.times
    up = (t > 1) & (t < 1.5)

    np.testing.assert_allclose(
        truth.position[up, 0, 1], 0.25 + 9.81 * (t[up] - 1) ** 2 / 2, rtol=0, atol=1e-14
    )
    # It rises 9.81 / 8 m at 9.81 / 2 m/s, comes down at 9.81 / sqrt 2 m/s, and bounces for twice as
    # long as that takes.
    landing = 1.5 + 0.5 + np.sqrt(2 * (9.81 / 8 + 9.81 / 8) / 9.81)
    assert rests(record)[-1] == (pytest.approx(landing + 2 * np.sqrt(0.5), rel=1e-12), 0, -1)


def test_a_disk_in_the_corner_of_a_tilted_box_rests_on_both_walls():
    # Along one wall it bounces off the other to rest, as the two stand at right angles; at 106
    # degrees the bounces on both come so close that rounding decides their order first.
    square = falling([[0, 2.25]], radius=0.5, walls=[[[-4, 3], [0, 0]], [[0, 0], [3, 4]]])
    record = computed(asked(square, 8.0))
    assert record.reason == ""
    assert {j for _, _, j in rests(record)} == {-1, -2}
    at = states(asked(square, 8.0), record)
    np.testing.assert_allclose(at.position[-1, 0], [-0.1, 0.7], rtol=0, atol=1e-14)
    assert not at.velocity[-1].any()
    blunt = asked(
        replace(square, velocity=[[0.1, 0]], walls=[[[-4, 3], [0, 0]], [[0, 0], [4, 3]]]), 8.0
    )
    record = computed(blunt)
    assert record.reason.startswith("rounding decides the order of the collisions of disk 0")
    with mpfr(512).precise():
        path = trace(blunt.scene, [], 8.0, mpfr(512))
        x, y = path.legs[0][-1][1:3]
    assert (path.reason, float(x), float(y)) == ("", pytest.approx(0, abs=1e-15), 0.625)


def test_a_settling_box_is_answered_far_beyond_its_first_rest():
    record = computed(lasting(boxed(2, 0.5, 10.0), 2.0), mpfr)
    first = rests(record)[0][0]

    assert first == pytest.approx(0.670262, abs=1e-6)
    assert record.horizon > 2 * first
    assert len(rests(record)) == 26
    assert "disk 17 rolls over disk 9 at t = 1.57837" in record.reason


def test_round_the_end_of_a_wall_no_momentum_is_said_to_stay():
    # there the normal of the wall turns with the disk
    scene = falling([[0, 0.5]], [2, 0], 0.0, [[[-10, 0], [1, 0]]], radius=0.5)
    record = computed(asked(scene, 2.0))

    assert record.horizon == pytest.approx(0.5)
    assert [said for said in record.remains if "momentum" in said] == []
    assert any("energy" in said for said in record.remains)


def dropped(restitution: float, duration: float = 1.0, scale: float = 1.0) -> Scenario:
    scene = lay_out(
        [[0, scale]],
        radius=scale / 4,
        restitution=restitution,
        gravity=[0, -9.81 / scale],
        walls=[[[-3 * scale, 0], [3 * scale, 0]]],
    )
    return replace(asked(scene, duration * scale), sample_interval=duration * scale / 64)


@pytest.mark.parametrize("restitution", [0.99, 1 - 1e-12])
def test_no_bounce_after_the_end_of_the_scene_is_listed(restitution: float):
    record = computed(dropped(restitution))
    assert len(record.events) == 1
    assert record.horizon == np.inf


@pytest.mark.parametrize("miss", [1e-2, 1e-3, 3e-4, 1e-9])
def test_bounces_are_exact_where_the_restitution_is_close_to_one(miss: float):
    # from bounce to bounce in rational arithmetic but for one root
    one = dropped(1 - miss, 4.0)
    (height, g), e = (0.75, 9.81), 1 - miss
    fall = np.sqrt(2 * height / g)
    left, speed = Fraction(4.0) - Fraction(fall), Fraction(g) * Fraction(fall) * Fraction(e)
    while (lasts := 2 * speed / Fraction(g)) < left:
        left, speed = left - lasts, speed * Fraction(e)
    expected = 0.25 + float((speed - Fraction(g) * left / 2) * left)
    # One rounding of the root is late by 1e-16 s at 4 m/s; eight bounces add to it.
    assert states(one, computed(one)).position[-1, 0, 1] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("restitution", [0.999, 1.0])
def test_the_collisions_of_a_fast_disk_in_a_narrow_box_do_not_accumulate(restitution: float):
    # a collision each 1e-11 s: 64 of them within 1e-9 s
    scene = lay_out(
        [[0, 0]],
        [1e5, 3e4],
        radius=0.001,
        restitution=restitution,
        walls=box([-1.001e-3, -1.001e-3], [1.001e-3, 1.001e-3]),
    )
    record = computed(replace(asked(scene, 2e-9), sample_interval=1e-10))
    assert (record.horizon, record.reason) == (np.inf, "")
    assert len(record.events) > 80


def test_the_bounces_listed_do_not_depend_on_the_unit_of_time():
    slow, fast = (computed(dropped(0.5, 4.0, scale)).events for scale in (1.0, 2.0**-12))
    assert len(fast) >= len(slow) - 2


@given(
    st.lists(st.tuples(*[st.integers(-3, 3)] * 2), min_size=2, max_size=12, unique=True),
    st.sampled_from([1.0, 1e-9, 0.1, 1e9]),
)
def test_float64_excludes_no_point_that_lies_on_the_line_of_a_wall(
    points: list[tuple[int, int]], scale: float
):
    at = scale * np.array(points, dtype=float)

    assert points_in_line(at[:2], at) == [k for k in range(len(at)) if collinear(at[:2], at[k])]


def test_of_many_walls_few_points_are_compared_exactly(monkeypatch: pytest.MonkeyPatch):
    # in rationals all of some thousand walls would take minutes
    asked: list[object] = []
    real = contact_finder.collinear
    monkeypatch.setattr(
        contact_finder, "collinear", lambda *pair: bool(asked.append(pair)) or real(*pair)
    )
    corners = 10.0 * np.exp(2j * np.pi * np.arange(400) / 400)
    ends = np.stack([corners.real, corners.imag], axis=-1)

    assert {len(points_in_line(pair, ends)) for pair in zip(ends, np.roll(ends, -1, axis=0))} == {2}
    assert len(asked) <= 4 * len(ends)
