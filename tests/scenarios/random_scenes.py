"""Random scenes that fall, pile up, wedge themselves into corners and touch: what every computation
must get through.

A scene depends on the seed and its own number only, so that the first of many are the same as few.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from crosscheck2d.scenarios.families.placing import box
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust

Draw = np.random.Generator

# s; thrusts start and stop at samples, so that every step is under a thrust as a whole
INTERVAL = 1 / 16
RESTITUTIONS = (0.0, 0.02, 0.5, 0.9, 1.0, None)  # None: anything from 0 to 1
NEAREST = 1e-3  # m between things that do not touch
GRID = 1 / 8  # m; multiples of it are exact in float64, and so is whether disks on it touch
MOST_TRIES = 500


def random_scenarios(count: int, seed: int = 0) -> list[Scenario]:
    return [random_scenario(seed, number) for number in range(count)]


def random_scenario(seed: int, number: int) -> Scenario:
    draw = np.random.default_rng([seed, number])
    layout = list(LAYOUTS)[number % len(LAYOUTS)]
    walls = LAYOUTS[layout](draw)
    place = lattice if layout == "touching" else scattered
    position, radius = place(draw, walls, int(draw.integers(1, 7)))
    n = len(radius)
    fixed = draw.random(n) < 0.15
    fixed[draw.integers(n)] = False
    speed = 0.0 if layout == "touching" or draw.random() < 0.3 else 1.5
    restitution = RESTITUTIONS[draw.integers(len(RESTITUTIONS))]
    mass = np.where(fixed, np.inf, draw.uniform(0.3, 5, n))
    scene = Scene(
        position=position,
        velocity=np.where(fixed[:, None], 0.0, speed * draw.normal(size=(n, 2))),
        radius=radius,
        mass=mass,
        restitution=draw.random() if restitution is None else restitution,
        walls=walls,
        gravity=gravity(draw),
    )
    duration = float(draw.integers(1, 4))
    return Scenario(
        name=f"random_{layout}_{seed}_{number}",
        asks="Does it end, whatever meets, and is it the same for all who answer?",
        source="random",
        scene=scene,
        duration=duration,
        sample_interval=INTERVAL,
        substeps=(1, 2),
        thrusts=thrusts(draw, mass, duration),
        without_truth="nobody has asked for it",
        seed=seed,
    )


def gravity(draw: Draw) -> Array:
    kind, angle = draw.random(), draw.uniform(0, 2 * np.pi)
    if kind < 0.25:
        return np.zeros(2)
    if kind < 0.6:
        return np.array([0.0, -draw.choice([8.0, 9.81])])
    return draw.uniform(0.5, 10) * np.array([np.cos(angle), np.sin(angle)])


def thrusts(draw: Draw, mass: Array, duration: float) -> list[Thrust]:
    samples, found = round(duration / INTERVAL), []
    for _ in range(int(draw.integers(1, 4)) * int(draw.random() < 0.5)):
        disk = int(draw.choice(np.flatnonzero(np.isfinite(mass))))
        first, last = np.sort(draw.choice(samples + 1, 2, replace=False)).tolist()
        last = samples if draw.random() < 0.3 else last
        force = mass[disk] * draw.uniform(1, 12) * draw.normal(size=2)
        found.append(Thrust(disk, first * INTERVAL, last * INTERVAL, force))
    return found


def scattered(draw: Draw, walls: Array, count: int) -> tuple[Array, Array]:
    centres, radii = list[Array](), list[float]()
    for _ in range(MOST_TRIES):
        centre, radius = draw.uniform(-1.3, 1.3, 2), draw.uniform(0.08, 0.3)
        others = [np.hypot(*(centre - other)) - r for other, r in zip(centres, radii)]
        if min([*others, *distances(centre, walls)], default=np.inf) > radius + NEAREST:
            centres.append(centre)
            radii.append(radius)
        if len(radii) == count:
            break
    return np.array(centres), np.array(radii)


def lattice(draw: Draw, _walls: Array, count: int) -> tuple[Array, Array]:
    """The same of equal disks that fill places of a square lattice from the corner on, touching
    exactly."""
    radius = GRID * draw.choice([1, 2])
    places = np.array([(column, row) for row in range(2) for column in range(4)])
    share = np.array([8, 6, 4, 2, 4, 2, 1, 1]) / 28
    kept = places[np.sort(draw.choice(len(places), count, replace=False, p=share))]
    return np.array(CORNER) + radius * (2 * kept + 1), np.full(count, radius)


def distances(point: Array, walls: Array) -> list[float]:
    start, along = walls[:, 0], walls[:, 1] - walls[:, 0]
    share = np.clip(((point - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return np.hypot(*(point - start - share[:, None] * along).T).tolist()


CORNER = (-1.5, -1.25)


def toward(angle: Array | float) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def ring(corners: Array) -> Array:
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def tilted_box(draw: Draw) -> Array:
    """Right angles, but for rounding."""
    size = draw.uniform(1.6, 2.4)
    return ring(size * toward(draw.uniform(0, np.pi / 2) + np.pi / 2 * np.arange(4)))


def triangle(draw: Draw) -> Array:
    angle = draw.uniform(0, 2 * np.pi) + np.array([0.0, 2.0, 4.0])
    return ring(2.2 * toward(angle + draw.uniform(-0.7, 0.7, 3)))


def floor(draw: Draw) -> Array:
    along = toward(draw.choice([0.0, draw.uniform(-0.6, 0.6)]))
    return np.array([[[0.0, -1.4] - 3 * along, [0.0, -1.4] + 3 * along]])


def crossing(draw: Draw) -> Array:
    one = draw.uniform(0, np.pi)
    other = one + draw.choice([np.pi / 2, draw.uniform(0.3, 2.8)])
    place = draw.uniform(-0.4, 0.4, 2)
    ways = [2 * toward(angle) for angle in (one, other)]
    return np.array([[place - way, place + way] for way in ways])


def wedge(draw: Draw) -> Array:
    middle = draw.choice([np.pi / 2, draw.uniform(0, 2 * np.pi)])
    half, tip = draw.uniform(0.15, 1.4), -1.2 * toward(middle)
    return np.array([[tip, tip + 3 * toward(middle + side)] for side in (half, -half)])


LAYOUTS: dict[str, Callable[[Draw], Array]] = {
    "box": lambda _draw: box(CORNER, (1.75, 1.5)),
    "touching": lambda _draw: box(CORNER, (1.75, 1.5)),
    "tilted_box": tilted_box,
    "crossing": crossing,
    "wedge": wedge,
    "triangle": triangle,
    "floor": floor,
    "loose": lambda draw: draw.uniform(-1.6, 1.6, (int(draw.integers(2, 5)), 2, 2)),
    "open": lambda _draw: np.zeros((0, 2, 2)),
}
