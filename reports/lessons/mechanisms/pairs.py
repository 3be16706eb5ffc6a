"""Pairs that meet head on, and the restitution of each."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.lessons.lesson import Read
from crosscheck2d.reports.lessons.mechanisms.ablation import asked
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory

CLOSING = np.array(
    [0.1, 0.2, 0.3, 0.4, 0.55, 0.7, 0.85, 0.95, 1.05, 1.2, 1.5, 1.9, 2.1, 3.0, 5.0]
)  # m/s
SECONDS = 0.5  # until the separation is read: they meet after 0.2 s


def at_all_speeds(e: float) -> Scenario:
    """One pair for each of `CLOSING`."""
    return asked(pairs(CLOSING, e), SECONDS)


def pairs(closing: Array, restitution: float, friction: float = 0.0, spin: float = 0.0) -> Scene:
    """One head-on pair of equal disks for each closing speed (k,) m/s, above each other, to meet
    after 0.2 s; both turn by `spin` rad/s, so that their surfaces slide on each other."""
    k, r = len(closing), 0.1
    gap = r + closing * 0.1
    x = np.stack(
        [
            np.column_stack([-gap, 3 * r * np.arange(k)]),
            np.column_stack([gap, 3 * r * np.arange(k)]),
        ],
        axis=1,
    )
    v = np.stack(
        [np.column_stack([closing / 2, np.zeros(k)]), np.column_stack([-closing / 2, np.zeros(k)])],
        axis=1,
    )
    return lay_out(
        position=x.reshape(-1, 2),
        velocity=v.reshape(-1, 2),
        radius=np.full(2 * k, r),
        angular_velocity=np.full(2 * k, spin),
        restitution=restitution,
        friction=friction,
    )


def separation(closing: Array) -> Read:
    """(k,) separation over approach speed of `pairs`, at the end."""
    return lambda each: (each.velocity[-1, 1::2, 0] - each.velocity[-1, 0::2, 0]) / closing


def sideways(each: Trajectory) -> Array:
    """(k,) the impulse along the surfaces over that along the normal of `pairs`."""
    taken: Array = each.velocity[-1, 1::2] - each.velocity[0, 1::2]
    return np.abs(taken[:, 1] / taken[:, 0])
