"""`reference:ordered` against exact answers: right to rounding where collisions can be
distinguished, bounded elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.reference_impl import neighbours, ordered
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.truth.exact import computed
from tests.adapters.event_driven.gases import boxed_asteroids

ROUNDING = 2.0**-53


def played(scene, dt, steps, variant=ordered):
    engine = Reference(variant)
    engine.load(scene, dt)
    engine.step(steps)
    return engine


def exact(scene, t):
    """Positions (n, 2) m at t s by the oracle, in many digits."""
    record = computed(Scenario("probe", "Where?", "here", scene, t, t))
    assert record.horizon >= t
    return (
        replace(record, float64_horizon=np.inf).sampled(scene, (), np.array([0.0, t])).position[-1]
    )


def off(scene, t, rate, variant=ordered):
    """m: the largest distance of a coordinate from the exact answer after t s at so many steps a
    second."""
    return np.abs(
        played(scene, 1 / rate, round(t * rate), variant).read().position - exact(scene, t)
    ).max()


CASES = [(1.0, 0.0, 10.0, 60), (0.9, -1.0, 4.0, 120)]


@pytest.mark.parametrize(("e", "gravity", "t", "rate"), CASES)
@pytest.mark.parametrize(
    "seeds", [range(3), pytest.param(range(20), marks=pytest.mark.slow)], ids=["3", "20"]
)
def test_the_asteroids_in_a_box_are_followed_to_rounding(e, gravity, t, rate, seeds):
    # No 2^-53 of a metre stays one: it grows e-fold in about a second, so 1e-6 is what is left of
    # 16 digits at 10 s. By projection (`exercise`) the same scenes are off by a disk.
    scenes = [boxed_asteroids(seed, e, gravity) for seed in seeds]
    errors = [off(scene, t, rate) for scene in scenes]
    print(
        f"e = {e}, g = {gravity}, {rate} Hz: median {np.median(errors):.2g} m, largest"
        f" {max(errors):.2g} m"
    )
    assert max(errors) < 1e-6
    assert gravity or len(errors) < 20 or np.median(errors) < 1e-9
    assert off(scenes[0], t, rate, neighbours) > 1e-2


def dense_box():
    return Scene(
        position=[[0.6, 0.6], [2.0, 0.9], [3.3, 0.7], [0.7, 2.2], [2.1, 2.3], [3.4, 2.2]],
        velocity=[[3.0, 1.0], [-2.0, 2.0], [1.0, -3.0], [2.5, 0.4], [0.0, 0.0], [-1.0, -2.0]],
        radius=[0.5, 0.4, 0.45, 0.5, 0.3, 0.4],
        mass=[1.0, 2.0, 1.5, 1.0, np.inf, 3.0],
        restitution=0.9,
        walls=box([0, 0], [4, 3]),
    )


@pytest.mark.parametrize("gravity", [0.0, -2.0])
def test_all_the_collisions_of_one_long_step_come_in_their_order(gravity):
    scene = replace(dense_box(), gravity=np.array([0.0, gravity]))
    events = EventEngine(scene)
    events.advance(0.6)
    engine = played(scene, 0.6, 1)
    reported = np.array([(i, j, J) for _, i, j, J in engine.collisions()])
    assert len(reported) >= 8
    assert [sorted(pair) for pair in reported[:, :2].tolist()] == [
        sorted(pair) for pair in events.collisions[:, 1:3].tolist()
    ]
    # Every collision multiplies what rounding did before it by about a free path over a radius.
    assert reported[:, 2] == pytest.approx(events.collisions[:, 3], rel=1e-11)
    assert np.abs(engine.read().position - events.motion_at(0.6)[0]).max() < 1e-11


@pytest.mark.parametrize("gravity", [0.0, -9.8])
def test_a_disk_that_passes_through_another_a_wall_or_its_end_within_a_step_has_struck_it(gravity):
    scene = Scene(
        position=[[0.0, 0.0], [1.0, 0.1], [0.0, 5.0], [0.0, 9.0]],
        velocity=[[40.0, 0.0], [0.0, 0.0], [40.0, 0.0], [40.0, 0.0]],
        radius=[0.2, 0.1, 0.1, 0.1],
        mass=[1.0, np.inf, 1.0, 1.0],
        restitution=1.0,
        gravity=[0.0, gravity],
        walls=[[[1.0, 4.0], [1.0, 6.0]], [[1.0, 9.05], [3.0, 9.5]]],
    )
    events = EventEngine(scene)
    events.advance(0.1)
    engine = played(scene, 0.1, 1)
    assert sorted(collision[1:3] for collision in engine.collisions()) == [(0, 1), (2, -1), (3, -2)]
    # A place rounds at 10 m; over a radius of 0.1 m that turns the normal, and with it 4 m of
    # flight: 400 times it.
    assert np.abs(engine.read().position - events.motion_at(0.1)[0]).max() < 400 * 10 * ROUNDING


def test_a_centre_that_leaves_the_box_enters_it_opposite_at_that_instant():
    scene = replace(
        boxed_asteroids(1), walls=np.zeros((0, 2, 2)), wrap=np.array([[-5.0, -3.0], [5.0, 3.0]])
    )
    events = EventEngine(scene)
    events.advance(2.0)
    # Rounding of 120 steps at 5 m, grown e-fold in about a second.
    assert (
        np.abs(played(scene, 1 / 60, 120).read().position - events.motion_at(2.0)[0]).max() < 1e-12
    )


def test_the_neighbour_list_leaves_every_bit_as_it_is():
    # No list holds with a disk that is so far out that its place rounds by more than a skin: with
    # it all pairs are asked, though none meets it.
    scene = boxed_asteroids(2, 0.9)
    by_list, by_all = Reference(ordered), Reference(ordered)
    by_list.load(scene, 1 / 60)
    by_all.load(
        replace(
            scene,
            position=np.vstack([scene.position, [[1.0, 1e300]]]),
            velocity=np.vstack([scene.velocity, [[0.0, 0.0]]]),
            radius=np.append(scene.radius, 0.1),
            mass=np.append(scene.mass, 1.0),
            inertia=np.append(scene.inertia, 1.0),
            angle=np.append(scene.angle, 0.0),
            angular_velocity=np.append(scene.angular_velocity, 0.0),
        ),
        1 / 60,
    )
    for count in (1, 200):
        by_list.step(count)
        by_all.step(count)
    assert len(by_list.collisions()) > 10
    assert by_list.collisions() == by_all.collisions()
    for one, other in zip(by_list.disks, by_all.disks):
        assert one.tobytes() == other[:21].tobytes()


def falling(height=1.0, e=0.5, gravity=-10.0):
    return lay_out(
        [[0.0, 0.25 + height]],
        mass=2.0,
        restitution=e,
        gravity=[0.0, gravity],
        walls=[[[-3.0, 0.0], [3.0, 0.0]]],
    )


def test_a_ball_that_bounces_ever_lower_comes_to_rest_when_it_should_and_carries_its_weight():
    # t = sqrt(2 h / g) (1 + e) / (1 - e) after infinitely many bounces; here after a few.
    dt, rest = 1 / 60, np.sqrt(0.2) * 3
    engine = played(falling(), dt, int(rest / dt) + 2)
    bounces = len(engine.collisions())
    engine.step(100)
    state = engine.read()
    assert 5 < bounces < 30
    # The last bounce is 1/16 of a step long at most, so it is g (dt / 32)2 / 2 high, and is cut
    # off.
    assert abs(state.position[0, 1] - 0.25) < 10 * (dt / 32) ** 2 / 2
    assert abs(state.velocity[0, 1]) < 10 * dt / 32
    weights = [collision.impulse for collision in engine.collisions()[bounces:]]
    assert sum(weights) == pytest.approx(100 * 2.0 * 10.0 * dt, rel=1e-9)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))]
)
def test_a_heap_takes_few_collisions_a_step_and_neither_overlaps_nor_gains_energy(
    seed,
):
    # Thirty disks that fall onto each other. Beside the collisions, each contact that lasts has an
    # entry a step: fewer than three pairs a disk touch in a plane, and a disk touches one wall or
    # so. Each step leaves 2^-20 of g dt2 / 2 and of the radii at most (`COARSE`), 300 steps 300
    # times it.
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(6), np.arange(5)), -1).reshape(-1, 2)
    scene = lay_out(
        0.6 + grid * 1.05 + rng.uniform(0, 0.02, (30, 2)),
        rng.normal(size=(30, 2)),
        radius=0.5,
        restitution=0.5,
        gravity=[0.0, -10.0],
        walls=box([0.0, 0.0], [6.6, 20.0]),
    )
    engine, deepest, gain = steps_of(scene, 1 / 60, 300)
    a_step = np.bincount([collision.step for collision in engine.collisions()])
    assert a_step.max() <= (ordered.MOST + 4) * 30
    assert deepest < 300 * 2 * ordered.COARSE
    assert gain < 300 * ordered.COARSE


def steps_of(scene, dt, steps, variant=ordered):
    """The engine; the deepest overlap of two disks, or a disk and a level or upright wall, in
    radii; and the largest gain of energy in a step as a share of that at the start."""
    engine, (i, j), deepest, gain = Reference(variant), np.triu_indices(scene.n, 1), 0.0, 0.0
    engine.load(scene, dt)

    def energy(state):
        turning = scene.inertia @ state.angular_velocity**2 / 2
        falling = scene.mass @ (
            (state.velocity**2).sum(axis=1) / 2 - state.position @ scene.gravity
        )
        return turning + falling

    before = start = energy(scene.state)
    for _ in range(steps):
        engine.step()
        state = engine.read()
        x, r = state.position, scene.radius
        gaps = (np.hypot(*(x[i] - x[j]).T) - r[i] - r[j]) / np.minimum(r[i], r[j])
        nearest = np.clip(x[:, None], scene.walls.min(axis=1), scene.walls.max(axis=1))
        walls = np.hypot(*np.moveaxis(x[:, None] - nearest, -1, 0)) / r[:, None] - 1
        deepest = max(deepest, -gaps.min(initial=0.0), -walls.min())
        gain, before = max(gain, (energy(state) - before) / abs(start)), energy(state)
    return engine, deepest, gain


def column(masses, e=0.0, gap=0.0, friction=0.0):
    n = len(masses)
    return lay_out(
        np.stack([np.zeros(n), 0.5 + gap + np.arange(n) * (1 + gap)], axis=-1),
        radius=0.5,
        mass=masses,
        restitution=e,
        friction=friction,
        gravity=[0.0, -10.0],
        walls=[[[-5.0, 0.0], [5.0, 0.0]]],
    )


STACKS = {
    "column_of_ten": scenario("column_of_ten").scene,
    "heavy on light": column([1.0, 100.0], gap=0.4),
    "light on heavy": column([100.0, 1.0], gap=0.4),
    "friction": column([1.0] * 4, e=0.3, gap=0.3, friction=0.5),
    "nine under 1e4 kg": column([1.0] * 9 + [1e4]),
    "thirty": column([1.0] * 30),
    "ten fall": column([1.0] * 10, e=0.5, gap=0.1),
}


@pytest.mark.parametrize("name", STACKS)
def test_a_stack_stands_neither_overlaps_nor_gains_energy(name):
    # Each step may leave `EXACT` of a radius, and 2^-40 of g dt2 / 2 on top of it, 300 times; with
    # 1e4 kg on 1 kg the rounding of the heavy one's push is 1e4 times as large.
    engine, deepest, gain = steps_of(STACKS[name], 1 / 60, 300)
    assert deepest < 10 * ordered.EXACT
    assert gain < 10 * ordered.EXACT
    assert np.abs(engine.read().velocity).max() < 1e-9
    floor = [hit.impulse for hit in engine.collisions() if hit.step >= 240 and hit.j == -1]
    weight = STACKS[name].mass.sum() * -STACKS[name].gravity[1]
    assert sum(floor) == pytest.approx(weight * 60 / 60, rel=1e-9)


def test_projection_pair_by_pair_overlaps_in_a_stack():
    assert steps_of(STACKS["column_of_ten"], 1 / 60, 60, neighbours)[1] > 1e-2


def test_a_disk_at_rest_beside_a_stack_stays_as_alone():
    # To a few roundings a step: it is in no solution of the stack. Not to the bit: alone it has 8
    # collisions a step, beside the stack it shares 40; and there it may overlap by `EXACT`, so that
    # a rounding does not use up those of all.
    stack, alone = column([1.0] * 4, e=0.5, gap=0.1), column([1.0], e=0.5, gap=0.3)
    both = {
        name: np.concatenate([getattr(stack, name), getattr(alone, name)])
        for name in ("velocity", "radius", "mass", "inertia", "angle", "angular_velocity")
    }
    beside = replace(stack, position=np.vstack([stack.position, [[3.0, 0.8]]]), **both)
    alone = replace(alone, position=[[3.0, 0.8]])
    ends = [played(scene, 1 / 64, 200).read() for scene in (beside, alone)]
    assert np.abs(ends[0].position[4:] - ends[1].position).max() < 200 * 4 * ROUNDING
    assert np.abs(ends[0].velocity[4:] - ends[1].velocity).max() < 200 * 4 * ROUNDING


def test_a_contact_that_a_collision_opens_pushes_no_more():
    # A disk that is struck after it was held flies off without the force: with it, this scene
    # gained up to 2e-3 of its energy in a step.
    stack = column([1.0] * 5, e=1.0)
    scene = replace(
        stack,
        position=np.vstack([stack.position, [[-3.0, 2.5]]]),
        velocity=np.vstack([stack.velocity, [[5.0, 0.0]]]),
        **{name: np.append(getattr(stack, name), 0.0) for name in ("angle", "angular_velocity")},
        **{
            name: np.append(getattr(stack, name), getattr(stack, name)[0])
            for name in ("radius", "mass", "inertia")
        },
    )
    assert steps_of(scene, 1 / 60, 90)[2] < 10 * ROUNDING


def sliding_past(speed):
    """A disk that touches a static one and slides past it, while it is pressed against it by 7.3
    m/s2."""
    return Scene(
        position=[[1.0, 2.0], [1.5, 2.0]],
        velocity=[[0.0, speed], [0.0, 0.0]],
        radius=[0.25] * 2,
        mass=[1.7, np.inf],
        gravity=[7.3, 0.6],
        restitution=0.99,
    )


@pytest.mark.parametrize("speed", [2.7, 5.7])
def test_two_that_touch_and_slide_past_each_other_part_at_every_step_size(speed):
    # They part as v2 / d = 14.6 m/s2 and more opens the gap, though rounding may say at first that
    # it closes. The control slides with 4.5 m/s2 of it: it is held where it is.
    rates = [20 * 1.01**k for k in range(300)]

    def pressed(speed):
        x = np.array(
            [played(sliding_past(speed), 1 / rate, 1).read().position[0, 0] for rate in rates]
        )
        return np.abs(x - (1.0 + 7.3 / 2 / np.square(rates)))

    assert pressed(speed).max() < 8 * ROUNDING  # a few roundings of a coordinate of 1 m
    assert pressed(1.5).max() > 1e-6


@pytest.mark.parametrize("seed", [0, 3, 12, 23])
def test_a_pile_whose_lowest_row_fills_the_box_gains_no_energy(seed):
    # Five disks of 0.5 m between walls 2.5 m apart: by rounding they could push each other without
    # bound. Of 48 such piles 20 threw a disk through the floor.
    k = np.arange(12)
    scatter = np.random.default_rng(seed).uniform(-0.1, 0.1, (12, 2))
    scene = lay_out(
        np.stack([0.8 * (k % 3) - 0.8, 0.5 + 0.7 * (k // 3)], -1) + scatter,
        walls=box([-1.25, 0], [1.25, 8]),
        gravity=np.array([0.0, -10.0]),
        restitution=0.2,
    )
    engine = played(scene, 1 / 64, 0)
    energies = []
    for _ in range(67):
        state = engine.read()
        energies.append((state.velocity**2).sum() / 2 + 10.0 * state.position[:, 1].sum())
        engine.step(4)
    assert np.diff(energies).max() < 1e-6 * energies[0]
