"""The metrics: the function, the unit, and what each is measured against.

To add one, write `def name(view) -> Value | None` and its row in `ROWS`. A metric that does not
apply to a scene returns None. CONTRIBUTING.md says which tests it must pass.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Metric:
    of: Callable[[View], Value | None]  # its name is that of the metric
    unit: str  # "1" for a ratio
    against: tuple[str, ...]  # `ITSELF`, `TRUTH`, `ENGINE` (against.py)
    title: str = ""  # the heading in tables; "": the name itself
    summary: str = ""  # what the number is; `crosscheck list metrics` prints it
    better: str = "lower"  # or "higher", "zero", "as stated" where none is best


BESIDE = (TRUTH, ENGINE)
ROWS = (
    Metric(
        position_max_radii,
        "radii",
        BESIDE,
        "Position, largest error",
        "Largest distance of any disk in any sample, in radii of that disk; across an edge of the"
        " wrap if that is shorter.",
    ),
    Metric(
        position_rms_radii,
        "radii",
        BESIDE,
        "Position, root mean square",
        "Root mean square distance over the disks that can move, and samples, in radii of each"
        " disk.",
    ),
    Metric(
        position_max,
        "m",
        BESIDE,
        "Position, largest error",
        "Largest distance of any disk in any sample.",
    ),
    Metric(
        position_rms,
        "m",
        BESIDE,
        "Position, root mean square",
        "Root mean square distance over the disks that can move, and samples.",
    ),
    Metric(
        velocity_max,
        "m/s",
        BESIDE,
        "Velocity, largest error",
        "Largest difference of a disk's velocity from the nearest that it has in the truth within"
        " 3.2 steps.",
    ),
    Metric(
        velocity_rms,
        "m/s",
        BESIDE,
        "Velocity, root mean square",
        "Root mean square over the disks that can move, and samples; `velocity_max` is the largest"
        " of the same differences.",
    ),
    Metric(
        angular_velocity_max,
        "rad/s",
        BESIDE,
        "Angular velocity, largest error",
        "Largest difference of angular velocity of any disk, in the samples in which"
        " `velocity_max` is judged; with friction only where the disk has no collision within 3.2"
        " steps.",
    ),
    Metric(
        angle_max,
        "rad",
        BESIDE,
        "Angle, largest error",
        "Largest difference of angle of any disk in any sample.",
    ),
    Metric(
        angle_rms,
        "rad",
        BESIDE,
        "Angle, root mean square",
        "Root mean square difference of angle over the disks that can turn, and samples.",
    ),
    Metric(
        time_to_1pct_s,
        "s",
        BESIDE,
        "Time until 1 % of a radius off",
        "Time of the first sample at which a disk is off by more than 1 % of its radius; `inf` if"
        " there is none.",
        better="higher",
    ),
    Metric(
        momentum_error,
        "1",
        (ITSELF,),
        "Momentum, largest error",
        "Largest |P(t) - P(0) - outer impulse| where that impulse is known, over the momentum at"
        " hand.",
    ),
    Metric(
        momentum_deviation,
        "1",
        BESIDE,
        "Momentum, root mean square",
        "Root mean square distance of the momentum from the truth's range within 3.2 steps, over"
        " the momentum at hand.",
    ),
    Metric(
        angular_momentum_error,
        "1",
        (ITSELF,),
        "Angular momentum, largest error",
        "Largest |L(t) - L(0) - outer angular impulse|, about the scene's centre of mass, over the"
        " angular momentum at hand.",
    ),
    Metric(
        energy_error,
        "1",
        (ITSELF, TRUTH),
        "Energy, largest error",
        "Largest |E(t) - E(0)| where nothing takes energy (e = 1, no friction, no thrust), else"
        " distance from the truth's range within 3.2 steps; over the energy at hand. The note says"
        " whether it is gained or lost.",
    ),
    Metric(
        energy_deviation,
        "1",
        BESIDE,
        "Energy, root mean square",
        "Root mean square distance of the energy from the truth's range within 3.2 steps, over the"
        " energy at hand.",
    ),
    Metric(
        energy_created,
        "1",
        (ITSELF,),
        "Energy created",
        "Largest rise of the energy above an earlier sample, over the energy at hand, beyond what"
        " half a step of gravity changes; no collision creates energy.",
    ),
    Metric(
        collisions.apex_change,
        "%",
        (ITSELF,),
        "Apex of a bounce, higher or lower than stated",
        "Mean change of the height of a disk's apex from one bounce on a level floor to the next,"
        " beyond the e2 that the scene states: above 0 the disk comes too high, below 0 not high"
        " enough. Of the disk with the largest.",
        better="zero",
    ),
    Metric(
        energy_loss_error,
        "1",
        (TRUTH,),
        "Energy lost, minus that of the exact answer",
        "Energy lost by the last judged sample, minus what the truth loses within 3.2 steps of it;"
        " over the energy at hand.",
        better="zero",
    ),
    Metric(
        collisions.restitution,
        "1",
        (ITSELF,),
        "Restitution measured",
        "Median e = -(dv after).n / (dv before).n over the collisions that can be read off the"
        " samples; where gravity leaves a range of e, its value nearest to what the scene states."
        " Where a tenth or more bounce and a tenth or more do not (e below 0.05), the median of"
        " those that are farther from what the scene states; the note has the share and the range.",
        better="as stated",
    ),
    Metric(
        collisions.restitution_error,
        "1",
        (ITSELF,),
        "Restitution, largest error",
        "Largest |e - what the scene states| over the collisions that can be read off the samples,"
        " beyond what gravity leaves open.",
    ),
    Metric(
        penetration_radii,
        "radii",
        (ITSELF,),
        "Deepest overlap",
        "Largest overlap in any sample, in radii of the smaller disk.",
    ),
    Metric(
        disks_tunnelled,
        "disks",
        (ITSELF,),
        "Disks that tunnelled through a wall",
        "Number of disks whose centre has crossed a wall between two samples, and had no time to"
        " go round its end (tunnelling). A wrap crosses nothing.",
    ),
    Metric(
        collisions.collision_count_error,
        "collisions",
        BESIDE,
        "Collisions, too many or too few",
        "Number of collisions minus that of the truth, or of the other engine, at any time; pairs"
        " at rest from the start are not counted.",
        better="zero",
    ),
    Metric(
        collisions.collisions_missed,
        "collisions",
        BESIDE,
        "Collisions missed",
        "Collisions of the truth, or of the other engine, that the engine does not have at that"
        " time. Collisions closer together than a step can resolve are not counted. Of a pair that"
        " collides seldom one counts as found up to half of the time to its next collision; the"
        " note has how many are more than 20 steps late or early.",
    ),
    Metric(
        collisions.collisions_spurious,
        "collisions",
        BESIDE,
        "Collisions spurious",
        "Collisions of the engine that the truth, or the other engine, does not have at their"
        " time; and one if a disk that lies, slides or rolls on a floor of several walls is thrown"
        " off it.",
    ),
    Metric(
        collisions.first_wrong_collision_s,
        "s",
        BESIDE,
        "Time of the first wrong collision",
        "Time of the first missed or spurious collision, and its pair; `inf` if there is none.",
        better="higher",
    ),
    Metric(
        collisions.collision_delay_dt,
        "dt",
        BESIDE,
        "Detection delay, median",
        "Median of engine time minus true time of the collisions, in dt; the engine time is the"
        " end of the step.",
        better="zero",
    ),
    Metric(
        collisions.collision_delay_max_dt,
        "dt",
        BESIDE,
        "Detection delay, largest",
        "Largest difference in time of any collision from the true one, in dt.",
    ),
    Metric(
        friction.tangential_velocity_error,
        "m/s",
        (TRUTH,),
        "Tangential velocity after a collision, largest error",
        "Largest error of a disk's velocity along the surfaces, in the first sample after a"
        " collision that is more than 3.2 steps from all collisions.",
    ),
    Metric(
        friction.friction_impulse_error,
        "N s",
        (TRUTH,),
        "Impulse of friction in a collision, largest error",
        "Largest error of the impulse of friction in a collision: I dw / r of a disk, because only"
        " friction changes its spin.",
    ),
    Metric(
        friction.friction_loss_error,
        "1",
        (TRUTH,),
        "Energy lost to friction in collisions, minus that of the exact answer",
        "Energy that friction takes in collisions, minus that of the exact answer, over the energy"
        " at hand.",
        better="zero",
    ),
    Metric(
        friction.restitution_loss_error,
        "1",
        (TRUTH,),
        "Energy lost to restitution beside friction, minus that of the exact answer",
        "Energy that restitution takes in collisions with friction, minus that of the exact"
        " answer, over the energy at hand.",
        better="zero",
    ),
    Metric(
        friction.time_to_roll_error_s,
        "s",
        (TRUTH,),
        "Time at which a disk begins to roll, minus the exact one",
        "Time at which a sliding disk begins to roll, minus that of the exact answer; the largest"
        " of all disks. If it slips to the end, what is left until the end: a lower bound.",
        better="zero",
    ),
    Metric(
        friction.slip_at_rest,
        "m/s",
        (TRUTH,),
        "Slip where a disk should roll, largest",
        "Largest speed at which a disk slides on a wall while, in the exact answer, it rolls or"
        " rests there; counted from 3.2 steps after that begins.",
    ),
)
METRICS = {row.of.__name__: row for row in ROWS}
