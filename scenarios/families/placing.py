"""Makes scenes: from lists, with walls, with random disks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from crosscheck2d.scenarios.model import Array, Scene


def lay_out(
    position: ArrayLike,
    velocity: ArrayLike = (0.0, 0.0),
    radius: ArrayLike = 0.25,
    mass: ArrayLike = 1.0,
    restitution: float = 1.0,
    **fields: Any,
) -> Scene:
    """The `Scene` of these disks; one velocity, radius or mass is that of all of them. Raises what
    `Scene` raises."""
    x, v, r, m = (np.asarray(value, float) for value in (position, velocity, radius, mass))
    return Scene(
        position=x,
        velocity=v if v.ndim > 1 else np.tile(v, (len(x), 1)),
        radius=r if r.ndim else np.full(len(x), r),
        mass=m if m.ndim else np.full(len(x), m),
        restitution=restitution,
        **fields,
    )


def tag(letter: str, value: float) -> str:
    """A number in the name of a scenario: "e09" for e = 0.9."""
    return f"{letter}{value:g}".replace(".", "")


def box(low: ArrayLike, high: ArrayLike) -> Array:
    """(4, 2, 2) m, the walls of a box from its low to its high corner: left, bottom, right, top."""
    (left, bottom), (right, top) = np.asarray(low, float), np.asarray(high, float)
    corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
    return np.array([(corners[side - 1], corners[side]) for side in range(4)])


def scatter(
    rng: np.random.Generator,
    low: Sequence[float],
    high: Sequence[float],
    radius: Array,
    first: ArrayLike | None = None,
) -> Array:
    """(n, 2) m, centres sampled uniformly between the corners; each is sampled again until its disk
    overlaps no earlier one.

    radius (n,) m. first (2,) m: the place of disk 0 if it is not sampled. For sparse disks only:
    each equal disk blocks four times its area for the next centres, so a free place always remains
    up to a quarter of the box.
    """
    centres = np.empty((len(radius), 2))
    n = 0  # are placed
    if first is not None:
        centres[0], n = first, 1
    while n < len(radius):
        centre = rng.uniform(low, high)
        if (np.hypot(*(centre - centres[:n]).T) > radius[:n] + radius[n]).all():
            centres[n], n = centre, n + 1
    return centres
