"""A scenario, its exact answer, and a view of something played beside it, as `compare` makes it."""

from __future__ import annotations

from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.view import View, cut
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import answered


def truth_of(name: str) -> tuple[Scenario, Trajectory]:
    one, truth = answered(scenario(name))
    assert truth is not None
    return one, truth


def beside_truth(one: Scenario, dt: float, played: Trajectory, truth: Trajectory) -> View:
    return View(one, dt, cut(played, len(truth)), truth, jumps_of(truth, one))
