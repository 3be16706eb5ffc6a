"""Every number of the report: a function, what it means, its unit, and what it is measured against.

To add one: write `def name(view) -> Value | None` and its row in `METRICS`. None: it does not apply here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reports import broken, laws
from reports.collisions import effective_restitution
from reports.view import Value, View
from scenarios.model import Array


def momentum_error(view: View) -> Value | None:
    """Largest |P(t) - P(0) - impulse from outside| over the largest sum of m|v|; where that impulse is known."""
    return _largest(broken.momentum(view), view)


def angular_momentum_error(view: View) -> Value | None:
    """Largest |L(t) - L(0) - angular impulse from outside|, about the origin, over the largest m|x||v| + I|w|."""
    return _largest(broken.angular_momentum(view), view)


def energy_error(view: View) -> Value | None:
    """Largest |E(t) - E_expected(t)| over the energy at hand; E(0) at e = 1, else the truth's in calm samples."""
    return _largest(broken.energy(view), view)


def energy_created(view: View) -> Value | None:
    """Largest rise of the energy above an earlier sample, over the energy at hand; no hit can give any."""
    if view.scenario.thrusts:
        return None
    actual = laws.energy(view.played, view.scenario.scene)
    rise = actual - np.minimum.accumulate(actual)
    return _largest(rise / (laws.energy_scale(view.played, view.scenario.scene) or 1.0), view)


def energy_loss_error(view: View) -> Value | None:
    """Energy lost from the first to the last calm sample, less what the truth loses, over the energy at hand."""
    scene = view.scenario.scene
    if broken.keeps_energy(view.scenario) or view.scenario.thrusts or view.other is None:
        return None
    last = int(np.flatnonzero(view.calm)[-1])
    played, true = laws.energy(view.played, scene), laws.energy(view.other, scene)
    excess = (played[0] - played[last]) - (true[0] - true[last])
    return Value(float(excess) / (laws.energy_scale(view.other, scene) or 1.0), at=float(view.played.t[last]))


def restitution_error(view: View) -> Value | None:
    """Largest |e_measured - e| over hits that can be read off the samples; slow hits under gravity are left out."""
    scenario = view.scenario
    if scenario.thrusts:
        return None
    slowest = 20 * float(np.linalg.norm(scenario.scene.gravity)) * scenario.sample_interval
    values, times = effective_restitution(view.played, scenario.scene, slowest)
    if not len(values):
        return None
    off = np.abs(values - scenario.scene.restitution)
    worst = int(np.argmax(off))
    note = f"{len(values)} hits read, median e {np.median(values):.4g}"
    return Value(float(off[worst]), at=float(times[worst]), note=note)


def penetration_radii(view: View) -> Value | None:
    """Largest overlap in any sample, in radii of the smaller disk."""
    if view.scenario.scene.n + len(view.scenario.scene.walls) < 2:
        return None
    return _largest(laws.penetration(view.played, view.scenario.scene), view)


def position_rms(view: View) -> Value | None:
    """Root mean square distance over disks and samples."""
    return Value(float(np.sqrt((view.apart**2).mean())))


def position_max(view: View) -> Value | None:
    """Largest distance of any disk in any sample."""
    return _largest_of_disks(view.apart, view)


def position_max_radii(view: View) -> Value | None:
    """Largest distance of any disk in any sample, in radii of that disk."""
    return _largest_of_disks(view.apart / view.scenario.scene.radius, view)


def velocity_rms(view: View) -> Value | None:
    """Root mean square difference of velocity over disks and calm samples."""
    return Value(float(np.sqrt((_velocity_apart(view)[view.calm] ** 2).mean())))


def velocity_max(view: View) -> Value | None:
    """Largest difference of velocity of any disk in calm samples."""
    return _largest_of_disks(np.where(view.calm[:, None], _velocity_apart(view), 0.0), view)


def angle_rms(view: View) -> Value | None:
    """Root mean square difference of angle over disks and samples."""
    return Value(float(np.sqrt((_angle_apart(view) ** 2).mean())))


def angle_max(view: View) -> Value | None:
    """Largest difference of angle of any disk in any sample."""
    return _largest_of_disks(_angle_apart(view), view)


def time_to_1pct_s(view: View) -> Value | None:
    """First sample at which some disk is off by more than 1 % of its radius; `inf` if none ever is."""
    off = view.apart / view.scenario.scene.radius > 0.01
    if not off.any():
        return Value(np.inf, note=f"never within {view.played.t[-1]:g} s")
    k = int(np.argmax(off.any(axis=1)))
    return Value(float(view.played.t[k]), int(np.argmax(off[k])), float(view.played.t[k]))


def collisions_missed(view: View) -> Value | None:
    """True hits the player does not have."""
    return Value(len(view.matched.missed), note=f"of {len(view.other.collisions)}")  # type: ignore[union-attr]


def collisions_invented(view: View) -> Value | None:
    """Hits of the player that the truth does not have."""
    return Value(len(view.matched.invented))


def first_wrong_collision_s(view: View) -> Value | None:
    """When the first hit is missed or invented, and whose; `inf` if none is."""
    if view.matched.first_wrong is None:
        return Value(np.inf, note="none")
    at, what = view.matched.first_wrong
    return Value(at, at=at, note=what)


def hit_delay_dt(view: View) -> Value | None:
    """Median over the hits of played time less true time, in dt; a hit is dated to the end of its step."""
    delay = view.matched.delay
    if not len(delay):
        return None
    note = f"{len(delay)} hits, largest {np.abs(delay).max() / view.dt:.3g} dt"
    return Value(float(np.median(delay)) / view.dt, note=note)


def _largest(series: Array | None, view: View) -> Value | None:
    if series is None:
        return None
    k = int(np.nanargmax(series))
    return Value(float(series[k]), at=float(view.played.t[k]))


def _largest_of_disks(values: Array, view: View) -> Value:
    k, disk = np.unravel_index(int(np.argmax(values)), values.shape)
    return Value(float(values[k, disk]), int(disk), float(view.played.t[k]))


def _velocity_apart(view: View) -> Array:
    return np.linalg.norm(view.played.velocity - view.other.velocity, axis=2)  # type: ignore[union-attr]


def _angle_apart(view: View) -> Array:
    return np.abs(view.played.angle - view.other.angle)  # type: ignore[union-attr]


@dataclass(frozen=True)
class Metric:
    """A row of `METRICS`.

    Attributes:
        of: the function.
        unit: of the value, "1" for a ratio.
        against: what it is measured against: "itself" (laws of physics and the start), "truth", "engine".
        better: "lower", "higher" or "zero" (the best value).
    """

    of: Callable[[View], Value | None]
    unit: str
    against: tuple[str, ...]
    better: str = "lower"

    @property
    def summary(self) -> str:
        """The first line of the function's docstring."""
        return (self.of.__doc__ or "").splitlines()[0]


METRICS: dict[str, Metric] = {
    "position_max_radii": Metric(position_max_radii, "radii", ("truth", "engine")),
    "position_max": Metric(position_max, "m", ("truth",)),
    "position_rms": Metric(position_rms, "m", ("truth", "engine")),
    "velocity_max": Metric(velocity_max, "m/s", ("truth",)),
    "velocity_rms": Metric(velocity_rms, "m/s", ("truth", "engine")),
    "angle_max": Metric(angle_max, "rad", ("truth", "engine")),
    "angle_rms": Metric(angle_rms, "rad", ("truth",)),
    "time_to_1pct_s": Metric(time_to_1pct_s, "s", ("truth", "engine"), "higher"),
    "momentum_error": Metric(momentum_error, "1", ("itself",)),
    "angular_momentum_error": Metric(angular_momentum_error, "1", ("itself",)),
    "energy_error": Metric(energy_error, "1", ("itself", "truth")),
    "energy_created": Metric(energy_created, "1", ("itself",)),
    "energy_loss_error": Metric(energy_loss_error, "1", ("truth",), "zero"),
    "restitution_error": Metric(restitution_error, "1", ("itself",)),
    "penetration_radii": Metric(penetration_radii, "radii", ("itself",)),
    "collisions_missed": Metric(collisions_missed, "hits", ("truth",)),
    "collisions_invented": Metric(collisions_invented, "hits", ("truth",)),
    "first_wrong_collision_s": Metric(first_wrong_collision_s, "s", ("truth",), "higher"),
    "hit_delay_dt": Metric(hit_delay_dt, "dt", ("truth",), "zero"),
}
