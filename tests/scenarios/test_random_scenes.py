"""Random scenes end, each within its limit, and say what the exact answer says; or they are refused
by name."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
import pytest

from crosscheck2d.adapters.event_driven.engine import EventDriven
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.exact import computed
from tests.scenarios.random_scenes import LAYOUTS, random_scenario, random_scenarios, toward
from tests.scenarios.time_limits import each_within

LIMIT = 2.0  # s of processor time a scene; most take some ms
FAST, LONG, CHUNKS = 45, 500, 5
REFUSALS = (
    r"the collisions of disk \d on ((disk|wall) \d( and )?)+ accumulate at \d\.?\d* s",
    r"disk \d slides round the end of wall \d at [\d.]+ s: its path there is no parabola",
)


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    for one in (random_scenario(0, 0), scenario("near_miss")):
        played(one)


def played(one: Scenario) -> Run:
    return play(EventDriven(), "event_driven:float64", one, one.sample_interval)


def sweep(asked: list[Scenario]) -> None:
    runs = each_within(LIMIT, played, asked)

    assert [one.name for one, run in zip(asked, runs) if run is None] == []
    for one, run in zip(asked, runs):
        if run.status == "ok":
            assert len(run.trajectory) == one.intervals + 1
        else:
            assert run.status == "unsupported"
            assert any(re.fullmatch(words, run.reason) for words in REFUSALS), run.reason
    assert Counter(run.status for run in runs)["ok"] > 0.6 * len(runs)


def departure(one: Scenario) -> tuple[float, int]:
    """How far the engine is from the exact answer at most, m, while that can be followed; and at
    how many samples.

    Where disks touch exactly they glide along each other, and a rounding becomes a collision: until
    the third only.
    """
    run = played(one)
    try:
        record = computed(one)
    except NoTruth:
        return 0.0, 0
    exact = record.sampled(one.scene, one.thrusts, one.times)
    k = min(len(exact), len(run.trajectory) if run.trajectory else 0)
    if "touching" in one.name:
        third = np.append(record.events[record.events[:, 3] > 0, 0], [np.inf] * 3)[2]
        k = min(k, int((one.times < third).sum()))
    return (
        float(np.abs(exact.position[:k] - run.trajectory.position[:k]).max(initial=0.0))
        if k
        else 0.0
    ), k


def agree(asked: list[Scenario]) -> None:
    """Within 1e-9 m. But a graze is a double root: a rounding of 1e-16 m makes 1e-8 m/s, and some
    1e-7 m in 3 s."""
    found = each_within(20 * LIMIT, departure, asked)

    assert [one.name for one, each in zip(asked, found) if each is None] == []
    far = {one.name: each[0] for one, each in zip(asked, found) if each[0] > 1e-9}
    assert all(off < 2e-6 for off in far.values()), far
    assert len(far) < 0.05 * len(found)
    assert sum(samples > 1 for _, samples in found) > 0.8 * len(found)


def test_a_few_random_scenes_end_played_or_refused_by_name():
    sweep(random_scenarios(FAST))


@pytest.mark.slow
def test_a_few_random_scenes_are_as_the_exact_answer_has_them():
    agree(random_scenarios(2 * len(LAYOUTS)))


def tiny_wall(number: int) -> Scenario:
    """A disk that meets a wall of 1e-9 to 1 m, with its foot within one such length of the middle:
    straight or obliquely, in a level or turned scene, with and without gravity and friction."""
    draw = np.random.default_rng([2, number])
    angle = draw.choice([*np.pi / 2 * np.arange(4), draw.uniform(0, 2 * np.pi)])
    along, normal = toward(angle), toward(angle + np.pi / 2)
    length, radius, t = 10 ** draw.uniform(-9, 0), draw.uniform(0.1, 0.3), draw.uniform(0.2, 0.8)
    place, foot = draw.uniform(-0.5, 0.5, 2), draw.uniform(-length, length)
    pull = 9.81 * draw.integers(2) * normal
    start = -draw.uniform(0.5, 3) * normal + draw.normal() * draw.integers(2) * along + pull * t
    scene = Scene(
        position=[place + foot * along + radius * normal - start * t + pull * t**2 / 2],
        velocity=[start],
        radius=[radius],
        mass=[1.0],
        restitution=draw.choice([0.0, 0.5, 0.9, 1.0]),
        friction=draw.choice([0.0, 0.3]),
        walls=[[place - length / 2 * along, place + length / 2 * along]],
        gravity=-pull,
    )
    return Scenario(f"tiny_wall_{number}", "How far off is it?", "random", scene, 2.0, 1 / 32)


@pytest.mark.slow
def test_walls_down_to_a_nanometre_are_as_the_exact_answer_has_them():
    # A normal that is wrong by a nanometre gives 1e-8 m. But at e = 0 a disk leaves an end almost
    # along the wall, and rounding has it meet the other end, too.
    scenes = [tiny_wall(number) for number in range(150)]
    found = [departure(one) for one in scenes]
    far = [one.scene.restitution for one, (off, _) in zip(scenes, found) if off > 1e-9]

    assert far == [0.0] * len(far)
    assert len(far) < 0.02 * len(found)
    assert max(off for off, _ in found) < 1e-7
    assert sum(samples > 10 for _, samples in found) > 100


@pytest.mark.long
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_all_random_scenes_end_played_or_refused_by_name(chunk):
    sweep(random_scenarios(LONG)[chunk::CHUNKS])


@pytest.mark.long
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_all_random_scenes_are_as_the_exact_answer_has_them(chunk):
    agree(random_scenarios(LONG)[chunk::CHUNKS])


def test_scenes_depend_on_their_seed_and_number_only():
    few, many = random_scenarios(5, seed=3), random_scenarios(200, seed=3)
    assert all((one.scene.position == other.scene.position).all() for one, other in zip(few, many))
    assert len({one.name for one in [*many, *random_scenarios(200, seed=4)]}) == 400
    e = [one.scene.restitution for one in many]
    assert {0.0, 0.02, 0.5, 0.9, 1.0} < set(e)
    assert any(not one.scene.gravity.any() for one in many)
    assert any(one.thrusts for one in many)
    assert any(one.scene.static.any() for one in many)


def test_what_never_ends_is_ended_and_reported():
    assert each_within(0.2, endless_at_two, [1, 2, 3]) == [1, None, 3]


def endless_at_two(item: int) -> int:
    while item == 2:
        pass
    return item
