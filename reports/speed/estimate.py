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
    playing = BUDGET * len(plan.budget_scenes) * len(set(plan.engines) & set(MECHANISMS))
    timing, timed = 0.0, 0
    for one in measurements:
        scenario, samples = open_scene(one.scene, one.seed), reach[one.scene, one.seed]
        n, wraps = scenario.scene.n, scenario.scene.wrap is not None
        step = STEP + n * (STEP_DISK + WRAP_DISK * wraps) + FORCE * bool(scenario.thrusts)
        reading = len(one.step_sizes) * samples * (READ + n * READ_DISK)
        playing += sum(one.step_sizes) * samples * LISTENING * step + reading
        if one.seed == plan.seed:
            timed += 1
            each = [all_rounds(samples * k * step, plan.effort) for k in one.step_sizes]
            # on the ladder of a scene the middle step size is timed twice
            timing += sum(each) + (each[len(each) // 2] if one.kind == SCENE else 0.0)
    if plan.whole:  # an engine that is too slow stops; setting up takes about twenty steps
        steps = [STEP + n * STEP_DISK for n in plan.effort.sizes]
        timing += len(ENGINES) * sum(all_rounds(step, plan.effort) + 20 * step for step in steps)
    whole = STARTING + playing / plan.workers + timing + PAGE
    length = f"{ceil(whole / 60)} minutes" if whole > 90 else f"{ceil(whole / 10) * 10} s"
    return (
        f"{counted(len(measurements), 'run')} to play at several step sizes, {timed} of them"
        f" to time: about {length} while nothing else runs."
    )


def all_rounds(run: float, effort: Effort) -> float:
    """s, for the rounds of one run of this many s, which is repeated until it fills a sample, as
    in `timing.interleaved`."""
    sample = max(run, LEAST)
    rounds = max(FEWEST_ROUNDS - WARM_UP, ceil(effort.budget / sample))
    return min(effort.rounds - WARM_UP, rounds) * (sample + READY)
