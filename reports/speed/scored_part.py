"""The part of a scene that has an exact answer, on which engines are measured."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import NoTruth


class Scored(NamedTuple):
    """A scenario cut at the last sample before the horizon of its exact answer, and the answer up
    to there."""

    scenario: Scenario
    truth: Trajectory


@cache
def scored(scene: str, seed: int) -> Scored:
    """The part of a scene that has an exact answer.

    Raises:
        NoTruth: there is none, or it ends before the first sample.
    """
    scenario = open_scene(scene, seed)
    if scenario.truth is None:
        raise NoTruth(scenario.without_truth or "the scene comes without an exact answer")
    truth = scenario.truth(scenario.times)
    if len(truth) < 2:
        raise NoTruth(f"its exact answer ends at {truth.horizon:.3g} s, before the first sample")
    return Scored(replace(scenario, duration=(len(truth) - 1) * scenario.sample_interval), truth)


def reach_of(scene: str, seed: int) -> tuple[int, str]:
    """The number of sample intervals with an exact answer; 0 and the reason if there are none."""
    try:
        return scored(scene, seed).scenario.intervals, ""
    except NoTruth as refusal:
        return 0, str(refusal)
