"""The hand-written solver alone, as a student would try it: arrays in, arrays out, no harness."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from crosscheck2d.reference_impl import exercise, lesson
from crosscheck2d.reference_impl.state import BY_INVERSE_MASS, EQUAL, ONE_SIDED, World, make_disks

ROUNDING = 2.0**-53  # what one operation in float64 may be off, relative
VARIANTS = [exercise, lesson]
both = pytest.mark.parametrize("solver", VARIANTS, ids=["exercise", "lesson"])

# The first example may compile, which takes longer than a deadline; the same examples every time.
steady = settings(deadline=None, derandomize=True)
speeds = st.floats(-10, 10)
masses = st.floats(1e-3, 1e3)


@st.composite
def overlapping_pairs(draw):
    """Two disks of random masses that overlap by a tenth, from any side, at any velocities, and any
    e."""
    angle = draw(st.floats(0, 2 * np.pi))
    away = 0.9 * np.array([np.cos(angle), np.sin(angle)])
    velocity = [[draw(speeds), draw(speeds)] for _ in range(2)]
    disks = make_disks(
        [-0.3 * away, 0.7 * away], velocity, [0.6, 0.4], [draw(masses), draw(masses)]
    )
    return disks, World(restitution=draw(st.floats(0, 1)))


def before_and_after(solver, disks, world, pair=(0, 1)):
    """Velocities before and after one collision, the unit normal from the first disk to the second,
    and the impulse."""
    apart = disks.position[1] - disks.position[0]
    before = disks.velocity.copy()
    impulse = solver.collide(disks, *pair, world)
    return before, disks.velocity.copy(), apart / np.hypot(*apart), impulse


def tolerance(disks, velocity):
    """m/s: a collision rounds about 16 times, and what is little to the heavy disk is more to the
    light one by the ratio."""
    ratio = disks.mass.max() / disks.mass.min()
    return 16 * ROUNDING * (np.abs(velocity).max() + 1e-300) * ratio


@both
@pytest.mark.parametrize(
    ("mass", "e", "before", "after"),
    [
        ((1, 1), 1.0, (1, -1), (-1, 1)),  # equal masses swap velocities
        ((1, 1), 0.0, (1, 0), (0.5, 0.5)),  # and stay together where nothing bounces
        ((1, 1), 0.5, (1, 0), (0.25, 0.75)),
        ((1, 3), 1.0, (1, 0), (-0.5, 0.5)),
        ((3, 1), 1.0, (1, 0), (0.5, 1.5)),
        ((1, 3), 0.0, (4, 0), (1, 1)),
        ((1, np.inf), 0.5, (2, 0), (-1, 0)),  # a static disk acts as a wall
        ((np.inf, 1), 0.5, (0, -2), (0, 1)),
    ],
)
def test_head_on_collisions_of_the_textbook(solver, mass, e, before, after):
    disks = make_disks([[-0.5, 0], [0.4, 0]], [[before[0], 0], [before[1], 0]], [0.5, 0.5], mass)
    solver.collide(disks, 0, 1, World(restitution=e))
    # 1/3 is not short: a few roundings remain where the masses are 1 and 3.
    assert disks.velocity[:, 0] == pytest.approx(after, abs=4 * ROUNDING)
    assert (disks.velocity[:, 1] == 0).all()


@pytest.mark.parametrize(
    ("solver", "way"), [(exercise, 1.0), (lesson, 0.0)], ids=["exercise", "lesson"]
)
def test_one_step_from_rest_tells_the_order_of_the_updates(solver, way):
    # Symplectic Euler moves by a dt2 in its first step, explicit Euler not at all; gravity, force
    # and torque alike.
    disks = make_disks([[0, 0], [9, 9]], np.zeros((2, 2)), [1, 1], [2, 2], inertia=[4, 4])
    disks.force[0], disks.torque[0] = [4.0, 8.0], 2.0
    solver.advance(disks, World(gravity=np.array([0.0, -1.0])), 0.5, 1)
    assert disks.velocity.tolist() == [[1.0, 1.5], [0.0, -0.5]]
    assert disks.angular_velocity.tolist() == [0.25, 0.0]
    assert disks.position.tolist() == [[way * 0.5, way * 0.75], [9.0, 9.0 - way * 0.25]]
    assert disks.angle.tolist() == [way * 0.125, 0.0]


@both
@steady
@given(pair=overlapping_pairs())
def test_a_collision_keeps_the_momentum(solver, pair):
    disks, world = pair
    before, after, _, _ = before_and_after(solver, disks, world)
    change = disks.mass @ (after - before)
    assert np.abs(change).max() <= disks.mass.min() * tolerance(disks, before)


@both
@steady
@given(pair=overlapping_pairs())
def test_a_collision_reverses_the_normal_speed_by_e_and_leaves_the_tangential(solver, pair):
    disks, world = pair
    before, after, n, impulse = before_and_after(solver, disks, world)
    closing, separating = ((v[0] - v[1]) @ n for v in (before, after))
    tangent = np.array([-n[1], n[0]])
    bound = tolerance(disks, before)
    if closing > 4 * ROUNDING * np.abs(before).max():  # whose sign rounding cannot turn
        assert abs(separating + world.restitution * closing) <= bound
        assert impulse > 0
    elif closing < -4 * ROUNDING * np.abs(before).max():
        assert (after == before).all()
        assert impulse == 0
    assert np.abs((after - before) @ tangent).max() <= bound


@both
@steady
@given(pair=overlapping_pairs())
def test_the_order_of_the_two_disks_does_not_matter(solver, pair):
    disks, world = pair
    swapped = make_disks(
        disks.position[::-1], disks.velocity[::-1], disks.radius[::-1], disks.mass[::-1]
    )
    bound = tolerance(disks, disks.velocity)
    solver.collide(disks, 0, 1, world)
    solver.collide(swapped, 0, 1, world)
    # The share of the second is 1 minus that of the first, so it rounds as 1 does.
    assert np.abs(disks.position - swapped.position[::-1]).max() <= 8 * ROUNDING
    assert np.abs(disks.velocity - swapped.velocity[::-1]).max() <= bound


@both
@steady
@given(pair=overlapping_pairs())
def test_projection_leaves_the_pair_touching_and_the_centre_of_mass_in_place(solver, pair):
    disks, world = pair
    centre = disks.mass @ disks.position / disks.mass.sum()
    solver.collide(disks, 0, 1, world)
    assert abs(np.hypot(*(disks.position[1] - disks.position[0])) - 1.0) <= 8 * ROUNDING
    assert np.abs(disks.mass @ disks.position / disks.mass.sum() - centre).max() <= 8 * ROUNDING


@pytest.mark.parametrize(
    ("split", "mass", "moved"),
    [
        (BY_INVERSE_MASS, (1, 3), (-0.375, 0.125)),
        (EQUAL, (1, 3), (-0.25, 0.25)),
        (ONE_SIDED, (1, 3), (-0.5, 0.0)),
        (EQUAL, (1, np.inf), (-0.5, 0.0)),  # a static disk never moves
        (ONE_SIDED, (np.inf, 1), (0.0, 0.5)),
    ],
)
def test_the_split_of_the_overlap_is_free_but_for_static_disks(split, mass, moved):
    disks = make_disks([[0, 0], [1.5, 0]], np.zeros((2, 2)), [1, 1], mass)
    exercise.collide(disks, 0, 1, World(split=split))
    assert (disks.position[:, 0] - [0, 1.5]).tolist() == list(moved)


def test_the_formula_as_printed_draws_a_separating_pair_together():
    for approaching_only, after in ((True, [-1.0, 1.0]), (False, [0.9, -0.9])):
        disks = make_disks([[0, 0], [0.9, 0]], [[-1, 0], [1, 0]], [0.5, 0.5], [1, 1])
        impulse = exercise.collide(
            disks, 0, 1, World(restitution=0.9, approaching_only=approaching_only)
        )
        assert disks.velocity[:, 0] == pytest.approx(after, abs=4 * ROUNDING)  # 1.9 is rounded
        assert impulse == (0.0 if approaching_only else pytest.approx(-1.9, rel=4 * ROUNDING))
        # separated in either case
        assert disks.position[:, 0] == pytest.approx([-0.05, 0.95], abs=4 * ROUNDING)


@steady
@given(pair=overlapping_pairs())
def test_the_equations_of_the_lesson_equal_the_impulse_of_the_exercise(pair):
    # V1 = (m1 v1 + m2 v2 - m2 (v1 - v2) e)/(m1 + m2) as printed, ours divided by m1 m2, and J/m:
    # one law.
    disks, world = pair
    m1, m2 = disks.mass
    bound = tolerance(disks, disks.velocity)
    printed = make_disks(disks.position, disks.velocity, disks.radius, disks.mass)
    before, after, n, _ = before_and_after(exercise, disks, world)
    v1, v2 = before @ n
    assume(v1 > v2)
    e = world.restitution
    V1 = (m1 * v1 + m2 * v2 - m2 * (v1 - v2) * e) / (m1 + m2)
    V2 = (m1 * v1 + m2 * v2 - m1 * (v2 - v1) * e) / (m1 + m2)
    assert np.abs(after @ n - [V1, V2]).max() <= bound
    lesson.collide(printed, 0, 1, world)
    assert np.abs(printed.velocity - after).max() <= bound


@both
@steady
@given(pair=overlapping_pairs(), static=st.integers(0, 1))
def test_a_static_disk_never_moves(solver, pair, static):
    disks, world = pair
    disks.mass[static], disks.velocity[static] = np.inf, 0.0
    disks.force[...], disks.torque[...] = 3.0, 2.0
    place = disks.position[static].copy()
    solver.advance(disks, world._replace(gravity=np.array([0.0, -9.8])), 0.01, 20)
    assert (disks.position[static] == place).all()
    assert (disks.velocity[static] == 0).all()
    assert disks.angle[static] == disks.angular_velocity[static] == 0
    disks.mass[...], disks.velocity[...] = np.inf, 0.0
    both_places = disks.position.copy()
    assert solver.collide(disks, 0, 1, world) == 0.0
    assert (disks.position == both_places).all()


@both
@steady
@given(e=st.floats(0, 1), vx=speeds, vy=st.floats(0.01, 10))
def test_a_wall_reflects_as_a_static_disk_does(solver, e, vx, vy):
    wall = World(restitution=e, walls=np.array([[[-1.0, 0.0], [1.0, 0.0]]]))
    by_wall = make_disks([[0, 0.9]], [[vx, -vy]], [1], [2])
    log = solver.advance(by_wall, wall, 0.0, 1)
    by_disk = make_disks([[0, 0.9], [0, -1]], [[vx, -vy], [0, 0]], [1, 1], [2, np.inf])
    impulse = solver.collide(by_disk, 0, 1, World(restitution=e))
    # of at most 10 m/s
    assert by_wall.velocity[0] == pytest.approx(by_disk.velocity[0], abs=8 * ROUNDING * 10)
    assert by_wall.velocity[0] == pytest.approx([vx, e * vy], abs=8 * ROUNDING * 10)
    assert log == [(0, 0, -1, pytest.approx(impulse, rel=8 * ROUNDING))]


def test_only_the_exercise_sets_a_disk_back_onto_the_wall():
    world = World(walls=np.array([[[-1.0, 0.0], [1.0, 0.0]]]))
    for solver, height in ((exercise, 1.0), (lesson, 0.875)):
        disks = make_disks([[0, 1]], [[0, -0.125]], [1], [1])
        solver.advance(disks, world, 1.0, 1)
        assert disks.position.tolist() == [[0.0, height]]


@both
def test_a_wall_ends_where_it_ends(solver):
    world = World(restitution=1.0, walls=np.array([[[0.0, 0.0], [-1.0, 0.0]]]))
    past = make_disks([[1.5, 0.5]], [[0, -1]], [1], [1])
    assert solver.advance(past, world, 0.25, 4) == []
    corner = make_disks([[0.75, 0.75]], [[-1, -1]], [1], [1])
    assert [collision[:3] for collision in solver.advance(corner, world, 0.0625, 1)] == [(0, 0, -1)]
    assert corner.velocity[0] == pytest.approx([1, 1], abs=4 * ROUNDING)


@both
def test_a_centre_beyond_an_edge_comes_in_opposite(solver):
    # The exercise sets it onto the edge, the lesson a box away; velocity and the other coordinate
    # stay; a centre on the edge stays.
    box = World(low=np.array([-5.0, -3.0]), high=np.array([5.0, 3.0]))
    disks = make_disks(
        [[4.75, 1], [1, -2.75], [-4.75, 2.75], [4.5, -1]],
        [[1, 0], [0, -1], [-1, 1], [0.5, 0]],
        [0.25] * 4,
        [1] * 4,
    )
    velocity = disks.velocity.copy()
    solver.advance(disks, box, 1.0, 1)
    beyond = 0 if solver is exercise else 0.75
    assert disks.position.tolist() == [
        [-5 + beyond, 1],
        [1, 3 - beyond],
        [5 - beyond, -3 + beyond],
        [5, -1],
    ]
    assert (disks.velocity == velocity).all()


@both
def test_coincident_centres_give_no_nan(solver):
    disks = make_disks([[1, 1], [1, 1]], [[1, 0], [-1, 0]], [0.5, 0.5], [1, 1])
    world = World(walls=np.array([[[1.0, 1.0], [2.0, 1.0]]]))
    solver.advance(disks, world._replace(walls=np.zeros((0, 2, 2))), 0.0, 1)
    assert np.isfinite(np.concatenate([disks.position, disks.velocity])).all()
    assert np.ptp(disks.position[:, 0]) == (1.0 if solver is exercise else 0.0)
    on_wall = make_disks([[1.5, 1]], [[0, 0]], [0.5], [1])
    solver.advance(on_wall, world, 0.0, 1)
    assert np.isfinite(on_wall.position).all()


@both
def test_a_collision_leaves_the_spin_alone(solver):
    disks = make_disks(
        [[0, 0.1], [0.9, 0]], [[1, 0], [-1, 0]], [0.5, 0.5], [1, 3], angular_velocity=[4.0, -7.0]
    )
    assert solver.advance(disks, World(), 0.01, 5)
    assert disks.angular_velocity.tolist() == [4.0, -7.0]
