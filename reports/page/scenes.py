"""What the report says of each scene at its middle step size: the situation to which it belongs,
errors, failed verdicts, and how long an engine follows the exact answer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import OWN, known_row
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.against import ITSELF, TRUTH
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.verdicts import VERDICTS, fails, in_words
from crosscheck2d.reports.compare.view import LEAST_SHARE, NOT_JUDGED
from crosscheck2d.reports.page.style import number
from crosscheck2d.scenarios.model import Scenario, Trajectory

FLIGHT, SINGLE, ROWS, STACKS = "Flight", "Single collisions", "Rows", "Stacks and rest"
CROWDS, SPIN, FRICTION = "Crowds", "Spin", "Friction"
SITUATIONS = {
    FLIGHT: "no collisions in the exact answer",
    SINGLE: "at most two disks move, or no disk meets two others",
    ROWS: "two or more disks on one line, and a third body",
    STACKS: "gravity and e = 0: contacts that last",
    CROWDS: "disks that meet many others",
    SPIN: "a disk turns; these scenes also count above",
    FRICTION: "with friction; these scenes count in no other row",
}
ERROR, ANGLE = "position_max_radii", "angle_max"
EXACT, RIGHT, SEEN, LOST = 1e-6, 1e-3, 0.1, 1.0
"""radii: a smaller error is exact; is right; cannot be seen; and a larger one is a radius off."""
TIE = 2.0
"""Errors within this factor are a tie: half the step divides an error by 1.4 to 3."""
LIBRARIES = {
    "pymunk": ("pymunk", "C, float64"),
    "box2d": ("Box2D 2.3", "C++, float32"),
    "box2d_v3": ("Box2D 3.1", "C, float32"),
    "planck": ("planck", "JavaScript, float64"),
    "matter": ("matter", "JavaScript, float64"),
    "rapier2d": ("Rapier", "Rust in wasm, float32"),
}
OURS = ("reference:exercise", "reference:ordered")
"""Our solvers that stand beside the libraries."""
WITH_FRICTION = {"reference:exercise": "reference:coulomb"}
"""The exercise has no friction; in scenes with friction its copy that has it stands for it."""


class TableNumber(NamedTuple):
    """A number of the tables, and a remark; NaN is not judged, the remark says why."""

    value: float
    remark: str

    @property
    def judged(self) -> bool:
        return not np.isnan(self.value)

    @property
    def text(self) -> str:
        return number(self.value) if self.judged else NOT_JUDGED


Numbers = dict[tuple[str, str], TableNumber]  # (`engine:profile`, metric) -> its number


@laws.cached
def values(comparison: Comparison) -> Numbers:
    """The numbers of a scenario at the middle dt, against the truth or else the laws of physics."""
    table = comparison.table
    near = table.dt_s == comparison.middle_dt
    several = comparison.scenario.scene.n > 1
    numbers: Numbers = {}
    for versus in (ITSELF, TRUTH):  # the truth comes last and replaces the laws
        rows = table[near & (table.versus == versus) & table.metric.isin([*METRICS, *VERDICTS])]
        for row in rows.to_dict("records"):
            disk = f"disk {row['disk']}" if row["disk"] >= 0 and several else ""
            instant = f"at {row['at_s']:.4g} s" if np.isfinite(row["at_s"]) else ""
            remark = ", ".join(filter(None, (disk, instant, str(row["note"]))))
            name = f"{row['engine']}:{row['profile']}"
            numbers[name, str(row["metric"])] = TableNumber(row["value"], remark)
    return numbers


@dataclass(frozen=True, eq=False)
class SceneScores:
    """A scene of a run, its situations as `situations_of`. Engines are named `engine:profile`."""

    comparison: Comparison
    situations: Sequence[str]

    @property
    def name(self) -> str:
        return self.comparison.scenario.name

    @cached_property
    def errors(self) -> dict[tuple[str, float, str], float]:
        """(engine, dt in s, metric) -> the position error in radii and the angle error in rad,
        where they are judged."""
        table = self.comparison.table
        rows = table[(table.versus == TRUTH) & table.metric.isin([ERROR, ANGLE])]
        return values_by(rows[rows.value.notna()])

    @cached_property
    def failed(self) -> dict[tuple[str, float], list[tuple[str, float]]]:
        """(engine, dt in s) -> (id, value) of each verdict that the run fails, the gravest
        first."""
        failed: dict[tuple[str, float], list[tuple[str, float]]] = {}
        for (name, dt, verdict), value in values_by(fails(self.comparison.table)).items():
            failed.setdefault((name, dt), []).append((verdict, value))
        return failed

    @cached_property
    def statuses(self) -> dict[tuple[str, float], str]:
        return {(run.name, run.dt): run.status for run in self.comparison.runs}

    @cached_property
    def refused(self) -> dict[str, str]:
        """Engine -> why it has no result at the middle step size."""
        return {run.name: run.reason for run in self.comparison.middle_runs if run.status != "ok"}

    @cached_property
    def frictionless(self) -> set[str]:
        return {run.name for run in self.comparison.middle_runs if run.frictionless}

    @cached_property
    def counts(self) -> bool:
        """Whether it has an exact answer for at least `LEAST_SHARE` of its samples after the
        start: before that, the disks of a pile have met nothing."""
        truth, intervals = self.comparison.truth, self.comparison.scenario.intervals
        return truth is not None and len(truth) - 1 >= max(1.0, LEAST_SHARE * intervals)

    def error(self, name: str, dt: float | None = None, metric: str = ERROR) -> float:
        """The error of an engine, inf where it has no result or fails a verdict; nan where there is
        nothing to compare with."""
        dt = self.comparison.middle_dt if dt is None else dt
        status = self.statuses.get((name, dt))
        if status is None or (name.endswith(OWN) and status == "unsupported"):
            return np.nan
        if (name, dt) in self.failed or status != "ok":
            return np.inf
        return self.errors.get((name, dt, metric), np.inf) if self.counts else np.nan

    def raw_error(self, name: str) -> float:
        key = (name, self.comparison.middle_dt, ERROR)
        return self.errors.get(key, np.nan) if self.counts else np.nan

    def refuses(self, name: str) -> bool:
        return self.statuses.get((name, self.comparison.middle_dt)) == "unsupported"

    def is_lost(self, name: str) -> bool:
        # a refusal is no loss
        return self.error(name) > LOST and not self.refuses(name)

    def verdicts(self, name: str) -> list[tuple[str, float]]:
        """(id, value) of the verdicts that an engine fails at the middle step size."""
        return self.failed.get((name, self.comparison.middle_dt), [])

    def words(self, name: str) -> list[str]:
        if name in self.refused:
            return [self.refused[name]]
        words = [in_words(verdict, value) for verdict, value in self.verdicts(name)]
        if self.raw_error(name) > LOST:
            end = self.comparison.scenario.duration
            words.append(f"a radius off after {self.follows.get(name, end):.2g} of {end:.2g} s")
        return words

    @cached_property
    def follows(self) -> dict[str, float]:
        # engine -> s, when a disk is first a radius off; inf if none is
        truth, scene = self.comparison.truth, self.comparison.scenario.scene
        times = {}
        for run in self.comparison.middle_runs:
            if run.trajectory is not None and truth is not None:
                off = laws.deviation(run.trajectory, truth, scene) > LOST * scene.radius
                first = int(np.argmax(off.any(axis=1)))
                times[run.name] = float(truth.t[first]) if off.any() else np.inf
        return times

    @cached_property
    def hopeless(self) -> bool:
        """Whether every library that was played is a radius off."""
        names = [run.name for run in self.comparison.middle_runs if is_library(run.name)]
        errors = [error for name in names if not np.isnan(error := self.raw_error(name))]
        return bool(errors) and min(errors) > LOST


def values_by(rows: pd.DataFrame) -> dict[tuple[str, float, str], float]:
    names = rows.engine + ":" + rows.profile
    return dict(zip(zip(names, rows.dt_s.astype(float), rows.metric), rows.value.astype(float)))


def situations_of(scenario: Scenario, truth: Trajectory | None) -> list[str]:
    """The situation of a scene, of the first five of `SITUATIONS`, and `SPIN` if a disk turns;
    `FRICTION` alone of a scene with friction.

    truth: its collisions say which disks meet; without it all disks may meet.
    """
    scene = scenario.scene
    if scene.friction:
        return [FRICTION]
    moving = int(np.isfinite(scene.mass).sum())
    turns = bool(scene.angular_velocity.any()) or any(t.torque for t in scenario.thrusts)
    met: dict[int, set[int]] = {}  # disk -> the other disks with which it collides, walls apart
    pairs = () if truth is None else zip(truth.collisions.i, truth.collisions.j)
    for i, j in pairs:
        for disk, partner in ((int(i), int(j)), (int(j), int(i))):
            if disk >= 0:
                met.setdefault(disk, set()).update({partner} if partner >= 0 else ())
    # centres, velocities and gravity: on one line if these vectors have rank 1
    along = [scene.position - scene.position[0], scene.velocity, scene.gravity[None]]
    scaled = np.vstack([rows / (np.abs(rows).max() or 1.0) for rows in along])
    one_line = int(np.linalg.matrix_rank(scaled, tol=1e-9)) <= 1
    if scene.gravity.any() and scene.restitution == 0:
        kind = STACKS
    elif truth is not None and not met:
        kind = FLIGHT
    elif moving > 1 and scene.n + len(scene.walls) > 2 and one_line:
        kind = ROWS
    elif moving <= 2 or (truth is not None and all(len(disks) < 2 for disks in met.values())):
        kind = SINGLE
    else:
        kind = CROWDS
    return [kind, SPIN] if turns else [kind]


def scenes_of(comparisons: Iterable[Comparison]) -> list[SceneScores]:
    return [SceneScores(each, situations_of(each.scenario, each.truth)) for each in comparisons]


def smooth(scenes: Sequence[SceneScores]) -> list[SceneScores]:
    return [scene for scene in scenes if scene.counts and FRICTION not in scene.situations]


def is_library(name: str) -> bool:
    """Whether an engine is a library, or an engine of the reader's that plugs in like one."""
    row = known_row(name)
    return name.partition(":")[0] in LIBRARIES if row is None else row.outside


def label(name: str) -> str:
    """An engine in a heading: "Box2D 2.3", "reference", the name of a file."""
    engine, _, profile = name.rpartition(":")
    if name.endswith(OWN):
        return engine.rpartition("/")[2]
    if engine in LIBRARIES:
        return LIBRARIES[engine][0]
    if engine == "reference":
        return engine if name == OURS[0] else profile
    return f"{engine} {profile}".removesuffix(" float64").replace("_", "-")


def long_label(name: str) -> str:
    return f"{label(name)}, {name.rpartition(':')[2]}" if is_library(name) else label(name)
