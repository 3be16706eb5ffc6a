"""A thrown disk, and how far an engine is above its parabola."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from adapters.mechanisms.ablated import AblatedReference
from reports.lessons.lesson import Claim, Curve, LessonChart, Shown
from reports.lessons.mechanisms.ablation import distances, filmed, over_time, runs_of
from reports.page.style import TRUTH
from scenarios.families.lesson import free_fall
from scenarios.model import Array

FlightClaims = Callable[[Array], list[Claim]]
ROUNDING_MM = 1e-9  # of some 400 float64 additions of metres, in mm


def falling(engine: str, on: AblatedReference, substeps: int, claims: FlightClaims) -> Shown:
    """mm above the parabola of a thrown disk; `claims` are made of g dt t / 2 in mm."""
    scenario = free_fall()
    assert scenario.truth is not None
    exact = scenario.truth(scenario.times).position
    runs = runs_of([engine], on, scenario, substeps)
    curves = over_time(runs, lambda each: 1e3 * (each.position - exact)[:, 0, 1])
    facts = distances(runs, curves, "mm")
    curves.append(Curve(TRUTH, scenario.times, np.zeros(scenario.intervals + 1)))
    offset = 1e3 * 9.81 * scenario.dt(substeps) * scenario.times / 2
    return Shown(
        [LessonChart("Above the parabola", "time in s", "mm", curves)],
        filmed(scenario, runs),
        facts,
        claims(offset),
    )
