"""The sphere passed to a solver in Python: the fields of the exercise, by attribute or by item."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Fields:
    """Named numbers that can be reached as attributes or as items: `sphere.position.x`,
    `sphere["position"]["x"]`."""

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:  # only called for a missing name
        raise AttributeError(f"a sphere has no field {name!r}", name=name, obj=self)

    def __getitem__(self, name: str) -> Any:
        return self.__dict__[name]

    def __setitem__(self, name: str, value: Any) -> None:
        self.__dict__[name] = value


def sphere_of(r: list[float]) -> Fields:
    """A sphere with the exercise's fields from its 12 numbers."""
    return Fields(
        position=Fields(x=r[0], y=r[1]),
        velocity=Fields(x=r[2], y=r[3]),
        force=Fields(x=r[4], y=r[5]),
        alpha=r[6],
        angularVelocity=r[7],
        torque=r[8],
        mass=r[9],
        MoI=r[10],
        size=r[11],
    )


class Traced(Fields):
    """The same, reporting every access to a number as ("r" or "w", the sphere's field)."""

    def __init__(
        self, access: Callable[[str, str], None], values: dict[str, Any], within: str = ""
    ) -> None:
        self.__dict__.update(_access=access, _values=dict(values), _within=within)

    def __getattr__(self, name: str) -> Any:
        if name not in self._values:
            return super().__getattr__(name)
        value = self._values[name]
        if not isinstance(value, Fields):
            self._access("r", self._within or name)
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        self._access("w", self._within or name)
        self._values[name] = value

    __getitem__ = __getattr__
    __setitem__ = __setattr__


NAMES = frozenset(vars(sphere_of([0.0] * 12)))
