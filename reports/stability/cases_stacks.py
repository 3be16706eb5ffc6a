"""Cases of disks that rest on each other, overlap, or do not fit; and of a ball that should come to
rest."""

from __future__ import annotations

from functools import partial
from math import sqrt

import numpy as np
from numpy.random import default_rng
from numpy.typing import ArrayLike

from crosscheck2d.reports.stability.cases_few import DT, RADIUS, SEEDS, G, disks, phase, scenario_of
from crosscheck2d.reports.stability.limits import RARELY, Case
from crosscheck2d.reports.stability.predicates import (
    BURSTS,
    EJECTED,
    NOT_AT_REST,
    STANDS,
    STILL_OVERLAP,
)
from crosscheck2d.scenarios.families.placing import box
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.closed_forms import at_rest

FLOOR = [[[-4, 0], [4, 0]]]


def column(count: int, mass: ArrayLike = 1.0) -> Scenario:
    y = RADIUS + 2 * RADIUS * np.arange(count)
    side, top = 1.05 * RADIUS, y[-1] + 2 * RADIUS
    walls = box([-side, 0], [side, top])
    scene = disks(np.stack([0 * y, y], -1), mass=mass, e=0.0, gravity=[0, -G], walls=walls)
    return scenario_of(scene, 2.0, DT, truth=lambda t: at_rest(scene, t))


def overlapping(x: float, _run: int) -> Scenario:
    scene = disks([[-(1 - x / 2) * RADIUS, 0], [(1 - x / 2) * RADIUS, 0]], e=0.0)
    return scenario_of(scene, 1.0, DT)


def overfull(x: float, _run: int) -> Scenario:
    # a hundred disks at rest on a lattice that cover x times the area of the box
    k = np.arange(100)
    size = np.array([10.5, 9 * sqrt(0.75) + 1])
    lattice = np.stack([k % 10 + 0.5 * (k // 10 % 2) + 0.5, sqrt(0.75) * (k // 10) + 0.5], -1)
    spacing = RADIUS * np.sqrt(100 * np.pi / x / size.prod())
    return scenario_of(disks(lattice * spacing, e=0.0, walls=box([0, 0], size * spacing)), 1.0, DT)


def last_bounce(height: float, e: float) -> float:
    """s, when a ball dropped from `height` m comes to rest (closed_forms.bouncing)."""
    return sqrt(2 * height / G) * (1 + e) / (1 - e)


def dropped(x: float, run: int) -> Scenario:
    # sampled for 1.5 times as long as it should bounce
    height = 1.0 + 0.1 * phase(run)
    until = 1.5 * last_bounce(height, 1 - x)
    samples = max(1, int(until / DT / 4))
    scene = disks([[0, RADIUS + height]], e=1 - x, gravity=[0, -G], walls=FLOOR)
    return scenario_of(scene, samples * 4 * DT, 4 * DT, 4)


def pile(x: float, run: int) -> Scenario:
    # the run is four times as long as one of the disks would bounce alone
    rng = default_rng(run)
    k = np.arange(12)
    position = np.stack([0.8 * (k % 3) - 0.8, 0.5 + 0.7 * (k // 3)], -1) + rng.uniform(
        -0.1, 0.1, (12, 2)
    )
    samples = int(last_bounce(2.5, 1 - x) / DT)
    scene = disks(position, e=1 - x, gravity=[0, -G], walls=box([-1.25, 0], [1.25, 8]))
    return scenario_of(scene, samples * 4 * DT, 4 * DT, 4, seed=run)


OVERLAPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99)
INELASTIC = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05)
overlap = partial(Case, scene=overlapping, parameter="overlap", values=OVERLAPS, unit="radii")
STACKS = (
    Case(
        "column",
        "How many disks can stand on each other between two walls?",
        lambda x, _run: column(int(x)),
        "disks",
        (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0),
        STANDS,
        whole=True,
        report="column_of_ten",
    ),
    Case(
        "heavy_on_light",
        "How heavy a disk can a disk of mass 1 carry?",
        lambda x, _run: column(2, [1.0, x]),
        "m2 / m1",
        (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4, 1e6, 1e8),
        STANDS,
    ),
    overlap(
        "overlap_energy",
        "From how deep an overlap on does an engine eject two disks at rest?",
        predicate=EJECTED,
    ),
    overlap(
        "overlap_recovery",
        "From how deep an overlap are two disks separated within a second?",
        predicate=STILL_OVERLAP,
    ),
    Case(
        "overfull_box",
        "How full may a box be before it bursts?",
        overfull,
        "area fraction",
        (0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.3, 1.5, 2.0),
        BURSTS,
        ratio=1.1,
    ),
    Case(
        "ball_comes_to_rest",
        "Up to which e does a ball come to rest when it should?",
        dropped,
        "1 - e",
        INELASTIC,
        NOT_AT_REST,
        runs=SEEDS,
    ),
    Case(
        "pile_comes_to_rest",
        "Up to which e does a pile of twelve disks come to rest?",
        pile,
        "1 - e",
        INELASTIC,
        NOT_AT_REST,
        runs=SEEDS,
        by_chance=RARELY,
        quick_values=INELASTIC[:7],
        ratio=1.1,
    ),
)
