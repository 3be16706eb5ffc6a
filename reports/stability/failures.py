"""Keeps the part of the first failing run at a limit that the page shows: the samples around the
failure, and the collisions among them."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.reports.page.replay import COLLISIONS
from crosscheck2d.reports.run.trajectories import STATE, load_trajectory, packed
from crosscheck2d.reports.stability.limits import Limit, Trial
from crosscheck2d.reports.stability.search import LimitSearch
from crosscheck2d.scenarios.model import Collisions, Scenario, Trajectory, frozen
from crosscheck2d.scenarios.no_truth import NoTruth

BEFORE, AFTER = 120, 40  # samples of a failure that are shown


def failure_files(search: LimitSearch, limit: Limit) -> list[bytes]:
    """The first failing run of a search, and the trajectory that is shown with it, if there is one,
    as the bytes of files."""
    failing, seen = limit.failing, search.failure(limit)
    if failing is None or seen is None or seen[1].trajectory is None:
        return []
    scenario, run = seen
    assert run.trajectory is not None
    shown = near(failing, scenario)
    trajectories = [run.trajectory]
    with suppress(NoTruth):
        if scenario.truth is not None:
            trajectories.append(scenario.truth(scenario.times))
    return [packed(part_of(one, shown, scenario), small=True) for one in trajectories]


def kept_failure(
    limit: Limit, folder: Path, scenario: Scenario
) -> tuple[Trajectory, Trajectory | None] | None:
    """The saved failing run and the trajectory shown with it; None if nothing was saved, or the
    file does not fit the scenario."""
    path = file_of(limit.case, limit.engine, folder)
    if not path.exists() or limit.failing is None:
        return None
    companion = companion_file(path)
    try:
        found = load_trajectory(path), load_trajectory(companion) if companion.exists() else None
    except (OSError, ValueError):
        return None
    most = len(near(limit.failing, scenario))
    return found if all(one is None or of_scenario(one, scenario, most) for one in found) else None


def of_scenario(one: Trajectory, scenario: Scenario, most: int) -> bool:
    """Whether arrays read from a file can be a trajectory of the scenario with at most this many
    samples."""
    k, n, collisions = len(np.atleast_1d(one.t)), scenario.scene.n, one.collisions
    shapes = {
        "t": (k,),
        "position": (k, n, 2),
        "velocity": (k, n, 2),
        "angle": (k, n),
        "angular_velocity": (k, n),
    }
    columns = [collisions.t, collisions.i, collisions.j, collisions.impulse]
    return (
        k <= most
        and all(getattr(one, name).shape == shape for name, shape in shapes.items())
        and all(
            column.shape == collisions.t.shape == (collisions.t.size,)
            and column.dtype.kind in "iuf"
            for column in columns
        )
        and bool(((collisions.i >= 0) & (collisions.i < n) & (collisions.j < n)).all())
    )


def file_of(case: str, engine: str, folder: Path) -> Path:
    """The file of the failing run."""
    name = f"{case}.{engine}"
    if "/" in name or len(name) > 200:  # files in two folders may have the same name
        digest = hashlib.sha256(name.encode()).hexdigest()[:8]
        name = f"{Path(case).name}.{Path(engine).name}-{digest}"[-200:]
    name = name.replace(":", "-")
    return folder / "trajectories" / f"{name}.npz"


def companion_file(path: Path) -> Path:
    """The file of the trajectory that is shown with the failing run of the file `path`."""
    return path.with_name(f"beside.{path.name}")


def near(failing: Trial, scenario: Scenario) -> NDArray[np.int64]:
    """The samples around the failure, up to `BEFORE` before and `AFTER` after it; if the failure
    is early or late in the run, more from the other side."""
    at = failing.at if np.isfinite(failing.at) else 0.0
    middle = int(np.clip(round(at / scenario.sample_interval), 0, scenario.intervals))
    first = max(0, min(middle - BEFORE, scenario.intervals - BEFORE - AFTER))
    return np.arange(first, min(scenario.intervals, first + BEFORE + AFTER) + 1)


def part_of(whole: Trajectory, shown: NDArray[np.int64], scenario: Scenario) -> Trajectory:
    """A trajectory at those of the samples `shown` that it has, and the collisions between them,
    if they are few enough to show."""
    first, last = shown[0], shown[-1]
    t, x, v, angle, spin = (
        frozen(getattr(whole, name)[first : last + 1]) for name in ("t", *STATE)
    )
    collisions = whole.collisions
    low, high = (k * scenario.sample_interval for k in (first - 0.5, last + 0.5))
    among = (collisions.t >= low) & (collisions.t <= high)
    among &= among.sum() <= COLLISIONS
    columns = [getattr(collisions, name)[among] for name in ("t", "i", "j", "impulse")]
    return Trajectory(t, x, v, angle, spin, Collisions(*columns))
