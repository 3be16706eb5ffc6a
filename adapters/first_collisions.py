"""The collisions of an engine: the starts of its contacts, if it reports an impulse in every
step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse, Engine
from crosscheck2d.scenarios.model import NO_COLLISIONS, Collisions, Scene, frozen


def collisions_of(engine: Engine, scene: Scene, dt: float) -> Collisions:
    """The collisions of an engine; none if it has failed and cannot report them."""
    try:
        impulses = engine.collisions()
    except Exception:  # the run already has the reason
        return NO_COLLISIONS
    return first_collisions(impulses, dt, weight_impulse(scene, dt))


def weight_impulse(scene: Scene, dt: float) -> float:
    """N s, the largest impulse of a contact in one step by the weight of all disks."""
    moving = scene.mass[~scene.static].sum()
    return float(2 * moving * np.linalg.norm(scene.gravity) * dt)


def first_collisions(
    collisions: Sequence[ContactImpulse], dt: float, weight: float = 0.0
) -> Collisions:
    """One collision for each start of a pair's impulses; its time is the end of the step.

    An impulse in the step after another of the same pair continues it if it is at most `weight` N
    s, or if the engine does not report its size; else it is a new collision. Impulses of less than
    a millionth of the pair's strongest are rounding, and left out; their magnitude counts, because
    the impulses of a faulty solver may have the wrong sign.
    """
    if not collisions:
        return NO_COLLISIONS
    step, i, j = (np.array(column) for column in list(zip(*collisions))[:3])
    impulse = np.array([collision.impulse for collision in collisions])
    low, high = np.minimum(i, j), np.maximum(i, j)
    disk, other = np.where(low < 0, high, low), np.where(low < 0, low, high)
    order = np.lexsort((step, other, disk))
    rows = step[order], disk[order], other[order], impulse[order]
    starts = first_of_pair(rows[1], rows[2])
    size = np.abs(rows[3])
    strongest = np.maximum.reduceat(np.nan_to_num(size), np.flatnonzero(starts))[
        np.cumsum(starts) - 1
    ]
    step, disk, other, impulse = (row[~(size < 1e-6 * strongest)] for row in rows)
    begins = first_of_pair(disk, other) | (np.diff(step, prepend=step[0]) > 1)
    begins |= np.abs(impulse) > weight
    order = np.flatnonzero(begins)[np.lexsort((other[begins], disk[begins], step[begins]))]
    return Collisions(
        t=frozen((step[order] + 1) * dt),
        i=frozen(disk[order], np.int64),
        j=frozen(other[order], np.int64),
        impulse=frozen(impulse[order]),
    )


def first_of_pair(disk: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(h,) True where rows sorted by pair come to a new pair."""
    return np.append(True, (np.diff(disk) != 0) | (np.diff(other) != 0))
