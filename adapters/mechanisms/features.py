"""What an engine costs with one thing more, or one less, than its matched profile: a row a feature, or a dial."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from types import FunctionType, SimpleNamespace
from typing import Any

from adapters.engine import Engine
from adapters.engines import ENGINES, changed


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


def _always_listing() -> Engine:
    from adapters.reference import Reference

    return Reference(listing())


@cache
def listing() -> Any:
    """The reference's solver for crowds with a list of neighbours for the fewest disks, too: the same source."""
    from numba import njit

    from reference_impl import crowd

    advance = FunctionType(crowd.advance.py_func.__code__, vars(crowd) | {"CROWD": 0})
    return SimpleNamespace(__name__="crowd", advance=njit(error_model="numpy")(advance))


FEATURES: tuple[Feature, ...] = tuple(
    feature
    for name, row in ENGINES.items()
    for feature in (
        *(Feature(name, change, partial(changed, name, **settings)) for change, settings in row.features.items()),
        *([Feature(name, "broad phase, always", _always_listing)] if name == "reference:exercise" else []),
    )
)
"""What an engine cannot be changed in is not here: pymunk has no CCD and always starts warm, Box2D 3.1 hides its
warm start, and no outside engine lets its broad phase be switched off."""


@dataclass(frozen=True)
class Dial:
    """What an engine lets one spend time on instead of smaller steps.

    Attributes:
        engine: the row of `ENGINES` it is turned in, `engine:profile`.
        what: the number that is turned.
        parameter: the name of that number among those of the engine's `make`.
        values: from cheap to dear.
    """

    engine: str
    what: str
    parameter: str
    values: tuple[int, ...]

    @property
    def name(self) -> str:
        """The engine and a profile that says what is turned, as `reports.page.style` knows it."""
        return f"{self.engine}+{self.what}"

    def at(self, value: int) -> Callable[[], Engine]:
        """How to make the engine with this value."""
        return partial(changed, self.engine, **{self.parameter: value})


DIALS: tuple[Dial, ...] = tuple(
    Dial(name, row.work.what, row.work.setting, row.work.values)
    for name, row in ENGINES.items()
    if row.work is not None and name.endswith(":matched")
)
