"""Plays one engine in one scene at several step sizes: its errors in one pass, its times in
another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from adapters.play import play_once
from reports.compare import laws
from reports.run.scenes import open_scene
from reports.run.stepping import Make, Stepping, overheads
from reports.run.timing import Sample, Timed, interleaved
from reports.run.timing_pass import can
from scenarios.model import Scenario, Trajectory
from scenarios.no_truth import NoTruth


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


def errors_of(
    scene: str, seed: int, name: str, make: Make, ladder: Sequence[int]
) -> list[dict[str, Any]]:
    """A row for each step size of `ladder` (coarse to fine): the error of engine `name` in the
    scene, up to the horizon.

    until_s is the horizon, where the run ends, and duration_s the duration of the scene.
    error_radii is the largest distance of any disk from the exact answer, inf where the run failed;
    change_radii the largest distance from the run at the next coarser step size, nan if either
    failed. An engine that converges to a wrong motion has a small change and a large error.
    """
    scenario, truth = scored(scene, seed)
    whole = open_scene(scene, seed).duration
    radius, before, rows = scenario.scene.radius, None, []
    engine_name, profile = name.split(":")
    for k in ladder:
        run = play_once(make, name, scenario, scenario.dt(k))
        row = {
            "scenario": scenario.name,
            "seed": seed,
            "engine": engine_name,
            "profile": profile,
            "dt_s": scenario.dt(k),
            "substeps": k,
            "status": run.status,
            "reason": run.reason,
            "until_s": scenario.duration,
            "duration_s": whole,
            "error_radii": np.inf,
            "change_radii": np.nan,
        }
        played = run.trajectory if run.status == "ok" else None
        if played is not None:
            row["error_radii"] = float(
                (laws.deviation(played, truth, scenario.scene) / radius).max()
            )
            if before is not None:
                row["change_radii"] = float(
                    (laws.deviation(played, before, scenario.scene) / radius).max()
                )
        before = played
        rows.append(row)
    return rows


def times_of(
    scene: str,
    seed: int,
    engines: Mapping[tuple[Any, int, int], Make],
    rounds: int,
    budget: float,
    also: Mapping[str, Make] = MappingProxyType({}),
) -> list[Sample]:
    """Timing samples, s per simulated second, of `engines`, by (who, substeps, copy), over the
    whole scored scene.

    also: engines of which the overheads are timed in the same rounds, by (name, what), s each, see
    `stepping.overheads`; those that an engine refuses are left out.
    """
    scenario = scored(scene, seed).scenario
    what = [
        Timed(key, Stepping(make, scenario, key[1]), scenario.duration)
        for key, make in engines.items()
    ]
    for name, make in also.items():
        besides = (Timed((name, each), run, k) for each, run, k in overheads(make, scenario))
        what += filter(can, besides)
    return interleaved(what, rounds, budget, seed)
