"""The neighbour list changes what is asked, never an answer: to the bit as all pairs, however wild
the scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st
from numba import njit

from crosscheck2d.reference_impl import exercise, neighbours
from crosscheck2d.reference_impl.compiled import forget_stale
from crosscheck2d.reference_impl.neighbour_list import (
    FEW,
    HALF_SKIN,
    LASTS,
    PAIRS,
    STRIDE,
    THICK,
    build_list,
    empty_list,
    holds,
)
from crosscheck2d.reference_impl.state import BY_INVERSE_MASS, EQUAL, ONE_SIDED, World, make_disks
from tests.adapters.event_driven.gases import boxed_gas

forget_stale(Path(__file__).parent, Path(neighbours.__file__).parent)

steady = settings(derandomize=True)
DT = 1 / 60


@st.composite
def scenes(draw):
    """From a thin gas to disks heaped upon each other; at rest or many boxes a step; with static
    disks, walls, wrap."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(
        st.integers(2, 90) | st.integers(neighbours.REBUILD, 3 * neighbours.REBUILD)
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
    return type(disks)(*(array.copy() for array in disks))


@njit(cache=True)
def by_list(disks, world, dt, count):
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]
    neighbours.advance_listed(disks, world, dt, count, collisions)
    return collisions


def listed(disks, world, left=LASTS, dt=DT):
    near = empty_list(disks.radius, len(world.walls))
    near.length[STRIDE] = neighbours.longest_stride(disks, dt)
    build_list(near, disks.position, disks.radius, world, left)
    return near


@njit(cache=True)
def collide_once(disks, world, near, k, count):
    collisions = [(0, 0, 0, 0.0) for _ in range(0)]
    neighbours.collide_near(disks, world, DT, near, k, 0, count, collisions)
    return collisions


def same(a, b):
    return all(one.tobytes() == other.tobytes() for one, other in zip(a, b))


@steady
@given(scene=scenes(), count=st.integers(1, 40))
def test_a_list_gives_the_bits_and_the_collisions_of_all_pairs(scene, count):
    disks, world = scene
    other = copy_of(disks)
    collisions = exercise.advance(disks, world, DT, count)
    event(f"list: {holds(listed(disks, world))}, collisions: {len(collisions) > 0}")
    assert by_list(other, world, DT, count) == collisions
    assert same(disks, other)


def heap(n=300, fill=3.0):
    rng = np.random.default_rng(3)
    radius = rng.uniform(0.3, 1.0, n)
    side = np.sqrt(np.pi * (radius**2).sum() / fill)
    return make_disks(rng.uniform(0, side, (n, 2)), rng.normal(size=(n, 2)), radius, np.ones(n))


def test_a_disk_moved_beyond_the_skin_in_mid_step_rebuilds_the_list_at_once():
    # In a heap the list is out of date before the first step ends; kept to its end, it would miss
    # pairs.
    world, first, renewed, stale = World(), heap(), heap(), heap()
    collisions = exercise.advance(first, world, DT, 1)
    for disks in renewed, stale:
        exercise.integrate(disks, world, DT)
    near = listed(renewed, world, 1)
    home = near.home.copy()
    assert holds(near)
    assert collide_once(renewed, world, near, 0, 1) == collisions
    assert not np.array_equal(near.home, home)
    assert same(first, renewed)

    kept = listed(stale, world, 1)
    kept.length[:] = np.inf
    collide_once(stale, world, kept, 0, 1)
    assert not same(first, stale)


def test_a_disk_moves_by_less_than_half_the_skin_as_long_as_the_list_holds():
    scene = boxed_gas(100, 0.3)  # read-only walls would have the solver compiled once more
    disks = make_disks(scene.position, scene.velocity, scene.radius, scene.mass)
    world, lasted = (
        World(restitution=1.0, walls=scene.walls.copy(), gravity=np.array([0.0, -10.0])),
        [],
    )
    kicks = neighbours.kicks_of(disks, world, DT / 4)
    for _ in range(20):
        near = listed(disks, world, LASTS, DT / 4)
        steps = 0
        while True:
            neighbours.fly(disks, kicks, DT / 4)
            neighbours.take_step(near, kicks.strongest)
            if not holds(near):
                break
            collide_once(disks, world, near, 0, 1)
            farthest = np.hypot(*(disks.position - near.home).T).max()
            assert farthest < near.length[HALF_SKIN]
            steps += 1
        lasted.append(steps)
    assert min(lasted) > 1


@pytest.mark.parametrize("n", [FEW, 500])
@pytest.mark.parametrize("packing", [0.1, 0.3, 0.6])
def test_the_near_pairs_are_all_pairs_within_the_skin_in_the_order_of_the_double_loop(packing, n):
    scene = boxed_gas(n, packing)
    position = scene.position - scene.position.mean(axis=0)
    disks = make_disks(position, scene.velocity, scene.radius, scene.mass)
    near = listed(disks, World(walls=scene.walls.copy()))
    skin, pairs = near.length[HALF_SKIN] / 0.49, slice(near.found[PAIRS])
    apart = np.hypot(*(position[:, None] - position).transpose(2, 0, 1)) - 1.0
    wanted = np.argwhere(np.triu(apart < skin, 1))
    assert holds(near)
    assert 0.1 < skin <= THICK * 0.5
    assert np.stack([near.first, near.second], 1)[pairs].tolist() == wanted.tolist()
    assert (near.reach[pairs] == 1.0).all()


def test_a_list_is_made_for_the_steps_that_are_left_but_not_for_more_than_it_pays():
    # Its skin is as thick as the fastest disk needs; thicker, a call of few steps would ask many
    # pairs in vain.
    scene, dt = boxed_gas(500, 0.3), DT / 8
    disks, world = make_disks(scene.position, scene.velocity, scene.radius, scene.mass), World()
    half_skin = {
        left: listed(disks, world, left, dt).length[HALF_SKIN]
        for left in (LASTS // 4, LASTS // 2, LASTS, 2 * LASTS)
    }
    assert half_skin[LASTS // 2] == pytest.approx(2 * half_skin[LASTS // 4], rel=1e-9)
    assert half_skin[LASTS // 2] > 0.0
    assert half_skin[LASTS] == half_skin[2 * LASTS] == 2 * half_skin[LASTS // 2]


@pytest.mark.parametrize("far", [1e12, 1e300, np.inf, np.nan])
def test_a_disk_lost_in_space_leaves_no_list_but_the_same_bits(far):
    world, disks = World(walls=np.array([[[-1.0, -1.0], [30.0, -1.0]]])), heap(80, 0.7)
    disks.position[7] = [far, 0.0]
    other = copy_of(disks)
    collisions = exercise.advance(disks, world, DT, 5)
    assert not holds(listed(other, world))
    assert collisions
    assert by_list(other, world, DT, 5) == collisions
    assert same(disks, other)


def test_disks_all_in_one_place_are_not_listed():
    disks = make_disks(np.zeros((300, 2)), np.zeros((300, 2)), np.ones(300), np.ones(300))
    assert not holds(listed(disks, World(), 1))


@pytest.mark.parametrize("n", [3, 21, FEW, FEW + 1, 300, 1000])
def test_a_gas_plays_as_by_all_pairs_on_both_sides_of_where_the_cells_begin(n):
    scene = boxed_gas(n, 0.3)
    first, other = (
        make_disks(scene.position, 5 * scene.velocity, scene.radius, scene.mass) for _ in range(2)
    )
    world = World(restitution=1.0, walls=scene.walls.copy())
    for count in (1, 7, 30):
        assert neighbours.advance(other, world, DT, count) == exercise.advance(
            first, world, DT, count
        )
        assert same(first, other)


@pytest.mark.long  # both kernels are compiled once more, for 20 s
@pytest.mark.parametrize("n", [3, 21, FEW, FEW + 1, 300, 1000])
def test_a_gas_kept_in_float32_plays_as_by_all_pairs(n):
    scene = boxed_gas(n, 0.3)
    disks = make_disks(scene.position, 5 * scene.velocity, scene.radius, scene.mass)
    first, other = (type(disks)(*(a.astype(np.float32) for a in disks)) for _ in range(2))
    world = World(restitution=1.0, walls=scene.walls.copy())
    assert neighbours.advance(other, world, DT, 60) == exercise.advance(first, world, DT, 60)
    assert same(first, other)
