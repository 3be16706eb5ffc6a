"""How long a measurement will take on an idle machine: a rough sum over the steps of all
engines."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.timing import FEWEST_ROUNDS, LEAST, WARM_UP
from crosscheck2d.reports.speed.effort import Effort
from crosscheck2d.reports.speed.plan import SCENE, Measurement, Reach, SpeedPlan
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.scenarios.model import Scenario

# s, means over the measurements: a step, each disk in it, applying forces in Python, wrapping a
# disk in Python; a read-out, each disk in it; preparing a sample. On the machine of `figures.csv`;
# on others half or twice as much.
STEP, STEP_DISK, FORCE, WRAP_DISK = 1.0e-6, 0.17e-6, 16e-6, 0.75e-6
READ, READ_DISK, READY = 20e-6, 1.5e-6, 1.5e-3
LISTENING = 1.5  # times a step where collisions are logged, too
STARTING = 12.0  # s until the workers have imported and compiled
BUDGET = 0.2  # s, for the error budget of one engine in one scene
PAGE = 8.0  # s


def estimate(plan: SpeedPlan, measurements: Sequence[Measurement], reach: Reach) -> str:
    """A sentence that says how much there is to measure and about how long it takes on an idle
    machine."""
    budgets = BUDGET * len(plan.budget_scenes) * len(set(plan.engines) & set(MECHANISMS))
    playing = (
        budgets + sum(seconds_to_play(measurement, reach) for measurement in measurements)
    ) / plan.workers
    timed = [measurement for measurement in measurements if measurement.seed == plan.seed]
    timing = sum(seconds_to_time(measurement, reach, plan.effort) for measurement in timed)
    timing += seconds_of_sizes(plan.effort) * plan.whole
    whole = STARTING + playing + timing + PAGE
    length = f"{ceil(whole / 60)} minutes" if whole > 90 else f"{ceil(whole / 10) * 10} s"
    return (
        f"{counted(len(measurements), 'run')} to play at several step sizes, {len(timed)} of them"
        f" to time: about {length} while nothing else runs."
    )


def step_of(scenario: Scenario) -> float:
    """s, of one step of a scene, with the time that Python takes."""
    n = scenario.scene.n
    wrapping = n * WRAP_DISK if scenario.scene.wrap is not None else 0.0
    return STEP + n * STEP_DISK + (FORCE if scenario.thrusts else 0.0) + wrapping


def seconds_to_play(measurement: Measurement, reach: Reach) -> float:
    """s, to play all step sizes, read at every sample."""
    scenario = open_scene(measurement.scene, measurement.seed)
    samples = reach[measurement.scene, measurement.seed]
    reading = len(measurement.step_sizes) * samples * (READ + scenario.scene.n * READ_DISK)
    return sum(measurement.step_sizes) * samples * LISTENING * step_of(scenario) + reading


def seconds_to_time(measurement: Measurement, reach: Reach, effort: Effort) -> float:
    """s, for all rounds of all step sizes; on a ladder of a scene the middle step size is timed
    twice."""
    step = step_of(open_scene(measurement.scene, measurement.seed))
    samples = reach[measurement.scene, measurement.seed]
    each = [all_rounds(samples * k * step, effort) for k in measurement.step_sizes]
    return sum(each) + (each[len(each) // 2] if measurement.kind == SCENE else 0.0)


def all_rounds(run: float, effort: Effort) -> float:
    """s, for the rounds of one run of this many s, which is repeated until it fills a sample, as
    in `timing.interleaved`."""
    sample = max(run, LEAST)
    rounds = min(
        effort.rounds - WARM_UP, max(FEWEST_ROUNDS - WARM_UP, ceil(effort.budget / sample))
    )
    return rounds * (sample + READY)


def seconds_of_sizes(effort: Effort) -> float:
    """s, for the numbers of disks; an engine that is too slow stops. Setting up takes as long as
    about twenty steps."""
    steps = [STEP + n * STEP_DISK for n in effort.sizes]
    return len(ENGINES) * sum(all_rounds(step, effort) + 20 * step for step in steps)
