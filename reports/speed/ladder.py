"""The part of a scene that has an exact answer; the error of an engine in it, for each purpose and
at several step sizes, and its cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from math import nan
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.verdicts import first_failed
from crosscheck2d.reports.compare.view import View, cut
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.stepping import Make, overheads, step_through
from crosscheck2d.reports.run.timing import Sample, Timed, interleaved
from crosscheck2d.reports.run.timing_pass import can
from crosscheck2d.scenarios.model import Array, Collisions, Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import NoTruth

STARTS = 20  # of a run, evenly spread over a step
FAILS = "fails"  # the status of a run that was played to its end and fails a verdict


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


def reason_of(scene: str, seed: int) -> str:
    # why there is no exact answer, "" where there is one
    try:
        scored(scene, seed)
    except NoTruth as refusal:
        return str(refusal)
    return ""


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
    truth = answer(times + begin)
    after = truth.collisions.t > begin
    kept = {name: array[after] for name, array in vars(truth.collisions).items()}
    collisions = Collisions(**kept | {"t": kept["t"] - begin})
    return replace(truth, t=truth.t - begin, collisions=collisions, horizon=truth.horizon - begin)


class Purpose(NamedTuple):
    error: Callable[[View], float]  # nan where too little of it can be judged
    what: str  # the error in words, with its unit


def of_trajectory(view: View) -> float:
    return float((view.deviation / view.scenario.scene.radius).max())


def of_energy(view: View) -> float:
    # against the law where energy is conserved, else against the exact answer
    alone = View(view.scenario, view.dt, view.played, rounding=view.rounding)
    errors = (METRICS["energy_error"].of(judged) for judged in (alone, view))
    return next((float(error.value) for error in errors if error is not None), nan)


def of_statistics(view: View) -> float:
    # three averages over time and moving disks: kinetic energy and height against gravity, over the
    # energy at hand; distance from the start, over the true one
    assert view.other is not None
    scene = view.scenario.scene
    averages = []
    for trajectory in (view.played, view.other):
        motion = laws.kinetic_energy(trajectory, scene)
        height = laws.energy(trajectory, scene) - motion
        way = laws.lengths(laws.nearer_way(trajectory.position - trajectory.position[0], scene))
        far = float(way[:, ~scene.static].mean()) if not scene.static.all() else 0.0
        averages.append((float(motion.mean()), float(height.mean()), far))
    (kinetic, potential, way_on), (true_kinetic, true_potential, true_way) = averages
    scale = scales.energy(view.scenario) or 1.0
    off = max(abs(kinetic - true_kinetic), abs(potential - true_potential)) / scale
    return max(off, abs(way_on - true_way) / true_way if true_way else 0.0)


PURPOSES: dict[str, Purpose] = {
    "trajectory": Purpose(of_trajectory, "distance of a disk from its exact position, in radii"),
    "energy": Purpose(of_energy, "error of the energy, over the energy at hand"),
    "statistics": Purpose(
        of_statistics, "error of averages over time: energies, distance from the start"
    ),
}


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
        row, played = error_row(scene, seed, name, k, run.status, run.reason), run.trajectory
        if run.status != "ok" or played is None:
            played = None
        elif failed := first_failed(run, whole, truth):
            row |= {"status": FAILS, "reason": failed.text}
            played = None
        else:
            played = cut(played, len(truth))
            for column, beside in (("error_radii", truth), ("change_radii", before)):
                if beside is not None:
                    off = laws.deviation(played, beside, scenario.scene) / radius
                    row[column] = float(off.max())
        before = played
        rows.append(row)
    return rows


def error_row(
    scene: str, seed: int, name: str, substeps: int, status: str, reason: str
) -> dict[str, Any]:
    # a row as it is where the run failed
    scenario = scored(scene, seed).scenario
    engine, profile = name.split(":")
    row: dict[str, Any] = {"scenario": scenario.name, "seed": seed}
    row |= {"engine": engine, "profile": profile, "dt_s": scenario.dt(substeps)}
    row |= {"substeps": substeps, "status": status, "reason": reason}
    row |= {"until_s": scenario.duration, "duration_s": open_scene(scene, seed).duration}
    return row | {"error_radii": np.inf, "change_radii": np.nan}


def times_of(
    scene: str,
    seed: int,
    engines: Mapping[tuple[Any, int, int], Make],
    rounds: int,
    budget: float,
    also: Mapping[str, Make] = MappingProxyType({}),
    whole: bool = False,
) -> list[Sample]:
    """Timing samples, s per simulated second, of `engines`, by (who, substeps, copy).

    also: engines of which the overheads are timed in the same rounds, by (name, what), s each, see
        `stepping.overheads`; those that an engine refuses are left out.
    whole: whether the scene goes on beyond the horizon of its exact answer; what comes there may
        cost more.
    """
    scenario = open_scene(scene, seed) if whole else scored(scene, seed).scenario
    timed = [
        Timed(key, partial(step_through, make, scenario, key[1]), scenario.duration)
        for key, make in engines.items()
    ]
    for name, make in also.items():
        besides = (Timed((name, part), run, k) for part, run, k in overheads(make, scenario))
        timed += filter(can, besides)
    return interleaved(timed, rounds, budget, seed)
