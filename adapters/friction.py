"""The refusal of all engines that do not model friction."""

from __future__ import annotations

from adapters.engine import Unsupported
from scenarios.model import Scene

REFUSAL = "does not model friction"


class Frictionless(Unsupported):
    """The engine does not model friction, and need not."""


def must_be_frictionless(scene: Scene, who: str) -> None:
    """Raise `Frictionless` for a scene with friction, which the engine `who` does not model."""
    if scene.friction:
        raise Frictionless(f"{who} {REFUSAL}, the scene has {scene.friction:g}")
