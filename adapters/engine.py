"""What an engine must be able to do to take part, a few verbs and no base class, and what its row
says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from adapters.matched import Searched
from scenarios.model import Array, Scene, State

# What stands in place of what an engine resolved a setting to, where its binding does not report
# it.
NOT_READABLE = "not readable"
PASSED = "passed with every step"  # the engine keeps no such setting
KEPT = "kept by the adapter"  # the engine knows no such setting
NOT_REPORTED = (NOT_READABLE, PASSED, KEPT)


FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53  # the relative rounding of a number


class Unsupported(Exception):
    """An engine cannot model this scene, and says why rather than approximate it."""


class NotStarted(Exception):
    """What an engine runs in cannot be had, as where memory is short: no fault of the engine's, and
    no result."""

    outside = True


class ContactImpulse(NamedTuple):
    """One contact with an impulse during step `step` (from 0): i and j in either order, wall w as
    -1 - w; N s.

    A contact that lasts gives a collision in every step; `play` keeps where each one begins.
    """

    step: int
    i: int
    j: int
    impulse: float


class Engine(Protocol):
    """The protocol. `read` gives all four arrays at the same instant, in the scene's order, static
    disks included.

    Attributes:
        listening: whether collisions are logged; set before `load`. Off where speed is measured:
            hearing of every collision in Python costs more than some engines' whole step.
        wrapping: s spent since it was set to 0 on setting disks onto the opposite edge in Python,
            for an engine that knows no such edge; part of what `step` takes, and no fault of the
            engine's.
    """

    listening: bool = True
    wrapping: float = 0.0

    def load(self, scene: Scene, dt: float) -> None:
        """Forget everything and build the scene for steps of `dt` s; raise `Unsupported` rather
        than approximate."""

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Act on one disk during the next step only; N (world frame), N m; forces add up."""

    def step(self, count: int = 1) -> None:
        """Advance `count` steps; the only call that is timed."""

    def read(self) -> State:
        """The present state, as float64 copies."""

    def collisions(self) -> list[ContactImpulse]:
        """Every impulse of a contact since `load`, in order of steps."""

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """Setting -> (asked for, resolved by the engine), after `load`; asked None: the engine's
        own default."""

    def versions(self) -> dict[str, str]:
        """Library -> version, of all that decides the numbers."""

    def close(self) -> None:
        """Give everything back."""


class Mark(NamedTuple):
    """How an engine is drawn: hex colour on a light and on a dark page, a shape of `PATHS` of
    reports/page/style.py.

    Against the page each colour has more than 3 : 1, which WCAG 2 asks of graphics, and any two
    engines' colours are 0.06 or more apart in OKLab, also as seen with protan-, deuteran- and
    tritanopia (matrices of Machado et al., IEEE TVCG 15, 1291, 2009). Where colour is not seen at
    all, the shape reports them apart.
    """

    light: str
    dark: str
    shape: str


class Work(NamedTuple):
    """What an engine lets one spend time on instead of smaller steps.

    Attributes:
        what: iterations or substeps.
        setting: the parameter of `EngineRow.make` that holds their number.
        values: those that are measured, from cheap to dear.
    """

    what: str
    setting: str
    values: tuple[int, ...]


class Variant(NamedTuple):
    """An engine with something changed, to test a reason by: parameters of `EngineRow.make`, what
    that is, in a few words.

    loaded: changes the engine once a scene is in it.
    """

    settings: Mapping[str, Any]
    what: str
    loaded: Callable[[Any], None] | None = None


@dataclass(frozen=True)
class EngineRow:
    """How to make an engine and all that the rest of the program needs to know of it.

    Attributes:
        make: a new engine; imports its library only now. Takes the parameters that `options`,
            `work` and `variants` name.
        summary: one line for `crosscheck list`.
        alpha: free flight advances by v dt + alpha a dt2 a step: 1/2 is exact, the offset after t
            is (alpha - 1/2) a dt t. A property of the order of updates, not an error of the
            adapter.
        rounding: the relative rounding of the numbers the engine keeps.
        leaves_state: what it played before changes what it plays next, so that each cell needs a
            process of its own; true of none below (a test plays each after others, bit for bit).
        distributions: the installed packages, as pip names them, whose versions decide its numbers.
        mark: how it is drawn; None: a colour and a shape that no other engine has.
        work: what it lets one spend time on; None: nothing.
        options: one thing more or less than the engine has, in a few words -> parameters of `make`;
            what each costs and breaks is measured by `crosscheck speed`.
        variants: name, which goes behind a "+" -> what `crosscheck stability` plays besides to test
            a reason.
        searched: reads what `crosscheck tune` searches; None: nothing.
        source: what distinguishes a solver's file that was saved from its earlier text; "" for an
            engine of this program.
    """

    make: Callable[..., Engine]
    summary: str
    alpha: float
    rounding: float
    leaves_state: bool = False
    distributions: tuple[str, ...] = ()
    mark: Mark | None = None
    work: Work | None = None
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, hash=False)
    variants: Mapping[str, Variant] = field(default_factory=dict, hash=False)
    searched: Callable[[], Searched] | None = None
    source: str = ""
