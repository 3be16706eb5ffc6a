"""The one refusal of all engines that know no friction."""

from __future__ import annotations

from adapters.engine import Unsupported
from scenarios.model import Scene


def must_be_frictionless(scene: Scene, who: str) -> None:
    """Raise `Unsupported` for a scene with friction, which the engine `who` does not model."""
    if scene.friction:
        raise Unsupported(f"{who} does not model friction, the scene has {scene.friction:g}")
