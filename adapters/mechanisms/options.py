"""What an engine costs with one option changed against its matched profile: a row an option, or a
sweep of one parameter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from types import FunctionType, SimpleNamespace
from typing import Any

from adapters.engine import Engine
from adapters.engines import ENGINES, changed


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


def _always_listing() -> Engine:
    from adapters.reference import Reference

    return Reference(listing())


@cache
def listing() -> Any:
    """The reference's solver with a neighbour list for the fewest disks, too: the same source."""
    from numba import njit

    from reference_impl import neighbours

    advance = FunctionType(neighbours.advance.py_func.__code__, vars(neighbours) | {"WORTH": 0})
    return SimpleNamespace(__name__="neighbours", advance=njit(error_model="numpy")(advance))


OPTIONS: tuple[Option, ...] = tuple(
    option
    for name, row in ENGINES.items()
    for option in (
        *(
            Option(name, change, partial(changed, name, **settings))
            for change, settings in row.options.items()
        ),
        *(
            [Option(name, "broad phase, always", _always_listing)]
            if name == "reference:exercise"
            else []
        ),
    )
)
"""What an engine cannot be changed in is not here: pymunk has no CCD and always starts warm, Box2D
3.1 hides its warm start, and no outside engine lets its broad phase be switched off."""


@dataclass(frozen=True)
class Sweep:
    """A parameter of an engine over its values: what time can be spent on instead of smaller steps.

    Attributes:
        engine: the row of `ENGINES` whose parameter is swept, `engine:profile`.
        what: the parameter, in a word.
        parameter: the name of that number among those of the engine's `make`.
        values: from cheap to expensive.
    """

    engine: str
    what: str
    parameter: str
    values: tuple[int, ...]

    @property
    def name(self) -> str:
        """The engine and a profile that says what is swept, as `reports.page.style` knows it."""
        return f"{self.engine}+{self.what}"

    def at(self, value: int) -> Callable[[], Engine]:
        """How to make the engine with this value."""
        return partial(changed, self.engine, **{self.parameter: value})


SWEEPS: tuple[Sweep, ...] = tuple(
    Sweep(name, row.work.what, row.work.setting, row.work.values)
    for name, row in ENGINES.items()
    if row.work is not None and name.endswith(":matched")
)
