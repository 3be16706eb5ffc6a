"""The oracle against closed forms, a float64 simulation, and itself in other numbers; and where it
refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Scenario, Scene, Thrust
from crosscheck2d.scenarios.truth.exact import ACCURACY, TruthRecord, computed
from crosscheck2d.scenarios.truth.oracle import events as oracle_events
from crosscheck2d.scenarios.truth.oracle.events import Path, trace
from crosscheck2d.scenarios.truth.oracle.numbers import balls, mpfr
from tests.adapters.event_driven.test_symmetries import changed
from tests.scenarios.test_catalogue import smallest_gap
from tests.scenarios.test_closed_forms import FLYING

RANDOM = ("asteroids", "falling_box", "gas_of_100")
COUNTS = {"asteroids": 20, "falling_box": 980, "gas_of_100": 1974}


def asked(scene: Scene, duration: float = 2.0, **fields) -> Scenario:
    return Scenario("scene", "?", "here", scene, duration, duration / 50, **fields)


def states(scene: Scenario, record: TruthRecord):
    """At the scenario's samples, beyond the horizon of float64, too."""
    return replace(record, float64_horizon=np.inf).sampled(scene.scene, scene.thrusts, scene.times)


def sampled(
    seed: int, n: int = 5, restitution: float = 1.0, gravity: float = 0.0, **fields
) -> Scene:
    rng = np.random.default_rng(seed)
    radius = rng.uniform(0.05, 0.2, n)
    return lay_out(
        position=scatter(rng, [-0.8, -0.8], [0.8, 0.8], radius),
        velocity=rng.normal(size=(n, 2)),
        radius=radius,
        mass=rng.uniform(0.5, 5, n),
        restitution=restitution,
        walls=box([-1, -1], [1, 1]),
        gravity=[0, gravity],
        **fields,
    )


@pytest.fixture(scope="module")
def records() -> dict[str, TruthRecord]:
    return {name: computed(scenario(name)) for name in RANDOM}


@pytest.mark.parametrize("name", [*FLYING, "ship_thrust", "spin_under_torque"])
def test_it_finds_what_the_closed_form_says(name: str):
    one = scenario(name)
    record = computed(one)
    expected, found = one.truth(one.times), states(one, record)
    k = min(len(expected), len(found))

    assert k > 0.8 * len(
        one.times
    )  # an accumulation ends the oracle, not the closed form; an unstable orbit the latter
    np.testing.assert_allclose(found.position[:k], expected.position[:k], rtol=0, atol=ACCURACY)
    np.testing.assert_allclose(found.angle[:k], expected.angle[:k], rtol=0, atol=ACCURACY)
    collisions, others = (
        sorted(zip(c.collisions.i, c.collisions.j, c.collisions.t, c.collisions.impulse))
        for c in (found, expected)
    )
    # one lists no bounces below 1e-4 s, one ends early
    if name in ("bouncing_ball_e09", "disk_between_static_disks"):
        until = (
            min(max(collision[2] for collision in each) for each in (collisions, others)) + ACCURACY
        )
        collisions, others = (
            [collision for collision in each if collision[2] <= until]
            for each in (collisions, others)
        )
    assert [collision[:2] for collision in collisions] == [collision[:2] for collision in others]
    # The closed form of Galperin's collisions divides by tangents of up to pi.
    times = [[collision[2] for collision in each] for each in (collisions, others)]
    np.testing.assert_allclose(*times, rtol=2e-13 if name == "galperin_314" else 0, atol=ACCURACY)
    # Impulses of 2e6 N s in the heaviest lane.
    np.testing.assert_allclose(
        [collision[3] for collision in collisions],
        [collision[3] for collision in others],
        rtol=1e-12,
    )


@pytest.mark.parametrize("name", [pytest.param("asteroids", marks=pytest.mark.slow), *RANDOM[1:]])
def test_the_random_scenes_are_answered_to_their_end(name: str, records: dict[str, TruthRecord]):
    one, record = scenario(name), records[name]
    truth = states(one, record)

    assert record.reason == ""
    assert len(truth) == len(one.times)
    assert len(truth.collisions) == COUNTS[name]
    assert truth.error_bound < ACCURACY
    assert smallest_gap(one.scene, truth.position).min() >= -ACCURACY
    assert ((record.events[:, 4] > 0) & (record.events[:, 4] < 1 + 1e-15)).all()


@given(
    seed=st.integers(0, 10**6),
    restitution=st.sampled_from([1.0, 0.9, 0.5]),
    gravity=st.sampled_from([0.0, -3]),
)
def test_it_finds_the_collisions_of_the_event_engine(seed: int, restitution: float, gravity: float):
    one = asked(sampled(seed, 4, restitution, gravity), 1.0)
    found, engine = states(one, computed(one)).collisions.t[:10], EventEngine(one.scene)
    engine.advance(float(found[-1]) + 1e-9 if len(found) else 1.0)

    # Ten collisions lose at most as many digits: 1e-16 times 10^6 or so.
    np.testing.assert_allclose(found, engine.collisions[:, 0], rtol=0, atol=1e-9)


def test_two_precisions_give_what_intervals_prove(records: dict[str, TruthRecord]):
    np.testing.assert_array_equal(
        records["asteroids"].legs, computed(scenario("asteroids"), mpfr).legs
    )


def test_interval_arithmetic_proves_every_comparison(records: dict[str, TruthRecord]):
    assert {name: record.method for name, record in records.items()} == dict.fromkeys(
        RANDOM, "certified"
    )
    one = scenario("gas_of_100")
    with pytest.raises(ArithmeticError):
        trace(one.scene, [], one.duration, balls(64))


def last_of(path: Path) -> np.ndarray:
    return np.array([[float(x) for x in legs[-1][:7]] for legs in path.legs])


def test_the_order_of_the_disks_does_not_matter():
    scene, order = sampled(5, 6, 0.9, -1.0), np.random.default_rng(1).permutation(6)
    scenes = scene, changed(scene, order)
    here, there = (last_of(trace(each, [], 2.0, mpfr(256))) for each in scenes)

    np.testing.assert_array_equal(here[order], there)


def test_a_mirrored_scene_moves_as_the_mirror_image():
    scene = sampled(6, 6, 0.9, -1.0)
    scenes = scene, changed(scene, flip=(-1.0, 1.0))
    here, there = (last_of(trace(each, [], 2.0, mpfr(256))) for each in scenes)

    np.testing.assert_array_equal(here * [1, -1, 1, -1, 1, -1, 1], there)


def test_time_runs_backwards_at_restitution_one():
    one = asked(sampled(7, 6), 3.0)
    truth = states(one, computed(one))
    assert len(truth.collisions) > 20
    back = asked(replace(one.scene, position=truth.position[-1], velocity=-truth.velocity[-1]), 3.0)
    start = states(back, computed(back)).at(-1)

    # The end is rounded by 1e-16, and some forty collisions enlarge that.
    np.testing.assert_allclose(start.position, one.scene.position, rtol=0, atol=1e-6)
    np.testing.assert_allclose(start.velocity, -one.scene.velocity, rtol=0, atol=1e-5)


def test_a_ball_falls_on_a_static_disk_a_wall_end_and_a_resting_pair_of_them():
    bumper = lay_out(
        [[0.3, 2.0], [0, 0.5]],
        [[-0.2, 0], [0, 0]],
        radius=[0.25, 0.5],
        mass=[1, np.inf],
        walls=[[[1, -3], [2, -3]]],
        gravity=[0, -9.81],
    )
    one = asked(bumper, 1.5)
    assert computed(one).method == "certified"
    truth = states(one, computed(one))
    t = truth.collisions.t[0]
    at = np.array([0.3 - 0.2 * t, 2 - 9.81 * t**2 / 2])

    assert truth.collisions.j[0] == 1
    assert np.hypot(*(at - [0, 0.5])) == pytest.approx(0.75, abs=1e-15 * 4)
    # Onto the end of a wall, from the side: blamed on the wall.
    edge = replace(bumper, position=[[1.0 - 0.1, 0.0], [-5, 0]], velocity=np.zeros((2, 2)))
    collision = computed(asked(edge, 1.2)).events[0]
    drop = np.sqrt(2 * (3 - np.sqrt(0.25**2 - 0.1**2)) / 9.81)
    assert collision[:3].tolist() == [pytest.approx(drop, rel=1e-15), 0, -1]
    assert collision[4] == pytest.approx(np.sqrt(1 - 0.16), rel=1e-14)


def test_thrusts_carry_a_disk_into_a_wall():
    scene = lay_out([[0, 0]], radius=0.5, mass=2, walls=[[[2, -1], [2, 1]]])
    one = asked(scene, 4.0, thrusts=[Thrust(0, 0.0, 1.0, [3.0, 0.0], 0.5)])
    record = computed(one)

    # 0.75 m and 1.5 m/s at 1 s, then the other 0.75 m in half a second.
    np.testing.assert_allclose(record.events[:, :4], [[1.5, 0, -1, 6.0]], rtol=1e-15)
    assert states(one, record).angular_velocity[-1, 0] == pytest.approx(2.0, rel=1e-15)


def test_an_edge_of_the_wrap_sets_the_centre_onto_the_other():
    scene = lay_out([[1, 0]], [1, 0], radius=0.1, wrap=[[-2, -2], [2, 2]])
    one = asked(scene, 10.0)
    truth = states(one, computed(one))

    np.testing.assert_allclose(truth.position[:, 0, 0], (one.times + 3) % 4 - 2, rtol=0, atol=1e-14)


def test_used_up_digits_end_the_truth(monkeypatch: pytest.MonkeyPatch):
    one = scenario("falling_box")
    whole = one.truth(one.times)  # before: it is kept for others
    monkeypatch.setattr("crosscheck2d.scenarios.truth.exact.FEWEST_BITS", 56)
    monkeypatch.setattr("crosscheck2d.scenarios.truth.exact.MOST_BITS", 100)
    record = computed(one)

    assert 0.1 < record.horizon < one.duration
    assert "used up" in record.reason
    k = len(states(one, record))
    np.testing.assert_allclose(
        states(one, record).position, whole.position[:k], rtol=0, atol=2 * ACCURACY
    )


def test_a_stale_record_taken_for_fresh_is_caught(
    monkeypatch: pytest.MonkeyPatch, records: dict[str, TruthRecord]
):
    # the bug of the first prototype: two precisions agree on a wrong motion
    monkeypatch.setattr(oracle_events.Motion, "stale", lambda _self, _record: False)
    one = scenario("asteroids")
    wrong = computed(one, mpfr)

    assert (
        smallest_gap(one.scene, states(one, wrong).position).min() < -ACCURACY
        or len(wrong.events) != COUNTS[one.name]
    )
    assert not np.array_equal(wrong.events[:, :3], records[one.name].events[:, :3])
