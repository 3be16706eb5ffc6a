"""The one loop that plays a scenario on an engine."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import replace

from adapters.advance import advance
from adapters.engine import Engine, NotStarted, Unsupported
from adapters.first_collisions import collisions_of
from adapters.run import Run, gather, run_of, substeps_of
from adapters.runaway import RUNAWAY, fault_of, reach
from scenarios.model import Scenario, State

Watch = Callable[[State], None]  # is given every good sample as soon as it is there


def unwatched(state: State) -> None:
    """Do nothing with a sample."""


def play_once(
    make: Callable[[], Engine], name: str, scenario: Scenario, dt: float, watch: Watch = unwatched
) -> Run:
    """`play` on a new engine, made by `make`, which is closed again whatever happens.

    A library that is missing is a refusal, with its name. Raises what `play` raises.
    """
    try:
        engine = make()
    except ImportError as missing:
        reason = f"{missing.name or missing} cannot be imported: {missing}"
        return replace(run_of(name, scenario, dt), status="unsupported", reason=reason)
    with closing(engine):
        return play(engine, name, scenario, dt, watch)


def play(engine: Engine, name: str, scenario: Scenario, dt: float, watch: Watch = unwatched) -> Run:
    """Play `scenario` in steps of `dt` s; `name` is `engine:profile`.

    Refusals, exceptions and runaways become the run's status, and what was played before them its
    trajectory. Raises `ValueError` if dt does not divide the sample interval, `MemoryError`, and
    `NotStarted`: of the latter two no engine is the cause.
    """
    substeps = substeps_of(scenario, dt)
    run, states, seconds = run_of(name, scenario, dt), list[State](), 0.0
    farthest = RUNAWAY * reach(scenario)
    try:
        engine.load(scenario.scene, dt)
        run = replace(run, settings=engine.settings(), versions=engine.versions())
        states.append(engine.read())
        watch(states[0])
        for k in range(scenario.intervals):
            seconds += advance(engine, scenario, k * substeps, substeps, dt)
            state = engine.read()
            if fault := fault_of(state, farthest):
                reason = f"{fault} at {(k + 1) * scenario.sample_interval:g} s"
                run = replace(run, status="diverged", reason=reason)
                break
            states.append(state)
            watch(state)
    except Unsupported as refusal:
        run = replace(run, status="unsupported", reason=str(refusal))
    except (MemoryError, NotStarted):
        raise
    except Exception as error:  # an engine may raise anything; the run says what
        status, reason = getattr(error, "status", "error"), f"{type(error).__name__}: {error}"
        run = replace(run, status=status, reason=reason)
    if states:
        collisions = collisions_of(engine, scenario.scene, dt)
        run = replace(run, trajectory=gather(scenario, states, collisions))
    return replace(run, seconds=seconds)
