"""Opens the requested scenes, by name or as a file, with the requested step sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from crosscheck2d.reports.run.archive import stored_scene
from crosscheck2d.reports.run.cells import scene_hash
from crosscheck2d.reports.terminal.exits import Unusable
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.catalogue import scenario as from_catalogue
from crosscheck2d.scenarios.files.scene_file import read_scene_file
from crosscheck2d.scenarios.files.tables import MOST_STEPS
from crosscheck2d.scenarios.model import Scenario

Records = Sequence[dict[str, Any]]  # the lines of a scene's cells, in the order of the tables


def open_scene(scene: str, seed: int) -> Scenario:
    """A scenario by catalogue name or file path; raises `KeyError` or `SceneFileError`."""
    return read_scene_file(Path(scene)) if scene.endswith(".toml") else from_catalogue(scene, seed)


def played_scenario(folder: Path, record: dict[str, Any]) -> Scenario:
    """The scenario of a cell, given its line in the run of `folder`; raises `Unusable` if it has
    changed since."""
    scene = (
        record["scene"]
        if record["scene"] in SCENARIOS
        else str(stored_scene(folder, record["scenario"]))
    )
    scenario = open_scene(scene, record["seed"])
    if scene_hash(scenario) != record["scene_hash"]:
        raise Unusable(
            f"{scenario.name} has changed since it was played; crosscheck run --resume"
            " plays it again"
        )
    return scenario


def scenario_of(folder: Path, records: Records) -> Scenario:
    """The scenario of a scene's cells, with the step sizes played; raises `Unusable` if it has
    changed since."""
    [scenario] = [
        played_scenario(folder, record)
        for record in {one["scene_hash"]: one for one in records}.values()
    ]
    return replace(scenario, substeps=tuple(sorted({record["substeps"] for record in records})))


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
