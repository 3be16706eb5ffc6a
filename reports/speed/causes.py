"""Why an engine does not keep an error: what its disks do, and the settings or the mechanism
without which the error goes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from adapters.engines import row_of
from adapters.mechanisms.ablated import AblatedReference
from adapters.mechanisms.settings import GONE, find_remedy, settings_of, without_finer
from adapters.mechanisms.table import END_OF_STEP, MECHANISMS
from adapters.play import play_once
from reports.compare import laws
from reports.compare.delays import jumps_of
from reports.compare.view import beside
from reports.page.style import number
from reports.speed.budget import (
    INTERPLAY,
    RESIDUAL,
    TIME,
    TOTAL,
    TOTALS,
    NotPlayed,
    budget_of,
    window_of,
)
from reports.speed.explained import LEAST
from reports.speed.purposes import PURPOSES
from reports.speed.scored_part import scored
from reports.terminal.counts import listed
from scenarios.model import Scene, Trajectory

LATE = "end-of-step detection"
SEEN = 0.01  # radii, or of a spin or speed: what is less is not worth a word
EXERCISE = {"alpha": 1.0, "project": True, "project_walls": True}
CANDIDATES: dict[str, Mapping[str, Any]] = {
    LATE: {},
    f"{LATE} with explicit Euler": {"alpha": 0.0},
    f"{LATE} with symplectic Euler": {"alpha": 1.0},
    f"{LATE} with symplectic Euler and overlaps corrected at once": EXERCISE,
    "e² in place of e": {"mixing": "the product"},
    "no friction": {"friction": 0.0},
}
"""What an engine may do whose mechanisms are not known: words, and the ablated reference that does
the same."""


def cause_of(scene: str, seed: int, name: str, substeps: int, purpose: str, bound: float) -> str:
    """Why the engine's error of a purpose exceeds the bound at `substeps` steps a sample interval,
    as a sentence without its stop."""
    scenario, truth = scored(scene, seed)
    dt, jumps = scenario.dt(substeps), jumps_of(truth, scenario)

    def error(parameters: Mapping[str, Any]) -> float:
        chosen, steps = without_finer(parameters)
        run = play_once(partial(row_of(name).make, **chosen), name, scenario, dt / steps)
        if run.status != "ok" or run.trajectory is None:
            return np.inf
        return PURPOSES[purpose].error(beside(scenario, run, truth, jumps))

    seen = play_once(row_of(name).make, name, scenario, scenario.dt(scenario.middle_substeps))
    effects = []
    if seen.trajectory is not None:
        effects = effects_of(seen.trajectory, truth, scenario.scene)
    does = ""
    if effects:
        does = f"at dt {number(seen.dt * 1e3)} ms a disk {listed(effects)}; cause: "
    remedy = find_remedy(settings_of(name, scenario.scene, dt), error, bound)
    if remedy.settings:
        falls = f"the error falls from {number(remedy.before)} to {number(remedy.after)}"
        return f"{does}{remedy.sentence(name)}: {falls}"
    measure = "energy" if purpose == "energy" else "position_radii"
    try:
        mechanism = mechanism_of(scene, seed, name, substeps, measure)
    except NotPlayed as failure:
        mechanism = f"not known: {failure}"
    return "; ".join(filter(None, [f"{does}{mechanism}", remedy.sentence(name)]))


def mechanism_of(scene: str, seed: int, name: str, substeps: int, measure: str) -> str:
    """The mechanism without which at most `GONE` of the error is left, or those that were ruled
    out. Raises `NotPlayed`."""
    if name in MECHANISMS:
        rows = budget_of(scene, seed, name, substeps)
        if rows[0]["note"]:
            raise NotPlayed(rows[0]["note"])
        total = next(row[measure] for row in rows if row["contribution"] == TOTAL)
        left = {
            LATE if row["contribution"] == TIME else row["contribution"]: row[f"left_{measure}"]
            for row in rows
            if row["contribution"] not in (*TOTALS, INTERPLAY, RESIDUAL)
        }
    else:
        at = window_of(scene, seed, substeps)
        whole = at.offset(at.played(row_of(name).make))
        size = "of_energy" if measure == "energy" else "radii"
        total = getattr(whole, size)
        left = {
            words: getattr(whole - at.offset(at.played(partial(ablated, changes))), size)
            for words, changes in CANDIDATES.items()
        }
    least = min(left, key=lambda part: left[part])
    if total > LEAST and left[least] <= GONE * total:
        return f"{least}: without it {number(left[least] / total, 2)} of the error is left"
    return f"not known: without any of these more than half of it is left: {'; '.join(left)}"


def ablated(changes: Mapping[str, Any]) -> AblatedReference:
    """The ablated reference with end-of-step detection and these parameters."""
    return AblatedReference(**END_OF_STEP | dict(changes))


def effects_of(played: Trajectory, truth: Trajectory, scene: Scene) -> list[str]:
    """What disks do otherwise than in the exact answer, as ends of a sentence: the deepest overlap,
    and what the disk that differs most has lost or gained of its spin and of its speed."""
    k = min(len(played), len(truth)) - 1
    deep = float(np.max(laws.penetration(played, scene)[: k + 1]))
    effects = [f"sinks {number(deep, 2)} radii into what it touches"] * (deep > SEEN)
    spins = np.abs(played.angular_velocity[k]), np.abs(truth.angular_velocity[k])
    speeds = (laws.lengths(one.velocity[k]) for one in (played, truth))
    for what, (is_, ought) in {"spin": spins, "speed": tuple(speeds)}.items():
        # of a disk without spin or speed in the exact answer there is no share
        change = np.where(scene.static | (ought == 0), 0.0, is_ / np.where(ought, ought, 1.0) - 1)
        worst = float(change[np.abs(change).argmax()])
        if isfinite(worst) and abs(worst) > SEEN:
            effects.append(
                f"{'loses' if worst < 0 else 'gains'} {number(100 * abs(worst), 2)} % of its {what}"
            )
    return effects
