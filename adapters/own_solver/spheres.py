"""The sphere that a solver in Python is given: the fields of the exercise, by attribute or by
item."""

from __future__ import annotations

from typing import Any


class Fields:
    """Named numbers that can be reached as attributes or as items: `sphere.position.x`,
    `sphere["position"]["x"]`."""

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:  # only for a name that is not there
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


NAMES = frozenset(vars(sphere_of([0.0] * 12)))
