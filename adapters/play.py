"""The one loop that plays a scenario on an engine."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace

from crosscheck2d.adapters.advance import advanced
from crosscheck2d.adapters.engine import Engine, NotStarted, Unsupported
from crosscheck2d.adapters.friction import Frictionless
from crosscheck2d.adapters.run import Run, collisions_of, fault_of, gather, reach, substeps_of
from crosscheck2d.scenarios.model import Scenario, State

Watch = Callable[[State], None]  # called with every valid sample


def unwatched(state: State) -> None:
    pass


def play_once(
    make: Callable[[], Engine], name: str, scenario: Scenario, dt: float, watch: Watch = unwatched
) -> Run:
    """`play` on a new engine, closed at the end; without its library the run is `unsupported`."""
    try:
        engine = make()
    except ImportError as missing:
        reason = f"{missing.name or missing} cannot be imported: {missing}"
        return replace(Run.unplayed(name, scenario, dt), status="unsupported", reason=reason)
    with closing(engine):
        return play(engine, name, scenario, dt, watch)


def play(engine: Engine, name: str, scenario: Scenario, dt: float, watch: Watch = unwatched) -> Run:
    """Play `scenario` in steps of `dt` s; `name` is `engine:profile`.

    A refusal, an exception or a runaway disk becomes the status of the run; its trajectory has the
    samples before that. Raises `ValueError` if dt does not divide the sample interval, and lets
    `MemoryError` and `NotStarted` pass, which are not the engine's fault.
    """
    substeps = substeps_of(scenario, dt)
    run, states, seconds = Run.unplayed(name, scenario, dt), list[State](), 0.0
    farthest = reach(scenario)
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
