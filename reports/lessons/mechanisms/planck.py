"""What float32 changes: Box2D 2.3 and planck, which is the same algorithm in float64, in the same
scenes.

`uv run --extra js python -m crosscheck2d.reports.lessons.mechanisms.planck` plays both and writes
planck.csv, which the lesson shows: planck is an npm package that need not be installed.
"""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path

import pandas as pd

from crosscheck2d.adapters.box2d import MATCHED
from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.laws import deviation
from crosscheck2d.reports.lessons.lesson import run_of
from crosscheck2d.reports.lessons.mechanisms.recorded import keep
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.model import Scenario, Trajectory
from crosscheck2d.scenarios.no_truth import answered

KEPT = Path(__file__).with_name("planck.csv")
COMMAND = "uv run --extra js python -m crosscheck2d.reports.lessons.mechanisms.planck"
PLANCK, BOX2D = "planck", "box2d"
PROFILES = ("matched", "shipped")
SCENES = ("free_fall", "oblique_e09", "head_on_unequal_e0", "head_on_equal_e09")  # of the lesson
LADDER = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)  # its steps in a sample interval
COLUMNS = [
    "scenario",
    "profile",
    "substeps",
    "dt_s",
    "planck_radii",
    "box2d_radii",
    "deviation_radii",
]
UNITS = {name: MATCHED[name] for name in ("length_unit", "step_unit", "time_unit")}
"""With these planck:matched is box2d:matched in float64."""


@cache
def known(name: str) -> tuple[Scenario, Trajectory | None]:
    """The scene of the catalogue, and its exact answer."""
    return answered(scenario(name))


def played(engine: str, profile: str, name: str, substeps: int) -> Run:
    """One engine in a scene of the catalogue, planck as matched in the units of Box2D."""
    row = f"{engine}:{profile}"
    units = UNITS if row == f"{PLANCK}:matched" else {}
    return run_of(row, known(name)[0], substeps, partial(row_of(row).make, **units))


def whole(run: Run) -> Trajectory | None:
    """The trajectory of a run; None if it does not reach the end of the scene."""
    return run.trajectory if run.status == "ok" else None


def largest_deviation(one: Trajectory | None, other: Trajectory | None, name: str) -> float:
    """Radii: the largest distance of any disk between the two, up to the end of the exact answer;
    nan if there is none of them."""
    scenario, truth = known(name)
    if one is None or other is None or truth is None:
        return float("nan")
    distances = deviation(one, other, scenario.scene)[: len(truth)]
    return float((distances / scenario.scene.radius).max())


def measured(name: str, profile: str, substeps: int) -> dict[str, float | str | int]:
    """A row of the table: the error of both engines, and their deviation from each other."""
    scenario, truth = known(name)
    planck, box2d = (whole(played(each, profile, name, substeps)) for each in (PLANCK, BOX2D))
    return {
        "scenario": name,
        "profile": profile,
        "substeps": substeps,
        "dt_s": scenario.dt(substeps),
        "planck_radii": largest_deviation(planck, truth, name),
        "box2d_radii": largest_deviation(box2d, truth, name),
        "deviation_radii": largest_deviation(planck, box2d, name),
    }


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


def main() -> None:
    """Play both engines in all scenes, and write planck.csv; it takes half a minute."""
    keep(KEPT, table(), [played(engine, PROFILES[0], SCENES[0], 1) for engine in (PLANCK, BOX2D)])


if __name__ == "__main__":
    main()
