"""`Run`: one scenario played by one engine; its trajectory; its collisions, the starts of contacts
if an engine reports an impulse in every step; and the states from which it cannot go on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import SILENT, ContactImpulse, Engine
from crosscheck2d.scenarios.model import (
    NO_COLLISIONS,
    Collisions,
    Scenario,
    Scene,
    State,
    Trajectory,
    frozen,
)

RUNAWAY = 1e3  # times the way of free flight: a disk farther out was thrown by the engine
STATUSES = ("ok", "unsupported", "diverged", "error", "crashed", "timeout")


@dataclass(frozen=True, eq=False)
class Run:
    """One scenario played by one engine at one dt."""

    engine: str
    profile: str
    scenario: str  # its name
    dt: float  # s
    status: str = "ok"  # one of `STATUSES`
    reason: str = ""  # why the status is not "ok"
    trajectory: Trajectory | None = None  # up to a failure; None if nothing was played
    seconds: float = 0.0  # wall time inside `step` while collisions are recorded; not a benchmark
    settings: dict[str, tuple[Any, Any]] = field(default_factory=dict)  # (asked for, resolved)
    versions: dict[str, str] = field(default_factory=dict)  # library -> version
    frictionless: bool = False  # whether it is refused because the engine models no friction

    @classmethod
    def unplayed(cls, name: str, scenario: Scenario, dt: float) -> Run:
        """Of `engine:profile`, without a trajectory yet."""
        engine, profile = name.split(":")
        return cls(engine, profile, scenario.name, dt)

    @property
    def name(self) -> str:
        return f"{self.engine}:{self.profile}"

    @property
    def silent(self) -> bool:
        return bool(self.settings.get("collisions", (None, None))[1] == SILENT)


def gather(scenario: Scenario, states: Sequence[State], collisions: Collisions) -> Trajectory:
    return Trajectory(
        t=frozen(scenario.times[: len(states)]),
        position=frozen([state.position for state in states]),
        velocity=frozen([state.velocity for state in states]),
        angle=frozen([state.angle for state in states]),
        angular_velocity=frozen([state.angular_velocity for state in states]),
        collisions=collisions,
    )


def substeps_of(scenario: Scenario, dt: float) -> int:
    """How many steps of `dt` s a sample interval has; raises `ValueError` if it does not divide."""
    interval = scenario.sample_interval
    substeps = round(interval / dt)
    if substeps < 1 or abs(substeps * dt - interval) > 1e-9 * interval:
        raise ValueError(f"dt {dt:g} s does not divide the sample interval {interval:g} s")
    return substeps


def collisions_of(engine: Engine, scene: Scene, dt: float) -> Collisions:
    try:
        impulses = engine.collisions()
    except Exception:  # the run already has the reason
        return NO_COLLISIONS
    return first_collisions(impulses, dt, weight_impulse(scene, dt))


def weight_impulse(scene: Scene, dt: float) -> float:
    """N s, the largest impulse of a contact in one step by the weight of all disks."""
    moving = scene.mass[~scene.static].sum()
    return float(2 * moving * np.linalg.norm(scene.gravity) * dt)


def first_collisions(
    collisions: Sequence[ContactImpulse], dt: float, weight: float = 0.0
) -> Collisions:
    """One collision for each start of a pair's impulses; its time is the end of the step.

    An impulse in the step after another of the same pair continues it if it is at most `weight` N
    s, or if the engine does not report its size; else it is a new collision. Impulses of less than
    a millionth of the pair's strongest are rounding, and left out; their magnitude counts, because
    the impulses of a faulty solver may have the wrong sign.
    """
    if not collisions:
        return NO_COLLISIONS
    step, i, j = (np.array(column) for column in list(zip(*collisions))[:3])
    impulse = np.array([collision.impulse for collision in collisions])
    low, high = np.minimum(i, j), np.maximum(i, j)
    disk, other = np.where(low < 0, high, low), np.where(low < 0, low, high)
    order = np.lexsort((step, other, disk))
    rows = step[order], disk[order], other[order], impulse[order]
    starts = first_of_pair(rows[1], rows[2])
    size = np.abs(rows[3])
    strongest = np.maximum.reduceat(np.nan_to_num(size), np.flatnonzero(starts))[
        np.cumsum(starts) - 1
    ]
    step, disk, other, impulse = (row[~(size < 1e-6 * strongest)] for row in rows)
    begins = first_of_pair(disk, other) | (np.diff(step, prepend=step[0]) > 1)
    begins |= np.abs(impulse) > weight
    order = np.flatnonzero(begins)[np.lexsort((other[begins], disk[begins], step[begins]))]
    return Collisions(
        t=frozen((step[order] + 1) * dt),
        i=frozen(disk[order], np.int64),
        j=frozen(other[order], np.int64),
        impulse=frozen(impulse[order]),
    )


def first_of_pair(disk: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.append(True, (np.diff(disk) != 0) | (np.diff(other) != 0))


def reach(scenario: Scenario) -> float:
    """m from the origin, `RUNAWAY` times what free flight under gravity and thrust can reach."""
    scene, duration = scenario.scene, scenario.duration
    thrust = sum(float(np.linalg.norm(t.force)) for t in scenario.thrusts) / scene.mass.min()
    start = max(
        np.abs(scene.position).max(), np.abs(scene.walls).max(initial=0.0), scene.radius.max()
    )
    return RUNAWAY * float(
        start
        + np.abs(scene.velocity).max() * duration
        + (np.linalg.norm(scene.gravity) + thrust) * duration * duration / 2
    )


def fault_of(state: State, farthest: float) -> str:
    """Why a run cannot continue from a state, or ""; `farthest` in m from the origin."""
    # Called after every sample, so sums of squares are tested first: they are finite only if every
    # number is.
    others = state.velocity, state.angle, state.angular_velocity
    if (
        np.vdot(state.position, state.position) <= farthest * farthest
        and sum(np.vdot(a, a) for a in others) < np.inf
    ):
        return ""
    for name in ("position", "velocity", "angle", "angular_velocity"):
        values = getattr(state, name)
        if not np.isfinite(values).all():
            return f"{name} of disk {int(np.argwhere(~np.isfinite(values))[0][0])} is not finite"
    if len(state.position) and (far := np.abs(state.position).max()) > farthest:
        return f"a disk is {far:.3g} m away"
    return ""
