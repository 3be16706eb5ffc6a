"""How long a measurement will take where nothing else runs: a rough sum over the steps of everybody."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

from adapters.engines import ENGINES
from reports.speed import ladder
from reports.speed.effort import Effort
from reports.speed.plan import SCENE, Plan, Player, Reach
from reports.speed.timing import FEWEST_ROUNDS, LEAST, WARM_UP

# s, means over the players: of a step and of each disk in it, and of reading them once (`figures.csv`, and the machine
# it names). Half or twice as much is usual elsewhere.
STEP, STEP_DISK, READ, READ_DISK = 1.0e-6, 0.17e-6, 20e-6, 1.5e-6
LISTENING = 1.5  # times a step where hits are heard of, too
STARTING = 15.0  # s until the workers have imported and compiled
PAGE = 10.0  # s


def estimate(plan: Plan, players: Sequence[Player], reach: Reach) -> str:
    """A sentence on how much there is to do and about how long it takes on an idle machine."""
    playing = sum(seconds_to_play(player, reach) for player in players) / plan.workers
    timed = [player for player in players if player.seed == plan.seed]
    timing = sum(seconds_to_time(player, reach, plan.effort) for player in timed)
    timing += seconds_of_sizes(plan.effort) * plan.whole
    whole = STARTING + playing + timing + PAGE
    length = f"{ceil(whole / 60)} minutes" if whole > 90 else f"{ceil(whole / 10) * 10} s"
    return f"{len(players)} ladders of steps to play and {len(timed)} to time: about {length} where nothing else runs"


def seconds_to_play(player: Player, reach: Reach) -> float:
    """s, of all rungs, read at every sample."""
    n, samples = ladder.open_scene(player.scene, player.seed).scene.n, reach[player.scene, player.seed]
    reading = len(player.rungs) * samples * (READ + n * READ_DISK)
    return sum(player.rungs) * samples * LISTENING * (STEP + n * STEP_DISK) + reading


def seconds_to_time(player: Player, reach: Reach, effort: Effort) -> float:
    """s, of all rounds of all rungs; the middle one is there twice on a ladder of a scene."""
    n, samples = ladder.open_scene(player.scene, player.seed).scene.n, reach[player.scene, player.seed]
    runs = [samples * k * (STEP + n * STEP_DISK) for k in player.rungs]
    rungs = [all_rounds(max(run, LEAST), effort) for run in runs]
    return sum(rungs) + (rungs[len(rungs) // 2] if player.kind == SCENE else 0.0)


def all_rounds(sample: float, effort: Effort) -> float:
    """s, of samples of so many s as `timing.interleaved` takes them."""
    rounds = min(effort.rounds, max(FEWEST_ROUNDS, ceil(effort.budget / sample)))
    return (rounds - WARM_UP) * sample


def seconds_of_sizes(effort: Effort) -> float:
    """s, for the numbers of disks: who is slow drops out, so that a step takes no longer than the patience."""
    steps = [STEP + n * STEP_DISK for n in effort.sizes]
    return len(ENGINES) * sum(all_rounds(max(step, LEAST), effort) + 20 * step for step in steps)
