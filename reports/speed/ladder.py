"""Plays one engine in one scene at several step sizes: its errors in one pass, its times in
another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.verdicts import first_failed
from crosscheck2d.reports.compare.view import cut
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.stepping import Make, overheads, step_through
from crosscheck2d.reports.run.timing import Sample, Timed, interleaved
from crosscheck2d.reports.run.timing_pass import can
from crosscheck2d.reports.speed.scored_part import scored

FAILS = "fails"  # the status of a run that was played to its end and fails a verdict


def errors_of(
    scene: str, seed: int, name: str, make: Make, ladder: Sequence[int]
) -> list[dict[str, Any]]:
    """A row for each step size of `ladder` (coarse to fine): the error of engine `name` in the
    scene, up to the horizon.

    until_s is the horizon, where the errors end, and duration_s the duration of the scene.
    error_radii is the largest distance of any disk from the exact answer, inf where the run failed,
    or fails a verdict anywhere in the scene (its status is then `FAILS`); change_radii the largest
    distance from the run at the next coarser step size, nan if either failed. An engine that
    converges to a wrong motion has a small change and a large error.
    """
    scenario, truth = scored(scene, seed)
    whole = open_scene(scene, seed)
    radius, before, rows = scenario.scene.radius, None, []
    for k in ladder:
        run = play_once(make, name, whole, whole.dt(k))
        if run.status != "ok" and scenario.duration < whole.duration:
            run = play_once(make, name, scenario, scenario.dt(k))
        row = error_row(scene, seed, name, k, run.status, run.reason)
        played = run.trajectory if run.status == "ok" else None
        if played is not None and (failed := first_failed(run, whole, truth)):
            row |= {"status": FAILS, "reason": failed.text}
            played = None
        if played is not None:
            played = cut(played, len(truth))
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


def error_row(
    scene: str, seed: int, name: str, substeps: int, status: str, reason: str
) -> dict[str, Any]:
    """A row of `errors_of` as it is where the run failed."""
    scenario = scored(scene, seed).scenario
    engine, profile = name.split(":")
    return {
        "scenario": scenario.name,
        "seed": seed,
        "engine": engine,
        "profile": profile,
        "dt_s": scenario.dt(substeps),
        "substeps": substeps,
        "status": status,
        "reason": reason,
        "until_s": scenario.duration,
        "duration_s": open_scene(scene, seed).duration,
        "error_radii": np.inf,
        "change_radii": np.nan,
    }


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
        Timed(key, partial(step_through, make, scenario, key[1]), scenario.duration)
        for key, make in engines.items()
    ]
    for name, make in also.items():
        besides = (Timed((name, each), run, k) for each, run, k in overheads(make, scenario))
        what += filter(can, besides)
    return interleaved(what, rounds, budget, seed)
