"""What an engine costs with one option changed against its matched profile: a row an option, or a sweep of one
parameter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from types import FunctionType, SimpleNamespace
from typing import Any

from adapters.engine import Engine
from adapters.engines import ENGINES


@dataclass(frozen=True)
class Option:
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
    from reference_impl import verlet_list

    return Reference(verlet_list, precision=np.float32)


def _always_listing() -> Engine:
    from adapters.reference import Reference

    return Reference(listing())


@cache
def listing() -> Any:
    """The reference's solver with a neighbour list for the fewest disks, too: the same source."""
    from numba import njit

    from reference_impl import verlet_list

    advance = FunctionType(verlet_list.advance.py_func.__code__, vars(verlet_list) | {"LISTED_FROM": 0})
    return SimpleNamespace(__name__="verlet_list", advance=njit(error_model="numpy")(advance))


def _rows(engine: str, make: Callable[..., Engine], changes: dict[str, dict[str, Any]]) -> list[Option]:
    return [Option(engine, change, partial(make, **settings)) for change, settings in changes.items()]


OPTIONS: tuple[Option, ...] = (
    Option("reference:exercise", "kept in float32", _float32),
    Option("reference:exercise", "broad phase, always", _always_listing),
    *_rows("pymunk:matched", changed_pymunk, {
        "50 iterations, not 10": {"iterations": 50},
        "200 iterations, not 10": {"iterations": 200},
        "sleeping": {"sleep_time_threshold": 0.5},
        "no rotation": {"turning": False},
        "hash, not tree": {"spatial_hash": (0.6, 1000)},
    }),
    *_rows("box2d:matched", changed_box2d, {
        "1 iteration, not 8": {"velocity_iterations": 1},
        "30 iterations, not 8": {"velocity_iterations": 30},
        "no position correction": {"position_iterations": 0},
        "no CCD": {"continuous": False, "bullet": False},
        "CCD at e = 1, too": {"elastic_continuous": True, "elastic_bullet": True},
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


@dataclass(frozen=True)
class Sweep:
    """A parameter of an engine over its values: what time can be spent on instead of smaller steps.

    Attributes:
        engine: the row of `ENGINES` whose parameter is swept, `engine:profile`.
        what: the parameter, in a word.
        change: the engine by its parameters.
        parameter: the name of the swept one among them.
        values: from cheap to expensive.
    """

    engine: str
    what: str
    change: Callable[..., Engine]
    parameter: str
    values: tuple[int, ...]

    @property
    def name(self) -> str:
        """The engine and a profile that says what is swept, as `reports.page.style` knows it."""
        return f"{self.engine}+{self.what}"

    def at(self, value: int) -> Callable[[], Engine]:
        """How to make the engine with this value."""
        return partial(self.change, **{self.parameter: value})


SWEEPS: tuple[Sweep, ...] = (
    Sweep("pymunk:matched", "iterations", changed_pymunk, "iterations", (1, 2, 5, 10, 20, 50, 100, 200)),
    Sweep("box2d:matched", "iterations", changed_box2d, "velocity_iterations", (1, 2, 4, 8, 16, 32, 64)),
    Sweep("box2d_v3:matched", "substeps", changed_box2d_v3, "substeps", (1, 2, 4, 8, 16)),
)
