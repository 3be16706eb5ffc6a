"""The one loop that plays a scenario on an engine, and the states from which it cannot go on."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace

import numpy as np

from crosscheck2d.adapters.advance import advanced
from crosscheck2d.adapters.engine import Engine, NotStarted, Unsupported
from crosscheck2d.adapters.friction import Frictionless
from crosscheck2d.adapters.run import Run, collisions_of, gather, substeps_of, unplayed_run
from crosscheck2d.scenarios.model import Scenario, State

# times the largest distance of free flight: a disk farther out was thrown by the engine
RUNAWAY = 1e3
Watch = Callable[[State], None]  # called with every valid sample


def unwatched(state: State) -> None:
    """The default `Watch`: do nothing."""


def play_once(
    make: Callable[[], Engine], name: str, scenario: Scenario, dt: float, watch: Watch = unwatched
) -> Run:
    """Run `play` on a new engine from `make`, which is always closed at the end.

    If its library cannot be imported, the run is `unsupported`. Raises what `play` raises.
    """
    try:
        engine = make()
    except ImportError as missing:
        reason = f"{missing.name or missing} cannot be imported: {missing}"
        return replace(unplayed_run(name, scenario, dt), status="unsupported", reason=reason)
    with closing(engine):
        return play(engine, name, scenario, dt, watch)


def play(engine: Engine, name: str, scenario: Scenario, dt: float, watch: Watch = unwatched) -> Run:
    """Play `scenario` in steps of `dt` s; `name` is `engine:profile`.

    A refusal, an exception or a runaway disk becomes the status of the run; its trajectory has the
    samples before that. Raises `ValueError` if dt does not divide the sample interval, and lets
    `MemoryError` and `NotStarted` pass, which are not the engine's fault.
    """
    substeps = substeps_of(scenario, dt)
    run, states, seconds = unplayed_run(name, scenario, dt), list[State](), 0.0
    farthest = RUNAWAY * reach(scenario)
    try:
        engine.load(scenario.scene, dt)
        run = replace(run, settings=engine.settings(), versions=engine.versions())
        states.append(engine.read())
        watch(states[0])
        for k, spent in enumerate(advanced(engine, scenario, substeps, dt)):
            seconds += spent
            state = engine.read()
            if fault := fault_of(state, farthest):
                reason = f"{fault} at {(k + 1) * scenario.sample_interval:g} s"
                run = replace(run, status="diverged", reason=reason)
                break
            states.append(state)
            watch(state)
    except Unsupported as refusal:
        frictionless = isinstance(refusal, Frictionless)
        status, reason = "unsupported", str(refusal)
        run = replace(run, status=status, reason=reason, frictionless=frictionless)
    except (MemoryError, NotStarted):
        raise
    except Exception as error:  # an engine may raise anything; the run records it
        status, reason = getattr(error, "status", "error"), f"{type(error).__name__}: {error}"
        run = replace(run, status=status, reason=reason)
    if states:
        collisions = collisions_of(engine, scenario.scene, dt)
        run = replace(run, trajectory=gather(scenario, states, collisions))
    return replace(run, seconds=seconds)


def reach(scenario: Scenario) -> float:
    """m from the origin, upper bound for free flight under gravity and thrust."""
    scene, duration = scenario.scene, scenario.duration
    thrust = sum(float(np.linalg.norm(t.force)) for t in scenario.thrusts) / scene.mass.min()
    start = max(
        np.abs(scene.position).max(), np.abs(scene.walls).max(initial=0.0), scene.radius.max()
    )
    return float(
        start
        + np.abs(scene.velocity).max() * duration
        + (np.linalg.norm(scene.gravity) + thrust) * duration * duration / 2
    )


def fault_of(state: State, farthest: float) -> str:
    """Why a run cannot continue from a state, or ""; `farthest` in m from the origin."""
    # Called after every sample, so sums of squares are tested first: they are finite only if every
    # number is.
    others = state.velocity, state.angle, state.angular_velocity
    if (
        np.vdot(state.position, state.position) <= farthest * farthest
        and sum(np.vdot(a, a) for a in others) < np.inf
    ):
        return ""
    for name in ("position", "velocity", "angle", "angular_velocity"):
        values = getattr(state, name)
        if not np.isfinite(values).all():
            return f"{name} of disk {int(np.argwhere(~np.isfinite(values))[0][0])} is not finite"
    if len(state.position) and (far := np.abs(state.position).max()) > farthest:
        return f"a disk is {far:.3g} m away"
    return ""
