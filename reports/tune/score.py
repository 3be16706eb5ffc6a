"""How well an engine plays the tuning scenes with some settings, and at what cost, against others
of its settings.

The bounds are the same for every engine, and absolute. A run gets worse where

- it fails or is refused, and was played before;
- a verdict (`reports/compare/verdicts.py`) fails that did not, or is above its bound by one bound
  more than before;
- a collision is missed where none was, or spurious, or more than one more than before.

What a setting breaks, it breaks for every seed, at the coarsest step at least: in a third of the
runs of a family. What is less comes and goes with the phase of a collision within its step, and so
does as much in all families together. Runs that get better are set against those that get worse.
But a run that is refused, or fails, is no matter of phase: there may be none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from functools import cache
from time import thread_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.adapters.advance import advance
from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engine_row import FLOAT32
from crosscheck2d.adapters.host.engine import PackageEngine
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare.collisions import match
from crosscheck2d.reports.compare.verdicts import VERDICTS, verdicts
from crosscheck2d.scenarios.families.tuning import FAMILIES, LADDER, one_of
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

FLOOR = 1e-6  # radii: below the finest accuracy that any page asks for, an error is as good as none
MOST_OF_A_FAMILY = 1 / 3  # of its runs, fewer than which may get worse
MOST_OF_ALL = 1 / 50  # of all runs: of 20 families with 12 runs as many as in one of them
# dt: after three bounces a step is up to so much early or late; so near the start or the end of the
# scene the partner of a collision may lie outside
EDGE = 6
TIMED_SUBSTEPS, ROUNDS = 4, 7
BEYOND = 1e6  # times its bound: an infinite value
FAILED, MISSED, SPURIOUS = "failed", "missed", "spurious"
HARMS = (FAILED, *VERDICTS, MISSED, SPURIOUS)
Make = Callable[[], Engine]
Asked = tuple[Scenario, Trajectory | None]


class TrialScores(NamedTuple):
    """The results of some settings on the tuning scenes; s scenes, k step sizes, coarse to fine.

    Attributes:
        error: (s, k) root mean square distance from the exact answer over disks and samples, in
            radii, at least `FLOOR`; inf where a scene was refused or failed, nan where there is no
            exact answer.
        harm: (s, k, h) what is wrong, `HARMS`: a failed verdict in multiples of its bound, or as it
            is where that is 0; numbers of collisions; 1 for a run that failed. 0: nothing.
    """

    error: Array
    harm: Array


@cache
def posed(families: tuple[str, ...], seeds: tuple[int, ...]) -> tuple[Asked, ...]:
    """The tuning scenes with their exact answers, which are cut at their horizons; family by
    family."""
    scenes = [one_of(name, seed) for name in FAMILIES if name in families for seed in seeds]
    return tuple((scene, scene.truth(scene.times) if scene.truth else None) for scene in scenes)


def measured(make: Make, scenes: Sequence[Asked]) -> TrialScores:
    runs = [[of_run(make, scene, truth, k) for k in LADDER] for scene, truth in scenes]
    error = [[error for error, _ in row] for row in runs]
    return TrialScores(np.array(error), np.array([[harm for _, harm in row] for row in runs]))


def of_run(
    make: Make, scenario: Scenario, truth: Trajectory | None, substeps: int
) -> tuple[float, list[float]]:
    dt, scene = scenario.dt(substeps), scenario.scene
    run = play_once(make, "tuned:engine", scenario, dt)
    harm = dict.fromkeys(HARMS, 0.0)
    if run.status != "ok" or run.trajectory is None:
        return np.inf, [*(harm | {FAILED: 1.0}).values()]
    played, moving = run.trajectory, ~scene.static
    for verdict in verdicts(scenario, played, dt, FLOAT32, truth):  # the same bounds for all
        if verdict.failed:
            harm[verdict.id] = min(verdict.value / (verdict.bound or 1.0), BEYOND)
    if truth is None:
        return np.nan, [*harm.values()]
    end = float(truth.t[-1])
    off = (played.position[: len(truth)] - truth.position)[:, moving] / scene.radius[moving, None]
    matched = match(played.collisions, truth.collisions, end, dt)
    for what, collisions in ((MISSED, matched.missed), (SPURIOUS, matched.spurious)):
        harm[what] = sum(EDGE * dt < t < end - EDGE * dt for t, _, _ in collisions)
    error = float(np.sqrt((off**2).sum(axis=2).mean()))
    return max(error, FLOOR), [*harm.values()]


def against(now: TrialScores, before: TrialScores, cost: float) -> dict[str, Any]:
    """`now` against `before`, if its steps cost `cost` times as much.

    same_dt, equal_cost: geometric mean over scenes and steps of error over error, at the same step
        size and at equal cost.
    better, worse: how many of the scenes and steps, `of`, have an error at equal cost smaller or
        larger by 20 %.
    harmed: runs that get worse, less those that get better.
    """
    at_its_cost = at_cost(now.error, cost)
    both = np.isfinite(now.error) & np.isfinite(at_its_cost) & np.isfinite(before.error)
    had = np.log(before.error[both])
    same, equal = np.log(now.error[both]) - had, np.log(at_its_cost[both]) - had
    return {
        "same_dt": float(np.exp(same.mean())),
        "equal_cost": float(np.exp(equal.mean())),
        "better": int((equal < np.log(0.8)).sum()),
        "worse": int((equal > np.log(1.25)).sum()),
        "of": int(both.sum()),
        "harmed": int(changes(now, before).sum()),
    }


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


def increases(now: Array, before: Array) -> NDArray[np.bool_]:
    """Whether there is a harm that was not, or by more than 1 more than before."""
    return np.where(before == 0, now > 0, now > before + 1)


def changes(now: TrialScores, before: TrialScores) -> NDArray[np.int64]:
    """(s, k) 1 where a run gets worse, -1 where it gets better, 0 where neither or both."""
    worse, better = increases(now.harm, before.harm), increases(before.harm, now.harm)
    change: NDArray[np.int64] = np.sign(worse.sum(axis=2) - better.sum(axis=2))
    return change


def faults_of(now: TrialScores, before: TrialScores, scenes: Sequence[Asked]) -> list[str]:
    """The families that get worse beyond the bounds; [] if no bound is broken."""
    family = np.array([scene.name.rsplit("-", 1)[0] for scene, _ in scenes])
    change, faults = changes(now, before), []
    increased = increases(now.harm, before.harm)
    lost = increased[:, :, HARMS.index(FAILED)]
    many = change.sum() > MOST_OF_ALL * change.size
    for name in dict.fromkeys(family.tolist()):
        its = np.flatnonzero(family == name)
        worse, runs = int(change[its].sum()), change[its].size
        if lost[its].any() or worse >= MOST_OF_A_FAMILY * runs or (many and worse > 0):
            # the harm that increases most: scene, dt, number
            more = np.where(increased[its], now.harm[its] - before.harm[its], 0.0)
            s, k, h = np.unravel_index(int(np.argmax(more)), more.shape)
            scene, _ = scenes[its[s]]
            unit = "times its bound" if HARMS[h] in VERDICTS else "in the run"
            has, had = (f"{scores.harm[its[s], k, h]:.2g}" for scores in (now, before))
            faults.append(
                f"{name}: {worse} of {runs} runs worse, {scene.name} at"
                f" {1e3 * scene.dt(LADDER[k]):.3g} ms: {HARMS[h]} {has} {unit}, not {had}"
            )
    return faults


def cost_of(make: Make, than: Make, scenes: Sequence[Asked]) -> float:
    """What a step costs over what it costs with the other settings: geometric mean over scenes.

    Both are timed in turns, `ROUNDS` times a scene, of whose ratios the median counts; see
    `Engine.listening` for why no collision is logged. Time of this thread, so that what else the
    machine does is not in it; of an engine in V8 the time in V8.
    """
    times = [
        [(spent(make, scene), spent(than, scene)) for _ in range(ROUNDS)] for scene, _ in scenes
    ]
    ratio = np.log(times)[:, :, 0] - np.log(times)[:, :, 1]
    return float(np.exp(np.median(ratio, axis=1).mean()))


def spent(make: Make, scenario: Scenario) -> float:
    """s inside `step`, through the scene."""
    with closing(make()) as engine:
        engine.listening = False
        engine.load(scenario.scene, scenario.dt(TIMED_SUBSTEPS))
        started = thread_time()
        advance(
            engine, scenario, 0, scenario.intervals * TIMED_SUBSTEPS, scenario.dt(TIMED_SUBSTEPS)
        )
        return engine.inside if isinstance(engine, PackageEngine) else thread_time() - started
