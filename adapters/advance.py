"""Advances an engine by steps, with the thrusts that act in them; and how far a thrust that starts
or stops inside a step displaces a disk in every engine, because a force acts for whole steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import cos, sin
from time import perf_counter
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.scenarios.model import Array, Scenario, Thrust

ROUNDING = 1e-9  # of a step: what rounding of start / dt may leave


def advanced(engine: Engine, scenario: Scenario, substeps: int, dt: float) -> Iterator[float]:
    """A generator that advances a freshly loaded engine by one sample interval at a time; yields
    the seconds inside `step`.

    If calls of the engine are expensive, it may have a method `expect(count, times, thrusts)`,
    which is called first: `step(count)` will be called `times` times, with a `read` after each and
    without `apply_force`. The engine then applies the `thrusts`, rows of `Foreseen`, itself.
    """
    expect = getattr(engine, "expect", None)
    if expect is not None:
        foreseen, first = list[Foreseen](), 0
        for steps, acting in thrust_steps(scenario.thrusts, 0, scenario.intervals * substeps, dt):
            foreseen += [
                Foreseen(first, t.disk, (share * t.force).tolist(), share * t.torque, t.frame)
                for t, share in acting
            ]
            first += steps
        expect(substeps, scenario.intervals, foreseen)
    for k in range(scenario.intervals):
        if expect is not None:
            yield timed(engine, substeps)
        else:
            yield advance(engine, scenario, k * substeps, substeps, dt)


def advance(engine: Engine, scenario: Scenario, first: int, count: int, dt: float) -> float:
    """Advance `count` steps from number `first` with their thrusts; returns the s inside `step`."""
    seconds = 0.0
    for step, acting in thrust_steps(scenario.thrusts, first, count, dt):
        for thrust, share in acting:
            force, torque = world_force(thrust, engine) * share, thrust.torque * share
            engine.apply_force(thrust.disk, force, torque)
        seconds += timed(engine, step)
    return seconds


def timed(engine: Engine, count: int) -> float:
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


def thrust_steps(
    thrusts: Sequence[Thrust], first: int, count: int, dt: float
) -> Iterator[tuple[int, list[tuple[Thrust, float]]]]:
    """Split steps first .. first + count into (number of steps, active thrusts): single steps while
    a thrust is on, else one block.

    A force is scaled by the fraction of the step during which its thrust is on, so that its impulse
    is exact. It acts over all of the step: what that displaces a disk by is `off_grid`.
    """
    if not thrusts:
        yield count, []
        return
    free = 0
    for step in range(first, first + count):
        shares = [(t, min(t.stop / dt, step + 1) - max(t.start / dt, step)) for t in thrusts]
        if acting := [(t, share) for t, share in shares if share > ROUNDING]:
            if free:
                yield free, []
            yield 1, acting
            free = 0
        else:
            free += 1
    if free:
        yield free, []


def world_force(thrust: Thrust, engine: Engine) -> Array:
    # (2,) N in the world frame; a body-frame force is turned by the disk's angle at the start of
    # the step.
    if thrust.frame == "world":
        return thrust.force
    return turned(thrust.force, engine.read().angle[thrust.disk])


def turned(force: Array, angle: float) -> Array:
    x, y = force
    return np.array([cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y])


def onto_torus(x: float, low: float, high: float) -> float:
    """A coordinate; if it has left the box from `low` to `high`, on from the opposite edge."""
    return x if low <= x <= high else x - (x - low) // (high - low) * (high - low)


def off_grid(scenario: Scenario, dt: float) -> float:
    """Radii, the largest displacement of a disk by thrusts that start or stop inside a step of `dt`
    s; 0 if none does.

    The force in such a step is reduced so that its impulse is exact, and acts during the whole
    step. A thrust F that is on for a fraction p of the step moves a disk of mass m by F dt2 p2 / 2m
    from its start on, and by F dt2 (p - p2 / 2) / m up to its stop; spread over the step by F dt2 p
    / 2m. The difference is F dt2 p (1 - p) / 2m either way, up to F dt2 / 8m. It remains, grows
    with every later collision, and is not the engine's fault. A torque displaces the rim likewise.
    The magnitudes of a disk's displacements are added up.
    """
    shift = np.zeros(scenario.scene.n)
    for thrust in scenario.thrusts:
        scene, i = scenario.scene, thrust.disk
        rate = (
            np.linalg.norm(thrust.force) / (scene.mass[i] * scene.radius[i])
            + abs(thrust.torque) / scene.inertia[i]
        )
        ends = (thrust.start, thrust.stop)
        on = [(at / dt) % 1.0 for at in ends if at < scenario.duration]  # p, or 1 - p
        spread = sum(p * (1 - p) / 2 for p in on if ROUNDING < p < 1 - ROUNDING)
        shift[i] += rate * dt**2 * spread
    return float(shift.max())


def off_grid_note(scenario: Scenario) -> str:
    off = {dt: off_grid(scenario, dt) for dt in map(scenario.dt, scenario.substeps)}
    shifts = ", ".join(f"{r:.2g} radii at dt = {dt:.4g} s" for dt, r in off.items() if r)
    if not shifts:
        return ""
    return (
        f"a thrust starts or stops inside a step: every engine is off by up to {shifts}, and more"
        " after a collision"
    )
