"""How well an engine plays the tuning scenes with some settings, and at what cost, against others
of its settings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from functools import cache
from time import thread_time
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.advance import advance
from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.javascript.engine import JavaScriptEngine
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.collisions import match
from crosscheck2d.scenarios.families.tuning import FAMILIES, LADDER, one_of
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

FLOOR = 1e-6  # radii: below the finest accuracy that any page asks for, an error is as good as none
# times as much energy as before, and so much of that at hand, may be wrong
MORE_ENERGY, SOME_ENERGY = 1.1, 0.01
TIMED_SUBSTEPS, ROUNDS = 4, 7
Make = Callable[[], Engine]
Asked = tuple[Scenario, Trajectory | None]


class TrialScores(NamedTuple):
    """The results of some settings on the tuning scenes; s scenes, k step sizes, coarse to fine.

    Attributes:
        error: (s, k) root mean square distance from the exact answer over disks and samples, in
            radii, at least `FLOOR`; inf where a scene was refused or failed, nan where there is no
            exact answer.
        gained: (s, k) energy over the energy at hand: at e = 1 the largest change, else the largest
            rise.
        missed, spurious: (s, k) collisions.
    """

    error: Array
    gained: Array
    missed: Array
    spurious: Array


class Against(NamedTuple):
    """What some settings are against those that are compared with.

    Attributes:
        same_dt: geometric mean over scenes and steps of error over error, at the same step size.
        equal_cost: the same, at equal cost.
        better, worse: how many of the scenes and steps have an error at equal cost smaller or
            larger by 20 %.
        of: how many there are.
        faults: what they break, each in a few words.
    """

    same_dt: float
    equal_cost: float
    better: int
    worse: int
    of: int
    faults: list[str]


@cache
def posed(families: tuple[str, ...], seeds: tuple[int, ...]) -> tuple[Asked, ...]:
    """The tuning scenes with their exact answers, which are cut at their horizons; family by
    family."""
    scenes = [
        one_of(each, seed) for each in FAMILIES if each.__name__ in families for seed in seeds
    ]
    return tuple((scene, scene.truth(scene.times) if scene.truth else None) for scene in scenes)


def measured(make: Make, scenes: Sequence[Asked]) -> TrialScores:
    """Play every scene at every step size."""
    rows = [[of_run(make, scene, truth, k) for k in LADDER] for scene, truth in scenes]
    return TrialScores(*np.moveaxis(np.array(rows, float), -1, 0))


def of_run(
    make: Make, scenario: Scenario, truth: Trajectory | None, substeps: int
) -> tuple[float, float, int, int]:
    """Error, energy gained, missed and spurious collisions; see `TrialScores`."""
    dt, scene = scenario.dt(substeps), scenario.scene
    run = play_once(make, "tuned:engine", scenario, dt)
    if run.status != "ok" or run.trajectory is None:
        return np.inf, 0.0, 0, 0
    played, moving = run.trajectory, ~scene.static
    energy = laws.energy(played, scene)
    # Where the scene keeps its energy, both ways; else only a rise is certainly wrong.
    keeps = scene.restitution == 1 and not scene.friction
    least = energy[0] if keeps else np.minimum.accumulate(energy)
    rise = float(np.max(np.abs(energy - least))) / (scales.energy(scenario) or 1.0)
    if truth is None:
        return np.nan, rise, 0, 0
    off = (played.position[: len(truth)] - truth.position)[:, moving] / scene.radius[moving, None]
    found = match(played.collisions, truth.collisions, float(truth.t[-1]), dt)
    error = float(np.sqrt((off**2).sum(axis=2).mean()))
    return max(error, FLOOR), rise, len(found.missed), len(found.spurious)


def against(now: TrialScores, before: TrialScores, cost: float, scenes: Sequence[Asked]) -> Against:
    """Set `now` against `before`, if its steps cost `cost` times as much."""
    both = np.isfinite(now.error) & np.isfinite(before.error)
    had = np.log(before.error[both])
    same, equal = np.log(now.error[both]) - had, np.log(at_cost(now.error, cost)[both]) - had
    counts = int((equal < np.log(0.8)).sum()), int((equal > np.log(1.25)).sum()), int(both.sum())
    return Against(
        float(np.exp(same.mean())),
        float(np.exp(equal.mean())),
        *counts,
        faults_of(now, before, scenes),
    )


def at_cost(error: Array, cost: float) -> Array:
    """(s, k) what the errors would be if a step cost as much as before: those at cost times the
    step size.

    Steps that cost twice as much are half as many. error (s, k) is read between the step sizes of
    the ladder on a line of its logarithm over that of dt; beyond its ends it is of first order, in
    proportion to dt.
    """
    ladder = -np.log(LADDER)[::-1]  # ln dt + const, increasing
    wanted = ladder + np.log(cost)
    beyond = wanted - np.clip(wanted, ladder[0], ladder[-1])
    with np.errstate(invalid="ignore"):
        logs = [np.interp(wanted, ladder, row[::-1]) + beyond for row in np.log(error)]
    points: Array = np.exp(np.array(logs)[:, ::-1])
    return points


def faults_of(now: TrialScores, before: TrialScores, scenes: Sequence[Asked]) -> list[str]:
    """What `now` breaks that `before` kept, family by family.

    A scene refused or failed; missed or spurious collisions, more of them than by counting noise (n
    + sqrt(n): where there was none, none may come); an energy that is wrong by more than
    `MORE_ENERGY` and `SOME_ENERGY`.
    """
    family = np.array([scene.name.rsplit("-", 1)[0] for scene, _ in scenes])
    faults = []
    for name in dict.fromkeys(family.tolist()):
        its = family == name
        if (lost := int((np.isinf(now.error[its]) & ~np.isinf(before.error[its])).sum())) > 0:
            faults.append(f"{name}: {lost} runs failed")
        for what in ("missed", "spurious"):
            n, had = (int(getattr(played, what)[its].sum()) for played in (now, before))
            if n > had + np.sqrt(had):
                faults.append(f"{name}: {n} {what} collisions, not {had}")
        rise, risen = (float(played.gained[its].max()) for played in (now, before))
        if rise > MORE_ENERGY * risen + SOME_ENERGY:
            faults.append(f"{name}: energy wrong by {rise:.2g}, not {risen:.2g}")
    return faults


def cost_of(make: Make, than: Make, scenes: Sequence[Asked]) -> float:
    """What a step costs over what it costs with the other settings: geometric mean over scenes.

    Both are timed in turns, `ROUNDS` times a scene, of which the shortest counts; see
    `Engine.listening` for why no collision is logged. Time of this thread, so that what else the
    machine does is not in it; of an engine in V8 the time in V8.
    """
    times = [
        [(spent(make, scene), spent(than, scene)) for _ in range(ROUNDS)] for scene, _ in scenes
    ]
    mine, theirs = np.min(times, axis=1).T
    return float(np.exp(np.log(mine / theirs).mean()))


def spent(make: Make, scenario: Scenario) -> float:
    """s inside `step`, through the scene."""
    with closing(make()) as engine:
        engine.listening = False
        engine.load(scenario.scene, scenario.dt(TIMED_SUBSTEPS))
        started = thread_time()
        advance(
            engine, scenario, 0, scenario.intervals * TIMED_SUBSTEPS, scenario.dt(TIMED_SUBSTEPS)
        )
        return engine.inside if isinstance(engine, JavaScriptEngine) else thread_time() - started
