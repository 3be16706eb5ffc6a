"""Scenes that are random (seed n): disks in a box, in the open, in the wrapping box; with what else
a scene may have."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.model import Scenario, Scene, Thrust

RESTITUTIONS = (1.0, 0.9, 0.5, 0.1)
# m; no coordinate is 8 m or more but the walls', see `nudges` of the horizon
WIDTH, HEIGHT = 9.0, 6.0
GAP = 0.02  # m, between any two bodies at the start: nothing touches


def random_scene(seed: int) -> Scenario:
    """Three to eight disks; in turn one of the four restitutions and one of the surroundings of
    `SURROUNDINGS`."""
    rng = np.random.default_rng(seed)
    surroundings = tuple(SURROUNDINGS)[seed // 4 % len(SURROUNDINGS)]
    walls, wrap = SURROUNDINGS[surroundings](rng)
    n, fixed = int(rng.integers(3, 9)), int(rng.integers(0, 3))
    radius = rng.uniform(0.1, 0.5, n)
    position = placed(rng, radius, walls)
    mass = rng.uniform(0.5, 4.0, n)
    mass[: 0 if surroundings == "wrap" else fixed] = np.inf
    velocity = np.where(np.isinf(mass)[:, None], 0.0, rng.normal(0, 2, (n, 2)))
    gravity = (0.0, 0.0) if seed % 3 == 0 else (rng.uniform(-1, 1), rng.uniform(-5, -1))
    scene = Scene(
        position=position,
        velocity=velocity,
        radius=radius,
        mass=mass,
        walls=walls,
        wrap=wrap,
        gravity=gravity,
        restitution=RESTITUTIONS[seed % 4],
    )
    thrusts = []
    for _ in range(int(rng.integers(0, 3))):
        start = rng.uniform(0, 2)
        stop, force = start + rng.uniform(0.1, 1.5), rng.normal(0, 4, 2)
        thrusts.append(Thrust(n - 1 - len(thrusts), start, stop, force))
    return scenario(f"{surroundings}-{seed}", scene, 4.0, thrusts)


def scenario(name: str, scene: Scene, duration: float, thrusts: list[Thrust]) -> Scenario:
    return Scenario(name, "?", "random (seed n)", scene, duration, duration / 16, thrusts=thrusts)


def box(_rng: np.random.Generator) -> tuple[np.ndarray, None]:
    corners = np.array([[0, 0], [WIDTH, 0], [WIDTH, HEIGHT], [0, HEIGHT]])
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1), None


def free_walls(rng: np.random.Generator) -> tuple[np.ndarray, None]:
    """One to four segments anywhere, which may cross each other, and two that cross for certain."""
    cross = np.array([[[3.0, 2.0], [5.0, 4.0]], [[5.0, 2.5], [3.5, 4.0]]]) + rng.uniform(-1, 1, 2)
    return (
        np.concatenate([rng.uniform(0, 1, (rng.integers(1, 5), 2, 2)) * (WIDTH, HEIGHT), cross]),
        None,
    )


def cluttered_box(rng: np.random.Generator) -> tuple[np.ndarray, None]:
    """A box with segments in it that touch nothing or cross its walls."""
    return np.concatenate([box(rng)[0], free_walls(rng)[0]]), None


def wrap(_rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((0, 2, 2)), np.array([[0, 0], [WIDTH, HEIGHT]])


SURROUNDINGS = {"box": box, "free_walls": free_walls, "cluttered_box": cluttered_box, "wrap": wrap}


def placed(rng: np.random.Generator, radius: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """(n, 2) m: centres in the box such that nothing overlaps anything."""
    position: list[np.ndarray] = []
    while len(position) < len(radius):
        r = radius[len(position)]
        x = rng.uniform(r + GAP, np.array([min(WIDTH, 8.0), HEIGHT]) - r - GAP)
        near_disk = any(np.hypot(*(x - y)) < r + s + GAP for y, s in zip(position, radius))
        near_wall = any(distance_to_segment(x, *wall) < r + GAP for wall in walls)
        if not near_disk and not near_wall:
            position.append(x)
    return np.array(position)


def distance_to_segment(x: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    along = end - start
    share = np.clip((x - start) @ along / (along @ along), 0, 1)
    return float(np.hypot(*(x - start - share * along)))
