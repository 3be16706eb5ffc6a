"""The error budget of an engine: its mechanisms are enabled in the reference one at a time, and
what they do not explain is the residual; and the share of all errors that is explained.

For each disk and sample, as vectors: engine - truth = contributions + interplay + residual.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from operator import add
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.table import FLIGHT, Mechanism, mechanisms_of, with_mechanisms
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.view import View, cut
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed.ladder import scored
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

TIME, INTERPLAY, SUM, ALL = "time of collisions", "interplay", "sum", "all"
TOTAL, RESIDUAL = "engine", "residual"
TOTALS = (SUM, ALL, TOTAL)
WHOSE = ["scenario", "seed", "engine", "profile", "dt_s", "until_s", "horizon_s", "duration_s"]
COLUMNS = [*WHOSE, "contribution", "position_radii", "energy", "off_engine_radii"]
COLUMNS += ["off_reference_radii", "off_deviation_radii", "closed_deviation_radii", "note"]
EXPLAINED = [*WHOSE, "error_radii", "residual_radii", "note"]
LEAST = 1e-9  # radii; smaller errors are rounding and need no explanation
TO = (0.01, 0.001)  # of an error: an error with a smaller residual counts as explained
# radii, the largest error by end-of-step detection alone: beyond it contributions do not add up
LIMIT = 0.5


class NotPlayed(Exception):
    """The engine failed in the scene, so that there is no error to explain."""


class Offset(NamedTuple):
    """The change by one cause: of the positions (k, m, 2) of the disks that move, in radii, and of
    the energy (k,), over the energy at hand."""

    position: Array
    energy: Array

    def __add__(self, other: Offset) -> Offset:  # type: ignore[override]
        return Offset(self.position + other.position, self.energy + other.energy)

    def __sub__(self, other: Offset) -> Offset:
        return Offset(self.position - other.position, self.energy - other.energy)

    @property
    def radii(self) -> float:
        # root mean square over disks and samples
        return float(np.sqrt((self.position**2).sum(axis=2).mean()))

    @property
    def of_energy(self) -> float:
        return float(np.sqrt((self.energy**2).mean()))


def budget_of(scene: str, seed: int, name: str, substeps: int) -> list[dict[str, Any]]:
    """The error budget of an engine whose mechanisms are known, `name`, in a scene, at `substeps`
    steps a sample interval: a row for each contribution.

    The columns of a row, among others:
        until_s: up to when the scene was evaluated.
        horizon_s: up to when its exact answer holds.
        duration_s: the duration of the scene itself.
        position_radii, energy: root mean square of what the contribution changes; the energy over
            the energy at hand.
        off_engine_radii, off_reference_radii, off_deviation_radii: what disabling it changes in the
            engine, what it changes in the reference with all other mechanisms, and how far these
            two differ.
        closed_deviation_radii: how far the contribution of flight is from its closed form up to
            the first collision.
        note: why there are no numbers.
    """
    at = window_of(scene, seed, substeps)
    scenario, dt, horizon = at.scenario, at.dt, scored(scene, seed).scenario.duration
    who = scenario.name, seed, *name.split(":"), dt
    extents = scenario.duration, horizon, open_scene(scene, seed).duration
    known: dict[str, Any] = dict(zip(WHOSE, (*who, *extents), strict=True))
    try:
        run = at.played(row_of(name).make)
        budget = Budget(at, mechanisms_of(name, run.settings, scenario.scene, dt), at.offset(run))
        contributions, checks = budget.contributions(), budget.ablated_in_both()
    except NotPlayed as failure:
        return [known | {"contribution": TOTAL, "note": str(failure)}]
    deviation = at.flight_deviation(contributions[FLIGHT], row_of(name).alpha)
    checks[FLIGHT] = {"closed_deviation_radii": deviation}
    rows = []
    for contribution, offset in contributions.items():
        numbers = {"position_radii": offset.radii, "energy": offset.of_energy}
        numbers |= checks.get(contribution, {})
        rows.append(known | {"contribution": contribution, "note": ""} | numbers)
    return rows


def window_of(scene: str, seed: int, substeps: int) -> Window:
    scenario, truth = scored(scene, seed)
    whole = Window(scenario, truth, scenario.dt(substeps))
    late = whole.played(partial(with_mechanisms, [])).trajectory
    assert late is not None
    off = (laws.deviation(late, truth, scenario.scene) / scenario.scene.radius).max(axis=1)
    last = max(int(np.append(np.flatnonzero(off > LIMIT), len(off))[0]) - 1, 1)
    shorter = replace(scenario, duration=last * scenario.sample_interval)
    # All collisions are kept: one just after the end is near to the last samples, too.
    return Window(shorter, replace(cut(truth, last + 1), collisions=truth.collisions), whole.dt)


@dataclass(frozen=True)
class Window:
    scenario: Scenario
    truth: Trajectory
    dt: float

    def played(self, make: Callable[[], Engine]) -> Run:
        """Raises `NotPlayed`: the engine failed."""
        run = play_once(make, "one:run", self.scenario, self.dt)
        if run.status != "ok":
            raise NotPlayed(f"{run.status}: {run.reason}")
        return run

    def offset(self, run: Run) -> Offset:
        """The error of a run; of energies in collision-free samples only, as a collision found a
        step late changes the whole energy."""
        scene, truth, played = self.scenario.scene, self.truth, run.trajectory
        assert played is not None
        moving = ~scene.static
        position = laws.difference(played, truth, scene)[:, moving] / scene.radius[moving, None]
        energy = laws.energy(played, scene) - laws.energy(truth, scene)
        free = View(self.scenario, self.dt, played, truth).collision_free_samples
        return Offset(position, energy[free] / (scales.energy(self.scenario) or 1.0))

    def offset_of(self, make: Callable[[], Engine]) -> Offset:
        return self.offset(self.played(make))

    def flight_deviation(self, contribution: Offset, alpha: float) -> float:
        """radii, at most, from (alpha - 1/2) dt (v(t) - v(0)) up to the first collision; see
        `EngineRow.alpha`."""
        truth, scene = self.truth, self.scenario.scene
        moving, free = ~scene.static, truth.t < truth.collisions.t.min(initial=np.inf)
        gained = (truth.velocity - truth.velocity[0])[free][:, moving]
        closed = (alpha - 0.5) * self.dt * (gained / scene.radius[moving, None])
        return float(np.abs(contribution.position[free] - closed).max(initial=0.0))


class Budget:
    """The error of one engine, and its mechanisms; each set of mechanisms is played only once."""

    def __init__(self, at: Window, mechanisms: Sequence[Mechanism], total: Offset) -> None:
        self.at, self.mechanisms, self.total = at, mechanisms, total
        self.known: dict[tuple[str, ...], Offset] = {}

    def contributions(self) -> dict[str, Offset]:
        """The contribution of each mechanism, then interplay, residual, sum, all together, and the
        engine. The mechanisms that the reference does not have are disabled in the engine, one
        after the other."""
        contributions, engine = {TIME: self.reference([])}, self.total
        for mechanism in self.mechanisms:
            if mechanism.parameters:
                contributions[mechanism.name] = self.contribution(mechanism)
            elif mechanism.without is not None:
                without = self.at.offset_of(mechanism.without)
                contributions[mechanism.name] = engine - without
                engine = without
        outside = [contributions[x.name] for x in self.mechanisms if not x.parameters]
        summed = reduce(add, contributions.values())
        reached = reduce(add, outside, self.reference(self.mechanisms))
        contributions |= {INTERPLAY: reached - summed, RESIDUAL: self.total - reached}
        return contributions | {SUM: summed, ALL: reached, TOTAL: self.total}

    def contribution(self, mechanism: Mechanism) -> Offset:
        below = [each for each in self.mechanisms if each.name in mechanism.on_top]
        return self.reference([*below, mechanism]) - self.reference(below)

    def ablated_in_both(self) -> dict[str, dict[str, float]]:
        """contribution -> what disabling it changes in the engine, and in the reference with
        all the rest enabled."""
        changes = {}
        for mechanism in self.mechanisms:
            if mechanism.parameters and mechanism.without is not None:
                rest = [each for each in self.mechanisms if each is not mechanism]
                in_engine = self.total - self.at.offset_of(mechanism.without)
                in_reference = self.reference(self.mechanisms) - self.reference(rest)
                changes[mechanism.name] = {
                    "off_engine_radii": in_engine.radii,
                    "off_reference_radii": in_reference.radii,
                    "off_deviation_radii": (in_engine - in_reference).radii,
                }
        return changes

    def reference(self, mechanisms: Sequence[Mechanism]) -> Offset:
        names = tuple(mechanism.name for mechanism in self.mechanisms if mechanism in mechanisms)
        if names not in self.known:
            self.known[names] = self.at.offset_of(partial(with_mechanisms, mechanisms))
        return self.known[names]


def explain(budget: pd.DataFrame) -> pd.DataFrame:
    """A row for each scene and engine, of `EXPLAINED`: its error, its residual (root mean squares),
    and how far the scene was evaluated, its exact answer goes, and the scene goes; note: why the
    engine has no error.
    """
    total, residual = (budget[budget.contribution == name] for name in (TOTAL, RESIDUAL))
    errors = total.rename(columns={"position_radii": "error_radii"})
    left = residual[[*WHOSE, "position_radii"]].set_axis([*WHOSE, "residual_radii"], axis=1)
    return errors.merge(left, on=WHOSE, how="left")[EXPLAINED]


def cut_scenes(table: pd.DataFrame) -> pd.DataFrame:
    """scenario, until_s and horizon_s of the scenes that are evaluated for a shorter time than
    their exact answer lasts; `table` as `explain` gives it."""
    scenes = table.drop_duplicates("scenario")[["scenario", "until_s", "horizon_s"]]
    return scenes[scenes.until_s < scenes.horizon_s * (1 - 1e-9)]


def explained_share(table: pd.DataFrame) -> str:
    """How many errors have a residual below each of `TO`, over which part of the scenes, and what
    is left out, as the page and README show it; `table` as `explain` gives it."""
    are_explained = "is explained", "are explained"
    scenes, short = table.drop_duplicates("scenario"), cut_scenes(table)
    engines = len(table[["engine", "profile"]].drop_duplicates())
    played = table[table.note == ""]
    errors = played[played.error_radii > LEAST]
    exact, failed = len(played) - len(errors), len(table) - len(played)
    left = errors.residual_radii / errors.error_radii
    within = [int((left <= bound).sum()) for bound in TO]
    whose = [f"{counted(engines, 'engine')} in {counted(len(scenes), 'scene')}"]
    whose += [f"{exact} more below {LEAST:g} radii"] * (exact > 0)
    whose += [f"{failed} not played"] * (failed > 0)
    sentence = (
        f"of {counted(len(errors), 'error')} ({'; '.join(whose)})"
        f" {counted(within[0], *are_explained)} to 1 %, {within[1]} to 0.1 %, over"
        f" {scenes.until_s.sum():.0f} of {scenes.horizon_s.sum():.0f} simulated seconds"
    )
    if short.empty:
        return f"{sentence}, up to the end of every exact answer"
    rows = zip(short.scenario, short.until_s, short.horizon_s)
    places = ", ".join(f"{scene} at {until:.2g} of {end:.2g} s" for scene, until, end in rows)
    whole = left[~errors.scenario.isin(short.scenario)]
    explained = counted(int((whole <= TO[0]).sum()), *are_explained)
    return (
        f"{sentence}: {counted(len(short), 'scene is', 'scenes are')} cut where end-of-step"
        f" detection alone puts a disk {LIMIT:g} radii off ({places}). Of the"
        f" {counted(len(whole), 'error')} in scenes that are not cut, {explained} to 1 %"
    )
