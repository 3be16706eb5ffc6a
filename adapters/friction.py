"""The one refusal of all engines that know no friction."""

from __future__ import annotations

from adapters.engine import Unsupported
from scenarios.model import Scene

REFUSAL = "does not model friction"


class Frictionless(Unsupported):
    """The engine knows no friction, which no engine need know."""


def must_be_frictionless(scene: Scene, who: str) -> None:
    """Raise `Frictionless` for a scene with friction, which the engine `who` does not model."""
    if scene.friction:
        raise Frictionless(f"{who} {REFUSAL}, the scene has {scene.friction:g}")
