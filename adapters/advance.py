"""Advances an engine by steps, with the thrusts that act during them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import cos, sin
from time import perf_counter
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.scenarios.model import Array, Scenario, Thrust


def advanced(engine: Engine, scenario: Scenario, substeps: int, dt: float) -> Iterator[float]:
    """A generator that advances a freshly loaded engine by one sample interval at a time; yields
    the seconds inside `step`.

    If calls of the engine are expensive, it may have a method `expect(count, times, thrusts)`,
    which is called first: `step(count)` will be called `times` times, with a `read` after each and
    without `apply_force`. The engine then applies the `thrusts`, rows of `Foreseen`, itself.
    """
    expect = getattr(engine, "expect", None)
    if expect is not None:
        steps = scenario.intervals * substeps
        expect(substeps, scenario.intervals, thrusts_by_step(scenario.thrusts, steps, dt))
    for k in range(scenario.intervals):
        if expect is not None:
            yield timed(engine, substeps)
        else:
            yield advance(engine, scenario, k * substeps, substeps, dt)


def advance(engine: Engine, scenario: Scenario, first: int, count: int, dt: float) -> float:
    """Advance `count` steps from step number `first` with the active thrusts; returns the seconds
    inside `step`."""
    seconds = 0.0
    for step, acting in thrust_steps(scenario.thrusts, first, count, dt):
        for thrust, share in acting:
            force, torque = world_force(thrust, engine) * share, thrust.torque * share
            engine.apply_force(thrust.disk, force, torque)
        seconds += timed(engine, step)
    return seconds


def timed(engine: Engine, count: int) -> float:
    """Advance `count` steps; returns the seconds inside `step`."""
    started = perf_counter()
    engine.step(count)
    return perf_counter() - started


class Foreseen(NamedTuple):
    """The effect of a thrust during one step."""

    step: int  # from 0
    disk: int
    force: list[float]  # N, in `frame`
    torque: float  # N m
    frame: str  # "world", or "body": turned by the angle of the disk at the start of the step


def thrusts_by_step(thrusts: Sequence[Thrust], count: int, dt: float) -> list[Foreseen]:
    """The forces and torques of all thrusts during the first `count` steps."""
    found, first = list[Foreseen](), 0
    for step, acting in thrust_steps(thrusts, 0, count, dt):
        found += [
            Foreseen(first, t.disk, (share * t.force).tolist(), share * t.torque, t.frame)
            for t, share in acting
        ]
        first += step
    return found


def thrust_steps(
    thrusts: Sequence[Thrust], first: int, count: int, dt: float
) -> Iterator[tuple[int, list[tuple[Thrust, float]]]]:
    """Split steps first .. first + count into (number of steps, active thrusts): single steps while
    a thrust is on, else one block.

    A force is scaled by the fraction of the step during which its thrust is on, so that its impulse
    is exact. It acts over all of the step: what that displaces a disk by is reported by
    thrust_grid.py.
    """
    if not thrusts:
        yield count, []
        return
    free = 0
    for step in range(first, first + count):
        shares = [(t, min(t.stop / dt, step + 1) - max(t.start / dt, step)) for t in thrusts]
        # smaller fractions are rounding of start / dt
        if acting := [(t, share) for t, share in shares if share > 1e-9]:
            if free:
                yield free, []
            yield 1, acting
            free = 0
        else:
            free += 1
    if free:
        yield free, []


def world_force(thrust: Thrust, engine: Engine) -> Array:
    """(2,) N in the world frame; a body-frame force is turned by the disk's angle at the start of
    the step."""
    if thrust.frame == "world":
        return thrust.force
    return turned(thrust.force, engine.read().angle[thrust.disk])


def onto_torus(x: float, low: float, high: float) -> float:
    """A coordinate; if it has left the box from `low` to `high`, on from the opposite edge."""
    return x if low <= x <= high else x - (x - low) // (high - low) * (high - low)


def turned(force: Array, angle: float) -> Array:
    """(2,) N, turned by `angle` rad."""
    x, y = force
    return np.array([cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y])
