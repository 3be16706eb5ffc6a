"""Finds states from which an engine cannot go on."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.model import Scenario, State

# times the largest distance of free flight: a disk farther out was thrown by the engine
RUNAWAY = 1e3


def reach(scenario: Scenario) -> float:
    """m from the origin, upper bound for free flight under gravity and thrust."""
    scene, t = scenario.scene, scenario.duration
    thrust = sum(float(np.linalg.norm(one.force)) for one in scenario.thrusts) / scene.mass.min()
    start = max(
        np.abs(scene.position).max(), np.abs(scene.walls).max(initial=0.0), scene.radius.max()
    )
    return float(
        start
        + np.abs(scene.velocity).max() * t
        + (np.linalg.norm(scene.gravity) + thrust) * t * t / 2
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
