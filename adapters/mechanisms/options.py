"""Engines with one option changed from the matched profile, whose cost is measured: a row for each
option, or a sweep of one parameter."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engine_row import AccuracyParameter
from crosscheck2d.adapters.engines import ENGINES, changed


class Option(NamedTuple):
    """One change to one engine."""

    engine: str  # the row of `ENGINES` to compare with, `engine:profile`
    change: str  # the difference, in a few words
    make: Callable[[], Engine]  # makes the changed engine; imports its library when called

    @property
    def plain(self) -> Callable[[], Engine]:
        return ENGINES[self.engine].make


OPTIONS = tuple(
    option
    for name, row in ENGINES.items()
    for option in (
        *(Option(name, what, partial(row.make, **it)) for what, it in row.options.items()),
        *(
            Option(name, f"as {same}", it.make)
            for same, it in ENGINES.items()
            if it.bits_of == name
        ),
    )
)
"""What cannot be changed is not here: Munk2D has no CCD and always starts warm; Box2D 3.1 has
b2World_EnableWarmStarting, which pyb2d3 does not hand on; no library can disable its broad phase.
"""


class Sweep(NamedTuple):
    """A parameter of an engine over its values: a way to spend time other than smaller steps."""

    engine: str  # the row of `ENGINES` whose parameter is swept, `engine:profile`
    parameter: AccuracyParameter

    @property
    def name(self) -> str:
        return f"{self.engine}+{self.parameter.what}"

    def at(self, value: int) -> Callable[[], Engine]:
        return partial(changed, self.engine, **{self.parameter.setting: value})


SWEEPS = tuple(
    Sweep(name, row.work)
    for name, row in ENGINES.items()
    if row.work is not None and name.endswith(":matched")
)
