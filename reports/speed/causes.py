"""Why an engine does not keep an error: what its disks do, and the settings or the mechanism
without which the error goes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import isfinite
from operator import attrgetter
from typing import Any

import numpy as np

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.ablated import AblatedReference
from crosscheck2d.adapters.mechanisms.settings import GONE, find_remedy, settings_of, without_finer
from crosscheck2d.adapters.mechanisms.table import (
    AIR,
    END_OF_STEP,
    FRICTION,
    MECHANISMS,
    SKIN,
    mechanisms_of,
)
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.causes import LATE, Cause, CauseKind, by_settings, unknown
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.view import beside
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.speed.budget import LEAST, Budget, NotPlayed, Window
from crosscheck2d.reports.speed.ladder import PURPOSES, scored
from crosscheck2d.reports.terminal.counts import listed
from crosscheck2d.scenarios.model import Scene, Trajectory

SWITCHED = (AIR, SKIN)  # by a setting of each library that has them, which was tried
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

    usual = play_once(row_of(name).make, name, scenario, scenario.dt(scenario.middle_substeps))
    does = ""
    played = usual.trajectory
    if played is not None and (effects := effects_of(played, truth, scenario.scene)):
        does = f"at dt {number(usual.dt * 1e3)} ms a disk {listed(effects)}; cause: "
    remedy = find_remedy(settings_of(name, scenario.scene, dt), error, bound)
    if remedy.settings:
        falls = f"the error falls from {number(remedy.before)} to {number(remedy.after)}"
        return does + by_settings(remedy, name, falls).told
    try:
        mechanism = mechanism_of(scene, seed, name, substeps, purpose)
    except NotPlayed as failure:
        mechanism = unknown(str(failure))
    return "; ".join(filter(None, [f"{does}{mechanism.told}", remedy.sentence(name)]))


def mechanism_of(scene: str, seed: int, name: str, substeps: int, purpose: str) -> Cause:
    """The mechanism without which at most `GONE` of the error in all of the scored part is left; or
    the few that leave no more together with end-of-step detection; or those that were ruled out.
    Raises `NotPlayed`."""
    scenario, truth = scored(scene, seed)
    at = Window(scenario, truth, scenario.dt(substeps))
    run = at.played(row_of(name).make)
    whole, size = at.offset(run), attrgetter("of_energy" if purpose == "energy" else "radii")
    total = size(whole)
    left, together = dict[str, float](), dict[str, float]()
    for words, changes in {} if name in MECHANISMS else CANDIDATES.items():
        make = partial(AblatedReference, **END_OF_STEP | dict(changes))
        left[words] = size(whole - at.offset_of(make))
    if name in MECHANISMS:
        known = mechanisms_of(name, run.settings, scenario.scene, at.dt)
        if name.endswith(":shipped"):
            tried = SWITCHED if scenario.scene.friction else (*SWITCHED, FRICTION)
            known = [each for each in known if each.name not in tried]
        budget = Budget(at, known, whole)
        late = [LATE] if (truth.collisions.impulse > 0).any() else []  # else nothing collides
        left |= dict.fromkeys(late, size(whole - budget.reference([])))
        for mechanism in known:
            if mechanism.parameters:
                left[mechanism.name] = size(whole - budget.contribution(mechanism))
            elif mechanism.without is not None:
                left[mechanism.name] = size(at.offset_of(mechanism.without))
        needed = [each for each in known if each.parameters]
        for mechanism in list(needed):
            fewer = [x for x in needed if x is not mechanism and mechanism.name not in x.on_top]
            if size(whole - budget.reference(fewer)) <= GONE * total:
                needed = fewer
        if needed:
            words = " with ".join([*late, listed([each.name for each in needed])])
            together[words] = size(whole - budget.reference(needed))
    for parts in (left, together):
        least = min(parts, key=lambda part: parts[part], default="")
        if least and total > LEAST and parts[least] <= GONE * total:
            shown = f"without it {number(parts[least] / total, 2)} of the error is left"
            return Cause(CauseKind.MECHANISM, least, shown=shown)
    return unknown(f"without any of these more than half of it is left: {'; '.join(left)}")


def effects_of(played: Trajectory, truth: Trajectory, scene: Scene) -> list[str]:
    """What disks do otherwise than in the exact answer, as ends of a sentence: the deepest overlap,
    and what the disk that differs most has lost or gained of its spin and of its speed."""
    k = min(len(played), len(truth)) - 1
    deep = float(np.max(laws.penetration(played, scene)[: k + 1]))
    effects = [f"sinks {number(deep, 2)} radii into what it touches"] * (deep > SEEN)
    motions = {
        "spin": [np.abs(motion.angular_velocity) for motion in (played, truth)],
        "speed": [laws.lengths(motion.velocity) for motion in (played, truth)],
    }
    for what, (run, exact) in motions.items():
        # of a disk with hardly any spin or speed in the exact answer a share means nothing
        slow = scene.static | (exact[k] <= SEEN * exact.max())
        change = np.where(slow, 0.0, run[k] / np.where(slow, 1.0, exact[k]) - 1)
        worst = float(change[np.abs(change).argmax()])
        if isfinite(worst) and abs(worst) > SEEN:
            effects.append(
                f"{'loses' if worst < 0 else 'gains'} {number(100 * abs(worst), 2)} % of its {what}"
            )
    return effects
