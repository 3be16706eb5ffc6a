"""What `crosscheck speed` measures, in its quick form and with `--full`: the scenes, the engines
that are played and timed in them, and about how long that takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import ENGINES, row_of, told_apart
from crosscheck2d.adapters.mechanisms.options import OPTIONS, SWEEPS, Option, Sweep
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.timing import FEWEST_ROUNDS, LEAST, WARM_UP
from crosscheck2d.reports.speed import ladder
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.scenarios.catalogue import RANDOM, SCENARIOS
from crosscheck2d.scenarios.model import Scenario

FEWEST_STEP_SIZES, MOST_STEP_SIZES = 3, 9
SCENE, OPTION, SWEEP = "scene", "option", "sweep"
PLAIN = ""  # the change of an engine that is not changed
# (scene, seed) -> how many sample intervals have an exact answer
Reach = Mapping[tuple[str, int], int]

# s, means over the measurements: a step, each disk in it, applying forces in Python, wrapping a
# disk in Python; a read-out, each disk in it; preparing a sample. On the machine of `figures.csv`;
# on others half or twice as much.
STEP, STEP_DISK, FORCE, WRAP_DISK = 1.0e-6, 0.17e-6, 16e-6, 0.75e-6
READ, READ_DISK, READY = 20e-6, 1.5e-6, 1.5e-3
LISTENING = 1.5  # times a step where collisions are logged, too
STARTING = 12.0  # s until the workers have imported and compiled
BUDGET = 0.2  # s, for the error budget of one engine in one scene
PAGE = 8.0  # s


@dataclass(frozen=True)
class Effort:
    # what is measured if nothing is asked for; in the quick form one of each kind, so that no one
    # of them is the pooled curve: flight, collisions head-on, oblique and below thresholds, walls,
    # static disks, sliding, a stack, rows, a force and a torque, and crowds (a test leaves out one
    # after the other)
    scenes: tuple[str, ...]
    seeds: int  # of a random scene
    most_steps: int  # of the finest dt of a ladder
    rounds: int  # of timing, warm-up not counted
    budget: float  # s of timing for one engine at one dt in one scene, beyond the first rounds
    sizes: tuple[int, ...]  # numbers of disks
    patience: float  # s a step may take before an engine drops out of the sizes
    # in which iterations and substeps are increased: a stack, a crowd, a slide, and collisions in a
    # row
    sweep_scenes: tuple[str, ...]
    budget_scenes: tuple[str, ...]
    # in which options are changed: three disks, a collision that thresholds affect, one disk under
    # gravity, many collisions, and a stack at rest
    option_scenes: tuple[str, ...] = (
        "disk_between_static_disks",
        "slow_collision",
        "bouncing_ball_e1",
        "line_gas",
        "column_of_ten",
    )

    def ladder(self, scenario: Scenario) -> tuple[int, ...]:
        return doublings(scenario, self.most_steps)


def doublings(scenario: Scenario, most_steps: int) -> tuple[int, ...]:
    """Steps in a sample interval, doubling from the scenario's own coarsest, as long as a run has
    `most_steps` or less; `FEWEST_STEP_SIZES` at least."""
    first = scenario.substeps[0]
    step_sizes = [first * 2**k for k in range(MOST_STEP_SIZES)]
    return tuple(
        k
        for n, k in enumerate(step_sizes)
        if n < FEWEST_STEP_SIZES or k * scenario.intervals <= most_steps
    )


QUICK = Effort(
    scenes=(
        "free_fall",
        "head_on_unequal_e09",
        "oblique_e09",
        "slow_collision",
        "bouncing_ball_e09",
        "box_billiard",
        "disk_between_static_disks",
        "slide_on_incline",
        "column_of_ten",
        "line_gas",
        "cradle_with_gaps",
        "body_frame_thrust",
        "asteroids",
        "gas_of_100",
    ),
    seeds=6,
    most_steps=4_000,
    rounds=4,
    budget=0.05,
    sizes=(3, 10, 30, 100, 300, 1000, 3000, 10_000),
    patience=0.1,
    sweep_scenes=("column_of_ten", "falling_box", "slide_on_incline"),
    budget_scenes=(
        "free_fall",
        "head_on_equal_e09",
        "oblique_e1",
        "slow_collision",
        "mass_ratios",
        "wall_to_wall",
        "bouncing_ball_e1",
        "disk_between_static_disks",
        "line_gas",
        "cradle_with_gaps",
        "column_of_ten",
        "asteroids",
        "gas_of_100",
    ),
)
FULL = Effort(
    scenes=tuple(SCENARIOS),
    seeds=16,
    most_steps=16_000,
    rounds=15,
    budget=0.5,
    sizes=(3, 10, 30, 100, 300, 1000, 3000, 10_000, 30_000, 100_000),
    patience=1.0,
    sweep_scenes=("column_of_ten", "cradle_touching", "line_gas", "gas_of_100", "slide_on_incline"),
    budget_scenes=tuple(SCENARIOS),
)


class Measurement(NamedTuple):
    """An engine in a scene with a seed at some steps of the sample interval (coarse to fine).

    kind: which question it is for: the ladders of all scenes, the options, or the sweeps. `change`
    is a row of `OPTIONS`, a value of a sweep, or `PLAIN`.
    """

    kind: str
    scene: str
    seed: int
    name: str
    change: str
    make: Callable[[], Engine]
    step_sizes: tuple[int, ...]

    @property
    def task(self) -> tuple[Any, ...]:
        return ("error", *self[:5], *self.step_sizes)

    @property
    def errors(self) -> Callable[[], list[dict[str, Any]]]:
        return partial(
            ladder.errors_of, self.scene, self.seed, self.name, self.make, self.step_sizes
        )


@dataclass(frozen=True)
class SpeedPlan:
    """What is asked for: scenes and engines by name, how much, from which seed, with how many
    workers.

    whole: not only these scenes, but the changed engines and the numbers of disks, too.
    """

    scenes: Sequence[str]
    engines: Sequence[str]
    effort: Effort
    seed: int
    workers: int
    whole: bool = True

    @property
    def options(self) -> list[Option]:
        return [option for option in OPTIONS if self.whole and option.engine in self.engines]

    @property
    def sweeps(self) -> list[Sweep]:
        return [sweep for sweep in SWEEPS if self.whole and sweep.engine in self.engines]

    @property
    def option_scenes(self) -> tuple[str, ...]:
        return self.effort.option_scenes if self.options else ()

    @property
    def sweep_scenes(self) -> tuple[str, ...]:
        return self.effort.sweep_scenes if self.sweeps else ()

    @property
    def budget_scenes(self) -> tuple[str, ...]:
        return self.effort.budget_scenes if self.whole else tuple(self.scenes)

    @property
    def seeded_scenes(self) -> list[tuple[str, int]]:
        """(scene, seed) for which an exact answer is needed."""
        scenes = dict.fromkeys((*self.scenes, *self.option_scenes, *self.sweep_scenes))
        seeded = [
            (scene, self.seed + k)
            for scene in scenes
            for k in range(self.effort.seeds if scene in RANDOM else 1)
        ]
        return seeded + [(scene, self.seed) for scene in self.budget_scenes if scene not in scenes]

    def measurements(self, reach: Reach) -> Iterator[Measurement]:
        """Every engine, in every scene and seed that has an exact answer: over the ladder of the
        scene; with each option, after the engine without, at the dt that the report shows; and with
        each value of a sweep at that dt, after the engine from 4 times that dt to an eighth."""
        for scene, seed in self.seeded_scenes:
            if not reach[scene, seed]:
                continue
            here = middle(scene)
            if scene in self.scenes:
                scenario = open_scene(scene, seed)
                rows = {name: row_of(name) for name in self.engines}
                for name in told_apart(rows, scenario.scene):
                    steps = self.effort.ladder(scenario)
                    yield Measurement(SCENE, scene, seed, name, PLAIN, rows[name].make, steps)
            if scene in self.option_scenes and seed == self.seed:
                for name in dict.fromkeys(option.engine for option in self.options):
                    make = row_of(name).make
                    yield Measurement(OPTION, scene, seed, name, PLAIN, make, (here,))
                for option in self.options:
                    change, make = option.change, option.make
                    yield Measurement(OPTION, scene, seed, option.engine, change, make, (here,))
            for sweep in self.sweeps if scene in self.sweep_scenes else ():
                steps = tuple(here * 2**k // 4 for k in range(6) if here * 2**k % 4 == 0)
                make = row_of(sweep.engine).make
                yield Measurement(SWEEP, scene, seed, sweep.engine, PLAIN, make, steps)
                for value in sweep.parameter.values:
                    make = sweep.at(value)
                    yield Measurement(SWEEP, scene, seed, sweep.name, str(value), make, (here,))


def middle(scene: str) -> int:
    return open_scene(scene, 0).middle_substeps


def estimate(plan: SpeedPlan, measurements: Sequence[Measurement], reach: Reach) -> str:
    playing = BUDGET * len(plan.budget_scenes) * len(set(plan.engines) & set(MECHANISMS))
    timing, timed = 0.0, 0
    for asked in measurements:
        scenario, samples = open_scene(asked.scene, asked.seed), reach[asked.scene, asked.seed]
        n, wraps = scenario.scene.n, scenario.scene.wrap is not None
        step = STEP + n * (STEP_DISK + WRAP_DISK * wraps) + FORCE * bool(scenario.thrusts)
        reading = len(asked.step_sizes) * samples * (READ + n * READ_DISK)
        playing += sum(asked.step_sizes) * samples * LISTENING * step + reading
        if asked.seed == plan.seed:
            timed += 1
            each = [all_rounds(samples * k * step, plan.effort) for k in asked.step_sizes]
            # on the ladder of a scene the middle step size is timed twice
            timing += sum(each) + (each[len(each) // 2] if asked.kind == SCENE else 0.0)
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
    # s, of a run of `run` s, which is repeated until it fills a sample, as in `timing.interleaved`
    sample = max(run, LEAST)
    rounds = max(FEWEST_ROUNDS - WARM_UP, ceil(effort.budget / sample))
    return min(effort.rounds - WARM_UP, rounds) * (sample + READY)
