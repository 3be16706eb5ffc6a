"""What is timed of an engine: a run through a scenario; and besides the overhead: a step of an
empty world, a call from Python, a read-out."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from functools import partial
from time import perf_counter
from typing import NamedTuple

from crosscheck2d.adapters.advance import advance, thrust_steps
from crosscheck2d.adapters.engine import Engine
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario, Scene

Make = Callable[[], Engine]
EMPTY_STEPS, CALLS, READS = 1000, 100, 20  # of one run
EMPTY, CALL, READ = "empty step", "call", "read"


class Spent(NamedTuple):
    """Seconds inside `step`, and those of them spent on wrapping at the edges in Python."""

    seconds: float
    wrapping: float = 0.0


def step_through(make: Make, scenario: Scenario, substeps: int) -> Spent:
    """A run of an engine through a scenario. Building the scene is not timed; nothing is read, and
    no collisions are recorded."""
    dt = scenario.dt(substeps)
    with closing(make()) as engine:
        engine.listening, engine.wrapping = False, 0.0
        engine.load(scenario.scene, dt)
        seconds = advance(engine, scenario, 0, scenario.intervals * substeps, dt)
        return Spent(seconds, engine.wrapping)


def empty_steps(make: Make, dt: float, calls: int, count: int) -> Spent:
    """Calls of `step`, each of `count` steps, of a world with one static disk, the least that every
    engine accepts."""
    with closing(make()) as engine:
        engine.listening = False
        engine.load(empty_world(), dt)
        started = perf_counter()
        for _ in range(calls):
            engine.step(count)
        return Spent(perf_counter() - started)


def read_outs(make: Make, scenario: Scenario) -> Spent:
    """`READS` read-outs of a scene after its first step, each after one more step: some engines
    cache what they have read."""
    seconds = 0.0
    with closing(make()) as engine:
        engine.listening = False
        engine.load(scenario.scene, scenario.dt(scenario.substeps[-1]))
        for _ in range(READS):
            engine.step(1)
            started = perf_counter()
            engine.read()
            seconds += perf_counter() - started
    return Spent(seconds)


def overheads(make: Make, scenario: Scenario) -> list[tuple[str, Callable[[], Spent], int]]:
    """(what, how to run it, count in a run) for everything that is timed beside the steps of an
    engine in a scenario."""
    dt = scenario.dt(scenario.substeps[-1])
    return [
        (EMPTY, partial(empty_steps, make, dt, 1, EMPTY_STEPS), EMPTY_STEPS),
        (CALL, partial(empty_steps, make, dt, CALLS, 1), CALLS),
        (READ, partial(read_outs, make, scenario), READS),
    ]


def empty_world() -> Scene:
    return lay_out(
        position=[[0, 0]],
        radius=1.0,
        mass=float("inf"),
    )


def binding_of(step: float, singly: float, scenario: Scenario, substeps: int) -> float:
    """s per simulated second that the steps and calls of an empty world take, if an empty step
    takes `step` s in a call of many steps, and `singly` s in a call of one."""
    steps, calls = rates(scenario, substeps)
    return step * steps + max(singly - step, 0.0) * calls


def rates(scenario: Scenario, substeps: int) -> tuple[float, float]:
    """Number of steps, and of calls of `step`, in a simulated second of the scenario. One call
    takes many steps, except while a thrust acts."""
    steps = scenario.intervals * substeps
    calls = sum(1 for _ in thrust_steps(scenario.thrusts, 0, steps, scenario.dt(substeps)))
    return steps / scenario.duration, calls / scenario.duration
