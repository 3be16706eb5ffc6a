"""The displacement, in every engine, of a thrust that starts or stops inside a step, because a
force acts for whole steps."""

from __future__ import annotations

import numpy as np

from crosscheck2d.scenarios.model import Scenario, Thrust

ROUNDING = 1e-9  # of a step: rounding of start / dt, as in `advance`


def off_grid(scenario: Scenario, dt: float) -> float:
    """Radii, the largest displacement of a disk by thrusts that start or stop inside a step of `dt`
    s; 0 if none does.

    The force in such a step is reduced so that its impulse is exact, and acts during the whole
    step. A thrust F that is on for a fraction p of the step moves a disk of mass m by F dt2 p2 / 2m
    from its start on, and by F dt2 (p - p2 / 2) / m up to its stop; spread over the step by F dt2 p
    / 2m. The difference is F dt2 p (1 - p) / 2m either way, up to F dt2 / 8m. It remains, grows
    with every later collision, and is not the engine's fault. A torque displaces the rim likewise.
    The magnitudes of a disk's displacements are added up.
    """
    shift = np.zeros(scenario.scene.n)
    for thrust in scenario.thrusts:
        scene, i = scenario.scene, thrust.disk
        rate = (
            np.linalg.norm(thrust.force) / (scene.mass[i] * scene.radius[i])
            + abs(thrust.torque) / scene.inertia[i]
        )
        shift[i] += rate * dt**2 * spread(thrust, scenario.duration, dt)
    return float(shift.max())


def spread(thrust: Thrust, duration: float, dt: float) -> float:
    """Sum of p (1 - p) / 2 over start and stop, p the share of the step for which the thrust is on
    (or off)."""
    parts = [(at / dt) % 1.0 for at in (thrust.start, thrust.stop) if at < duration]
    return sum(p * (1 - p) / 2 for p in parts if ROUNDING < p < 1 - ROUNDING)


def off_grid_note(scenario: Scenario) -> str:
    """A sentence on the step sizes at which thrusts start or stop inside a step; "" if there are
    none."""
    off = {dt: off_grid(scenario, dt) for dt in map(scenario.dt, scenario.substeps)}
    found = ", ".join(f"{radii:.2g} radii at dt = {dt:.4g} s" for dt, radii in off.items() if radii)
    if not found:
        return ""
    return (
        f"a thrust starts or stops inside a step: every engine is off by up to {found}, and more"
        " after a collision"
    )
