"""Impacts that were measured: a small sphere thrown obliquely onto a plate, as a disk with the
inertia of a sphere."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from crosscheck2d.scenarios.families.friction import IMPACT, start_of, turning_answer
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.sliding import bounce

MEASURED = np.genfromtxt(
    Path(__file__).with_name("kharaz.csv"), delimiter=",", names=True, encoding="utf-8"
)
"""(m,) angle_deg between velocity and normal; e_t, what is left of the speed along the plate;
spin_rad_s afterwards; NaN where it is not known.

Kharaz, Gorham & Salman, Powder Technology 120, 281, 2001: 5 mm spheres of aluminium oxide, without
spin before. Numbers as digitised for Kratos (DEMApplication, basic_benchmarks/paper_data/
benchmark4_graph1.dat and graph2.dat, "Experiment"); those of Lethe differ by up to 1 %.
"""
RADIUS, DENSITY, SPEED = 0.0025, 4000.0, 3.9  # m, kg/m3, m/s
RESTITUTION, FRICTION = 0.98, 0.092  # as measured there
SPHERE = 5 / 2  # m r2 / I


def oblique_impacts(dt: float, lead: float) -> Scenario:
    """A sphere for each measured angle; all touch the plate after `lead` steps of `dt` s."""
    angle = np.radians(MEASURED["angle_deg"])
    n, wait = len(angle), lead * dt
    along, down = SPEED * np.sin(angle), SPEED * np.cos(angle)
    mass = np.full(n, DENSITY * 4 / 3 * np.pi * RADIUS**3)
    scene = lay_out(
        np.stack([20 * RADIUS * np.arange(n), RADIUS + down * wait], axis=1),
        np.stack([along, -down], axis=1),
        RADIUS,
        mass,
        inertia=mass * RADIUS**2 / SPHERE,
        walls=[[[-1.0, 0.0], [2.0, 0.0]]],
        restitution=RESTITUTION,
        friction=FRICTION,
    )

    def truth(t: Array) -> Trajectory:
        start, v = start_of(scene)
        shape = scene.radius, np.full(n, SPHERE)
        legs = bounce(start, v, *shape, RESTITUTION, FRICTION, float(down[0]) * wait)
        kick = (1 + RESTITUTION) * mass * down
        return turning_answer(scene, t, legs.at(t), [(wait, i, -1, kick[i]) for i in range(n)])

    return Scenario(
        "oblique_impacts",
        "Does an oblique impact turn and brake a 5 mm sphere as the experiment says?",
        f"Kharaz, Gorham & Salman, Powder Technology 120, 281, 2001; {IMPACT}",
        scene,
        duration=32 * dt,
        sample_interval=dt,
        substeps=(1,),
        truth=truth,
    )
