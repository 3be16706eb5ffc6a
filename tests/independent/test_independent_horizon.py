"""The oracle's horizon against starts moved by a rounding, each simulated in 420 bits:
`exact_motion`.

The definition: every number of the start is off by a rounding, each on its own: float64's relative
2 ** -52 of the largest coordinate, or speed. The horizon is when the standard deviation of some
disk's position reaches a billionth of its radius.

How far samples can be held to it: the motion stretches one direction far more than all others, so
that a disk's distance in a draw is about a normal number times its standard deviation. The mean
square of eight samples over its expectation is then chi squared with 8 degrees of freedom over 8,
which is between 0.107 and 3.27 but for one in a thousand either side: their root mean square at the
horizon must be 0.33 to 1.81 billionths, and below before it. Over all scenes the mean of those
squares has a standard deviation of sqrt(2 / (8 scenes)): it must be 1 within three.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import gmpy2
import numpy as np
import pytest
from gmpy2 import mpc

from crosscheck2d.scenarios import catalogue
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.truth.exact import computed
from tests.independent.exact_motion import Motion, Vector
from tests.independent.random_scenes import box, placed, scenario

pytestmark = pytest.mark.independent

Record = Callable[[str, object], None]

SAMPLES = 8
LEAST, MOST = 0.33, 1.81  # of the root mean square of eight samples over its expectation
BILLIONTH = 1e-9
FAR = 10**6  # events: none of these motions has as many
EPS = 2.0**-52
GASES, SUITE = 8, ("asteroids", "falling_box")


def gas(seed: int) -> Scenario:
    rng = np.random.default_rng(1000 + seed)
    radius = rng.uniform(0.25, 0.45, 10)
    walls, _ = box(rng)
    scene = Scene(
        position=placed(rng, radius, walls),
        velocity=rng.normal(0, 2, (10, 2)),
        radius=radius,
        mass=rng.uniform(0.5, 4.0, 10),
        walls=walls,
        gravity=(0, -4.0 * (seed // 2 % 2)),
        restitution=(1.0, 0.9)[seed % 2],
    )
    return scenario(f"gas-{seed}", scene, 8.0, [])


def nudges(scene: Scene, rng: np.random.Generator) -> list[tuple[Vector, Vector]]:
    length, speed = EPS * np.abs(scene.position).max(), EPS * np.abs(scene.velocity).max()
    signs = rng.choice([-1, 1], (scene.n, 4)) * ~scene.static[:, None]
    return [(mpc(*map(float, s[:2] * length)), mpc(*map(float, s[2:] * speed))) for s in signs]


def distances(one: Scenario, end: float, samples: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (k,) s up to `end`, and (k,) the largest root mean square distance over the samples of
    any disk, in radii."""
    short = Scenario(one.name, "?", "?", one.scene, end, end, thrusts=one.thrusts)
    rng = np.random.default_rng(seed)
    exact = Motion(short, FAR)
    moved = [Motion(short, FAR, nudges(one.scene, rng)) for _ in range(samples)]
    assert not any(motion.reason for motion in (exact, *moved))
    times = np.linspace(0, end, 201)
    square = np.zeros((len(times), one.scene.n))
    for k, t in enumerate(times):
        here = exact.at(float(t))
        for motion in moved:
            square[k] += [float(gmpy2.norm(p.x - q.x)) for p, q in zip(here, motion.at(float(t)))]
    return times, (np.sqrt(square / samples) / one.scene.radius).max(axis=1)


def verdict(times: np.ndarray, distance: np.ndarray, horizon: float) -> str:
    at, before = float(np.interp(horizon, times, distance)), distance[times <= horizon].max()
    if before > MOST * BILLIONTH:
        return f"too late: starts are {before:.2g} radii apart before it"
    return f"too early: starts are {at:.2g} radii apart by then" if at < LEAST * BILLIONTH else ""


def crossing(times: np.ndarray, distance: np.ndarray) -> float:
    late = np.flatnonzero(distance > BILLIONTH)
    return float(times[late[0]]) if len(late) else np.inf


def mean_square(gases: list[tuple[np.ndarray, np.ndarray, float]], share: float) -> float:
    """Over gases (times, distance, horizon): of the distance at a share of the horizon, in
    billionths of a radius."""
    return float(
        np.mean([(np.interp(share * horizon, t, d) / BILLIONTH) ** 2 for t, d, horizon in gases])
    )


@pytest.mark.parametrize(
    ("gases", "suite"),
    [(4, ()), pytest.param(GASES, SUITE, marks=pytest.mark.long)],
    ids=["four gases", "all"],
)
def test_at_the_horizon_starts_a_rounding_apart_are_a_billionth_of_a_radius_apart(
    record_property: Record, gases: int, suite: tuple[str, ...]
):
    # The controls: horizons that are all a tenth longer, or shorter.
    scenes = [gas(seed) for seed in range(gases)] + [catalogue.scenario(name) for name in suite]
    lines, found, wrong = [], [], []
    for seed, one in enumerate(scenes):
        horizon = computed(one).float64_horizon
        times, distance = distances(one, min(1.15 * horizon, one.duration), SAMPLES, seed)
        found.append((times, distance, horizon))
        lines.append(f"{one.name} {horizon:.3f} ({crossing(times, distance):.3f})")
        wrong += [f"{one.name}: {fault}"] if (fault := verdict(times, distance, horizon)) else []
    summary = f"horizons, s (from {SAMPLES} samples): {', '.join(lines)}"
    record_property("found", f"{summary}; mean square {mean_square(found, 1):.2f} of the expected")

    assert not wrong
    three_deviations = 3 * sqrt(2 / (SAMPLES * len(scenes)))
    assert abs(mean_square(found, 1) - 1) < three_deviations
    for share in (0.9, 1.1):
        assert abs(mean_square(found[:gases], share) - 1) > three_deviations
