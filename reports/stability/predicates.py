"""What "fails" means: a predicate reads one number off a run and has a bound above which the run
fails. It gives a `Verdict`, the type of those on whole runs; bounds that both have are kept there.

This file has the predicates of one or two disks, of friction, stacks, piles and overlaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.verdicts import (
    MOST_BOUNCE,
    MOST_JITTER,
    MOST_RESIDUAL,
    MOST_SINKING,
    SETTLED,
    Verdict,
    own_speed,
)
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory

REFUSED = "refused"
MOST_SPEED = 10.0  # radii/s


Reading = Callable[[Scenario, Trajectory], Verdict]  # of a run that was played to its end


class Predicate(NamedTuple):
    """A run fails if its number is above `bound`, or is not a number."""

    name: str  # the id of its verdict, as it stands in limits.csv
    means: str  # what failing is, as a part of a sentence
    unit: str  # of the number
    bound: float  # the largest that still works
    read: Reading  # a verdict of another name says what in particular has failed


def predicate(means: str, unit: str, bound: float) -> Callable[[Reading], Predicate]:
    """Makes a function a predicate of its name."""
    return lambda read: Predicate(read.__name__.replace("_", " "), means, unit, bound, read)


def judge(predicate: Predicate, scenario: Scenario, run: Run) -> Verdict:
    """The verdict on a run; one that was refused, stopped early or raised an exception fails with
    its reason."""
    if run.status != "ok" or run.trajectory is None:
        outcome = REFUSED if run.status == "unsupported" else run.status
        at = float(run.trajectory.t[-1]) if run.trajectory is not None else 0.0
        return Verdict(outcome, np.nan, predicate.bound, at, event=run.reason)
    # positions that overflow make the run fail
    with np.errstate(over="ignore", invalid="ignore"):
        verdict = predicate.read(scenario, run.trajectory)
    return replace(verdict, id=verdict.id or predicate.name, bound=predicate.bound)


def read(value: float, at: float, event: str, disk: int | None = 0, kind: str = "") -> Verdict:
    """A verdict at `at` s on a disk (None: all), which `judge` gives its bound and, where it has no
    kind, its name."""
    return Verdict(kind, float(value), np.inf, float(at), () if disk is None else (disk,), event)


def worst_of(verdicts: list[Verdict]) -> Verdict:
    # all of them are in units of their bounds
    return max(verdicts, key=lambda verdict: verdict.value)


def first_above(t: Array, series: Array, bound: float) -> float:
    """s, the first sample at which the series (k,) exceeds its bound; the last sample if it
    never does."""
    above = ~(series <= bound)
    return float(t[np.argmax(above)] if above.any() else t[-1])


def largest(
    t: Array, series: Array, bound: float, event: str, disk: int | None = 0, kind: str = ""
) -> Verdict:
    """The largest of a series (k,), at the first sample above its bound; one with a kind of its own
    is a part of a predicate, in units of its bound."""
    value = float(series.max()) / (bound if kind else 1.0)
    return read(value, first_above(t, series, bound), event, disk, kind)


def truth_of(scenario: Scenario) -> Trajectory:
    assert scenario.truth is not None
    return scenario.truth(scenario.times)


def worst_disk(series: Array) -> int:
    return int(np.nanargmax(series)) if np.isfinite(series).any() else 0


@predicate("a disk passes through a disk or a wall that it should collide with", "collisions", 0.0)
def collisions_missed(scenario: Scenario, played: Trajectory) -> Verdict:
    true = truth_of(scenario)
    expected, change = (laws.lengths(x.velocity[-1] - x.velocity[0]) for x in (true, played))
    missed = ((expected > 0) & (change < 0.01 * expected)).any()
    at, wall = float(true.collisions.t[0]), true.collisions.j[0] < 0
    through = "the disk passes through the wall" if wall else "the disks pass through each other"
    return read(float(missed), at, f"the collision is missed: {through}")


@predicate("a disk that touches nothing is deflected", "of the speed", 1e-3)
def spurious_collisions(scenario: Scenario, played: Trajectory) -> Verdict:
    change = laws.lengths(played.velocity - played.velocity[0]).max(axis=1)
    share = change / laws.lengths(scenario.scene.velocity).max()
    return largest(played.t, share, 1e-3, "a spurious collision: the disks do not touch")


@predicate("the collision does not have the scene's e", "1", 0.01)
def restitution_off(scenario: Scenario, played: Trajectory) -> Verdict:
    start, end = (float(v[0, 0] - v[1, 0]) for v in (played.velocity[0], played.velocity[-1]))
    e = -end / start
    at = truth_of(scenario).collisions.t[0]
    return read(abs(e - scenario.scene.restitution), at, f"the collision has e = {e + 0.0:.3g}")


@predicate("a free disk has not moved the right distance", "of the way", 0.01)
def wrong_distance(scenario: Scenario, played: Trajectory) -> Verdict:
    true = truth_of(scenario)
    way, expected = (laws.lengths(x.position[-1] - x.position[0]) for x in (played, true))
    off = np.abs(way - expected) / expected
    disk = worst_disk(off)
    event = f"disk {disk} has moved {way[disk] / expected[disk]:.4g} times the right distance"
    return read(off[disk], played.t[-1], event)


@predicate("a disk leaves the collision with a wrong velocity", "of the speed", 1e-3)
def velocity_off(scenario: Scenario, played: Trajectory) -> Verdict:
    true = truth_of(scenario)
    off = laws.lengths(played.velocity[-1] - true.velocity[-1])
    own = laws.lengths(true.velocity[-1])
    share = off / np.where(own > 0, own, laws.lengths(true.velocity[0]).max())
    disk = worst_disk(share)
    return read(share[disk], true.collisions.t[0], f"disk {disk} leaves with a wrong velocity")


@predicate("the path, scaled back, differs from that at scale 1", "radii", 0.25)
def deviation(scenario: Scenario, played: Trajectory) -> Verdict:
    off = laws.lengths(played.position - truth_of(scenario).position) / scenario.scene.radius
    event = "from here the path differs from that at scale 1"
    return largest(played.t, off.max(axis=1), deviation.bound, event)


@predicate("the angle of a free disk does not follow its spin", "of the angle", 0.02)
def angle_off(scenario: Scenario, played: Trajectory) -> Verdict:
    turned = played.t * scenario.scene.angular_velocity[0]
    off = np.abs(played.angle[:, 0] - turned)[1:] / turned[1:]
    event = f"turns {played.angle[-1, 0] / turned[-1]:.4g} times as far as it should"
    return read(off[-1], played.t[1], event)


@predicate("the energy of an oscillator doubles or halves", "doublings of energy", 1.0)
def spring_grows(_: Scenario, played: Trajectory) -> Verdict:
    energy = (played.velocity**2 + played.position**2).sum(axis=(1, 2)) / 2  # of 1 kg on 1 N/m
    quarter = len(energy) // 4
    # Means over a quarter of the run: the energy of a stable method oscillates within a period.
    factor = float(energy[-quarter:].mean() / energy[:quarter].mean())
    at = first_above(played.t, np.abs(np.log2(energy / energy[0])), spring_grows.bound)
    event = f"after 300 steps the energy is {factor:.3g} times that at the start"
    return read(abs(float(np.log2(factor))), at, event)


@predicate("a bounce changes the height that the ball reaches", "of the height", MOST_BOUNCE)
def bounce_off(scenario: Scenario, played: Trajectory) -> Verdict:
    scene, y = scenario.scene, played.position[:, 0, 1] - scenario.scene.radius[0]
    heights = laws.apexes(y)[1] / y[0]  # of each flight, the drop itself first
    below = played.position[:, 0, 1] < 0
    if len(heights) < 2 or below[-1]:
        at = first_above(played.t, below.astype(float), 0.5)
        return read(np.nan, at, "the ball falls through the floor")
    changes = np.diff(heights)
    worst = int(np.argmax(np.abs(changes)))
    word, mean = "higher" if changes[worst] > 0 else "lower", float(np.abs(changes.mean()))
    first = np.sqrt(2 * (scene.position[0, 1] - scene.radius[0]) / -scene.gravity[1])
    event = (
        f"after bounce {worst + 1} it reaches {abs(changes[worst]):.3g} drop heights {word} than"
        f" before; the mean over all bounces is {mean:.3g}"
    )
    return read(np.abs(changes[worst]), first, event)


@predicate("the impulse of friction is not that of Coulomb's law", "of the impulse", 0.1)
def friction_off(scenario: Scenario, played: Trajectory) -> Verdict:
    true, scene = truth_of(scenario), scenario.scene
    impulse, expected = friction_impulses(played, scene), friction_impulses(true, scene)
    off = np.abs(impulse - expected) / np.abs(expected)
    way, disk = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(off), off, -1))), off.shape)
    share = impulse[way, disk] / expected[way, disk] + 0.0
    what = ("speed along the surfaces", "spin")[way]
    event = f"friction changes the {what} of disk {disk} by {share:.3g} times the right amount"
    return read(off[way, disk], true.collisions.t[0], event, int(disk))


def friction_impulses(trajectory: Trajectory, scene: Scene) -> Array:
    """(2, n) N s of friction from start to end, once from the disks' velocities (m dv) and once
    from their spins (I dw / r). The two have the same size if friction acts at the rim. Along the
    contact: the floor, or between two disks side by side."""
    tangent = np.array([1.0, 0.0] if len(scene.walls) else [0.0, 1.0])
    dv = (trajectory.velocity[-1] - trajectory.velocity[0]) @ tangent
    dw = trajectory.angular_velocity[-1] - trajectory.angular_velocity[0]
    return np.array([scene.mass * dv, scene.inertia * dw / scene.radius])


@predicate("a disk does not roll at the right speed after it has slid", "of the start speed", 0.01)
def rolling_off(scenario: Scenario, played: Trajectory) -> Verdict:
    scene = scenario.scene
    speed, rim = (
        np.stack([run.velocity[:, 0, 0], -scene.radius[0] * run.angular_velocity[:, 0]])
        for run in (played, truth_of(scenario))
    )
    off = np.abs(speed - rim).max(axis=0) / np.abs(scene.velocity[0, 0])
    moves, turns = speed[:, -1] / rim[:, -1]
    event = f"it moves at {moves:.4g}, and its rim at {turns:.4g}, of the speed of rolling"
    return read(off[-1], first_above(played.t, off, rolling_off.bound), event)


@predicate("a disk slips on a slope on which it should roll", "of the speed", 0.05)
def slips(scenario: Scenario, played: Trajectory) -> Verdict:
    along = played.velocity[1:, 0, 0]
    slip = along + scenario.scene.radius[0] * played.angular_velocity[1:, 0]
    share = np.abs(slip) / np.where(along, np.abs(along), np.nan)
    at = first_above(played.t[1:], share, slips.bound)
    return read(share[-1], at, f"the rim slips at {share[-1]:.3g} of the speed of the disk")


@predicate("a disk at rest moves or turns after the first tenth of the run", "radii", 0.01)
def creeps(scenario: Scenario, played: Trajectory) -> Verdict:
    first = int(np.ceil(SETTLED * (len(played) - 1)))
    x, turned = played.position[:, 0], played.angle[:, 0]
    radius = scenario.scene.radius[0]
    moved = np.hypot(*(x - x[first]).T) / radius + np.abs(turned - turned[first])
    moved[:first] = 0.0
    return largest(played.t, moved, creeps.bound, f"it has moved by {moved.max():.3g} radii")


def fastest(played: Trajectory, scene: Scene) -> Array:
    """(k,) radii/s."""
    speed: Array = (laws.lengths(played.velocity) / scene.radius).max(axis=1)
    return speed


@predicate("a disk sinks by 0.1 radii, or jitters at 0.02 sqrt(g R)", "of the bound", 1.0)
def does_not_stand(scenario: Scenario, played: Trajectory) -> Verdict:
    half, moved = len(played) // 2, laws.lengths(played.position - played.position[0])
    radii = (moved / scenario.scene.radius).max(axis=1)
    worst = int(np.argmax(moved[-1]))
    event = f"disk {worst} has moved by {radii.max():.3g} radii"
    speed = laws.lengths(played.velocity[half:]) / own_speed(scenario)
    jitter = float(np.sqrt((speed**2).mean(axis=1)).mean())
    says = f"jitters at {jitter:.3g} sqrt(g R)"
    return worst_of(
        [
            largest(played.t, radii, MOST_SINKING, event, worst, "sinks"),
            read(jitter / MOST_JITTER, played.t[half], says, None, "jitters"),
        ]
    )


@predicate("two disks that start at rest separate at a speed", "radii/s", 0.1)
def ejected(scenario: Scenario, played: Trajectory) -> Verdict:
    speed = fastest(played, scenario.scene)
    at = first_above(played.t, speed, ejected.bound)
    return read(speed[-1], at, f"the disks separate at {speed[-1]:.3g} radii/s")


@predicate("an overlap is left after a second", "radii", 0.02)
def still_overlap(scenario: Scenario, played: Trajectory) -> Verdict:
    overlap = float(laws.penetration(played, scenario.scene)[-1])
    return read(overlap, played.t[-1], f"an overlap of {overlap:.3g} radii is left")


@predicate("a disk leaves the box, or flies at 10 radii/s", "of the bound", 1.0)
def bursts(scenario: Scenario, played: Trajectory) -> Verdict:
    walls, x = scenario.scene.walls, played.position
    low, high = walls.min(axis=(0, 1)), walls.max(axis=(0, 1))
    outside = ((x < low) | (x > high)).any(axis=2).sum(axis=1)
    speed, out = fastest(played, scenario.scene), f"{outside.max()} disks are out of the box"
    flies = f"a disk flies at {speed.max():.3g} radii/s"
    return worst_of(
        [
            largest(played.t, outside, 0.5, out, None, "escape"),
            largest(played.t, speed, MOST_SPEED, flies, None, "energy"),
        ]
    )


@predicate("a disk that should be at rest moves", "sqrt(g R)", MOST_RESIDUAL)
def not_at_rest(scenario: Scenario, played: Trajectory) -> Verdict:
    late = played.velocity[-max(1, len(played) // 10) :]
    speed = np.sqrt((late**2).sum(axis=2).mean(axis=1)) / own_speed(scenario)
    event = f"still moves at {speed.max():.3g} sqrt(g R)"
    return read(speed.max(), played.t[-len(late)], event, None)
