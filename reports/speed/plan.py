"""What `crosscheck speed` measures, in its quick form and with `--full`: the scenes, and the
engines that are played and timed in them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import row_of, told_apart
from crosscheck2d.adapters.mechanisms.options import OPTIONS, SWEEPS, Option, Sweep
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import ladder
from crosscheck2d.scenarios.catalogue import RANDOM, SCENARIOS
from crosscheck2d.scenarios.model import Scenario

FEWEST_STEP_SIZES, MOST_STEP_SIZES = 3, 9
SCENE, OPTION, SWEEP = "scene", "option", "sweep"
PLAIN = ""  # the change of an engine that is not changed


def names(text: str) -> tuple[str, ...]:
    return tuple(text.split())


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
    sizes: tuple[int, ...]  # numbers of disks; () measures neither sizes nor changed engines
    patience: float  # s a step may take before an engine drops out of the sizes
    # in which iterations and substeps are increased: a stack, a crowd, a slide, and collisions in a
    # row
    sweep_scenes: tuple[str, ...]
    budget_scenes: tuple[str, ...]
    # in which options are changed: three disks, a collision that thresholds affect, one disk under
    # gravity, many collisions, and a stack at rest
    option_scenes: tuple[str, ...] = names(
        "disk_between_static_disks slow_collision bouncing_ball_e1 line_gas column_of_ten"
    )

    def ladder(self, scenario: Scenario) -> tuple[int, ...]:
        return doublings(scenario, self.most_steps)

    def of_scenes(self, scenes: Sequence[str]) -> Effort:
        """Of these scenes only: no sizes and no changed engines."""
        named = tuple(scenes)
        return replace(
            self, scenes=named, budget_scenes=named, option_scenes=(), sweep_scenes=(), sizes=()
        )


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
    scenes=names(
        "free_fall head_on_unequal_e09 oblique_e09 slow_collision bouncing_ball_e09 box_billiard "
        "disk_between_static_disks slide_on_incline column_of_ten line_gas cradle_with_gaps "
        "body_frame_thrust asteroids gas_of_100"
    ),
    seeds=6,
    most_steps=4_000,
    rounds=4,
    budget=0.05,
    sizes=(3, 10, 30, 100, 300, 1000, 3000, 10_000),
    patience=0.1,
    sweep_scenes=("column_of_ten", "falling_box", "slide_on_incline"),
    budget_scenes=names(
        "free_fall head_on_equal_e09 oblique_e1 slow_collision mass_ratios wall_to_wall "
        "bouncing_ball_e1 disk_between_static_disks line_gas cradle_with_gaps column_of_ten "
        "asteroids gas_of_100"
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

    def errors(self) -> list[dict[str, Any]]:
        return ladder.errors_of(self.scene, self.seed, self.name, self.make, self.step_sizes)


@dataclass(frozen=True)
class SpeedPlan:
    """What is asked for: how much, by which engines, from which seed, with how many workers."""

    effort: Effort
    engines: Sequence[str]
    seed: int
    workers: int

    @property
    def options(self) -> list[Option]:
        return [x for x in OPTIONS if self.effort.option_scenes and x.engine in self.engines]

    @property
    def sweeps(self) -> list[Sweep]:
        return [x for x in SWEEPS if self.effort.sweep_scenes and x.engine in self.engines]

    @property
    def seeded_scenes(self) -> list[tuple[str, int]]:
        """(scene, seed) for which an exact answer is needed."""
        effort = self.effort
        scenes = dict.fromkeys((*effort.scenes, *effort.option_scenes, *effort.sweep_scenes))
        seeded = [
            (scene, self.seed + k)
            for scene in scenes
            for k in range(effort.seeds if scene in RANDOM else 1)
        ]
        return seeded + [
            (scene, self.seed) for scene in effort.budget_scenes if scene not in scenes
        ]

    def measurements(self, answered: Collection[tuple[str, int]]) -> Iterator[Measurement]:
        """Every engine, in every scene and seed that has an exact answer: over the ladder of the
        scene; with each option, after the engine without, at the dt that the report shows; and with
        each value of a sweep at that dt, after the engine from 4 times that dt to an eighth."""
        rows = {name: row_of(name) for name in self.engines}
        for scene, seed in self.seeded_scenes:
            if (scene, seed) not in answered:
                continue
            here, scenario = middle(scene), open_scene(scene, seed)
            asked: list[tuple[str, str, str, Callable[[], Engine], tuple[int, ...]]] = []
            if scene in self.effort.scenes:
                steps = self.effort.ladder(scenario)
                for name in told_apart(rows, scenario.scene):
                    asked.append((SCENE, name, PLAIN, rows[name].make, steps))
            if scene in self.effort.option_scenes and seed == self.seed:
                for name in dict.fromkeys(option.engine for option in self.options):
                    asked.append((OPTION, name, PLAIN, rows[name].make, (here,)))
                for option in self.options:
                    asked.append((OPTION, option.engine, option.change, option.make, (here,)))
            for sweep in self.sweeps if scene in self.effort.sweep_scenes else ():
                steps = tuple(here * 2**k // 4 for k in range(6) if here * 2**k % 4 == 0)
                asked.append((SWEEP, sweep.engine, PLAIN, rows[sweep.engine].make, steps))
                for value in sweep.parameter.values:
                    asked.append((SWEEP, sweep.name, str(value), sweep.at(value), (here,)))
            for kind, name, change, make, steps in asked:
                yield Measurement(kind, scene, seed, name, change, make, steps)


def middle(scene: str) -> int:
    return open_scene(scene, 0).middle_substeps
