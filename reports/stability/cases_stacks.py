"""Cases of disks that rest on each other, overlap, or do not fit; and of a ball that should come to
rest."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.random import default_rng

from crosscheck2d.reports.stability.limits import RARELY, Case
from crosscheck2d.reports.stability.phases import phase
from crosscheck2d.reports.stability.predicates_crowds import (
    BURSTS,
    EJECTED,
    NOT_AT_REST,
    STANDS,
    STILL_OVERLAP,
)
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.closed_forms import at_rest

RADIUS, G, DT = 0.25, 10.0, 1 / 64
FLOOR = [[[-4, 0], [4, 0]]]


def column(count: int, mass: np.ndarray) -> Scenario:
    """Disks exactly above each other between two walls, 2 s."""
    y = RADIUS + 2 * RADIUS * np.arange(count)
    side, top = 1.05 * RADIUS, y[-1] + 2 * RADIUS
    scene = lay_out(
        position=np.stack([0 * y, y], -1),
        velocity=np.zeros((count, 2)),
        radius=np.full(count, RADIUS),
        mass=mass,
        restitution=0.0,
        gravity=[0, -G],
        walls=box([-side, 0], [side, top]),
    )
    return Scenario(
        "column",
        "Does it stand?",
        "equilibrium",
        scene,
        2.0,
        DT,
        (1,),
        truth=lambda t: at_rest(scene, t),
    )


def column_of(x: float, _run: int) -> Scenario:
    """x equal disks."""
    return column(int(x), np.ones(int(x)))


def heavy_on_light(x: float, _run: int) -> Scenario:
    """A disk of mass x on one of mass 1."""
    return column(2, np.array([1.0, x]))


def overlapping(x: float, _run: int) -> Scenario:
    """Two disks at rest that overlap by x radii, e = 0, 1 s."""
    scene = lay_out(
        position=[[-(1 - x / 2) * RADIUS, 0], [(1 - x / 2) * RADIUS, 0]],
        velocity=np.zeros((2, 2)),
        radius=[RADIUS, RADIUS],
        mass=[1.0, 1.0],
        restitution=0.0,
    )
    return Scenario(
        "overlapping", "Are they separated gently?", "no start of a scene", scene, 1.0, DT, (1,)
    )


def overfull(x: float, _run: int) -> Scenario:
    """A hundred disks at rest on a lattice in a box, x times its area, e = 0, 1 s."""
    k = np.arange(100)
    size = np.array([10.5, 9 * sqrt(0.75) + 1])
    lattice = np.stack([k % 10 + 0.5 * (k // 10 % 2) + 0.5, sqrt(0.75) * (k // 10) + 0.5], -1)
    spacing = RADIUS * np.sqrt(100 * np.pi / x / size.prod())
    scene = lay_out(
        position=lattice * spacing,
        velocity=np.zeros((100, 2)),
        radius=np.full(100, RADIUS),
        mass=np.ones(100),
        restitution=0.0,
        walls=box([0, 0], size * spacing),
    )
    return Scenario("overfull", "Does it burst?", "no start of a scene", scene, 1.0, DT, (1,))


def last_bounce(height: float, e: float) -> float:
    """s, when a ball dropped from `height` m comes to rest (closed_forms.bouncing)."""
    return sqrt(2 * height / G) * (1 + e) / (1 - e)


def dropped(x: float, run: int) -> Scenario:
    """A ball with e = 1 - x is dropped from 1 m to 1.1 m and sampled for 1.5 times as long as it
    should bounce."""
    height = 1.0 + 0.1 * phase(run)
    until = 1.5 * last_bounce(height, 1 - x)
    samples = max(1, int(until / DT / 4))
    scene = lay_out(
        position=[[0, RADIUS + height]],
        velocity=[[0, 0]],
        radius=[RADIUS],
        mass=[1.0],
        restitution=1 - x,
        gravity=[0, -G],
        walls=FLOOR,
    )
    return Scenario(
        "dropped",
        "Does it come to rest?",
        "the bouncing ball in closed form",
        scene,
        samples * 4 * DT,
        4 * DT,
        (4,),
    )


def pile(x: float, run: int) -> Scenario:
    """Twelve disks with e = 1 - x fall into a box; the run is four times as long as one of them
    would bounce alone."""
    rng = default_rng(run)
    k = np.arange(12)
    position = np.stack([0.8 * (k % 3) - 0.8, 0.5 + 0.7 * (k // 3)], -1) + rng.uniform(
        -0.1, 0.1, (12, 2)
    )
    samples = int(last_bounce(2.5, 1 - x) / DT)
    scene = lay_out(
        position=position,
        velocity=np.zeros((12, 2)),
        radius=np.full(12, RADIUS),
        mass=np.ones(12),
        restitution=1 - x,
        gravity=[0, -G],
        walls=box([-1.25, 0], [1.25, 8]),
    )
    return Scenario(
        "pile",
        "Does it come to rest?",
        "energy can only fall",
        scene,
        samples * 4 * DT,
        4 * DT,
        (4,),
        seed=run,
    )


SEEDS = 16  # runs at a value
INELASTIC = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05)
OVERLAPS = ("overlap", (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99), overlapping)

STACKS = (
    Case(
        "column",
        "How many disks can stand on each other between two walls?",
        "disks",
        (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0),
        column_of,
        STANDS,
        whole=True,
        report="column_of_ten",
    ),
    Case(
        "heavy_on_light",
        "How heavy a disk can a disk of mass 1 carry?",
        "m2 / m1",
        (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4, 1e6, 1e8),
        heavy_on_light,
        STANDS,
    ),
    Case(
        "overlap_energy",
        "From how deep an overlap on does an engine eject two disks at rest?",
        *OVERLAPS,
        EJECTED,
        unit="radii",
    ),
    Case(
        "overlap_recovery",
        "From how deep an overlap are two disks separated within a second?",
        *OVERLAPS,
        STILL_OVERLAP,
        unit="radii",
    ),
    Case(
        "overfull_box",
        "How full may a box be before it bursts?",
        "area fraction",
        (0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.3, 1.5, 2.0),
        overfull,
        BURSTS,
        ratio=1.1,
    ),
    Case(
        "ball_comes_to_rest",
        "Up to which e does a ball come to rest when it should?",
        "1 - e",
        INELASTIC,
        dropped,
        NOT_AT_REST,
        runs=SEEDS,
    ),
    Case(
        "pile_comes_to_rest",
        "Up to which e does a pile of twelve disks come to rest?",
        "1 - e",
        INELASTIC,
        pile,
        NOT_AT_REST,
        runs=SEEDS,
        by_chance=RARELY,
        quick_values=INELASTIC[:7],
        ratio=1.1,
    ),
)
