"""What float32 changes: Box2D 2.3 and planck, which is the same algorithm in float64, in the same
scenes.

`uv run --extra js python -m reports.lessons.mechanisms.planck` plays both and writes planck.csv,
which the lesson shows: planck is an npm package that need not be installed.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date
from functools import cache
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd

from adapters.engine_row import EngineRow
from adapters.engines import ENGINES, FETCHED
from adapters.play import play_once
from adapters.run import Run
from reports.compare.laws import deviation
from reports.terminal.foreign_text import put_text
from scenarios.catalogue import SCENARIOS, scenario
from scenarios.model import Array, Scenario, Trajectory
from scenarios.no_truth import answered

KEPT = Path(__file__).with_name("planck.csv")
COMMAND = "uv run --extra js python -m reports.lessons.mechanisms.planck"
PLANCK, BOX2D = "planck", "box2d"
PROFILES = ("matched", "shipped")
SCENES = ("free_fall", "oblique_e09", "head_on_unequal_e0", "head_on_equal_e09")  # of the lesson
LADDER = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)  # its steps in a sample interval
COLUMNS = ["scenario", "profile", "substeps", "dt_s", "planck_radii", "box2d_radii", "apart_radii"]


@cache
def known(name: str) -> tuple[Scenario, Trajectory | None]:
    """The scene of the catalogue, and its exact answer."""
    return answered(scenario(name))


def run_of(engine: str, profile: str, name: str, substeps: int) -> Run:
    """One engine in a scene of the catalogue."""
    rows: Mapping[str, EngineRow] = FETCHED if engine == PLANCK else ENGINES
    called, (scene, _) = f"{engine}:{profile}", known(name)
    return play_once(rows[called].make, called, scene, scene.dt(substeps))


def off(run: Run, other: Trajectory, scene: Scenario) -> Array:
    """(k,) radii: the largest distance of any disk from where `other` has it, up to the end of
    the exact answer; one nan if the run was not played to its end."""
    truth = known(scene.name)[1]
    if run.status != "ok" or run.trajectory is None or truth is None:
        return np.array([np.nan])
    apart = deviation(run.trajectory, other, scene.scene)[: len(truth)]
    largest: Array = (apart / scene.scene.radius).max(axis=1)
    return largest


def measured(name: str, profile: str, substeps: int) -> dict[str, float | str | int]:
    """A row of the table: the error of both engines, and how far they are apart."""
    scene, truth = known(name)
    assert truth is not None
    planck, box2d = (run_of(engine, profile, name, substeps) for engine in (PLANCK, BOX2D))
    found = {
        "planck_radii": off(planck, truth, scene),
        "box2d_radii": off(box2d, truth, scene),
        "apart_radii": off(planck, box2d.trajectory or truth, scene) + 0 * off(box2d, truth, scene),
    }
    row: dict[str, float | str | int] = {
        "scenario": name,
        "profile": profile,
        "substeps": substeps,
        "dt_s": scene.dt(substeps),
    }
    return row | {column: float(values.max()) for column, values in found.items()}


def table() -> pd.DataFrame:
    """Every scene with an exact answer at its middle step size, and those of the lesson at all of
    `LADDER`; in both profiles."""
    rows = []
    for name in SCENARIOS:
        scene, truth = known(name)
        ladder = {scene.middle_substeps, *(LADDER if name in SCENES else ())}
        if truth is not None:
            rows += [measured(name, profile, k) for profile in PROFILES for k in sorted(ladder)]
    return pd.DataFrame(rows, columns=COLUMNS)


@cache
def kept() -> pd.DataFrame:
    """The table as it was last written."""
    return pd.read_csv(StringIO("\n".join(read()[1])))


def recorded() -> str:
    """When and with which versions it was written."""
    return read()[0].removeprefix("# ")


@cache
def read() -> tuple[str, list[str]]:
    """The first line of planck.csv, and the others."""
    first, *lines = KEPT.read_text(encoding="utf-8").splitlines()
    return first, lines


def main() -> None:
    """Play both engines in all scenes, and write planck.csv; it takes half a minute."""
    found = table()
    runs = [run_of(engine, PROFILES[0], SCENES[0], 1) for engine in (PLANCK, BOX2D)]
    versions = {library: version for run in runs for library, version in run.versions.items()}
    made = ", ".join(f"{library} {version}" for library, version in versions.items())
    text = found.to_csv(index=False, float_format="%.6g")
    put_text(KEPT, f"# {date.today().isoformat()} with {made}\n{text}")


if __name__ == "__main__":
    main()
