"""A thrown disk, and how far an engine is above its parabola."""

from __future__ import annotations

from collections.abc import Callable

from crosscheck2d.reports.lessons.lesson import Claim, Makes, Shown, Simulation
from crosscheck2d.reports.lessons.mechanisms.ablation import ABLATED, PLAIN, distances
from crosscheck2d.scenarios.families.lesson import free_fall
from crosscheck2d.scenarios.model import Array

ROUNDING_MM = 1e-9  # of some 400 float64 additions of metres, in mm


def falling(
    engine: str, makes: Makes, substeps: int, claims: Callable[[Array], list[Claim]]
) -> Shown:
    """mm above the parabola of a thrown disk; `claims` are made of g dt t / 2 in mm."""
    scenario = free_fall()
    played = Simulation.by(scenario, (engine, PLAIN, ABLATED), substeps, makes)
    exact = played.truth.position
    chart = played.over_time(
        "Above the parabola", "mm", lambda each: 1e3 * (each.position - exact)[:, 0, 1]
    )
    offset = 1e3 * 9.81 * scenario.dt(substeps) * scenario.times / 2
    return Shown([chart], played.film, distances(chart, "mm"), claims(offset))
