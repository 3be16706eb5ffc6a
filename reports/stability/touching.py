"""Which law a player follows where touching disks are hit: named, never scored, for no limit of small gaps decides."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from reports.stability.cases_hits import AFTER, LEAD, RADIUS
from reports.stability.players import play_as
from scenarios.model import Array, Scenario
from scenarios.placing import lay_out

NEAR = 0.02  # of the incoming speed: a player whose velocities are farther from every law follows none of them
SPEED, DT = 8.0, 1 / 256  # an eighth of a radius a step; far above any threshold
PAIRS, AT_ONCE = "pair after pair", "all contacts at once"


@dataclass(frozen=True, eq=False)
class Touching:
    """A scene at e = 1 in which disk 0 hits disks that touch each other.

    Attributes:
        asks: what happens, in a sentence.
        position: (n, 2) in radii; disk 0 comes in along x at speed 1.
        laws: name -> velocities (n, 2) in units of the incoming speed; several where the order is free.
        source: of the laws.
    """

    asks: str
    position: Array
    laws: dict[str, list[Array]]
    source: str


@dataclass(frozen=True)
class LawOf:
    """What a player did: the law it is nearest to, "none" if that is farther than `NEAR`, and how far it is."""

    name: str
    player: str
    law: str
    off: float
    velocity: tuple[tuple[float, float], ...]
    status: str = "ok"

    @staticmethod
    def from_record(record: dict[str, Any]) -> LawOf:
        """From a line of the journal."""
        velocity = tuple((float(x), float(y)) for x, y in record["velocity"])
        return LawOf(record["name"], record["player"], record["law"], float(record["off"]), velocity, record["status"])


BREAK = np.array([[-1 / 8, -sqrt(3) / 8], [3 / 4, sqrt(3) / 4], [3 / 8, -sqrt(3) / 8]])
MIRRORED = BREAK[[0, 2, 1]] * [1, -1]
TOUCHING = {
    "touching_row": Touching(
        "A disk hits a row of two that touch.",
        np.array([[-2.0, 0], [0, 0], [2, 0]]),
        {
            PAIRS: [np.array([[0.0, 0], [0, 0], [1, 0]])],
            AT_ONCE: [np.array([[-1 / 3, 0], [2 / 3, 0], [2 / 3, 0]])],
        },
        "equal masses swap velocities pair by pair; or e = 1 is asked of every contact in one solve",
    ),
    "touching_break": Touching(
        "A disk hits two that touch, in their middle.",
        np.array([[-sqrt(3), 0], [0, 1], [0, -1]]),
        {
            PAIRS: [BREAK, MIRRORED],
            AT_ONCE: [np.array([[-1 / 5, 0], [3 / 5, sqrt(3) / 5], [3 / 5, -sqrt(3) / 5]])],
        },
        "the two limits of small gaps; or e = 1 is asked of every contact in one solve",
    ),
}


def scene_of(one: Touching) -> Scenario:
    """Disk 0 flies in and is there in the middle of its fourth step."""
    position = one.position * RADIUS
    position[0, 0] -= SPEED * DT * (LEAD + 0.5)
    n = len(position)
    scene = lay_out(
        position=position, velocity=[[SPEED, 0], *np.zeros((n - 1, 2))], radius=np.full(n, RADIUS), mass=np.ones(n),
        restitution=1.0,
    )  # fmt: skip
    steps = LEAD + 1 + AFTER
    return Scenario("touching", one.asks, one.source, scene, steps * DT, DT, (1,))


def law_of(name: str, player: str) -> LawOf:
    """Play a scene, and compare with every law."""
    one = TOUCHING[name]
    run = play_as(player, scene_of(one))
    if run.status != "ok" or run.trajectory is None:
        return LawOf(name, player, f"refused: {run.reason}" if run.status == "unsupported" else run.status, np.nan, ())
    velocity = run.trajectory.velocity[-1] / SPEED
    off = {law: min(float(np.abs(velocity - v).max()) for v in answers) for law, answers in one.laws.items()}
    nearest = min(off, key=lambda law: off[law])
    law = nearest if off[nearest] <= NEAR else "none"
    return LawOf(name, player, law, off[nearest], tuple((float(x), float(y)) for x, y in velocity))
