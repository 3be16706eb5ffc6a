"""Which law an engine follows in a collision with touching disks, and how large gaps must be until
the laws agree.

The law is named, never scored: for touching disks the limit of small gaps does not decide between
the laws; with gaps the exact answer does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import ceil, nan, sqrt
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.reports.stability.predicates import REFUSED
from crosscheck2d.reports.stability.scenes import LEAD, RADIUS, disks
from crosscheck2d.reports.stability.variants import play_as
from crosscheck2d.scenarios.model import Array, Scenario
from crosscheck2d.scenarios.truth.exact import with_oracle

# of the incoming speed; an engine whose velocities differ by more from every law follows none
NEAR = 0.02
# m/s, s: a radius in 32 steps, as a late detection tilts the normal; above any threshold
SPEED, DT = 8.0, 1 / 1024
AFTER = 24  # steps after the collision: an engine may need a step for each contact
PAIRS, AT_ONCE = "pair after pair", "all contacts at once"
GAPS = (0.0, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0)  # radii


@dataclass(frozen=True, eq=False)
class Touching:
    """A scene at e = 1 in which disk 0 strikes disks that touch each other.

    Attributes:
        asks: what happens, in a sentence.
        position: (n, 2) in radii, all touching; disk 0 comes in along x at speed 1.
        displaced: (n, 2) by how much a disk is moved for each radius of gap.
        laws: name -> velocities (n, 2) in units of the incoming speed; several where the order is
            free.
        source: of the laws.
    """

    asks: str
    position: Array
    displaced: Array
    laws: dict[str, list[Array]]
    source: str


class AtGap(NamedTuple):
    """The result of an engine at one gap, in radii.

    law: the nearest one, "none" if all are farther off than `NEAR`; off: the distance to it.
    momentum: its change, over the initial momentum. energy: over the initial energy. velocity: of
    the disks, over the incoming speed.
    """

    gap: float
    law: str
    off: float
    momentum: float
    energy: float
    velocity: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class LawOf:
    """The result of an engine at every gap."""

    name: str
    engine: str
    gaps: tuple[AtGap, ...]
    status: str = "ok"

    @staticmethod
    def from_record(record: dict[str, Any]) -> LawOf:
        """From the value of its row."""
        gaps = []
        for gap, law, off, momentum, energy, velocity in record["gaps"]:
            rows = tuple((float(x), float(y)) for x, y in velocity)
            gaps.append(AtGap(gap, law, float(off), float(momentum), float(energy), rows))
        return LawOf(**record | {"gaps": tuple(gaps)})


def cradle(n: int) -> Touching:
    """A disk strikes a row of n - 1 disks."""
    row = np.stack([2.0 * np.arange(n) - 2, np.zeros(n)], axis=-1)
    apart = np.stack([np.maximum(0.0, np.arange(n) - 1), np.zeros(n)], axis=-1)
    last, together = np.zeros((n, 2)), np.zeros((n, 2))
    last[-1, 0] = 1.0
    together[:, 0] = 2 / n
    together[0, 0] -= 1
    return Touching(
        f"A disk strikes a row of {n - 1}.",
        row,
        apart,
        {PAIRS: [last], AT_ONCE: [together]},
        "equal masses swap velocities pair by pair; or e = 1 holds for every contact in one solve",
    )


BREAK = np.array([[-1 / 8, -sqrt(3) / 8], [3 / 4, sqrt(3) / 4], [3 / 8, -sqrt(3) / 8]])
MIRRORED = BREAK[[0, 2, 1]] * [1, -1]
TOUCHING = {
    "touching_cradle_of_3": cradle(3),
    "touching_cradle_of_5": cradle(5),
    "touching_break": Touching(
        "A disk strikes two, in their middle.",
        np.array([[-sqrt(3), 0], [0, 1], [0, -1]]),
        np.array([[0.0, 0], [0, 0], [sqrt(3) / 2, -1 / 2]]),
        {
            PAIRS: [BREAK, MIRRORED],
            AT_ONCE: [np.array([[-1 / 5, 0], [3 / 5, sqrt(3) / 5], [3 / 5, -sqrt(3) / 5]])],
        },
        "the two limits of small gaps; or e = 1 holds for every contact in one solve",
    ),
}


def scene_of(touching: Touching, gap: float) -> Scenario:
    """Disk 0 flies in and arrives in the middle of its fourth step; the scene lasts until long
    after the last collision."""
    position = (touching.position + gap * touching.displaced) * RADIUS
    position[0, 0] -= SPEED * DT * (LEAD + 0.5)
    scene = disks(position, [[SPEED, 0], *np.zeros((len(position) - 1, 2))])
    crossing = 4 * gap * RADIUS / (SPEED * DT)  # steps: four gaps, or one at a quarter of the speed
    steps = LEAD + 1 + AFTER + ceil(crossing)
    return Scenario("touching", touching.asks, touching.source, scene, steps * DT, DT, (1,))


@cache
def answers(name: str, gap: float) -> dict[str, list[Array]]:
    """Law -> the velocities (n, 2) that it allows; if the disks do not touch, the exact answer
    is pair after pair."""
    touching = TOUCHING[name]
    if gap == 0:
        return touching.laws
    scenario = with_oracle(scene_of(touching, gap))
    assert scenario.truth is not None
    return touching.laws | {PAIRS: [scenario.truth(scenario.times).velocity[-1] / SPEED]}


def law_of(name: str, engine: str, gaps: tuple[float, ...] = GAPS) -> LawOf:
    """Play a scene at every gap, and compare with every law."""
    results = []
    for gap in gaps:
        run = play_as(engine, scene_of(TOUCHING[name], gap))
        if run.status != "ok" or run.trajectory is None:
            outcome = REFUSED if run.status == "unsupported" else run.status
            results.append(AtGap(gap, outcome, nan, nan, nan, ()))
        else:
            velocity = run.trajectory.velocity[-1] / SPEED
            results.append(named(velocity, gap, answers(name, gap)))
    return LawOf(name, engine, tuple(results))


def named(velocity: Array, gap: float, laws: dict[str, list[Array]]) -> AtGap:
    """The law whose velocities are nearest to these (n, 2), in units of the incoming speed."""
    off = {law: min(np.abs(velocity - v).max() for v in vs) for law, vs in laws.items()}
    nearest = min(off, key=lambda law: float(off[law]))
    momentum = float(np.linalg.norm(velocity.sum(axis=0) - [1, 0]))
    rows = tuple((float(x), float(y)) for x, y in velocity)
    law = nearest if off[nearest] <= NEAR else "none"
    return AtGap(gap, law, float(off[nearest]), momentum, float((velocity**2).sum()), rows)
