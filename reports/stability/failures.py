"""The replay of the first run that failed at a limit: the samples around the failure, packed for
the page."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.page.replay import COLLISIONS, pack_layers, ratio_of
from crosscheck2d.reports.run.trajectories import STATE
from crosscheck2d.reports.stability.limits import Limit, Trial
from crosscheck2d.reports.stability.search import LimitSearch
from crosscheck2d.scenarios.model import Collisions, Scenario, Trajectory, frozen
from crosscheck2d.scenarios.no_truth import NoTruth

BEFORE, AFTER = 120, 40  # samples of a failure that are shown
SECONDS = 5.0  # that a replay lasts


def with_failure(search: LimitSearch, limit: Limit) -> Limit:
    """The limit with the replay of its first failing run and the trajectory that is shown with it,
    if there is one."""
    failing, failure = limit.failing, search.failure(limit)
    if failing is None or failure is None or failure[1].trajectory is None:
        return limit
    scenario, run = failure
    shown, trajectories = near(failing, scenario), [failure[1].trajectory]
    with suppress(NoTruth):
        if scenario.truth is not None:
            trajectories.append(scenario.truth(scenario.times))
    engine, profile = limit.engine.split(":")
    runs = Run(engine, profile, limit.case, run.dt), None
    parts = [part_of(trajectory, shown, scenario) for trajectory in trajectories]
    layers = [(run, part) for run, part in zip(runs, parts) if len(part)]
    pack = pack_layers(scenario, layers, shown, opening(failing, scenario, shown))
    return replace(limit, replay=pack, ratio=ratio_of(scenario, layers))


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
    names = ("t", *STATE)
    state: dict[str, Any] = {n: frozen(getattr(whole, n)[first : last + 1]) for n in names}
    collisions = whole.collisions
    low, high = (k * scenario.sample_interval for k in (first - 0.5, last + 0.5))
    among = (collisions.t >= low) & (collisions.t <= high)
    among &= among.sum() <= COLLISIONS
    columns = [getattr(collisions, name)[among] for name in ("t", "i", "j", "impulse")]
    return replace(whole, **state, collisions=Collisions(*columns))


def opening(failing: Trial, scenario: Scenario, shown: NDArray[np.int64]) -> dict[str, Any]:
    """The time at which the player starts, a tenth of the shown time before the failure, and
    what it marks."""
    first, last = float(scenario.times[shown[0]]), float(scenario.times[shown[-1]])
    at = min(max(failing.at, first), last) if np.isfinite(failing.at) else first
    return {
        "opens": max(first, at - max(0.1 * (last - first), 1.5 * scenario.sample_interval)),
        "pace": (last - first) / SECONDS,
        "event": {"t": at, "disk": failing.disk},
    }
