"""What is asked for, and everybody who is played and timed for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from adapters.engine import Engine
from adapters.engines import row_of
from adapters.mechanisms.features import DIALS, FEATURES, Dial, Feature
from reports.speed import ladder
from reports.speed.effort import Effort

SCENE, FEATURE, DIAL = "scene", "feature", "dial"
PLAIN = ""  # the change of an engine that is not changed
Reach = Mapping[tuple[str, int], int]  # (scene, seed) -> how many sample intervals have an exact answer


class Measurement(NamedTuple):
    """An engine in a scene, drawn from a seed, at some steps of the sample interval (coarse to fine).

    kind: which question it is for: the ladders of all scenes, the features, or the dials. `change` is a row of
    `FEATURES`, a value of a dial, or `PLAIN`.
    """

    kind: str
    scene: str
    seed: int
    name: str
    change: str
    make: Callable[[], Engine]
    rungs: tuple[int, ...]

    @property
    def task(self) -> tuple:
        """What stands for it where results are kept."""
        return ("error", *self[:5], *self.rungs)

    @property
    def errors(self) -> Callable[[], list[dict[str, Any]]]:
        """How to find how far off it is."""
        return partial(ladder.errors_of, self.scene, self.seed, self.name, self.make, self.rungs)


@dataclass(frozen=True)
class Plan:
    """What is asked for: scenes and engines by name, how much, from which seed, with how many workers.

    whole: not only these scenes, but the changed engines and the numbers of disks, too.
    """

    scenes: Sequence[str]
    engines: Sequence[str]
    effort: Effort
    seed: int
    workers: int
    whole: bool = True

    @property
    def features(self) -> list[Feature]:
        """The rows of `FEATURES` for the engines that are asked for."""
        return [feature for feature in FEATURES if self.whole and feature.engine in self.engines]

    @property
    def dials(self) -> list[Dial]:
        """The rows of `DIALS` for the engines that are asked for."""
        return [dial for dial in DIALS if self.whole and dial.engine in self.engines]

    @property
    def feature_scenes(self) -> tuple[str, ...]:
        """Where the changed engines are measured, if any are."""
        return self.effort.feature_scenes if self.features else ()

    @property
    def dial_scenes(self) -> tuple[str, ...]:
        """Where the dials are turned, if any are."""
        return self.effort.dial_scenes if self.dials else ()

    @property
    def budget_scenes(self) -> tuple[str, ...]:
        """Where errors are taken apart: in the scenes asked for, if any are."""
        return self.effort.budget_scenes if self.whole else tuple(self.scenes)

    @property
    def draws(self) -> list[tuple[str, int]]:
        """(scene, seed) of all that an exact answer is needed for."""
        scenes = dict.fromkeys((*self.scenes, *self.feature_scenes, *self.dial_scenes))
        draws = [(scene, seed) for scene in scenes for seed in self.effort.seeds_of(scene, self.seed)]
        return draws + [(scene, self.seed) for scene in self.budget_scenes if scene not in scenes]

    def measurements(self, reach: Reach) -> Iterator[Measurement]:
        """Everybody, in every draw that has an exact answer."""
        drawn = {draw for draw, samples in reach.items() if samples}
        for scene, seed in (draw for draw in self.draws if draw in drawn):
            if scene in self.scenes:
                rungs = self.effort.ladder(ladder.open_scene(scene, seed))
                yield from (
                    Measurement(SCENE, scene, seed, name, PLAIN, row_of(name).make, rungs) for name in self.engines
                )
            if scene in self.feature_scenes and seed == self.seed:
                yield from self.changed(scene)
            if scene in self.dial_scenes:
                yield from self.turned(scene, seed)

    def changed(self, scene: str) -> Iterator[Measurement]:
        """Every changed engine, after those they are set against, at the dt the report shows."""
        rungs = (middle(scene),)
        for name in dict.fromkeys(feature.engine for feature in self.features):
            yield Measurement(FEATURE, scene, self.seed, name, PLAIN, row_of(name).make, rungs)
        for one in self.features:
            yield Measurement(FEATURE, scene, self.seed, one.engine, one.change, one.make, rungs)

    def turned(self, scene: str, seed: int) -> Iterator[Measurement]:
        """Every dial at every value at the dt the report shows, and its engine over a ladder of dt beside it."""
        here = middle(scene)
        for dial in self.dials:
            yield Measurement(DIAL, scene, seed, dial.engine, PLAIN, row_of(dial.engine).make, around(here))
            for value in dial.values:
                yield Measurement(DIAL, scene, seed, dial.name, str(value), dial.at(value), (here,))


def around(here: int) -> tuple[int, ...]:
    """Steps in a sample interval from a fourth of `here` to eight times as many."""
    return tuple(here * 2**k // 4 for k in range(6) if here * 2**k % 4 == 0)


def middle(scene: str) -> int:
    """Steps in a sample interval at the dt the report shows."""
    rungs = ladder.open_scene(scene, 0).substeps
    return rungs[len(rungs) // 2]
