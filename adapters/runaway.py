"""What is wrong with a state that no engine can be played on from."""

from __future__ import annotations

import numpy as np

from scenarios.model import Scenario, State

# times as far as anything can fly in a scene: a disk beyond that has been thrown by the engine
RUNAWAY = 1e3


def reach(scenario: Scenario) -> float:
    """m from the origin, no less than any disk can get in free flight under gravity and thrust."""
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
    """What is wrong with a state that cannot be gone on from, or ""; `farthest` in m from the
    origin."""
    # Asked after every sample, so sums of squares are asked first: they are finite only if every
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
