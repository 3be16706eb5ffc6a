"""Friction: the refusal of all engines that do not model it, and what both Box2Ds are told."""

from __future__ import annotations

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.scenarios.model import Scene


class Frictionless(Unsupported):
    """The engine does not model friction, and need not."""


def must_be_frictionless(scene: Scene, who: str) -> None:
    if scene.friction:
        raise Frictionless(f"{who} does not model friction, the scene has {scene.friction:g}")


def of_shapes(scene: Scene, matched: bool, asked: float | None) -> float | None:
    """For both Box2Ds, the friction of every shape (that of a pair is the root of the product);
    None: the engine's default, as a user without friction in mind leaves it."""
    if asked is not None:
        return asked
    return float(scene.friction) if matched or scene.friction > 0 else None
