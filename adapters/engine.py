"""The protocol of an engine: the methods that an adapter must have. There is no base class."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:  # importing numpy takes 0.2 s, and the process of an Exercise.js does not need it
    from crosscheck2d.scenarios.model import Array, Scene, State

# In `settings`, in place of the resolved value, where the engine does not report it:
NOT_READABLE = "not readable"  # the binding has no getter
PASSED = "passed with every step"  # an argument of the step, which the engine does not store
KEPT = "kept by the adapter"  # the adapter does it, the engine has no such setting
NO_SUCH = "no such setting"  # another version of the library has it, not this one: it is left out
NOT_REPORTED = (NOT_READABLE, PASSED, KEPT)
SILENT = "not reported"  # the setting "collisions" of an engine that reports none


class Unsupported(Exception):
    """An engine cannot model this scene and must not approximate it; str() is the reason."""


class NotLoaded(Unsupported):
    """The file of an engine cannot be loaded, so it can play no scene at all."""


class NotStarted(Exception):
    """The process of an engine could not be started; this is not a result of the engine."""

    outside = True


class ContactImpulse(NamedTuple):
    """The impulse of a contact in one step; a lasting contact has one in every step."""

    step: int  # from 0
    i: int  # a disk
    j: int  # the other disk, in either order; or -1 - w for wall w
    impulse: float  # N s; NaN where the engine does not report it


class Engine(Protocol):
    """The protocol: `load` once, then `step` and `read` any number of times, then `close`."""

    # Whether collisions are recorded; set before `load`. Off for timings: it may outlast a step.
    listening: bool = True
    # s of `step` that the adapter spent on `Scene.wrap`, because the engine itself has no such
    # edges. Measurements set it to 0 first.
    wrapping: float = 0.0

    def load(self, scene: Scene, dt: float) -> None:
        """Forget everything and build the scene for steps of `dt` s; raise `Unsupported` rather
        than approximate."""

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Act on one disk during the next step only; N (world frame), N m; forces add up."""

    def step(self, count: int = 1) -> None:
        """Advance `count` steps; the only call that is timed."""

    def read(self) -> State:
        """Float64 copies, all at the same instant, in the scene's order, including static disks."""

    def collisions(self) -> list[ContactImpulse]:
        """Every impulse of a contact since `load`, in order of steps. An engine that reports none
        returns [] and has `"collisions": (None, SILENT)` in its settings: they are not judged."""

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """After `load`: setting -> (asked for, resolved); asked None: the engine's own default."""

    def versions(self) -> dict[str, str]:
        """Library -> version, of every library that affects the numbers."""

    def close(self) -> None:
        """Release all memory and processes."""
