"""Whether a disk is so fast that it can pass through another, or through a wall, between two steps,
and whether an engine caps its speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from adapters.run import Run
from reports.compare.comparison import Comparison
from scenarios.model import Array, Scenario, Scene

# of a speed: a smaller difference from a cap is rounding
ROUNDED = 1 - 1e-6
SPEED_CAP = "speed cap in m/s"  # the setting of engines that have one and tell it


def fast_note(comparison: Comparison) -> str:
    """A sentence on the step sizes at which a disk can pass through another, and on the engines
    that cap speeds below the scene's; "" if there is neither."""
    fastest = fastest_two(comparison)
    return " ".join(
        [*passing(comparison.scenario, fastest), *capped(comparison.runs, float(fastest.max()))]
    )


def can_pass(comparison: Comparison) -> bool:
    """Whether in the coarsest step a disk can pass through another, or through a wall."""
    return bool(passing(comparison.scenario, fastest_two(comparison)))


def passing(scenario: Scenario, fastest: Array) -> list[str]:
    """At most one sentence: the coarsest step size at which a disk can pass through another or a
    wall, and one at which it cannot."""
    dt = scenario.dt(min(scenario.substeps))
    ratio = step_displacement(scenario.scene, fastest, dt)
    if ratio <= 1.0:
        return []
    return [
        f"In a step of {plain(dt, 4)} s two disks, or a disk and a wall, can approach by"
        f" {plain(ratio, 2)} times the distance at which they touch. In an engine that tests for"
        " overlap at the end of a step one can pass through the other (tunnelling). With steps of"
        f" {plain(rounded_down(dt / ratio))} s it cannot."
    ]


def capped(runs: Sequence[Run], fastest: float) -> list[str]:
    """At most one sentence: the engines that kept disks slower than `fastest` m/s, at the coarsest
    step size at which one did."""
    caps: dict[float, list[str]] = {}
    for run in runs:
        cap = run.settings.get(SPEED_CAP, (None, None))[1]
        if run.status == "ok" and isinstance(cap, (int, float)) and cap < ROUNDED * fastest:
            caps.setdefault(run.dt, []).append(f"{run.name} {plain(cap)} m/s")
    if not caps:
        return []
    dt = max(caps)
    return [
        f"The fastest disk has {plain(fastest)} m/s; in steps of {plain(dt, 4)} s some engines"
        f" allow less: {', '.join(caps[dt])}."
    ]


def fastest_two(comparison: Comparison) -> Array:
    """(samples, 2) m/s: the two greatest speeds in the exact answer up to its horizon, the greatest
    last. Without an exact answer: those at the start, and in each run at the finest dt their
    greatest, of which the median engine counts."""
    if comparison.truth is not None:
        return two_greatest(comparison.truth.velocity)
    scenario = comparison.scenario
    finest = scenario.dt(max(scenario.substeps))
    ends = [
        two_greatest(run.trajectory.velocity).max(axis=0)
        for run in comparison.runs
        if run.status == "ok" and run.trajectory is not None and run.dt == finest
    ]
    start = two_greatest(scenario.scene.velocity[None])
    return np.vstack([start, np.median(ends, axis=0)]) if ends else start


def two_greatest(velocity: Array) -> Array:
    """(samples, 2) m/s: the two greatest speeds of (samples, n, 2) m/s; 0 first of a lone disk."""
    speed = np.linalg.norm(velocity, axis=-1)
    return np.sort(np.pad(speed, ((0, 0), (1, 0))), axis=1)[:, -2:]


def step_displacement(scene: Scene, fastest: Array, dt: float) -> float:
    """By how much two disks, or a disk and a wall, can at most approach in a step of `dt` s, over
    the distance of centre and centre, or wall, at which they touch; above 1 a centre can be past
    the other's before an overlap is seen.

    `fastest`: (samples, 2) m/s, as of `fastest_two`. An upper bound: the two fastest need not meet,
    nor be the smallest.
    """
    radii = np.sort(scene.radius)
    approach = [0.0]
    if scene.n > 1:
        approach.append(float(fastest.sum(axis=1).max() * dt / radii[:2].sum()))
    if len(scene.walls):
        approach.append(float(fastest[:, -1].max() * dt / radii[0]))
    return max(approach)


def plain(value: float, digits: int = 3) -> str:
    """To so many significant digits, without an exponent."""
    return np.format_float_positional(float(f"{value:.{digits}g}"), trim="-")


def rounded_down(value: float) -> float:
    """To one significant digit, downwards."""
    unit = 10.0 ** np.floor(np.log10(value))
    return float(np.floor(value / unit) * unit)
