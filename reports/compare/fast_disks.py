"""Whether a disk is so fast that it can pass through another, or through a wall, between two steps,
and whether an engine caps its speed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.scenarios.model import Array, Scene

# of a speed: a smaller difference from a cap is rounding
ROUNDED = 1 - 1e-6
SPEED_CAP = "speed cap in m/s"  # the setting of engines that have one and tell it


def fast_note(comparison: Comparison) -> str:
    """Sentences on the coarsest step size at which a disk can pass through another or a wall, and
    on the engines that keep disks below the scene's largest speed; "" if there is neither."""
    scenario, sentences = comparison.scenario, []
    dt = scenario.dt(min(scenario.substeps))
    ratio = dt * largest(comparison, lambda velocity: approach(scenario.scene, velocity))
    if ratio > 1.0:
        sentences.append(
            f"In a step of {plain(dt, 4)} s two disks, or a disk and a wall, can approach by"
            f" {plain(ratio, 2)} times the distance at which they touch. In an engine that tests"
            " for overlap at the end of a step one can pass through the other (tunnelling). With"
            f" steps of {plain(rounded_down(dt / ratio))} s it cannot."
        )
    fastest = largest(comparison, lambda velocity: float(laws.lengths(velocity).max()))
    caps: dict[float, list[str]] = {}
    for run in comparison.runs:
        cap = run.settings.get(SPEED_CAP, (None, None))[1]
        if run.status == "ok" and isinstance(cap, (int, float)) and cap < ROUNDED * fastest:
            caps.setdefault(run.dt, []).append(f"{run.name} {plain(cap)} m/s")
    if caps:
        sentences.append(
            f"The fastest disk has {plain(fastest)} m/s; in steps of {plain(max(caps), 4)} s some"
            f" engines allow less: {', '.join(caps[max(caps)])}."
        )
    return " ".join(sentences)


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
