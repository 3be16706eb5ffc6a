"""What is timed of an engine: a run through a scenario; and besides the overhead: a step of an
empty world, a call from Python, a read-out."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Stepping:
    """A run of an engine through a scenario. Building the scene is not timed; nothing is read, and
    no collisions are recorded."""

    make: Make
    scenario: Scenario
    substeps: int

    def __call__(self) -> Spent:
        """One run."""
        scenario, dt = self.scenario, self.scenario.dt(self.substeps)
        with closing(self.make()) as engine:
            engine.listening, engine.wrapping = False, 0.0
            engine.load(scenario.scene, dt)
            seconds = advance(engine, scenario, 0, scenario.intervals * self.substeps, dt)
            return Spent(seconds, engine.wrapping)


@dataclass(frozen=True)
class EmptySteps:
    """Steps of a world with one static disk, the least that every engine accepts: `EMPTY_STEPS` in
    one call of `step`, or if `singly`, `CALLS` of one step each."""

    make: Make
    dt: float
    singly: bool

    def __call__(self) -> Spent:
        """One run."""
        with closing(self.make()) as engine:
            engine.listening = False
            engine.load(empty_world(), self.dt)
            calls, count = (CALLS, 1) if self.singly else (1, EMPTY_STEPS)
            started = perf_counter()
            for _ in range(calls):
                engine.step(count)
            return Spent(perf_counter() - started)


@dataclass(frozen=True)
class ReadOuts:
    """`READS` read-outs of a scene after its first step, each after one more step: some engines
    cache what they have read."""

    make: Make
    scenario: Scenario

    def __call__(self) -> Spent:
        """One run."""
        seconds = 0.0
        with closing(self.make()) as engine:
            engine.listening = False
            engine.load(self.scenario.scene, self.scenario.dt(self.scenario.substeps[-1]))
            for _ in range(READS):
                engine.step(1)
                started = perf_counter()
                engine.read()
                seconds += perf_counter() - started
        return Spent(seconds)


def overheads(make: Make, scenario: Scenario) -> list[tuple[str, EmptySteps | ReadOuts, int]]:
    """(what, how to run it, count in a run) for everything that is timed beside the steps of an
    engine in a scenario."""
    dt = scenario.dt(scenario.substeps[-1])
    return [
        (EMPTY, EmptySteps(make, dt, singly=False), EMPTY_STEPS),
        (CALL, EmptySteps(make, dt, singly=True), CALLS),
        (READ, ReadOuts(make, scenario), READS),
    ]


def empty_world() -> Scene:
    """One static disk, and nothing that moves."""
    return lay_out(
        position=[[0, 0]], velocity=[[0, 0]], radius=[1.0], mass=[float("inf")], restitution=1.0
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
