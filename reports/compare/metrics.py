"""The metrics: the function, the unit, and what each is measured against.

To add one, write `def name(view) -> Value | None`, its row in `ROWS` and its texts in metrics.toml.
A metric that does not apply to a scene returns None. CONTRIBUTING.md says which tests it must pass.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crosscheck2d.reports.compare import collision_metrics as collisions
from crosscheck2d.reports.compare import friction_metrics as friction
from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.against import ENGINE, ITSELF, TRUTH
from crosscheck2d.reports.compare.view import LEAST_SHARE, Value, View, not_judged
from crosscheck2d.scenarios.model import Array

# Positions and angles: every sample counts.


def position_rms(view: View) -> Value | None:
    return _rms_of(view.deviation, ~view.scene.static)


def position_rms_radii(view: View) -> Value | None:
    return _rms_of(view.deviation / view.scene.radius, ~view.scene.static)


def position_max(view: View) -> Value | None:
    return _largest_of_disks(view.deviation, view)


def position_max_radii(view: View) -> Value | None:
    return _largest_of_disks(view.deviation / view.scene.radius, view)


def time_to_1pct_s(view: View) -> Value | None:
    off = view.deviation / view.scene.radius > 0.01
    if not off.any():
        return Value(np.inf, note=f"never within {view.played.t[-1]:g} s")
    k = int(np.argmax(off.any(axis=1)))
    return Value(float(view.played.t[k]), int(np.argmax(off[k])), float(view.played.t[k]))


def angle_rms(view: View) -> Value | None:
    turns = laws.moving_inertia(view.scene) > 0
    return _rms_of(np.abs(view.played.angle - view.reference.angle), turns)


def angle_max(view: View) -> Value | None:
    return _largest_of_disks(np.abs(view.played.angle - view.reference.angle), view)


# Velocities, momentum and energy against the truth: beside its range within the detection delay
# (delays.py). Beside an engine: of the disks that are away from their collisions in both (view.py).


def velocity_rms(view: View) -> Value | None:
    return over_judged(Value(_rms(view.velocity_deviation[view.judged])), view)


def velocity_max(view: View) -> Value | None:
    off = np.where(view.judged, view.velocity_deviation, 0.0)
    return over_judged(_largest_of_disks(off, view), view)


def angular_velocity_max(view: View) -> Value | None:
    off = np.abs(view.played.angular_velocity - view.reference.angular_velocity)
    off = np.where(view.judged_spin, off, 0.0)
    return over_judged(_largest_of_disks(off, view), view, view.judged_spin)


def momentum_deviation(view: View) -> Value | None:
    off = view.momentum_deviation[view.judged.any(axis=1)]
    return over_judged(Value(_rms(off) / (scales.momentum(view.scenario) or 1.0)), view)


def energy_deviation(view: View) -> Value | None:
    off = view.energy_deviation[view.judged.any(axis=1)]
    return over_judged(Value(_rms(off) / (scales.energy(view.scenario) or 1.0)), view)


def energy_error(view: View) -> Value | None:
    scenario, truth = view.scenario, view.other
    # where energy is conserved the start is the exact answer; else it takes a truth to know it
    if scales.keeps_energy(scenario) == (truth is not None) or scales.lifts(scenario):
        return None
    energy = laws.energy(view.played, scenario.scene)
    gained = energy - energy[0] if truth is None else view.energy_deviation
    gained = gained / (scales.energy(scenario) or 1.0)
    error = _largest(np.abs(gained), view)
    if error.value > 0:
        up = gained[int(np.searchsorted(view.played.t, error.at))] > 0
        error = error._replace(note="gained" if up else "lost")
    return error if truth is None else over_judged(error, view)


def energy_loss_error(view: View) -> Value | None:
    scenario, truth = view.scenario, view.other
    if scales.keeps_energy(scenario) or scenario.thrusts or scales.lifts(scenario):
        return None
    if truth is None or view.jumps is None:
        return None
    if not view.judged.any():
        return over_judged(Value(np.nan), view)
    last = int(np.flatnonzero(view.judged.any(axis=1))[-1])
    scale = scales.energy(scenario) or 1.0
    low, high = view.energy_range
    start = laws.energy(view.played, scenario.scene)[0] - laws.energy(truth, scenario.scene)[0]
    excess = float(start - view.energy_deviation[last]) / scale
    width = (high[last] - low[last]) / scale
    note = f"the delay explains {width:.2g}" if width else ""
    return over_judged(Value(excess, at=float(view.played.t[last]), note=note), view)


# The laws of physics, of a run by itself.


def momentum_error(view: View) -> Value | None:
    off = scales.unexplained_momentum(view.scenario, view.played)
    return None if off is None else _largest(off, view)


def angular_momentum_error(view: View) -> Value | None:
    # A thrust acts where its disk is, which only the engine knows, and a wrap moves disks.
    scenario, scene, played = view.scenario, view.scene, view.played
    if scene.wrap is not None or scenario.thrusts or not scales.knows_impulses(scenario):
        return None
    # The centre of mass is that of the start, so that the origin does not matter. The total weight
    # acts at x0 + v0 t + g t2 / 2, so its torque is known.
    m, g, t = laws.moving_mass(scene), scene.gravity, played.t
    lever = np.outer(t**2 / 2, m @ played.velocity[0])
    actual = laws.angular_momentum(played, scene)
    expected = actual[0] + lever[:, 0] * g[1] - lever[:, 1] * g[0]
    return _largest(np.abs(actual - expected) / (scales.angular_momentum(scenario) or 1.0), view)


def energy_created(view: View) -> Value | None:
    scenario, played = view.scenario, view.played
    if scenario.thrusts or scales.lifts(scenario):
        return None
    actual = laws.energy(played, scenario.scene)
    slack = laws.half_step(played, scenario.scene, view.dt)
    rise = actual - slack - np.minimum.accumulate(actual + slack)
    return _largest(np.maximum(rise, 0.0) / (scales.energy(scenario) or 1.0), view)


def penetration_radii(view: View) -> Value | None:
    if view.scene.n + len(view.scene.walls) < 2:
        return None
    return _largest(laws.penetration(view.played, view.scene), view)


def disks_tunnelled(view: View) -> Value | None:
    if not len(view.scene.walls):
        return None
    disks = {disk for _, disk, _ in laws.wall_crossings(view.played, view.scene)}
    return Value(len(disks), min(disks, default=-1))


def over_judged(value: Value, view: View, judged: np.ndarray | None = None) -> Value:
    """The value with the number of `judged` samples (k, n) in its note, by default `View.judged`;
    "not judged" where they are fewer than `LEAST_SHARE` (view.py)."""
    judged = view.judged if judged is None else judged
    if view.share(judged) < LEAST_SHARE:
        return not_judged(f"only {view.carried(judged)}")
    return value._replace(note=", ".join(filter(None, (view.carried(judged), value.note))))


def _rms_of(values: Array, chosen: np.ndarray) -> Value | None:
    """Of (k, n) values over the chosen disks (n,); None without any."""
    return Value(_rms(np.compress(chosen, values, axis=1))) if chosen.any() else None


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else np.nan


def _largest(series: Array, view: View) -> Value:
    if np.isnan(series).all():
        return Value(np.nan, note="too large for float64")
    k = int(np.nanargmax(series))
    return Value(float(series[k]), at=float(view.played.t[k]))


def _largest_of_disks(values: Array, view: View) -> Value:
    k, disk = np.unravel_index(int(np.argmax(values)), values.shape)
    return Value(float(values[k, disk]), int(disk), float(view.played.t[k]))


class Metric(NamedTuple):
    of: Callable[[View], Value | None]  # its name is that of the metric
    unit: str  # "1" for a ratio
    against: tuple[str, ...]  # `ITSELF`, `TRUTH`, `ENGINE` (against.py)
    better: str = "lower"  # or "higher", "zero", "as stated" where none is best

    @property
    def title(self) -> str:
        """The heading in tables; "": the name itself."""
        return TEXTS[self.of.__name__][0]

    @property
    def summary(self) -> str:
        """What the number is; `crosscheck list metrics` prints it."""
        return TEXTS[self.of.__name__][1]


TEXTS: dict[str, list[str]] = tomllib.loads(
    Path(__file__).with_name("metrics.toml").read_text(encoding="utf-8")
)
BESIDE = (TRUTH, ENGINE)
ROWS = (
    Metric(position_max_radii, "radii", BESIDE),
    Metric(position_rms_radii, "radii", BESIDE),
    Metric(position_max, "m", BESIDE),
    Metric(position_rms, "m", BESIDE),
    Metric(velocity_max, "m/s", BESIDE),
    Metric(velocity_rms, "m/s", BESIDE),
    Metric(angular_velocity_max, "rad/s", BESIDE),
    Metric(angle_max, "rad", BESIDE),
    Metric(angle_rms, "rad", BESIDE),
    Metric(time_to_1pct_s, "s", BESIDE, "higher"),
    Metric(momentum_error, "1", (ITSELF,)),
    Metric(momentum_deviation, "1", BESIDE),
    Metric(angular_momentum_error, "1", (ITSELF,)),
    Metric(energy_error, "1", (ITSELF, TRUTH)),
    Metric(energy_deviation, "1", BESIDE),
    Metric(energy_created, "1", (ITSELF,)),
    Metric(collisions.apex_change, "%", (ITSELF,), "zero"),
    Metric(energy_loss_error, "1", (TRUTH,), "zero"),
    Metric(collisions.restitution, "1", (ITSELF,), "as stated"),
    Metric(collisions.restitution_error, "1", (ITSELF,)),
    Metric(penetration_radii, "radii", (ITSELF,)),
    Metric(disks_tunnelled, "disks", (ITSELF,)),
    Metric(collisions.collision_count_error, "collisions", BESIDE, "zero"),
    Metric(collisions.collisions_missed, "collisions", BESIDE),
    Metric(collisions.collisions_spurious, "collisions", BESIDE),
    Metric(collisions.first_wrong_collision_s, "s", BESIDE, "higher"),
    Metric(collisions.collision_delay_dt, "dt", BESIDE, "zero"),
    Metric(collisions.collision_delay_max_dt, "dt", BESIDE),
    Metric(friction.tangential_velocity_error, "m/s", (TRUTH,)),
    Metric(friction.friction_impulse_error, "N s", (TRUTH,)),
    Metric(friction.friction_loss_error, "1", (TRUTH,), "zero"),
    Metric(friction.restitution_loss_error, "1", (TRUTH,), "zero"),
    Metric(friction.time_to_roll_error_s, "s", (TRUTH,), "zero"),
    Metric(friction.slip_at_rest, "m/s", (TRUTH,)),
)
METRICS = {row.of.__name__: row for row in ROWS}
