"""Rest, slopes and collapse: the exact answers against `resting_motion.py`."""

from __future__ import annotations

import numpy as np
import pytest

from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.truth.exact import computed
from tests.independent.resting_motion import ball_on_slope, column

pytestmark = pytest.mark.independent
MANY = pytest.param(450, marks=pytest.mark.long)
# in the reason of an answer that ends
UNKNOWN = ("order of", "orders than", "do not end", "used up their digits")


def slope_scene(seed: int) -> tuple[Scene, float]:
    draw = np.random.default_rng([39, seed])
    angle = draw.uniform(-0.6, 0.6) * (draw.random() < 0.8)
    along, up = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    radius, mass = draw.uniform(0.1, 0.5), draw.uniform(0.3, 4)
    scene = Scene(
        position=[(radius + draw.uniform(0.05, 1.0)) * up],
        velocity=[draw.normal(size=2) * 1.5],
        angular_velocity=[draw.normal() * draw.choice([0, 10, 40])],
        radius=[radius],
        mass=[mass],
        inertia=[mass * radius**2 * draw.uniform(0.3, 1.0)],
        walls=[[-1000 * along, 1000 * along]],
        gravity=[0, -draw.choice([5.0, 9.81])],
        restitution=draw.uniform(0.05, 0.8),
        friction=draw.choice([0.0, 0.05, 0.2, 0.5, 1.5]),
    )
    e, g = scene.restitution, -scene.gravity[1] * np.cos(angle)
    first = np.abs(scene.velocity[0] @ up) + np.sqrt(2 * g * 1.0 + (scene.velocity[0] @ up) ** 2)
    return scene, float(min(3 * first / g / (1 - e), 6.0)) + 0.5


def column_scene(seed: int) -> Scene:
    draw = np.random.default_rng([40, seed])
    n = int(draw.integers(1, 5))
    radius, gaps = draw.uniform(0.05, 0.4, n), draw.uniform(0.05, 0.6, n)
    y = np.cumsum(gaps + 2 * radius) - radius
    return Scene(
        position=np.column_stack([np.zeros(n), y]),
        velocity=np.column_stack([np.zeros(n), draw.normal(size=n) * draw.choice([0, 0.5])]),
        radius=radius,
        mass=10 ** draw.uniform(-1, 1, n),
        walls=[[[-5, 0], [5, 0]]],
        gravity=[0, -9.81],
        restitution=draw.choice([0.0, 0.0, 0.1, 0.2]),
        friction=draw.choice([0.0, 0.5]),
    )


def asked(scene: Scene, duration: float) -> Scenario:
    return Scenario("rest", "?", "random", scene, duration, duration / 40)


@pytest.mark.parametrize("count", [30, MANY])
def test_balls_on_slopes_end_as_in_the_plain_motion(count: int):
    for seed in range(count):
        scene, duration = slope_scene(seed)
        one = asked(scene, duration)
        record = computed(one)
        assert record.reason == "", seed
        (position, velocity), (_, spin) = record.motion(scene, [], one.times)
        start, end = scene.walls[0]
        along = (end - start) / np.hypot(*(end - start))
        expected, gap = ball_on_slope(scene, one.times)
        up = np.array([-along[1], along[0]])
        middle = (start + end) / 2

        np.testing.assert_allclose((position[:, 0] - middle) @ along, expected[:, 0], atol=1e-11)
        np.testing.assert_allclose(velocity[:, 0] @ along, expected[:, 1], rtol=1e-12, atol=1e-11)
        # A spin makes no rotation in the record without friction: it is constant then.
        np.testing.assert_allclose(spin[:, 0], expected[:, 2], rtol=1e-12, atol=1e-10)
        # The ends of the wall, at 1 km, are rounded to 1e-13 m.
        height = (position[:, 0] - start) @ up - scene.radius[0]
        np.testing.assert_allclose(height, gap, rtol=0, atol=1e-11)


@pytest.mark.parametrize("count", [20, pytest.param(200, marks=pytest.mark.long)])
def test_columns_come_to_rest_as_in_the_plain_motion(count: int):
    # An answer ends only where the order of collisions may decide, or is not known not to; four of
    # five last to the end.
    ended, cut_short = 0, list[int]()
    for seed in range(count):
        scene = column_scene(seed)
        one = asked(scene, 2.5)
        record = computed(one)
        assert record.reason == "" or any(words in record.reason for words in UNKNOWN), seed
        ended += record.reason == ""
        times = one.times[one.times < min(record.horizon, one.duration)]
        (position, _), _ = record.motion(scene, [], times)
        expected = column(scene, times, np.random.default_rng(seed))
        cut_short += [seed] * (len(expected) < len(times))
        np.testing.assert_allclose(
            position[: len(expected), :, 1], expected, rtol=0, atol=1e-11, err_msg=str(seed)
        )
    assert ended >= 0.8 * count
    assert len(cut_short) <= 0.02 * count, cut_short
