"""What an engine costs with one thing more, or one less, than its matched profile: a row a feature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from adapters.engine import Engine
from adapters.engines import ENGINES


@dataclass(frozen=True)
class Feature:
    """One change to one engine.

    Attributes:
        engine: the row of `ENGINES` it is set against, `engine:profile`.
        change: what is different, in a few words.
        make: the changed engine; imports its library only now.
    """

    engine: str
    change: str
    make: Callable[[], Engine]

    @property
    def plain(self) -> Callable[[], Engine]:
        """The engine without the change."""
        return ENGINES[self.engine].make


def changed_pymunk(**changed: Any) -> Engine:
    """pymunk, matched, with these parameters of its adapter."""
    from adapters.pymunk import Pymunk

    return Pymunk("matched", **changed)


def changed_box2d(**changed: Any) -> Engine:
    """Box2D 2.3, matched, with these parameters of its adapter."""
    from adapters.box2d import Box2DEngine

    return Box2DEngine("matched", **changed)


def changed_box2d_v3(**changed: Any) -> Engine:
    """Box2D 3.1, matched, with these parameters of its adapter."""
    from adapters.box2d_v3 import Box2DV3

    return Box2DV3("matched", **changed)


def _float32() -> Engine:
    import numpy as np

    from adapters.reference import Reference
    from reference_impl import crowd

    return Reference(crowd, precision=np.float32)


def _all_pairs() -> Engine:
    from adapters.reference import Reference
    from reference_impl import exercise

    return Reference(exercise)


def _rows(engine: str, make: Callable[..., Engine], changes: dict[str, dict[str, Any]]) -> list[Feature]:
    return [Feature(engine, change, partial(make, **settings)) for change, settings in changes.items()]


FEATURES: tuple[Feature, ...] = (
    Feature("reference:exercise", "kept in float32", _float32),
    Feature("reference:exercise", "all pairs, never a list", _all_pairs),
    *_rows("pymunk:matched", changed_pymunk, {
        "10 iterations, not 50": {"iterations": 10},
        "200 iterations, not 50": {"iterations": 200},
        "sleeping": {"sleep_time_threshold": 0.5},
        "no rotation": {"turning": False},
        "hash, not tree": {"spatial_hash": (0.6, 1000)},
    }),
    *_rows("box2d:matched", changed_box2d, {
        "1 iteration, not 8": {"velocity_iterations": 1},
        "30 iterations, not 8": {"velocity_iterations": 30},
        "push-out, 3 iterations": {"position_iterations": 3},
        "CCD": {"continuous": True},
        "CCD, all bullets": {"continuous": True, "bullet": True},
        "sleeping": {"sleeping": True},
        "no warm start": {"warm_starting": False},
        "no rotation": {"turning": False},
    }),
    *_rows("box2d_v3:matched", changed_box2d_v3, {
        "1 substep, not 4": {"substeps": 1},
        "16 substeps, not 4": {"substeps": 16},
        "CCD": {"continuous": True},
        "CCD, all bullets": {"continuous": True, "bullet": True},
        "sleeping": {"sleeping": True},
        "no rotation": {"turning": False},
    }),
)  # fmt: skip
"""What an engine cannot be changed in is not here: pymunk has no CCD and always starts warm, Box2D 3.1 hides its
warm start, and no outside engine lets its broad phase be switched off."""
