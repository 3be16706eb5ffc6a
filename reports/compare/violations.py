"""How far a trajectory breaks the laws of physics, sample by sample, relative to the scales of the
scene.

Each function returns (k,) numbers, or None where the law says nothing. A comparison with the truth
allows for the detection delay (delays.py), and samples that are not judged are nan.
"""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.view import View
from crosscheck2d.scenarios.model import Array, Scenario


def momentum(view: View) -> Array | None:
    """|P(t) - P(0) - impulse from outside| over the momentum at hand (scales.py).

    The outer impulse comes from weight and world-frame thrust. If walls, static disks or a turning
    thrust act, only the engine knows the impulse: None.
    """
    if view.other is not None or not knows_impulses(view.scenario):
        return None
    scene, played = view.scenario.scene, view.played
    actual = laws.momentum(played, scene)
    expected = actual[0] + np.outer(played.t, laws.moving_mass(scene).sum() * scene.gravity)
    for thrust in view.scenario.thrusts:
        expected = expected + np.outer(laws.time_on(thrust, played.t), thrust.force)
    return laws.lengths(actual - expected) / (scales.momentum(view.scenario) or 1.0)


def angular_momentum(view: View) -> Array | None:
    """|L(t) - L(0) - angular impulse from outside| over the angular momentum at hand (scales.py).

    The centre of mass is that of the start, so that the origin does not matter. The total weight
    acts at x0 + v0 t + g t2 / 2, so its torque is known. A thrust acts where its disk is, which
    only the engine knows, and a wrap moves disks: there the law says nothing.
    """
    scene, played = view.scenario.scene, view.played
    silent = scene.wrap is not None or view.scenario.thrusts or not knows_impulses(view.scenario)
    if view.other is not None or silent:
        return None
    m, g, t = laws.moving_mass(scene), scene.gravity, played.t
    lever = np.outer(t**2 / 2, m @ played.velocity[0])
    actual = laws.angular_momentum(played, scene)
    expected = actual[0] + lever[:, 0] * g[1] - lever[:, 1] * g[0]
    share: Array = np.abs(actual - expected) / (scales.angular_momentum(view.scenario) or 1.0)
    return share


def energy(view: View) -> Array | None:
    """|E(t) - E_expected(t)| over the energy at hand (scales.py)."""
    gained = energy_gained(view)
    return None if gained is None else np.abs(gained)


def energy_gained(view: View) -> Array | None:
    """E(t) - E_expected(t) over the energy at hand (scales.py).

    At e = 1 without friction and thrust E_expected is E(0); else it is the truth's. If a scene
    wraps under gravity the law says nothing: a disk that is set onto the opposite edge has another
    height.
    """
    scenario, conserved = view.scenario, keeps_energy(view.scenario)
    if conserved == (view.other is not None) or lifts(scenario):
        return None
    actual = laws.energy(view.played, scenario.scene)
    gained = actual - actual[0] if view.other is None else view.energy_deviation
    return gained / (scales.energy(scenario) or 1.0)


def energy_rise(view: View) -> Array | None:
    """E(t) minus the smallest E before t, over the energy at hand, beyond `laws.half_step`: only
    thrust can add energy."""
    scene = view.scenario.scene
    if view.scenario.thrusts or lifts(view.scenario):
        return None
    actual = laws.energy(view.played, scene)
    slack = laws.half_step(view.played, scene, view.dt)
    rise = actual - slack - np.minimum.accumulate(actual + slack)
    return np.maximum(rise, 0.0) / (scales.energy(view.scenario) or 1.0)


def lifts(scenario: Scenario) -> bool:
    """Whether the wrap of the scene lifts disks against gravity."""
    return scenario.scene.wrap is not None and bool(scenario.scene.gravity.any())


def knows_impulses(scenario: Scenario) -> bool:
    """Whether weight and world-frame thrust are all that acts from outside."""
    fixed = len(scenario.scene.walls) or scenario.scene.static.any()
    return not fixed and all(thrust.frame == "world" for thrust in scenario.thrusts)


def keeps_energy(scenario: Scenario) -> bool:
    """Whether neither collisions nor friction nor thrust change the energy."""
    scene = scenario.scene
    return scene.restitution == 1 and not scene.friction and not scenario.thrusts
