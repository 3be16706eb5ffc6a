"""What the JavaScript engines make of pairs that meet head on, for lesson 6.11.

`uv run --extra js python -m crosscheck2d.reports.lessons.mechanisms.javascript_bounces` plays them
and writes javascript_bounces.csv, which the lesson shows: the engines are npm packages that need
not be installed.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.lessons.lesson import run_of
from crosscheck2d.reports.lessons.mechanisms.pairs import CLOSING, at_all_speeds, separation
from crosscheck2d.reports.lessons.mechanisms.recorded import keep, table_in
from crosscheck2d.scenarios.model import Array

KEPT = Path(__file__).with_name("javascript_bounces.csv")
COMMAND = "uv run --extra js python -m crosscheck2d.reports.lessons.mechanisms.javascript_bounces"
ENGINES = ("planck", "matter", "rapier2d")
# what is disabled -> the profile, and the options that do it
VERSIONS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "nothing": ("shipped", {}),
    "air in matter": ("shipped", {"friction_air": 0}),
    "air, rotation in matter": ("shipped", {"friction_air": 0, "turning": False}),
    "air, rotation, iterations in matter": (
        "shipped",
        {"friction_air": 0, "turning": False, "velocity_iterations": 1},
    ),
    "all that matched lifts": ("matched", {}),
}
CHANGED = "matter, changed"  # as shipped but for what is switched off
RESTITUTIONS = (0.5, 0.9, 1.0)


def name_in(engine: str, version: str) -> str:
    """Whose curve it is: `engine:profile`, or `CHANGED`; the options are matter's alone."""
    changed = engine == "matter" and VERSIONS[version][1]
    return CHANGED if changed else f"{engine}:{VERSIONS[version][0]}"


def played(engine: str, version: str, e: float) -> Run:
    """A JavaScript engine at 60 steps a second."""
    profile, options = VERSIONS[version]
    name = f"{engine}:{profile}"
    make = partial(row_of(name).make, **(options if engine == "matter" else {}))
    return run_of(name, at_all_speeds(e), 1, make)


def measured(engine: str, version: str, e: float) -> pd.DataFrame:
    """A row for each closing speed: separation over approach speed. Raises `ValueError` if the
    engine does not play the scene to its end."""
    run = played(engine, version, e)
    if run.status != "ok" or run.trajectory is None:
        raise ValueError(f"{run.name}: {run.status}: {run.reason}")
    ratio = separation(CLOSING)(run.trajectory)
    return pd.DataFrame(
        {"engine": engine, "off": version, "e": e, "closing_m_per_s": CLOSING, "ratio": ratio}
    )


def ratios(engine: str, version: str, e: float) -> Array:
    """(k,) the recorded separation over approach speed at each of `CLOSING`."""
    rows = table_in(KEPT)
    mine = (rows.engine == engine) & (rows.off == version) & (rows.e == e)
    return rows.ratio[mine].to_numpy(float)


def main() -> None:
    """Play all of them and write javascript_bounces.csv; it takes some seconds."""
    cases = [(name, off, e) for name in ENGINES for off in VERSIONS for e in RESTITUTIONS]
    runs = [played(name, "nothing", RESTITUTIONS[0]) for name in ENGINES]
    keep(KEPT, pd.concat([measured(*case) for case in cases]), runs)


if __name__ == "__main__":
    main()
