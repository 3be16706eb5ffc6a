"""Whether a disk is so fast that it can pass through another, or through a wall, between two steps,
and whether an engine caps its speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.scenarios.model import Array, Scene

# of a speed: a smaller difference from a cap is rounding
ROUNDED = 1 - 1e-6
SPEED_CAP = "speed cap in m/s"  # the setting of engines that have one and tell it


def fast_note(comparison: Comparison) -> str:
    """A sentence on the step sizes at which a disk can pass through another, and on the engines
    that cap speeds below the scene's; "" if there is neither."""
    fastest = largest(comparison, lambda velocity: float(laws.lengths(velocity).max()))
    return " ".join([*passing(comparison), *capped(comparison.runs, fastest)])


def passing(comparison: Comparison) -> list[str]:
    """At most one sentence: the coarsest step size at which a disk can pass through another or a
    wall, and one at which it cannot."""
    scenario = comparison.scenario
    dt = scenario.dt(min(scenario.substeps))
    ratio = dt * largest(comparison, lambda velocity: approach(scenario.scene, velocity))
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


def largest(comparison: Comparison, of: Callable[[Array], float]) -> float:
    """The value of velocities (samples, n, 2) m/s in the exact answer up to its horizon. Without an
    exact answer: of those at the start, or of a run at the finest dt, of which the median engine
    counts; the larger."""
    if comparison.truth is not None:
        return of(comparison.truth.velocity)
    scenario = comparison.scenario
    finest = scenario.dt(max(scenario.substeps))
    runs = [
        of(run.trajectory.velocity)
        for run in comparison.runs
        if run.status == "ok" and run.trajectory is not None and run.dt == finest
    ]
    return max(of(scenario.scene.velocity[None]), float(np.median(runs)) if runs else 0.0)


def approach(scene: Scene, velocity: Array) -> float:
    """1/s, at most: how fast two disks, or a disk and a wall, approach at velocities (samples, n,
    2) m/s, over the distance of centre and centre, or wall, at which they touch. Times dt, above 1
    a centre can be past the other's before an overlap is seen.

    An upper bound: the two fastest need not meet, nor be the smallest. Along a wall a disk does not
    approach it.
    """
    radii, speeds = np.sort(scene.radius), np.sort(laws.lengths(velocity), axis=1)
    rates = [0.0]
    if scene.n > 1:
        rates.append(float(speeds[:, -2:].sum(axis=1).max() / radii[:2].sum()))
    for start, end in scene.walls:
        across = np.abs(laws.cross(velocity, end - start)) / laws.lengths(end - start)
        rates.append(float((across / scene.radius).max()))
    return max(rates)


def plain(value: float, digits: int = 3) -> str:
    """To so many significant digits, without an exponent."""
    return np.format_float_positional(float(f"{value:.{digits}g}"), trim="-")


def rounded_down(value: float) -> float:
    unit = 10.0 ** np.floor(np.log10(value))
    return float(np.floor(value / unit) * unit)
