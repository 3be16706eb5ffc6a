"""Cases of many disks: they rest on each other, overlap, do not fit, or should come to rest; a gas
in a box at e = 1: energy, temperature, pressure, collision rate, and what it remembers (the gas of
hard disks: Alder & Wainwright, J. Chem. Phys. 31, 459, 1959)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import ArrayLike

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.stability.cases_few import (
    DT,
    RADIUS,
    G,
    phase,
    scenario_of,
)
from crosscheck2d.reports.stability.limits import DrivenEngine, played
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Array, Collisions, Scenario, Scene, Trajectory, frozen
from crosscheck2d.scenarios.truth.closed_forms import at_rest

FLOOR = [[[-4, 0], [4, 0]]]


def column(count: int, mass: ArrayLike = 1.0) -> Scenario:
    y = RADIUS + 2 * RADIUS * np.arange(count)
    side, top = 1.05 * RADIUS, y[-1] + 2 * RADIUS
    walls = box([-side, 0], [side, top])
    scene = lay_out(
        np.stack([0 * y, y], -1), mass=mass, restitution=0.0, gravity=[0, -G], walls=walls
    )
    return scenario_of(scene, 2.0, DT, truth=lambda t: at_rest(scene, t))


def overlapping(x: float, _run: int) -> Scenario:
    scene = lay_out([[-(1 - x / 2) * RADIUS, 0], [(1 - x / 2) * RADIUS, 0]], restitution=0.0)
    return scenario_of(scene, 1.0, DT)


def overfull(x: float, _run: int) -> Scenario:
    # a hundred disks at rest on a lattice that cover x times the area of the box
    k = np.arange(100)
    size = np.array([10.5, 9 * sqrt(0.75) + 1])
    lattice = np.stack([k % 10 + 0.5 * (k // 10 % 2) + 0.5, sqrt(0.75) * (k // 10) + 0.5], -1)
    spacing = RADIUS * np.sqrt(100 * np.pi / x / size.prod())
    return scenario_of(
        lay_out(lattice * spacing, restitution=0.0, walls=box([0, 0], size * spacing)), 1.0, DT
    )


def last_bounce(height: float, e: float) -> float:
    """s, when a ball dropped from `height` m comes to rest (closed_forms.bouncing)."""
    return sqrt(2 * height / G) * (1 + e) / (1 - e)


def dropped(x: float, run: int) -> Scenario:
    # sampled for 1.5 times as long as it should bounce
    height = 1.0 + 0.1 * phase(run)
    until = 1.5 * last_bounce(height, 1 - x)
    samples = max(1, int(until / DT / 4))
    scene = lay_out([[0, RADIUS + height]], restitution=1 - x, gravity=[0, -G], walls=FLOOR)
    return scenario_of(scene, samples * 4 * DT, 4 * DT, 4)


def pile(x: float, run: int) -> Scenario:
    # the run is four times as long as one of the disks would bounce alone
    rng = default_rng(run)
    k = np.arange(12)
    position = np.stack([0.8 * (k % 3) - 0.8, 0.5 + 0.7 * (k // 3)], -1) + rng.uniform(
        -0.1, 0.1, (12, 2)
    )
    samples = int(last_bounce(2.5, 1 - x) / DT)
    scene = lay_out(position, restitution=1 - x, gravity=[0, -G], walls=box([-1.25, 0], [1.25, 8]))
    return scenario_of(scene, samples * 4 * DT, 4 * DT, 4, seed=run)


GAS_DT = 1 / 240
STEP = 0.04  # of a radius: how far a disk of mean energy moves in a step
STATE = ("position", "velocity", "angle", "angular_velocity")


def gas(
    packing: float,
    seed: int,
    *,
    rows: int = 6,
    columns: int = 6,
    steps: int = 500,
    every: int = 10,
    step: float = STEP,
    mass: ArrayLike = 1.0,
) -> Scenario:
    """Disks of radius 0.25 m on a triangular lattice in a box that they fill to `packing`, with
    velocities from Maxwell's distribution.

    kT is such that a disk of mass 1 at the root mean square speed flies `step` radii in a step.
    """
    n, rng = rows * columns, default_rng(seed)
    radius, masses = np.full(n, RADIUS), np.broadcast_to(np.asarray(mass, float), n)
    row, column = divmod(np.arange(n), columns)
    lattice = np.stack([column + 0.5 * (row % 2) + 0.5, np.sqrt(0.75) * row + 0.5], -1)
    size = np.array([columns + 0.5, np.sqrt(0.75) * (rows - 1) + 1])
    spacing = np.sqrt(np.pi * (radius**2).sum() / packing / size.prod())
    velocity = maxwell(rng, masses, step * RADIUS / GAS_DT)
    walls = box([0, 0], size * spacing)
    scene = lay_out(lattice * spacing, velocity, mass=masses, walls=walls)
    return scenario_of(scene, steps * GAS_DT, every * GAS_DT, every, seed=seed)


def maxwell(rng: Generator, mass: Array, speed: float) -> Array:
    """(n, 2) m/s, random, then scaled so that the disks of each mass have exactly the same
    temperature and those of mass 1 the rms `speed`."""
    velocity = rng.normal(size=(len(mass), 2))
    for kind in np.unique(mass):
        same = mass == kind
        velocity[same] *= speed / np.sqrt(kind * (velocity[same] ** 2).sum(axis=1).mean())
    return velocity


def long_run(x: float, run: int) -> Scenario:
    return gas(0.3, run, rows=5, columns=4, steps=int(x), every=int(x) // 50)


def wrapped_run(x: float, run: int) -> Scenario:
    # in a box that wraps as the exercise's does: there is no wall that could change the momentum
    boxed = long_run(x, run)
    scene = boxed.scene
    corners = np.stack([scene.walls.min(axis=(0, 1)), scene.walls.max(axis=(0, 1))])
    return replace(boxed, scene=replace(scene, walls=np.zeros((0, 2, 2)), wrap=corners))


def mixture(x: float, run: int) -> Scenario:
    return gas(0.3, run, mass=np.where(np.arange(36) % 2, x, 1.0), steps=2000, every=4)


def steps_of_gas(x: float, run: int) -> Scenario:
    # sampled at most fifty times
    every = max(1, int(x) // 50)
    return gas(0.3, run, steps=int(x) // every * every, every=every)


def against(first: Run, run: Run, scenario: Scenario) -> tuple[Scenario, Run]:
    if first.status != "ok" or first.trajectory is None:
        return scenario, first
    instead: Trajectory = first.trajectory
    return replace(scenario, truth=lambda _: instead), run


def reversed_order(driven: DrivenEngine, scenario: Scenario) -> tuple[Scenario, Run]:
    scene = scenario.scene
    fields = {name: getattr(scene, name)[::-1] for name in (*STATE, "radius", "mass", "inertia")}
    run = played(driven, replace(scenario, scene=replace(scene, **fields)))
    if run.trajectory is not None:  # disk i is renamed n - 1 - i
        n, met = scene.n, run.trajectory.collisions
        i, j = n - 1 - met.i, np.where(met.j < 0, met.j, n - 1 - met.j)
        low, high = np.where(j < 0, i, np.minimum(i, j)), np.where(j < 0, j, np.maximum(i, j))
        collisions = Collisions(met.t, frozen(low, np.int64), frozen(high, np.int64), met.impulse)
        state = {name: getattr(run.trajectory, name)[:, ::-1] for name in STATE}
        run = replace(run, trajectory=replace(run.trajectory, **state, collisions=collisions))
    return against(played(driven, scenario), run, scenario)


def restarted(driven: DrivenEngine, scenario: Scenario) -> tuple[Scenario, Run]:
    whole = played(driven, scenario)
    if whole.status != "ok" or whole.trajectory is None:
        return scenario, whole
    before, half, interval = whole.trajectory, scenario.intervals // 2, scenario.sample_interval
    state = before.at(half)
    fresh: Scene = replace(scenario.scene, **{name: getattr(state, name) for name in STATE})
    duration = (scenario.intervals - half) * interval
    rest = played(driven, replace(scenario, scene=fresh, duration=duration))
    if rest.status != "ok" or rest.trajectory is None:
        return scenario, rest
    after, late = rest.trajectory, rest.trajectory.collisions
    parts: dict[str, Any] = {
        name: frozen(np.concatenate([getattr(before, name)[:half], getattr(after, name)]))
        for name in STATE
    }
    collisions = Collisions(frozen(late.t + half * interval), late.i, late.j, late.impulse)
    joined = replace(before, **parts, collisions=collisions)
    return against(whole, replace(rest, trajectory=joined), scenario)


SCENES: dict[str, Callable[[float, int], Scenario]] = {
    "column": lambda x, _run: column(int(x)),
    "heavy_on_light": lambda x, _run: column(2, [1.0, x]),
    "overlap_energy": overlapping,
    "overlap_recovery": overlapping,
    "overfull_box": overfull,
    "ball_comes_to_rest": dropped,
    "pile_comes_to_rest": pile,
    "dense_gas": lambda x, run: gas(x, run, rows=10, columns=10, steps=200),
    "fast_gas": lambda x, run: gas(0.3, run, step=x, steps=300),
    "long_gas": long_run,
    "long_wrapped_gas": wrapped_run,
    # among 35 of mass 1
    "heavy_in_gas": lambda x, run: gas(0.3, run, mass=np.where(np.arange(36) == 14, x, 1.0)),
    "equipartition": mixture,
    # sampled more often than a disk collides
    "thermometer": lambda x, run: gas(x, run, rows=10, columns=10, steps=4000, every=20),
    "insertion_order": steps_of_gas,
    "restart": steps_of_gas,
}
