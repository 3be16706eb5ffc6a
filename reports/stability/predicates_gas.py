"""The predicates for gases at e = 1: a conserved quantity drifts, or a statistic differs from the
literature."""

from __future__ import annotations

from functools import cache
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.verdicts import MOST_MOMENTUM, Verdict
from crosscheck2d.reports.stability.predicates import (
    first_above,
    largest,
    predicate,
    read,
    truth_of,
    worst_of,
)
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

# B_k / B_2^(k-1) of hard disks, k = 1 .. 10 (Clisby & McCoy, J. Stat. Phys. 122, 15, 2006).
VIRIALS = (
    *(1, 1, (16 / 3 - 4 * np.sqrt(3) / np.pi) / 4, 0.53223180, 0.33355604),
    *(0.1988425, 0.1148728, 0.0649930, 0.0362193, 0.0199537),
)


@cache
def approximant() -> tuple[np.ndarray, np.ndarray]:
    # numerator and denominator, highest power first, of the Pade approximant [4/5] of the virials
    series = np.array(VIRIALS) * 2.0 ** np.arange(10)
    matrix = [[series[5 + k - m] if 5 + k - m >= 0 else 0.0 for m in range(1, 6)] for k in range(5)]
    below = np.append(1.0, np.linalg.solve(np.array(matrix), -series[5:10]))
    above = [sum(below[m] * series[k - m] for m in range(min(k, 5) + 1)) for k in range(5)]
    return np.array(above)[::-1], below[::-1]


def compressibility(packing: float) -> float:
    """Z = p V / (N kT): the virial series in the packing, resummed."""
    above, below = approximant()
    return float(np.polyval(above, packing) / np.polyval(below, packing))


def bulk_packing(packing: float, radius: float, size: np.ndarray) -> float:
    """The packing far from the walls of a box that its disks cover by `packing`.

    A hard wall has the line tension rho r kT / (1 - eta), so by Gibbs' adsorption equation rho r (1
    - eta) / (1 + eta) disks a length are missing along it; at a corner two such strips overlap.
    """
    area, around = size.prod(), 2 * size.sum()
    bulk = packing
    for _ in range(100):  # a fixed point: each round leaves a fifth of the error or less
        missing = radius * (1 - bulk) / (1 + bulk)
        bulk = packing * area / (area - missing * around + 4 * missing**2)
    return float(bulk)


class Gas(NamedTuple):
    """Force on the four walls together in N, and collisions between disks a second."""

    force: float
    rate: float


def gas_in_box(
    n: int, radius: float, size: np.ndarray, temperature: float, mass: float = 1.0
) -> Gas:
    """The `Gas` of `n` equal disks in a box of `size` (2,) m at kT = `temperature` J, e = 1.

    The force on a cut through the box is that of the bulk pressure, less the line tension of the
    two walls that are cut (scaled particle theory: Helfand, Frisch & Lebowitz, J. Chem. Phys. 34,
    1037, 1961). The virials of walls and collisions add up to 2 N kT in any gas, and a collision
    has the mean impulse sqrt(pi m kT): this gives the rate, which is Enskog's, 4 / sqrt(pi) (Z - 1)
    a disk, where there are no walls.
    """
    bulk = bulk_packing(n * pi * radius**2 / size.prod(), radius, size)
    density = bulk / (pi * radius**2)
    tension = density * radius * temperature / (1 - bulk)
    on_end = compressibility(bulk) * density * temperature * size[::-1] - 2 * tension
    inner = float((on_end * (size - 2 * radius)).sum())
    rate = (inner - 2 * n * temperature) / (2 * radius * sqrt(pi * mass * temperature))
    return Gas(float(2 * on_end.sum()), rate)


BLOCKS = 10
# block errors; with ten blocks the mean is farther off by chance in 3 of 1000 readings (Student's
# t)
ERRORS = 4.0
MOST_OFF = 0.05  # relative to the literature, in addition
RANGES = 5  # of speed, with equal numbers of disks


@predicate("the energy changes at e = 1", "of the energy", 0.01)
def energy_drifts(scenario: Scenario, played: Trajectory) -> Verdict:
    energy = laws.energy(played, scenario.scene)
    off = np.abs(energy / energy[0] - 1)
    event = f"the energy is {energy[-1] / energy[0]:.4g} times that at the start"
    return largest(played.t, off, energy_drifts.bound, event, None)


@predicate(
    "the momentum changes by more than a hundred roundings of float32",
    "of all momenta",
    MOST_MOMENTUM,
)
def momentum_drifts(scenario: Scenario, played: Trajectory) -> Verdict:
    mass, velocity = scenario.scene.mass[:, None], played.velocity
    momentum = (mass * velocity).sum(axis=1)
    whole = laws.lengths(mass * velocity[0]).sum()
    off = laws.lengths(momentum - momentum[0]) / whole
    event = f"the momentum has changed by {off.max():.3g} of the sum of all momenta"
    return largest(played.t, off, momentum_drifts.bound, event, None)


@predicate("the disks of the two runs are at different positions", "radii", 1e-3)
def diverges(scenario: Scenario, played: Trajectory) -> Verdict:
    off = laws.lengths(played.position - truth_of(scenario).position) / scenario.scene.radius
    disk = int(np.argmax(off[-1]))
    event = f"disk {disk} is at another position"
    return largest(played.t, off.max(axis=1), diverges.bound, event, disk)


def in_blocks(series: Array) -> Array:
    # means over blocks of equal length, without the first tenth
    settled = series[len(series) // 10 :]
    return np.array([block.mean(axis=0) for block in np.array_split(settled, BLOCKS)])


def block_error(blocks: Array) -> float:
    return float(blocks.std(ddof=1)) / sqrt(len(blocks))


@predicate(
    "the temperatures of light and heavy disks differ by half a doubling plus 4 block errors",
    "doublings",
    0.5,
)
def temperatures_part(scenario: Scenario, played: Trajectory) -> Verdict:
    mass = scenario.scene.mass
    kinetic = mass * (played.velocity**2).sum(axis=2) / 2
    light, heavy = (kinetic[:, mass == kind].mean(axis=1) for kind in (mass.min(), mass.max()))
    blocks = np.log2(in_blocks(heavy) / in_blocks(light))
    off = max(0.0, abs(float(blocks.mean())) - ERRORS * block_error(blocks))
    at = first_above(played.t, np.abs(np.log2(heavy / light)), 1.0)
    event = f"heavy disks are {2 ** blocks.mean():.3g} times as hot as light ones"
    return read(off, at, event, None)


@predicate(
    "the speeds, collision rate or wall pressure differ from Maxwell, Enskog or the virial series"
    " by 5 % plus 4 block errors",
    "of the bound",
    1.0,
)
def wrong_gas(scenario: Scenario, played: Trajectory) -> Verdict:
    collisions, at = played.collisions, float(played.t[len(played) // 10])
    expected, shares = literature(scenario), in_blocks(shares_of_speeds(played))
    words = ("the slowest", *("those between",) * (RANGES - 2), "the fastest")
    parts = [
        off_literature(
            "not Maxwell", shares[:, k], 1 / RANGES, f"the share that {word} fifth should be", at
        )
        for k, word in enumerate(words)
    ]
    met = counted(played, collisions.j >= 0, np.ones(len(collisions)))
    parts.append(off_literature("rate", met, expected.rate, "Enskog's rate of collisions", at))
    if not np.isnan(collisions.impulse).any():  # Box2D 3.1 reports no impulses
        force = counted(played, collisions.j < 0, collisions.impulse)
        whose = "the pressure of the virial series"
        parts.append(off_literature("pressure", force, expected.force, whose, at))
    return worst_of(parts)


def literature(scenario: Scenario) -> Gas:
    scene = scenario.scene
    size = scene.walls.max(axis=(0, 1)) - scene.walls.min(axis=(0, 1))
    temperature = float(scene.mass[0] * (scene.velocity**2).sum() / 2 / scene.n)
    return gas_in_box(scene.n, float(scene.radius[0]), size, temperature, float(scene.mass[0]))


def counted(played: Trajectory, which: NDArray[np.bool_], weights: Array) -> Array:
    # sums of the weights of some collisions, per second, in blocks after the first tenth
    edges = np.linspace(0.1 * played.t[-1], played.t[-1], BLOCKS + 1)
    sums, _ = np.histogram(played.collisions.t[which], edges, weights=weights[which])
    return sums / np.diff(edges)


def off_literature(kind: str, blocks: Array, expected: float, whose: str, at: float) -> Verdict:
    """The relative error of a mean, less `ERRORS` block errors, in units of `MOST_OFF`."""
    ratio, error = float(blocks.mean()) / expected, block_error(blocks) / expected
    off = max(0.0, abs(ratio - 1) - ERRORS * error) / MOST_OFF
    return read(off, at, f"{ratio:.3f} ± {error:.3f} times {whose}", None, kind)


def shares_of_speeds(played: Trajectory) -> Array:
    """(k, `RANGES`) share of the disks in each of the ranges of speed that should hold equal
    shares.

    Velocities of n equal disks at a given energy are spread evenly over a sphere in 2n dimensions:
    a disk has more than the share s of the energy with the probability (1 - s)^(n - 1), which is
    Maxwell's exp(-m v2 / 2kT) for many.
    """
    energy = (played.velocity**2).sum(axis=2)
    share = energy / energy.sum(axis=1, keepdims=True)
    rank = 1 - (1 - share) ** (energy.shape[1] - 1)
    bins = np.clip((rank * RANGES).astype(int), 0, RANGES - 1)
    shares: Array = (bins[:, :, None] == np.arange(RANGES)).mean(axis=1)
    return shares
