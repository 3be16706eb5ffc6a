"""What an engine must be able to do to take part: a few verbs, and no base class."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from scenarios.model import Array, Scene, State

# What stands in place of the value that an engine resolved a setting to:
NOT_READABLE = "not readable"  # its binding does not report it
PASSED = "passed with every step"  # it keeps no such setting
KEPT = "kept by the adapter"  # it knows no such setting
NOT_REPORTED = (NOT_READABLE, PASSED, KEPT)


class Unsupported(Exception):
    """An engine cannot model this scene, and says why rather than approximate it."""


class NotStarted(Exception):
    """What an engine runs in cannot be had, as where memory is short: no fault of the engine's, and
    no result."""

    outside = True


class ContactImpulse(NamedTuple):
    """A contact with an impulse during one step; one that lasts gives another in every step."""

    step: int  # from 0
    i: int  # a disk
    j: int  # the other disk, in either order; or -1 - w for wall w
    impulse: float  # N s; NaN where the engine does not report it


class Engine(Protocol):
    """The protocol: `load`, then `step` and `read` as often as is wanted, and `close`."""

    # Whether collisions are logged; set before `load`. Off where speed is measured: to log every
    # collision in Python costs more than some engines' whole step.
    listening: bool = True
    # s spent in Python on setting disks onto the opposite edge, by an engine that knows no such
    # edge; part of what `step` takes. Whoever measures sets it to 0.
    wrapping: float = 0.0

    def load(self, scene: Scene, dt: float) -> None:
        """Forget everything and build the scene for steps of `dt` s; raise `Unsupported` rather
        than approximate."""

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Act on one disk during the next step only; N (world frame), N m; forces add up."""

    def step(self, count: int = 1) -> None:
        """Advance `count` steps; the only call that is timed."""

    def read(self) -> State:
        """Float64 copies, all of the same instant, in the scene's order, static disks included."""

    def collisions(self) -> list[ContactImpulse]:
        """Every impulse of a contact since `load`, in order of steps."""

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """Setting -> (asked for, resolved by the engine), after `load`; asked None: the engine's
        own default."""

    def versions(self) -> dict[str, str]:
        """Library -> version, of all that decides the numbers."""

    def close(self) -> None:
        """Give everything back."""
