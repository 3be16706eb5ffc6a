"""Cases of whole scenes: the largest usable dt of every scenario of the suite, and one quantity of
a user's scene file that is varied."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.stability.limits import Case
from crosscheck2d.reports.stability.predicates_usable import USABLE
from crosscheck2d.reports.stability.variants import WITH_FRICTION_ONLY
from crosscheck2d.scenarios.catalogue import RANDOM, SCENARIOS, scenario
from crosscheck2d.scenarios.files.scene_file import read_scene_file
from crosscheck2d.scenarios.model import (
    Array,
    Scenario,
    Scene,
    Thrust,
    Trajectory,
    frozen,
)
from crosscheck2d.scenarios.truth.exact import with_oracle

MOST_SAMPLES = 300  # samples at most
LONG = 2e4  # steps of a disk
SEEDS = 4  # runs at a value of a random scene


def in_steps(whole: Scenario, dt: float) -> Scenario:
    """The scenario with a step as near to `dt` s as its duration allows, sampled at most
    `MOST_SAMPLES` times."""
    steps = max(1, round(whole.duration / dt))
    every = -(-steps // MOST_SAMPLES)
    samples = -(-steps // every)
    return replace(whole, sample_interval=whole.duration / samples, substeps=(every,))


def at_dt(name: str, x: float, run: int) -> Scenario:
    """x = dt in s; the seed is the number of the run."""
    return in_steps(scenario(name, run), x)


def ladder(one: Scenario, an_octave: int = 1) -> tuple[float, ...]:
    """Step sizes in s, a fixed number for each factor of two, from an eighth of the sample
    interval to a tenth of the duration."""
    steps = [one.sample_interval * 2.0 ** (k / an_octave - 3) for k in range(23 * an_octave)]
    return tuple(dt for dt in steps if dt <= one.duration / 10)


def dense_ladder(one: Scenario) -> tuple[float, ...]:
    """Step sizes in s, as `ladder`, and from the sample interval on four for each factor of two
    (two where a run is long).

    In a scene without random numbers each dt puts the collisions at other places within their
    steps: failures appear at scattered step sizes, and only a dense scan finds the first. Finer
    steps seldom fail and cost most. Both forms scan the same step sizes.
    """
    steps = one.duration / one.sample_interval * 8
    close = ladder(one, 2 if one.scene.n * steps > LONG else 4)
    return tuple(sorted({*ladder(one), *(dt for dt in close if dt > one.sample_interval)}))


SUITE = tuple(
    Case(
        f"dt_{name}",
        partial(at_dt, name),
        "dt",
        dense_ladder(build()),
        USABLE,
        build().asks,
        unit="s",
        runs=SEEDS if name in RANDOM else 1,
        ratio=1.2,
        refines=False,
        report=name,
    )
    for name, build in SCENARIOS.items()
    if not build().scene.friction  # the kept limits are of the scenes without
)


def with_scene(one: Scenario, **fields: Any) -> Scenario:
    """The scenario with other fields of its scene, and the exact answer to that."""
    return with_oracle(replace(one, scene=replace(one.scene, **fields)))


def at_speed(one: Scenario, x: float) -> Scenario:
    """All initial velocities and spins times x."""
    velocity, spin = one.scene.velocity * x, one.scene.angular_velocity * x
    return with_scene(one, velocity=velocity, angular_velocity=spin)


def at_mass_ratio(one: Scenario, x: float) -> Scenario:
    """The mass of `heaviest` times x, and its inertia, and the thrusts on it."""
    scene, disk = one.scene, heaviest(one.scene)
    factor = np.where(np.arange(scene.n) == disk, x, 1.0)
    thrusts = [scaled_thrust(t, x, x) if t.disk == disk else t for t in one.thrusts]
    heavier = replace(one, thrusts=thrusts)
    return with_scene(heavier, mass=scene.mass * factor, inertia=scene.inertia * factor)


def heaviest(scene: Scene) -> int:
    """The heaviest disk that moves; of several the smallest, then the first by x and y, so that the
    order of the disks does not matter."""
    keys = (*scene.position.T[::-1], scene.radius, -scene.mass, scene.static)
    return int(np.lexsort(keys)[0])


def similar(one: Scenario, size: float = 1.0, shift: float = 0.0) -> Scenario:
    """The same motion, `size` times as large, and moved by `shift` m to the right.

    The exact answer is computed from that of the scene itself. It is exact except for the last
    digit of the scene's numbers; the oracle does not accept scenes whose scale is far from 1.
    """
    scene, truth, by = one.scene, one.truth, np.array([shift, 0.0])
    changed: Scene = replace(
        scene,
        position=scene.position * size + by,
        velocity=scene.velocity * size,
        radius=scene.radius * size,
        inertia=scene.inertia * size**2,
        walls=scene.walls * size + by,
        gravity=scene.gravity * size,
        wrap=None if scene.wrap is None else scene.wrap * size + by,
    )

    def answer(t: Array) -> Trajectory:
        assert truth is not None
        was = truth(t)
        return replace(
            was,
            position=was.position * size + by,
            velocity=was.velocity * size,
            error_bound=was.error_bound * size,
            collisions=replace(was.collisions, impulse=frozen(was.collisions.impulse * size)),
        )

    thrusts = [scaled_thrust(t, size, size**2) for t in one.thrusts]
    return replace(one, scene=changed, thrusts=thrusts, truth=None if truth is None else answer)


def scaled_thrust(thrust: Thrust, force: float, torque: float) -> Thrust:
    """The thrust times a factor."""
    return replace(thrust, force=thrust.force * force, torque=thrust.torque * torque)


FACTORS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1e3)


class Varied(NamedTuple):
    """What can be varied in a scene file: what a value means, its unit, the values to scan, and
    how the scene is changed."""

    parameter: str
    unit: str
    values: tuple[float, ...]
    change: Callable[[Scenario, float], Scenario]


VARIES = {
    "dt": Varied("dt", "s", (), in_steps),
    "speed": Varied(
        "start velocities and spins / the file's",
        "1",
        (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, *FACTORS),
        at_speed,
    ),
    "mass_ratio": Varied(
        "mass of the heaviest disk, times and divided by",
        "1",
        (*FACTORS, 1e4, 1e5, 1e6),
        at_mass_ratio,
    ),
    "restitution": Varied(
        "restitution",
        "1",
        (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0),
        lambda one, x: with_scene(one, restitution=x),
    ),
    "scale": Varied(
        "all lengths / the file's",
        "1",
        (1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, *FACTORS),
        lambda one, x: similar(one, size=x),
    ),
    "offset": Varied(
        "displacement of the whole scene to the right",
        "m",
        (*FACTORS, 1e4, 1e5, 1e6),
        lambda one, x: similar(one, shift=x),
    ),
}
"""What `--vary` takes, and what it means."""


def varied(path: str, what: str, x: float, run: int) -> Scenario:
    """The scene of a file at the middle step of its ladder, with one quantity varied; in run 1 the
    other way: divided by x."""
    one = read_scene_file(Path(path))
    if what == "dt":
        return in_steps(one, x)
    return replace(VARIES[what].change(one, 1 / x if run else x), substeps=(one.middle_substeps,))


def cannot_vary(one: Scenario, what: str) -> str:
    """Why this cannot be varied in a scene, as the end of a sentence; "" if it can."""
    if what == "mass_ratio" and one.scene.static.all():
        return "no disk moves, so that none can be made heavier"
    if what == "dt" and not ladder(one):
        return (
            "it lasts less than ten steps of an eighth of its sample_interval, the finest that"
            " would be tried"
        )
    return ""


@cache
def case_of_file(path: str, what: str) -> Case:
    """The case: up to which value is the scene of this file usable?"""
    one = read_scene_file(Path(path))
    meant, parameter = VARIES[what], VARIES[what].parameter
    if what == "mass_ratio":
        parameter = parameter.replace("the heaviest disk", f"disk {heaviest(one.scene)}")
    if what != "dt":
        parameter += f", at dt = {number(one.dt(one.middle_substeps))} s"
    return Case(
        f"{path}:{what}",
        partial(varied, path, what),
        parameter,
        meant.values or dense_ladder(one),
        USABLE,
        f"{one.name}: {one.asks}",
        meant.unit,
        runs=2 if what == "mass_ratio" else 1,
        also=WITH_FRICTION_ONLY if one.scene.friction else (),
    )
