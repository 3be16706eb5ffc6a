"""Opens the requested scenes, by name or as a file, with the requested step sizes."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from crosscheck2d.scenarios.catalogue import scenario as from_catalogue
from crosscheck2d.scenarios.files.scene_file import read_scene_file, scenario_of
from crosscheck2d.scenarios.files.tables import MOST_STEPS
from crosscheck2d.scenarios.model import Scenario


def open_scene(scene: str, seed: int) -> Scenario:
    """A scenario by catalogue name or file path; raises `KeyError` or `SceneFileError`."""
    return read_scene_file(Path(scene)) if scene.endswith(".toml") else from_catalogue(scene, seed)


class SceneSource(NamedTuple):
    """A scene that was played, with what is needed to make its scenario again anywhere.

    Attributes:
        name: its name.
        seed: that of a random scene.
        substeps: the step sizes that were played.
        text: its scene file; "" for a scene of the catalogue.
        digest: its `scene_hash`.
    """

    name: str
    seed: int
    substeps: tuple[int, ...]
    text: str
    digest: str

    def scenario(self) -> Scenario:
        if self.text:
            scenario = scenario_of(tomllib.loads(self.text), f"{self.name}.toml")
        else:
            scenario = from_catalogue(self.name, self.seed)
        return replace(scenario, substeps=self.substeps)


def with_steps(scenario: Scenario, dts: Sequence[float], full: bool) -> Scenario:
    """The scenario with the requested step sizes: `dts` in s instead of its own, two finer ones if
    `full`.

    Raises:
        ValueError: a dt does not divide the sample interval, or is too small; names the scenario
            and the dt.
    """
    ladder, interval = tuple(scenario.substeps), scenario.sample_interval
    most = MOST_STEPS // scenario.intervals
    for dt in dts:
        if dt > 0 and interval / dt > most + 0.5:  # the nearest whole number is more
            raise ValueError(
                f"--dt {dt:g} gives {scenario.name} more than {MOST_STEPS} steps: must be "
                f"{interval / most:.12g} s or more"
            )
        k = round(interval / dt) if dt > 0 else 0
        if k < 1 or abs(k * dt / interval - 1) > 1e-9:
            # Twelve digits: fewer digits may name another step size, which would be refused as
            # this one is.
            raise ValueError(
                f"--dt {dt:.12g} does not fit {scenario.name}: must be its sample interval "
                f"{interval:.12g} s divided by a whole number, e.g. {scenario.dt(ladder[-1]):.12g}"
            )
    if dts:
        ladder = tuple(sorted({round(scenario.sample_interval / dt) for dt in dts}))
    if full:
        ladder += (ladder[-1] * 2, ladder[-1] * 4)
    return replace(scenario, substeps=ladder)
