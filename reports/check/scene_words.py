"""A scene of a check in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from crosscheck2d.reports.check.rows import shown
from crosscheck2d.scenarios.model import Scenario

if TYPE_CHECKING:
    from crosscheck2d.reports.check.smallest_scene import Smallest


def scene_lines(scenario: Scenario) -> list[str]:
    """A scene in words, a line for each sphere."""
    scene, lines = scenario.scene, []
    for k in range(scene.n):
        lines.append(
            f"at {shown(scene.position[k])} m, {shown(scene.velocity[k])} m/s, size"
            f" {shown(scene.radius[k])} m, mass {shown(scene.mass[k])} kg"
        )
        for thrust in (thrust for thrust in scenario.thrusts if thrust.disk == k):
            lines[-1] += f", force {shown(thrust.force)} N, torque {shown(thrust.torque)} N m"
            lines[-1] += f", MoI {shown(scene.inertia[k])} kg m²"
    return lines


def faults_of(one: Smallest) -> str:
    """The faults that a scene shows: "fault 1", "faults 1 and 2"."""
    return f"fault{'s' * (len(one.of) > 1)} {' and '.join(map(str, one.of))}"


def together(one: Smallest) -> str:
    """A sentence if several faults change the same numbers of a scene."""
    numbers = " and ".join(map(str, one.of))
    return f"Faults {numbers} change the same numbers here: the scene shows them together."
