"""What is measured: the scenes, and the engines that are played and timed in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import row_of, told_apart
from crosscheck2d.adapters.mechanisms.options import OPTIONS, SWEEPS, Option, Sweep
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import ladder
from crosscheck2d.reports.speed.effort import Effort
from crosscheck2d.scenarios.catalogue import RANDOM

SCENE, OPTION, SWEEP = "scene", "option", "sweep"
PLAIN = ""  # the change of an engine that is not changed
# (scene, seed) -> how many sample intervals have an exact answer
Reach = Mapping[tuple[str, int], int]


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
        """The key under which its result is stored."""
        return ("error", *self[:5], *self.step_sizes)

    @property
    def errors(self) -> Callable[[], list[dict[str, Any]]]:
        """A function that computes its errors."""
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
        """The rows of `OPTIONS` of the engines that were asked for."""
        return [option for option in OPTIONS if self.whole and option.engine in self.engines]

    @property
    def sweeps(self) -> list[Sweep]:
        """The rows of `SWEEPS` of the engines that were asked for."""
        return [sweep for sweep in SWEEPS if self.whole and sweep.engine in self.engines]

    @property
    def option_scenes(self) -> tuple[str, ...]:
        """The scenes in which options are measured; none if only some scenes were asked for."""
        return self.effort.option_scenes if self.options else ()

    @property
    def sweep_scenes(self) -> tuple[str, ...]:
        """The scenes in which parameters are swept; none if only some scenes were asked for."""
        return self.effort.sweep_scenes if self.sweeps else ()

    @property
    def budget_scenes(self) -> tuple[str, ...]:
        """Where errors have a budget: in the scenes asked for, if any are."""
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
        """Every engine, in every scene and seed that has an exact answer."""
        answered = {seeded for seeded, samples in reach.items() if samples}
        for scene, seed in (seeded for seeded in self.seeded_scenes if seeded in answered):
            if scene in self.scenes:
                scenario = open_scene(scene, seed)
                step_sizes = self.effort.ladder(scenario)
                rows = {name: row_of(name) for name in self.engines}
                for name in told_apart(rows, scenario.scene):
                    yield unchanged(SCENE, scene, seed, name, step_sizes)
            if scene in self.option_scenes and seed == self.seed:
                yield from self.changed(scene)
            if scene in self.sweep_scenes:
                yield from self.swept(scene, seed)

    def changed(self, scene: str) -> Iterator[Measurement]:
        """The engines with one option changed, after those without, at the dt the report shows."""
        step_sizes = (middle(scene),)
        for name in dict.fromkeys(option.engine for option in self.options):
            yield unchanged(OPTION, scene, self.seed, name, step_sizes)
        for one in self.options:
            yield Measurement(
                OPTION, scene, self.seed, one.engine, one.change, one.make, step_sizes
            )

    def swept(self, scene: str, seed: int) -> Iterator[Measurement]:
        """Every sweep at every value at the dt the report shows, after its engine over a ladder of
        dt."""
        here = middle(scene)
        for sweep in self.sweeps:
            yield unchanged(SWEEP, scene, seed, sweep.engine, around(here))
            for value in sweep.parameter.values:
                yield Measurement(
                    SWEEP, scene, seed, sweep.name, str(value), sweep.at(value), (here,)
                )


def unchanged(
    kind: str, scene: str, seed: int, name: str, step_sizes: tuple[int, ...]
) -> Measurement:
    """That of an engine as it is."""
    return Measurement(kind, scene, seed, name, PLAIN, row_of(name).make, step_sizes)


def around(here: int) -> tuple[int, ...]:
    """Steps in a sample interval from a fourth of `here` to eight times as many."""
    return tuple(here * 2**k // 4 for k in range(6) if here * 2**k % 4 == 0)


def middle(scene: str) -> int:
    """Steps in a sample interval at the dt the report shows."""
    return open_scene(scene, 0).middle_substeps
