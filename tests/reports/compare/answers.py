"""A scenario, its exact answer, and views of what was played, as `compare` makes them."""

from __future__ import annotations

from collections.abc import Sequence

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.view import View, beside, cut
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario, Scene, Trajectory
from crosscheck2d.scenarios.no_truth import answered


def truth_of(name: str) -> tuple[Scenario, Trajectory]:
    one, truth = answered(scenario(name))
    assert truth is not None
    return one, truth


def beside_truth(one: Scenario, dt: float, played: Trajectory, truth: Trajectory) -> View:
    return View(one, dt, cut(played, len(truth)), truth, jumps_of(truth, one))


def one_disk(
    position: Sequence[float],
    velocity: Sequence[float] = (0.0, 0.0),
    e: float = 1.0,
    **more: object,
) -> Scene:
    """A disk of 1 kg and 0.1 m, unless `more` says otherwise."""
    disk = {"position": [position], "velocity": [velocity], "radius": [0.1], "mass": [1.0]}
    return Scene(**(disk | {"restitution": e} | more))


def run_engine(one: Scenario, engine: str, substeps: int = 1) -> Run:
    return play(ENGINES[engine].make(), engine, one, one.dt(substeps))


def run_engines(one: Scenario, *engines: str) -> list[Run]:
    """At every step size of the scenario."""
    return [run_engine(one, engine, k) for engine in engines for k in one.substeps]


def run_alone(one: Scenario, engine: str, substeps: int = 1) -> View:
    """What an engine makes of a scenario, beside nothing but the laws."""
    return beside(one, run_engine(one, engine, substeps), None, None)
