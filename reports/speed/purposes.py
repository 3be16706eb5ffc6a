"""The purposes for which a scene is played, and the error of a run for each."""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import NamedTuple

from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.view import View
from crosscheck2d.scenarios.model import Scene, Trajectory


class Purpose(NamedTuple):
    """A purpose.

    Attributes:
        error: of a run beside the exact answer; nan where too little of it can be judged.
        what: the error in words, with its unit.
    """

    error: Callable[[View], float]
    what: str


def of_trajectory(view: View) -> float:
    """Largest distance of any disk from its exact position, in radii of that disk."""
    return float((view.deviation / view.scenario.scene.radius).max())


def of_energy(view: View) -> float:
    """The metric `energy_error`, over the energy at hand: against the law where energy is
    conserved, else against the exact answer."""
    alone = View(view.scenario, view.dt, view.played, rounding=view.rounding)
    found = (METRICS["energy_error"].of(each) for each in (alone, view))
    return next((float(value.value) for value in found if value is not None), nan)


def of_statistics(view: View) -> float:
    """Largest relative error of three averages over time and moving disks: kinetic energy and
    height against gravity, over the energy at hand; distance from the start, over the true one."""
    assert view.other is not None
    scenario = view.scenario
    scale = scales.energy(scenario) or 1.0
    (kinetic, potential, way), (true_kinetic, true_potential, true_way) = (
        averages(each, scenario.scene) for each in (view.played, view.other)
    )
    off = max(abs(kinetic - true_kinetic), abs(potential - true_potential)) / scale
    return max(off, abs(way - true_way) / true_way if true_way else 0.0)


def averages(trajectory: Trajectory, scene: Scene) -> tuple[float, float, float]:
    """Over time: kinetic and potential energy of all disks, J; mean distance from the start, m."""
    kinetic = laws.kinetic_energy(trajectory, scene)
    way = laws.lengths(laws.nearer_way(trajectory.position - trajectory.position[0], scene))
    return (
        float(kinetic.mean()),
        float((laws.energy(trajectory, scene) - kinetic).mean()),
        float(way[:, ~scene.static].mean()) if not scene.static.all() else 0.0,
    )


PURPOSES: dict[str, Purpose] = {
    "trajectory": Purpose(of_trajectory, "distance of a disk from its exact position, in radii"),
    "energy": Purpose(of_energy, "error of the energy, over the energy at hand"),
    "statistics": Purpose(
        of_statistics, "error of averages over time: energies, distance from the start"
    ),
}
