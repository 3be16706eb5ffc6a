"""The predicates: each computes one number with a unit from a run, and has a bound above which the
run fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.verdicts import MOST_BOUNCE
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory


class Reading(NamedTuple):
    """A number in the predicate's unit; for a failure its time (s), a sentence, the disk (-1: all),
    and the name of the predicate."""

    value: float
    at: float = np.nan
    event: str = ""
    broken: str = ""
    failed: bool = False
    disk: int = 0


class Predicate(NamedTuple):
    """A run fails if its number is above `bound`, or is not a number.

    Attributes:
        name: as it stands in limits.csv.
        unit: of the number.
        bound: the largest that still works.
        means: what failing is, in words.
        read: scenario and run, played to its end -> the reading; `failed` and `broken` are filled
            in by `judge`.
    """

    name: str
    unit: str
    bound: float
    means: str
    read: Callable[[Scenario, Trajectory], Reading]


def judge(predicate: Predicate, scenario: Scenario, run: Run) -> Reading:
    """Read a run; a run that was refused, stopped early or raised an exception fails with its
    reason."""
    if run.status != "ok" or run.trajectory is None:
        outcome = "refused" if run.status == "unsupported" else run.status
        at = float(run.trajectory.t[-1]) if run.trajectory is not None else 0.0
        return Reading(np.nan, at, run.reason, outcome, True)
    # positions that overflow make the run fail
    with np.errstate(over="ignore", invalid="ignore"):
        reading = predicate.read(scenario, run.trajectory)
    if reading.value <= predicate.bound:
        return reading
    return reading._replace(failed=True, broken=reading.broken or predicate.name)


def first_above(t: Array, series: Array, bound: float) -> float:
    """s, the first sample at which the series (k,) exceeds its bound; the last sample if it
    never does."""
    above = ~(series <= bound)
    return float(t[np.argmax(above)] if above.any() else t[-1])


def largest(
    t: Array,
    series: Array,
    bound: float,
    event: str,
    *,
    of: float = 1.0,
    broken: str = "",
    disk: int = 0,
) -> Reading:
    """The largest of a series (k,), in units of `of`, at the first sample above its bound."""
    value, at = float(series.max()) / of, first_above(t, series, bound)
    return Reading(value, at, event, broken, disk=disk)


def truth_of(scenario: Scenario) -> Trajectory:
    """The exact answer at the samples; every scenario of these cases has one."""
    assert scenario.truth is not None
    return scenario.truth(scenario.times)


def gain(trajectory: Trajectory) -> Array:
    """(n,) m/s, the change of each disk's velocity from start to end."""
    change: Array = np.linalg.norm(trajectory.velocity[-1] - trajectory.velocity[0], axis=1)
    return change


def _collisions_missed(scenario: Scenario, played: Trajectory) -> Reading:
    true = truth_of(scenario)
    should, does = gain(true), gain(played)
    missed = int(((should > 0) & (does < 0.01 * should)).any())
    at, wall = float(true.collisions.t[0]), true.collisions.j[0] < 0
    through = "the disk passes through the wall" if wall else "the disks pass through each other"
    return Reading(missed, at, f"the collision is missed: {through}")


def _collisions_spurious(scenario: Scenario, played: Trajectory) -> Reading:
    change = np.linalg.norm(played.velocity - played.velocity[0], axis=2).max(axis=1)
    share = change / np.linalg.norm(scenario.scene.velocity, axis=1).max()
    return largest(played.t, share, 1e-3, "a spurious collision: the disks do not touch")


def _restitution_off(scenario: Scenario, played: Trajectory) -> Reading:
    closing, separating = (
        float(v[0, 0] - v[1, 0]) for v in (played.velocity[0], played.velocity[-1])
    )
    e = -separating / closing
    off = abs(e - scenario.scene.restitution)
    return Reading(
        off,
        float(truth_of(scenario).collisions.t[0]),
        f"the collision has e = {e + 0.0:.3g}",
    )


def _wrong_distance(scenario: Scenario, played: Trajectory) -> Reading:
    way = np.linalg.norm(played.position[-1] - played.position[0], axis=1)
    true = truth_of(scenario)
    ought = np.linalg.norm(true.position[-1] - true.position[0], axis=1)
    off = np.abs(way - ought) / ought
    worst = int(np.nanargmax(off)) if np.isfinite(off).any() else 0
    return Reading(
        float(off[worst]),
        float(played.t[-1]),
        f"disk {worst} has moved {way[worst] / ought[worst]:.4g} times the right distance",
    )


def _velocity_off(scenario: Scenario, played: Trajectory) -> Reading:
    true = truth_of(scenario)
    off = np.linalg.norm(played.velocity[-1] - true.velocity[-1], axis=1)
    own = np.linalg.norm(true.velocity[-1], axis=1)
    share = off / np.where(own > 0, own, np.linalg.norm(true.velocity[0], axis=1).max())
    worst = int(np.nanargmax(share)) if np.isfinite(share).any() else 0
    return Reading(
        float(share[worst]),
        float(true.collisions.t[0]),
        f"disk {worst} leaves with a wrong velocity",
    )


def _scaled_deviation(scenario: Scenario, played: Trajectory) -> Reading:
    true = truth_of(scenario)
    off = (np.linalg.norm(played.position - true.position, axis=2) / scenario.scene.radius).max(
        axis=1
    )
    return largest(played.t, off, 0.25, "from here the path differs from that at scale 1")


def _angle_off(scenario: Scenario, played: Trajectory) -> Reading:
    turned = played.t * scenario.scene.angular_velocity[0]
    off = np.abs(played.angle[:, 0] - turned)[1:] / turned[1:]
    return Reading(
        float(off[-1]),
        float(played.t[1]),
        f"turns {played.angle[-1, 0] / turned[-1]:.4g} times as far as it should",
    )


def _spring_grows(_: Scenario, played: Trajectory) -> Reading:
    energy = (played.velocity**2 + played.position**2).sum(axis=(1, 2)) / 2  # of 1 kg on 1 N/m
    quarter = len(energy) // 4
    # Means over a quarter of the run: the energy of a stable method oscillates within a period.
    factor = float(energy[-quarter:].mean() / energy[:quarter].mean())
    at = first_above(played.t, np.abs(np.log2(energy / energy[0])), SPRING_GROWS.bound)
    return Reading(
        abs(float(np.log2(factor))),
        at,
        f"after 300 steps the energy is {factor:.3g} times that at the start",
    )


def _bounces_off(scenario: Scenario, played: Trajectory) -> Reading:
    heights = apexes(scenario, played)
    below = played.position[:, 0, 1] < 0
    if len(heights) < 2 or below[-1]:
        return Reading(
            np.nan,
            first_above(played.t, below.astype(float), 0.5),
            "the ball falls through the floor",
        )
    changes = np.diff(heights)
    worst = int(np.argmax(np.abs(changes)))
    word, mean = "higher" if changes[worst] > 0 else "lower", float(np.abs(changes.mean()))
    return Reading(
        float(np.abs(changes[worst])),
        first_bounce(scenario),
        f"after bounce {worst + 1} it reaches {abs(changes[worst]):.3g} drop heights {word} than"
        f" before; the mean over all bounces is {mean:.3g}",
    )


def apexes(scenario: Scenario, played: Trajectory) -> Array:
    """(k,) the height that a dropped ball reaches in each flight, the drop itself first, over
    the height of the drop."""
    y = played.position[:, 0, 1] - scenario.scene.radius[0]
    heights: Array = laws.apexes(y)[1] / y[0]
    return heights


def first_bounce(scenario: Scenario) -> float:
    """s, when a ball dropped onto y = 0 first reaches it."""
    scene = scenario.scene
    return float(np.sqrt(2 * (scene.position[0, 1] - scene.radius[0]) / -scene.gravity[1]))


COLLISIONS_MISSED = Predicate(
    "collisions missed",
    "collisions",
    0.0,
    "a disk passes through a disk or a wall that it should collide with",
    _collisions_missed,
)
COLLISIONS_SPURIOUS = Predicate(
    "spurious collisions",
    "of the speed",
    1e-3,
    "a disk that touches nothing is deflected",
    _collisions_spurious,
)
RESTITUTION_OFF = Predicate(
    "restitution off", "1", 0.01, "the collision does not have the scene's e", _restitution_off
)
WRONG_DISTANCE = Predicate(
    "wrong distance",
    "of the way",
    0.01,
    "a free disk has not moved the right distance",
    _wrong_distance,
)
VELOCITY_OFF = Predicate(
    "velocity off",
    "of the speed",
    1e-3,
    "a disk leaves the collision with a wrong velocity",
    _velocity_off,
)
SCALED_DEVIATION = Predicate(
    "deviation",
    "radii",
    0.25,
    "the path, scaled back, differs from that at scale 1",
    _scaled_deviation,
)
ANGLE_OFF = Predicate(
    "angle off",
    "of the angle",
    0.02,
    "the angle of a free disk does not follow its spin",
    _angle_off,
)
BOUNCES_OFF = Predicate(
    "bounce off",
    "of the height",
    MOST_BOUNCE,
    "a bounce changes the height that the ball reaches",
    _bounces_off,
)
SPRING_GROWS = Predicate(
    "spring grows",
    "doublings of energy",
    1.0,
    "the energy of an oscillator doubles or halves",
    _spring_grows,
)
