"""The part of a scene that has an exact answer, on which engines are measured; from its beginning,
or from where it is a fraction of a step later."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.scenarios.model import Array, Collisions, Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import NoTruth

STARTS = 20  # of a run, evenly spread over a step


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


def starts_within_a_step(scene: str, seed: int, dt: float) -> Iterator[tuple[float, Scored]]:
    """(s, the scored part from there on) for `STARTS` instants of the first step of `dt` s.

    Each begins in the exact state of its instant, so that every collision falls into another part
    of its step. It has one sample interval less, unless there is only one.
    """
    scenario, _ = scored(scene, seed)
    answer, intervals = scenario.truth, max(scenario.intervals - 1, 1)
    assert answer is not None
    for begin in (dt * (np.arange(STARTS) + 0.5) / STARTS).tolist():
        state = answer(np.array([begin])).at(0)
        fields = ("position", "velocity", "angle", "angular_velocity")
        thrusts = [
            replace(thrust, start=max(thrust.start - begin, 0.0), stop=thrust.stop - begin)
            for thrust in scenario.thrusts
            if thrust.stop > begin
        ]
        part = replace(
            scenario,
            scene=replace(scenario.scene, **{name: getattr(state, name) for name in fields}),
            duration=intervals * scenario.sample_interval,
            thrusts=thrusts,
            truth=partial(later, answer, begin),
        )
        yield begin, Scored(part, later(answer, begin, part.times))


def later(answer: Callable[[Array], Trajectory], begin: float, times: Array) -> Trajectory:
    """An exact answer whose time begins at `begin` s of another."""
    truth = answer(times + begin)
    after = truth.collisions.t > begin
    t, i, j, impulse = (
        getattr(truth.collisions, name)[after] for name in ("t", "i", "j", "impulse")
    )
    return replace(
        truth,
        t=truth.t - begin,
        collisions=Collisions(t - begin, i, j, impulse),
        horizon=truth.horizon - begin,
    )
