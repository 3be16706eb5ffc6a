"""What failing means for gases, stacks and piles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reports import laws
from reports.stability.players import play_as
from reports.stability.predicates import Predicate, Reading, first_above, truth_of
from scenarios.model import Array, Scenario, Trajectory

Pick = Callable[[Trajectory], tuple[Array, Array]]
BLOCKS = 10
ERRORS = 4.0  # block errors that a mean may be off by chance: a false alarm in some 10 000 readings
YARDSTICK = "event_driven:float64"  # what a gas in the same box does, from hit to hit; tests/test_events.py holds it
# to the virial series and to Enskog's rate on a torus, where there are no walls to correct for


def _energy_drifts(scenario: Scenario, played: Trajectory) -> Reading:
    energy = laws.energy(played, scenario.scene)
    off = np.abs(energy / energy[0] - 1)
    factor = energy[-1] / energy[0]
    at = first_above(played.t, off, ENERGY_DRIFTS.bound)
    return Reading(float(off.max()), at, f"the energy is {factor:.4g} of what it was", disk=-1)


def _gas_parts(scenario: Scenario, played: Trajectory) -> Reading:
    apart = np.linalg.norm(played.position - truth_of(scenario).position, axis=2) / scenario.scene.radius
    off = apart.max(axis=1)
    worst = int(np.argmax(apart[-1]))
    return Reading(
        float(off.max()), first_above(played.t, off, GAS_PARTS.bound), f"disk {worst} is somewhere else", disk=worst
    )


def beyond_chance(blocks: Array, expected: float) -> float:
    """How far the mean of (`BLOCKS`,) is from what is expected, relative, less `ERRORS` of its errors; at least 0."""
    mean, error = float(blocks.mean()), float(blocks.std(ddof=1)) / np.sqrt(len(blocks))
    return max(0.0, abs(mean / expected - 1) - ERRORS * error / abs(expected))


def in_blocks(series: Array) -> Array:
    """(`BLOCKS`,) means of a series (k,) over as many stretches of it; the first tenth is left out."""
    settled = series[len(series) // 10 :]
    return np.array([block.mean() for block in np.array_split(settled, BLOCKS)])


def _temperatures_part(scenario: Scenario, played: Trajectory) -> Reading:
    mass = scenario.scene.mass
    kinetic = mass * (played.velocity**2).sum(axis=2) / 2
    light, heavy = (kinetic[:, mass == kind].mean(axis=1) for kind in (mass.min(), mass.max()))
    blocks = np.log2(in_blocks(heavy) / in_blocks(light))
    off = max(0.0, abs(float(blocks.mean())) - ERRORS * float(blocks.std(ddof=1)) / np.sqrt(BLOCKS))
    at = first_above(played.t, np.abs(np.log2(heavy / light)), 1.0)
    return Reading(off, at, f"heavy disks are {2 ** blocks.mean():.3g} times as hot as light ones", disk=-1)


def _wrong_gas(scenario: Scenario, played: Trajectory) -> Reading:
    other = play_as(YARDSTICK, scenario).trajectory
    assert other is not None
    parts = [_shape(scenario, played), _beside("rate", played, other, disk_hits)]
    if not np.isnan(played.collisions.impulse).any():  # Box2D 3.1 does not tell with what impulse it hits
        parts.append(_beside("pressure", played, other, wall_impulses))
    return max(parts, key=lambda part: part.value)


def _shape(scenario: Scenario, played: Trajectory) -> Reading:
    squared = (played.velocity**2).sum(axis=2)
    n = scenario.scene.n
    ought = 2 * n / (n + 1)  # of velocities drawn from a sphere in 2n dimensions: Maxwell's 2 for many disks
    shape = (squared**2).mean(axis=1) / squared.mean(axis=1) ** 2
    off = beyond_chance(in_blocks(shape), ought) / MOST_OFF
    at = first_above(played.t, np.abs(shape / ought - 1), 0.5)
    return Reading(off, at, f"<v4> / <v2>2 is {shape.mean():.3g}, not {ought:.3g}", "not Maxwell", disk=-1)


def disk_hits(one: Trajectory) -> tuple[Array, Array]:
    """Times of hits between disks, each counted once."""
    t = one.collisions.t[one.collisions.j >= 0]
    return t, np.ones(len(t))


def wall_impulses(one: Trajectory) -> tuple[Array, Array]:
    """Times of hits on walls, and their impulses."""
    walls = one.collisions.j < 0
    return one.collisions.t[walls], one.collisions.impulse[walls]


def _beside(what: str, played: Trajectory, other: Trajectory, pick: Pick) -> Reading:
    """Sums over hits in blocks of time, beside those of the event engine in the same box from the same start."""
    edges = np.linspace(0.1 * played.t[-1], played.t[-1], BLOCKS + 1)
    mine, its = (
        np.histogram(times, edges, weights=weights)[0].astype(float) for times, weights in (pick(played), pick(other))
    )
    error = np.sqrt((mine.var(ddof=1) + its.var(ddof=1)) / BLOCKS) / its.mean()
    ratio = mine.mean() / its.mean()
    off = max(0.0, abs(ratio - 1) - ERRORS * error) / MOST_OFF
    return Reading(off, float(edges[1]), f"{ratio:.3g} times the {what} of the exact gas", what, disk=-1)


def _stands(scenario: Scenario, played: Trajectory) -> Reading:
    scene = scenario.scene
    moved = (np.linalg.norm(played.position - played.position[0], axis=2) / scene.radius).max(axis=1)
    speed = np.linalg.norm(played.velocity[len(played) // 2 :], axis=2) / own_speed(scenario)
    jitter = float(np.sqrt((speed**2).mean(axis=1)).mean())
    worst = int(np.argmax(np.linalg.norm(played.position[-1] - played.position[0], axis=1)))
    sinks = Reading(
        float(moved.max()) / MOST_SINKING, first_above(played.t, moved, MOST_SINKING),
        f"disk {worst} has moved by {moved.max():.3g} radii", "sinks", disk=worst,
    )  # fmt: skip
    jitters = Reading(
        jitter / MOST_JITTER,
        float(played.t[len(played) // 2]),
        f"trembles at {jitter:.3g} sqrt(g R)",
        "jitters",
        disk=-1,
    )
    return max(sinks, jitters)


def own_speed(scenario: Scenario) -> float:
    """sqrt(g R) m/s, of a disk that falls by half its radius."""
    return float(np.sqrt(np.linalg.norm(scenario.scene.gravity) * scenario.scene.radius.min()))


def _ejected(scenario: Scenario, played: Trajectory) -> Reading:
    speed = (np.linalg.norm(played.velocity, axis=2) / scenario.scene.radius).max(axis=1)
    return Reading(float(speed[-1]), first_above(played.t, speed, EJECTED.bound), f"thrown at {speed[-1]:.3g} radii/s")


def _not_apart(scenario: Scenario, played: Trajectory) -> Reading:
    left = laws.penetration(played, scenario.scene)
    return Reading(float(left[-1]), float(played.t[-1]), f"an overlap of {left[-1]:.3g} radii is left")


def _bursts(scenario: Scenario, played: Trajectory) -> Reading:
    scene = scenario.scene
    low, high = scene.walls.min(axis=(0, 1)), scene.walls.max(axis=(0, 1))
    outside = ((played.position < low) | (played.position > high)).any(axis=2).sum(axis=1)
    speed = (np.linalg.norm(played.velocity, axis=2) / scene.radius).max(axis=1)
    escapes = Reading(
        2.0 * float(outside.max()), first_above(played.t, outside.astype(float), 0.5),
        f"{outside.max()} disks are out of the box", "escape", disk=-1,
    )  # fmt: skip
    flies = Reading(
        float(speed.max()) / MOST_SPEED,
        first_above(played.t, speed, MOST_SPEED),
        f"a disk flies at {speed.max():.3g} radii/s",
        "energy",
        disk=-1,
    )
    return max(escapes, flies)


def _not_at_rest(scenario: Scenario, played: Trajectory) -> Reading:
    late = played.velocity[-max(1, len(played) // 10) :]
    speed = np.sqrt((late**2).sum(axis=2).mean(axis=1)) / own_speed(scenario)
    return Reading(
        float(speed.max()), float(played.t[-len(late)]), f"still moves at {speed.max():.3g} sqrt(g R)", disk=-1
    )


MOST_SINKING, MOST_JITTER, MOST_SPEED = 0.1, 0.02, 10.0  # radii; sqrt(g R); radii/s
MOST_OFF = 0.05  # of a mean

ENERGY_DRIFTS = Predicate("energy drifts", "of the energy", 0.01, "energy comes or goes at e = 1", _energy_drifts)
GAS_PARTS = Predicate("parts", "radii", 1e-3, "the same gas is somewhere else", _gas_parts)
TEMPERATURES_PART = Predicate(
    "temperatures part",
    "doublings",
    0.5,
    "one kind of disk is hotter by half a doubling and 4 block errors",
    _temperatures_part,
)
WRONG_GAS = Predicate(
    "wrong gas",
    "of the bound",
    1.0,
    "distribution of speeds, rate of hits or wall pressure off by 5 % and 4 block errors",
    _wrong_gas,
)
STANDS = Predicate(
    "does not stand", "of the bound", 1.0, "a disk sinks by 0.1 radii, or trembles at 0.02 sqrt(g R)", _stands
)
EJECTED = Predicate("thrown apart", "radii/s", 0.1, "two disks at rest are given energy", _ejected)
NOT_APART = Predicate("still overlap", "radii", 0.02, "an overlap is left after a second", _not_apart)
BURSTS = Predicate("bursts", "of the bound", 1.0, "a disk leaves the box, or flies at 10 radii/s", _bursts)
NOT_AT_REST = Predicate("not at rest", "sqrt(g R)", 0.05, "what should lie still moves", _not_at_rest)
