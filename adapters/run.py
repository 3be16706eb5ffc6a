"""`Run`: one scenario played by one engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from crosscheck2d.adapters.engine import SILENT
from crosscheck2d.scenarios.model import Collisions, Scenario, State, Trajectory, frozen

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

    @property
    def name(self) -> str:
        """`engine:profile`, the key in `ENGINES`."""
        return f"{self.engine}:{self.profile}"

    @property
    def silent(self) -> bool:
        """Whether the engine reports no collisions, according to its settings."""
        return bool(self.settings.get("collisions", (None, None))[1] == SILENT)


def unplayed_run(name: str, scenario: Scenario, dt: float) -> Run:
    """A run of `engine:profile` without a trajectory yet."""
    engine, profile = name.split(":")
    return Run(engine, profile, scenario.name, dt)


def gather(scenario: Scenario, states: Sequence[State], collisions: Collisions) -> Trajectory:
    """States at the first samples of a scenario as a `Trajectory`."""
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
