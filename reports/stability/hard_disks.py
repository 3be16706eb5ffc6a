"""A gas of equal hard disks in the literature: pressure and collision rate, in the bulk and between
walls."""

from __future__ import annotations

from functools import cache
from math import pi, sqrt
from typing import NamedTuple

import numpy as np

# B_k / B_2^(k-1) of hard disks, k = 1 .. 10 (Clisby & McCoy, J. Stat. Phys. 122, 15, 2006).
VIRIALS = (
    1,
    1,
    (16 / 3 - 4 * np.sqrt(3) / np.pi) / 4,
    0.53223180,
    0.33355604,
    0.1988425,
    0.1148728,
    0.0649930,
    0.0362193,
    0.0199537,
)


@cache
def approximant() -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator, highest power first, of the Pade approximant [4/5] of the virial
    series."""
    series = np.array(VIRIALS) * 2.0 ** np.arange(10)
    matrix = np.array(
        [
            [series[5 + row - col] if 5 + row - col >= 0 else 0.0 for col in range(1, 6)]
            for row in range(5)
        ]
    )
    below = np.append(1.0, np.linalg.solve(matrix, -series[5:10]))
    above = np.array(
        [sum(below[m] * series[k - m] for m in range(min(k, 5) + 1)) for k in range(5)]
    )
    return above[::-1], below[::-1]


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
