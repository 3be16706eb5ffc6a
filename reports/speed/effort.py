"""How much `crosscheck speed` measures: the quick form, and `--full`."""

from __future__ import annotations

from dataclasses import dataclass

from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.model import Scenario

FEWEST_STEP_SIZES, MOST_STEP_SIZES = 3, 9


@dataclass(frozen=True)
class Effort:
    """The scenes, step sizes, rounds and numbers of disks that are measured.

    Attributes:
        scenes: what is measured if nothing is asked for; in the quick form one of each kind, so
            that no one of them is the pooled curve: flight, collisions head-on, oblique and below
            thresholds, walls, static disks, sliding, a stack, rows, a force and a torque, and
            crowds (a test leaves out one after the other).
        seeds: how many seeds of a random scene.
        most_steps: of the finest dt of a ladder.
        rounds: of timing, warm-up not counted.
        budget: s of timing for one engine at one dt in one scene, beyond the first rounds.
        sizes: numbers of disks.
        patience: s a step may take before an engine drops out of the sizes.
        sweep_scenes: in which iterations and substeps are increased: a stack, a crowd, a slide, and
            collisions in a row.
        option_scenes: in which engines with changed options are measured: three disks, a collision
            that thresholds affect, one disk under gravity, many collisions, and a stack at rest.
        budget_scenes: of which the error budget is made.
    """

    scenes: tuple[str, ...]
    seeds: int
    most_steps: int
    rounds: int
    budget: float
    sizes: tuple[int, ...]
    patience: float
    sweep_scenes: tuple[str, ...]
    budget_scenes: tuple[str, ...]
    option_scenes: tuple[str, ...] = (
        "disk_between_static_disks",
        "slow_collision",
        "bouncing_ball_e1",
        "line_gas",
        "column_of_ten",
    )

    def ladder(self, scenario: Scenario) -> tuple[int, ...]:
        """Steps in a sample interval, as `doublings` with `most_steps`."""
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
