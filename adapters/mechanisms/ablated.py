"""The ablated reference as an engine: the exercise's solver with the mechanisms of other engines
enabled or disabled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt
from typing import Any

import numpy as np

from crosscheck2d.adapters.mechanisms import ablated_reference
from crosscheck2d.adapters.mechanisms.ablated_reference import STAGES, Parameters
from crosscheck2d.adapters.mechanisms.contacts import no_contacts
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.scenarios.model import Array, Scene

EXERCISE = ("accelerate", "move", "pairs", "walls")
POSITION_FIRST = ("move", "pairs", "walls", "accelerate")
# Detect at the old positions, set target velocities after gravity, then move (Box2D 2.3,
# b2Island::Solve).
BOX2D = (
    *("detect", "by_island", "accelerate", "aim", "warm_start", "bounce", "cap", "move"),
    "position_correction",
)
# Move, detect there, set target velocities before gravity; position correction moves in the next
# step (Munk2D, cpSpaceStep).
PYMUNK = ("move", "detect", "aim", "accelerate", "warm_start", "bounce", "nudge")
# Detect and set targets once, then soft substeps, then one sweep for restitution (Box2D 3.1,
# b2SolverStage).
SUBSTEP = ("accelerate", "warm_start", "soften", "move", "relax")
BOX2D_V3 = ("detect", "by_colour", "aim", *SUBSTEP * 4, "restitute")

MIXING: dict[str, Callable[[float, float], float]] = {
    "as stated": lambda a, _: a,
    "the larger": max,
    "the smaller": min,
    "the mean": lambda a, b: (a + b) / 2,
    "the root of the product": lambda a, b: sqrt(a * b),
    "the product": lambda a, b: a * b,
}


class AblatedReference(Reference):
    """`ablated_reference` with these parameters; without any the exercise's solver, to the bit.

    order: the stages of a step; substeps: how often the order is repeated in a dt, each with its
        fraction of dt.
    alpha: free flight advances by v dt + alpha a dt2 a step, whatever the order; None: as the order
        has it.
    mixing: how the restitutions of two disks are combined, a key of `MIXING`.
    friction: of a pair; None: the scene's.
    `parameters`: fields of `ablated_reference.Parameters`.
    """

    def __init__(
        self,
        order: Sequence[str] = EXERCISE,
        *,
        substeps: int = 1,
        alpha: float | None = None,
        mixing: str = "as stated",
        friction: float | None = None,
        precision: type = np.float64,
        **parameters: Any,
    ) -> None:
        super().__init__(ablated_reference, precision=precision)
        self.order, self.substeps, self.alpha, self.mixing = tuple(order), substeps, alpha, mixing
        self.friction = friction
        self.moves = substeps * self.order.count("move")
        # of a move in units of a h2, beside v h, so that the whole step has alpha
        drift = 0.0
        if alpha is not None:
            after = self.order.index("accelerate") < self.order.index("move")
            drift = self.moves * alpha - (self.moves - 1) / 2 - after
        # an int instead of a float would compile the solver again
        kinds = Parameters._field_defaults
        numbers = {name: type(kinds[name])(value) for name, value in parameters.items()}
        self.on = Parameters(
            np.array([STAGES.index(stage) for stage in self.order]), drift, **numbers
        )

    def load(self, scene: Scene, dt: float) -> None:
        self.kept = no_contacts(scene.n, len(scene.walls), self.precision)
        self.kept.facing[:] = np.stack([np.cos(scene.angle), np.sin(scene.angle)], axis=1)
        super().load(scene, dt)
        self.world = self.world._replace(
            restitution=float(MIXING[self.mixing](scene.restitution, scene.restitution)),
            friction=float(scene.friction if self.friction is None else self.friction),
        )

    def _entered(self, *_: Array) -> Callable[[int], list[Any]]:
        h = self.precision(self.dt / self.moves)

        def advance(count: int) -> list[Any]:
            collisions = ablated_reference.advance(
                self.disks, self.world, self.on, self.kept, h, count * self.substeps
            )
            return [(k // self.substeps, i, j, impulse) for k, i, j, impulse in collisions]

        return advance

    def settings(self) -> dict[str, tuple[Any, Any]]:
        reported = {
            "mixing": self.mixing,
            "substeps": self.substeps,
            "alpha": self.alpha,
            "friction": self.friction,
            **self.on._asdict(),
            "order": ", ".join(self.order),
        }
        return {name: (value, value) for name, value in reported.items()}
