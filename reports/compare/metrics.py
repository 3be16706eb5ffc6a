"""The metrics: the function, the unit, and what each is measured against.

To add one, write `def name(view) -> Value | None` and its row in `METRICS`. A metric that does not
apply to a scene returns None. CONTRIBUTING.md says which tests it must pass.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, wraps
from inspect import getdoc

import numpy as np

from crosscheck2d.reports.compare import collision_metrics as collisions
from crosscheck2d.reports.compare import friction_metrics as friction
from crosscheck2d.reports.compare import laws, scales, violations
from crosscheck2d.reports.compare.against import ENGINE, ITSELF, TRUTH
from crosscheck2d.reports.compare.apexes import bounce_changes
from crosscheck2d.reports.compare.view import LEAST_SHARE, Value, View, not_judged
from crosscheck2d.scenarios.model import Array

Measure = Callable[[View], Value | None]


def over_judged(
    measure: Measure, samples: Callable[[View], np.ndarray] = lambda view: view.judged
) -> Measure:
    """The metric with the number of judged `samples` (k, n) in its note; "not judged" where they
    are fewer than `LEAST_SHARE` (view.py)."""

    @wraps(measure)
    def carried(view: View) -> Value | None:
        found = measure(view)
        if found is None or view.other is None:
            return found
        judged = samples(view)
        if view.share(judged) < LEAST_SHARE:
            return not_judged(f"only {view.carried(judged)}")
        return found._replace(note=", ".join(filter(None, (view.carried(judged), found.note))))

    return carried


def momentum_error(view: View) -> Value | None:
    """Largest |P(t) - P(0) - outer impulse| where that impulse is known, over the momentum at
    hand."""
    return _largest(violations.momentum(view), view)


def angular_momentum_error(view: View) -> Value | None:
    """Largest |L(t) - L(0) - outer angular impulse|, about the scene's centre of mass, over the
    angular momentum at hand."""
    return _largest(violations.angular_momentum(view), view)


@over_judged
def energy_error(view: View) -> Value | None:
    """Largest |E(t) - E(0)| where nothing takes energy (e = 1, no friction, no thrust), else
    distance from the truth's range within 3.2 steps; over the energy at hand. The note says whether
    it is gained or lost."""
    gained = violations.energy_gained(view)
    found = None if gained is None else _largest(np.abs(gained), view)
    if gained is None or found is None or not found.value > 0:
        return found
    up = gained[int(np.searchsorted(view.played.t, found.at))] > 0
    return found._replace(note="gained" if up else "lost")


def energy_created(view: View) -> Value | None:
    """Largest rise of the energy above an earlier sample, over the energy at hand, beyond what half
    a step of gravity changes; no collision creates energy."""
    return _largest(violations.energy_rise(view), view)


@over_judged
def energy_deviation(view: View) -> Value | None:
    """Root mean square distance of the energy from the truth's range within 3.2 steps, over the
    energy at hand.

    Beside an engine: difference of the energies of all disks that are away from their collisions in
    both (view.py).
    """
    off = view.energy_deviation[view.judged.any(axis=1)]
    return Value(_rms(off) / (scales.energy(view.scenario) or 1.0))


@over_judged
def momentum_deviation(view: View) -> Value | None:
    """Root mean square distance of the momentum from the truth's range within 3.2 steps, over the
    momentum at hand.

    Beside an engine: distance of the momenta of all disks that are away from their collisions in
    both (view.py).
    """
    off = view.momentum_deviation[view.judged.any(axis=1)]
    return Value(_rms(off) / (scales.momentum(view.scenario) or 1.0))


@over_judged
def energy_loss_error(view: View) -> Value | None:
    """Energy lost by the last judged sample, minus what the truth loses within 3.2 steps of it;
    over the energy at hand."""
    scenario = view.scenario
    if violations.keeps_energy(scenario) or scenario.thrusts or violations.lifts(scenario):
        return None
    if view.other is None or view.jumps is None:
        return None
    if not view.judged.any():
        return Value(np.nan)
    last = int(np.flatnonzero(view.judged.any(axis=1))[-1])
    scale = scales.energy(scenario) or 1.0
    low, high = view.energy_range
    start = laws.energy(view.played, scenario.scene)[0] - laws.energy(view.other, scenario.scene)[0]
    excess = float(start - view.energy_deviation[last]) / scale
    width = (high[last] - low[last]) / scale
    return Value(
        excess,
        at=float(view.played.t[last]),
        note=f"the delay explains {width:.2g}" if width else "",
    )


def penetration_radii(view: View) -> Value | None:
    """Largest overlap in any sample, in radii of the smaller disk."""
    if view.scenario.scene.n + len(view.scenario.scene.walls) < 2:
        return None
    return _largest(laws.penetration(view.played, view.scenario.scene), view)


def disks_tunnelled(view: View) -> Value | None:
    """Number of disks whose centre has crossed a wall between two samples, and had no time to go
    round its end (tunnelling). A wrap crosses nothing."""
    if not len(view.scenario.scene.walls):
        return None
    disks = {disk for _, disk, _ in laws.wall_crossings(view.played, view.scenario.scene)}
    return Value(len(disks), min(disks, default=-1))


def position_rms(view: View) -> Value | None:
    """Root mean square distance over the disks that can move, and samples."""
    return _rms_of(view.deviation, ~view.scenario.scene.static)


def position_rms_radii(view: View) -> Value | None:
    """Root mean square distance over the disks that can move, and samples, in radii of each
    disk."""
    return _rms_of(view.deviation / view.scenario.scene.radius, ~view.scenario.scene.static)


def position_max(view: View) -> Value | None:
    """Largest distance of any disk in any sample."""
    return _largest_of_disks(view.deviation, view)


def position_max_radii(view: View) -> Value | None:
    """Largest distance of any disk in any sample, in radii of that disk; across an edge of the wrap
    if that is shorter."""
    return _largest_of_disks(view.deviation / view.scenario.scene.radius, view)


@over_judged
def velocity_rms(view: View) -> Value | None:
    """Root mean square over the disks that can move, and samples; `velocity_max` is the largest of
    the same differences."""
    return Value(_rms(view.velocity_deviation[view.judged]))


@over_judged
def velocity_max(view: View) -> Value | None:
    """Largest difference of a disk's velocity from the nearest that it has in the truth within 3.2
    steps.

    Beside an engine: from the other's, where the disk has no collision within 3.2 steps in either
    (view.py).
    """
    return _largest_of_disks(np.where(view.judged, view.velocity_deviation, 0.0), view)


@partial(over_judged, samples=lambda view: view.judged_spin)
def angular_velocity_max(view: View) -> Value | None:
    """Largest difference of angular velocity of any disk, in the samples in which `velocity_max` is
    judged; with friction only where the disk has no collision within 3.2 steps."""
    return _largest_of_disks(np.where(view.judged_spin, view.angular_velocity_deviation, 0.0), view)


def angle_rms(view: View) -> Value | None:
    """Root mean square difference of angle over the disks that can turn, and samples."""
    return _rms_of(view.angle_deviation, laws.moving_inertia(view.scenario.scene) > 0)


def angle_max(view: View) -> Value | None:
    """Largest difference of angle of any disk in any sample."""
    return _largest_of_disks(view.angle_deviation, view)


def time_to_1pct_s(view: View) -> Value | None:
    """Time of the first sample at which a disk is off by more than 1 % of its radius; `inf` if
    there is none."""
    off = view.deviation / view.scenario.scene.radius > 0.01
    if not off.any():
        return Value(np.inf, note=f"never within {view.played.t[-1]:g} s")
    k = int(np.argmax(off.any(axis=1)))
    return Value(float(view.played.t[k]), int(np.argmax(off[k])), float(view.played.t[k]))


def apex_change(view: View) -> Value | None:
    """Mean change of the height of a disk's apex from one bounce on a level floor to the next,
    beyond the e2 that the scene states: above 0 the disk comes too high, below 0 not high enough.
    Of the disk with the largest."""
    disks = np.flatnonzero(~view.scenario.scene.static)
    changes = {int(disk): bounce_changes(view, int(disk)) for disk in disks}
    means = {disk: 100 * float(change.mean()) for disk, change in changes.items() if len(change)}
    if not means:
        return None
    disk = max(means, key=lambda disk: abs(means[disk]))
    change = 100 * changes[disk]
    whole = 100 * (np.prod(changes[disk] + 1) - 1)
    note = f"{len(change)} bounces, from {change.min():+.2g} to {change.max():+.2g} %,"
    note += f" in all {whole:+.2g} %"
    return Value(means[disk], disk, note=note)


def _rms_of(values: Array, chosen: np.ndarray) -> Value | None:
    """Of (k, n) values over the chosen disks (n,); None without any."""
    return Value(_rms(np.compress(chosen, values, axis=1))) if chosen.any() else None


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else np.nan


def _largest(series: Array | None, view: View) -> Value | None:
    if series is None:
        return None
    if np.isnan(series).all():
        return Value(np.nan, note="too large for float64")
    k = int(np.nanargmax(series))
    return Value(float(series[k]), at=float(view.played.t[k]))


def _largest_of_disks(values: Array, view: View) -> Value:
    k, disk = np.unravel_index(int(np.argmax(values)), values.shape)
    return Value(float(values[k, disk]), int(disk), float(view.played.t[k]))


@dataclass(frozen=True)
class Metric:
    """A row of `METRICS`.

    Attributes:
        of: the function.
        unit: of the value; "1" for a ratio.
        against: what it is measured against: `ITSELF`, `TRUTH`, `ENGINE` (against.py).
        better: "lower", "higher", "zero" or "as stated" (the best value).
        title: the heading in tables; "": the name itself.
    """

    of: Callable[[View], Value | None]
    unit: str
    against: tuple[str, ...]
    better: str = "lower"
    title: str = ""

    @property
    def summary(self) -> str:
        """The first paragraph of the function's docstring, in one line."""
        return " ".join((getdoc(self.of) or "").split("\n\n")[0].split())


SCALES = {
    f"{scale.__name__.replace('_', ' ')} at hand": " ".join((getdoc(scale) or "").split())
    for scale in (scales.momentum, scales.angular_momentum, scales.energy)
}
METRICS: dict[str, Metric] = {
    "position_max_radii": Metric(
        position_max_radii, "radii", (TRUTH, ENGINE), title="Position, largest error"
    ),
    "position_rms_radii": Metric(
        position_rms_radii, "radii", (TRUTH, ENGINE), title="Position, root mean square"
    ),
    "position_max": Metric(position_max, "m", (TRUTH, ENGINE), title="Position, largest error"),
    "position_rms": Metric(position_rms, "m", (TRUTH, ENGINE), title="Position, root mean square"),
    "velocity_max": Metric(velocity_max, "m/s", (TRUTH, ENGINE), title="Velocity, largest error"),
    "velocity_rms": Metric(
        velocity_rms, "m/s", (TRUTH, ENGINE), title="Velocity, root mean square"
    ),
    "angular_velocity_max": Metric(
        angular_velocity_max, "rad/s", (TRUTH, ENGINE), title="Angular velocity, largest error"
    ),
    "angle_max": Metric(angle_max, "rad", (TRUTH, ENGINE), title="Angle, largest error"),
    "angle_rms": Metric(angle_rms, "rad", (TRUTH, ENGINE), title="Angle, root mean square"),
    "time_to_1pct_s": Metric(
        time_to_1pct_s, "s", (TRUTH, ENGINE), "higher", title="Time until 1 % of a radius off"
    ),
    "momentum_error": Metric(momentum_error, "1", (ITSELF,), title="Momentum, largest error"),
    "momentum_deviation": Metric(
        momentum_deviation, "1", (TRUTH, ENGINE), title="Momentum, root mean square"
    ),
    "angular_momentum_error": Metric(
        angular_momentum_error, "1", (ITSELF,), title="Angular momentum, largest error"
    ),
    "energy_error": Metric(energy_error, "1", (ITSELF, TRUTH), title="Energy, largest error"),
    "energy_deviation": Metric(
        energy_deviation, "1", (TRUTH, ENGINE), title="Energy, root mean square"
    ),
    "energy_created": Metric(energy_created, "1", (ITSELF,), title="Energy created"),
    "apex_change": Metric(
        apex_change, "%", (ITSELF,), "zero", title="Apex of a bounce, higher or lower than stated"
    ),
    "energy_loss_error": Metric(
        energy_loss_error,
        "1",
        (TRUTH,),
        "zero",
        title="Energy lost, minus that of the exact answer",
    ),
    "restitution": Metric(
        collisions.restitution, "1", (ITSELF,), "as stated", title="Restitution measured"
    ),
    "restitution_error": Metric(
        collisions.restitution_error, "1", (ITSELF,), title="Restitution, largest error"
    ),
    "penetration_radii": Metric(penetration_radii, "radii", (ITSELF,), title="Deepest overlap"),
    "disks_tunnelled": Metric(
        disks_tunnelled, "disks", (ITSELF,), title="Disks that tunnelled through a wall"
    ),
    "collision_count_error": Metric(
        collisions.collision_count_error,
        "collisions",
        (TRUTH, ENGINE),
        "zero",
        title="Collisions, too many or too few",
    ),
    "collisions_missed": Metric(
        collisions.collisions_missed, "collisions", (TRUTH, ENGINE), title="Collisions missed"
    ),
    "collisions_spurious": Metric(
        collisions.collisions_spurious, "collisions", (TRUTH, ENGINE), title="Collisions spurious"
    ),
    "first_wrong_collision_s": Metric(
        collisions.first_wrong_collision_s,
        "s",
        (TRUTH, ENGINE),
        "higher",
        title="Time of the first wrong collision",
    ),
    "collision_delay_dt": Metric(
        collisions.collision_delay_dt,
        "dt",
        (TRUTH, ENGINE),
        "zero",
        title="Detection delay, median",
    ),
    "collision_delay_max_dt": Metric(
        collisions.collision_delay_max_dt, "dt", (TRUTH, ENGINE), title="Detection delay, largest"
    ),
    "tangential_velocity_error": Metric(
        friction.tangential_velocity_error,
        "m/s",
        (TRUTH,),
        title="Tangential velocity after a collision, largest error",
    ),
    "friction_impulse_error": Metric(
        friction.friction_impulse_error,
        "N s",
        (TRUTH,),
        title="Impulse of friction in a collision, largest error",
    ),
    "friction_loss_error": Metric(
        friction.friction_loss_error,
        "1",
        (TRUTH,),
        "zero",
        title="Energy lost to friction in collisions, minus that of the exact answer",
    ),
    "restitution_loss_error": Metric(
        friction.restitution_loss_error,
        "1",
        (TRUTH,),
        "zero",
        title="Energy lost to restitution beside friction, minus that of the exact answer",
    ),
    "time_to_roll_error_s": Metric(
        friction.time_to_roll_error_s,
        "s",
        (TRUTH,),
        "zero",
        title="Time at which a disk begins to roll, minus the exact one",
    ),
    "slip_at_rest": Metric(
        friction.slip_at_rest, "m/s", (TRUTH,), title="Slip where a disk should roll, largest"
    ),
}
