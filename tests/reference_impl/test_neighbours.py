"""The neighbour list changes what is asked, never an answer: to the bit as all pairs, however wild
the scene."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st
from numba import njit

from reference_impl import exercise, verlet_list
from reference_impl.neighbours import LASTS, build_list
from reference_impl.state import BY_INVERSE_MASS, EQUAL, ONE_SIDED, World, make_disks
from tests.adapters.event_driven.gases import boxed_gas

steady = settings(derandomize=True)
DT = 1 / 60


@st.composite
def scenes(draw):
    """From a thin gas to disks heaped upon each other; at rest or many boxes a step; with static
    disks, walls, wrap."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(
        st.integers(2, 90) | st.integers(verlet_list.REBUILD, 3 * verlet_list.REBUILD)
    )  # from there on it may rebuild again in a step
    # area of all disks over that of the box
    fill = draw(st.sampled_from([0.05, 0.3, 0.8, 2.0, 8.0, 100.0]))
    radius = rng.uniform(draw(st.sampled_from([0.05, 0.9])), 1.0, n)
    side = np.sqrt(np.pi * (radius**2).sum() / fill)
    speed = draw(st.sampled_from([0.0, 0.1, 3.0, 100.0, 1e5]))
    mass = np.where(
        rng.random(n) < draw(st.sampled_from([0.0, 0.2])), np.inf, rng.uniform(0.5, 2.0, n)
    )
    # of static disks, too, which nevertheless do not move
    velocity = speed * rng.normal(size=(n, 2))
    spin = rng.normal(size=n) * rng.choice([-0.0, 1.0], n)
    disks = make_disks(rng.uniform(0, side, (n, 2)), velocity, radius, mass, angular_velocity=spin)
    forced = rng.random(n) < draw(st.sampled_from([0.0, 0.1, 1.0]))
    disks.force[forced], disks.torque[forced] = [3.0, -2.0], 0.7
    corners = np.array([[0, 0], [side, 0], [side, side], [0, side]])
    walls = np.stack([corners, np.roll(corners, -1, 0)], 1)[: draw(st.sampled_from([0, 2, 4]))]
    box = draw(st.sampled_from([np.inf, side]))
    world = World(
        restitution=draw(st.sampled_from([0.0, 0.9, 1.0])),
        gravity=np.array([-0.0, draw(st.sampled_from([0.0, -0.0, -10.0]))]),
        walls=walls,
        low=np.full(2, 0.0 if box < np.inf else -np.inf),
        high=np.full(2, box),
        split=draw(st.sampled_from([BY_INVERSE_MASS, EQUAL, ONE_SIDED])),
        approaching_only=draw(st.booleans()),
    )
    return disks, world


def copy_of(disks):
    """The same disks in arrays of their own."""
    return type(disks)(*(array.copy() for array in disks))


@njit
def by_list(disks, world, dt, count):
    """As `verlet_list.advance`, however few the disks are; the collisions, and in how many steps
    all pairs had to be asked."""
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]
    return collisions, verlet_list.advance_listed(disks, world, dt, count, collisions)


@njit
def until_beyond_skin(disks, world, near):
    """In which step of one the list of near pairs ends to hold: 0, or 1 if it lasts."""
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]
    return verlet_list.play(
        disks,
        world,
        DT,
        1,
        collisions,
        verlet_list.accelerations_of(disks, world, DT),
        near,
        0,
        0,
        0,
    )[0]


def same(a, b):
    """Whether two sets of disks agree in every bit."""
    return all(one.tobytes() == other.tobytes() for one, other in zip(a, b))


@steady
@given(scene=scenes(), count=st.integers(1, 40))
def test_a_list_gives_the_bits_and_the_collisions_of_all_pairs(scene, count):
    """Positions, velocities, angles, and every collision in its order with its impulse."""
    disks, world = scene
    other = copy_of(disks)
    collisions = exercise.advance(disks, world, DT, count)
    reported, unlisted = by_list(other, world, DT, count)
    event(
        f"by list: {np.sign(count - unlisted)}, by all pairs: {np.sign(unlisted)}, collisions:"
        f" {len(collisions) > 0}"
    )
    assert same(disks, other)
    assert reported == collisions


def heap(n=300, fill=3.0):
    """Disks heaped upon each other at random, which projections throw about."""
    rng = np.random.default_rng(3)
    radius = rng.uniform(0.3, 1.0, n)
    side = np.sqrt(np.pi * (radius**2).sum() / fill)
    return make_disks(rng.uniform(0, side, (n, 2)), rng.normal(size=(n, 2)), radius, np.ones(n))


def test_a_disk_moved_beyond_the_skin_in_mid_step_rebuilds_the_list_at_once():
    """In a heap the list is out of date before the first step ends; kept to its end, it would miss
    pairs."""
    world, first, other, stale = World(), heap(), heap(), heap()
    collisions = exercise.advance(first, world, DT, 1)
    exercise.integrate(other, world, DT)
    near = build_list(other, world, DT, 1)
    assert near.listed
    assert until_beyond_skin(other, world, near) == 0

    reported, _ = by_list(renewed := heap(), world, DT, 1)
    assert same(first, renewed)
    assert reported == collisions

    exercise.integrate(stale, world, DT)
    kept = build_list(stale, world, DT, 1)._replace(half_skin=np.inf)
    assert until_beyond_skin(stale, world, kept) == 1
    assert not same(first, stale)


@pytest.mark.parametrize("packing", [0.1, 0.3, 0.6])
def test_the_near_pairs_are_all_pairs_within_the_skin_in_the_order_of_the_double_loop(packing):
    """Counted the slow way, in a gas around the origin, where cells have negative numbers."""
    scene = boxed_gas(500, packing)
    position = scene.position - scene.position.mean(axis=0)
    disks = make_disks(position, scene.velocity, scene.radius, scene.mass)
    near = build_list(disks, World(walls=scene.walls), DT, LASTS)
    skin = near.half_skin / 0.49
    apart = np.hypot(*(position[:, None] - position).transpose(2, 0, 1)) - 1.0
    wanted = np.argwhere(np.triu(apart < skin, 1))
    assert near.listed
    assert 0.1 < skin <= 1.0
    assert np.stack([near.first, near.second], 1).tolist() == wanted.tolist()
    assert (near.reach2 == 1.0).all()


def test_a_list_is_made_for_the_steps_that_are_left_but_not_for_more_than_it_pays():
    """Its skin is as thick as the fastest disk needs; thicker, a call of few steps would ask many
    pairs in vain."""
    scene, dt = boxed_gas(500, 0.3), DT / 4
    disks, world = make_disks(scene.position, scene.velocity, scene.radius, scene.mass), World()
    half_skin = {
        left: build_list(disks, world, dt, left).half_skin for left in (2, 4, 8, LASTS, 2 * LASTS)
    }
    assert half_skin[8] == 2 * half_skin[4] == 4 * half_skin[2] > 0.0
    assert half_skin[LASTS] == half_skin[2 * LASTS] == 2 * half_skin[8]


@pytest.mark.parametrize("far", [1e12, 1e300, np.inf, np.nan])
def test_a_disk_lost_in_space_leaves_no_list_but_the_same_bits(far):
    """Nobody can say in which cell it is."""
    world, disks = World(walls=np.array([[[-1.0, -1.0], [30.0, -1.0]]])), heap(80, 0.7)
    disks.position[7] = [far, 0.0]
    other = copy_of(disks)
    collisions = exercise.advance(disks, world, DT, 5)
    reported, unlisted = by_list(other, world, DT, 5)
    assert unlisted == 5
    assert collisions
    assert same(disks, other)
    assert reported == collisions


def test_disks_all_in_one_place_are_not_listed():
    """Every pair is near: a list would be as long as the double loop, and hold memory besides."""
    disks = make_disks(np.zeros((300, 2)), np.zeros((300, 2)), np.ones(300), np.ones(300))
    assert not build_list(disks, World(), DT, 1).listed


@pytest.mark.parametrize("n", [verlet_list.LISTED_FROM - 1, verlet_list.LISTED_FROM, 1000])
def test_a_gas_plays_as_by_all_pairs_on_both_sides_of_where_the_list_begins(n):
    """As the harness plays it: in several calls."""
    scene = boxed_gas(n, 0.3)
    first, other = (
        make_disks(scene.position, 5 * scene.velocity, scene.radius, scene.mass) for _ in range(2)
    )
    world = World(restitution=1.0, walls=scene.walls)
    for count in (1, 7, 30):
        assert verlet_list.advance(other, world, DT, count) == exercise.advance(
            first, world, DT, count
        )
        assert same(first, other)
