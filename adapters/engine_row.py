"""What an engine's row says of it: how to make it, and all that the rest of the program needs to
know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from adapters.engine import Engine
from adapters.matched import Searched

FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53  # the relative rounding of a number


class Mark(NamedTuple):
    """How an engine is drawn: hex colour on a light and on a dark page, a shape of `PATHS` of
    reports/page/style.py.

    Against the page each colour has more than 3 : 1, which WCAG 2 asks of graphics, and any two
    engines' colours are 0.06 or more apart in OKLab, also as seen with protan-, deuteran- and
    tritanopia (matrices of Machado et al., IEEE TVCG 15, 1291, 2009). Where colour is not seen at
    all, the shape tells them apart.
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
            adapter. NaN: of an engine's own file, in which any order of updates is right.
        rounding: the relative rounding of the numbers the engine keeps.
        leaves_state: what it played before changes what it plays next, so that each cell needs a
            process of its own; true of none in `ENGINES` (a test plays each after others, bit for
            bit).
        distributions: the installed packages, as pip names them, whose versions decide its numbers.
        mark: how it is drawn; None: a colour and a shape that no other engine has.
        work: what it lets one spend time on; None: nothing.
        options: one thing more or less than the engine has, in a few words -> parameters of `make`;
            what each costs and breaks is measured by `crosscheck speed`.
        variants: name, which goes behind a "+" -> what `crosscheck stability` plays besides to test
            a reason.
        searched: reads what `crosscheck tune` searches; None: nothing.
        bits_of: the engine whose numbers it gives to the last bit, at another cost, in every scene
            without friction; where only the numbers count, it does not play beside that one unless
            asked for. "": of none.
        adds_friction: it plays scenes with friction, which that engine refuses; without friction it
            is never played beside that one.
        orders_collisions: it takes each collision at its own time, not at the end of a step; it is
            ranked apart from the engines.
        departs: a probe of the protocol that it misses by its own physics, not by its adapter ->
            the cause.
        package: the npm package, pinned in adapters/javascript/package.json, that it plays by and
            that is fetched once; "": it needs none.
        source: what distinguishes a solver's file that was saved from its earlier text; "" for an
            engine of this program.
        exercise: it is a solver's file with the functions of the exercise, which `crosscheck check`
            judges.
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
    bits_of: str = ""
    adds_friction: bool = False
    orders_collisions: bool = False
    departs: Mapping[str, str] = field(default_factory=dict, hash=False)
    package: str = ""
    source: str = ""
    exercise: bool = False
