"""The row of an engine: how to make it, and everything else that the program needs to know about
it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.matched import Searched

FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53  # the relative rounding of a number


class Mark(NamedTuple):
    """How an engine is drawn: hex colour on a light and on a dark page, and a shape of `PATHS` of
    reports/page/style.py that neither another row nor `PALETTE` there has.

    Each colour has a contrast above 3 : 1 to the page, as WCAG 2 requires for graphics. Any two
    colours differ by at least 0.06 in OKLab, also with protan-, deuteran- and tritanopia (matrices
    of Machado et al., IEEE TVCG 15, 1291, 2009). Without colour the shape distinguishes the
    engines. Where a colour or shape is taken, tests/reports/page/test_colours.py names free ones.
    """

    light: str
    dark: str
    shape: str


class AccuracyParameter(NamedTuple):
    """A parameter with which an engine spends time on accuracy instead of smaller steps."""

    what: str  # iterations or substeps
    setting: str  # the parameter of `EngineRow.make` with their number
    values: tuple[int, ...]  # the measured ones, from cheap to expensive


class Variant(NamedTuple):
    """A changed engine, with which a cause is tested."""

    settings: Mapping[str, Any]  # parameters of `EngineRow.make`
    what: str  # the change in a few words
    loaded: Callable[[Any], None] | None = None  # changes the engine after `load`


@dataclass(frozen=True)
class EngineRow:
    """How to make an engine, and everything else that the program needs to know about it."""

    # makes a new engine; imports its library when called; takes the parameters that `options`,
    # `work` and `variants` name
    make: Callable[..., Engine]
    summary: str  # one line for `crosscheck list`
    # Free flight advances by v dt + alpha a dt2 a step: 1/2 is exact, the offset after t is
    # (alpha - 1/2) a dt t. This follows from the order of updates; it is not an error of the
    # adapter. NaN for a user's engine file, in which any order is right.
    alpha: float
    rounding: float  # the relative rounding of the engine's numbers
    # whether an earlier scene changes the next results, so that each cell needs a new process;
    # False for all of `ENGINES` (a test plays each after others, bit for bit)
    leaves_state: bool = False
    outside: bool = False  # it is a library; else it is listed among the solvers of this project
    # the installed packages, by their names in pip, whose versions affect its numbers; numba, numpy
    # and mini-racer affect those of all engines and need no mention
    distributions: tuple[str, ...] = ()
    # how it is drawn, the same for all profiles of an engine; None: a colour and a shape are chosen
    # that no other engine has
    mark: Mark | None = None
    # what tells its lines from those of the engine's other profiles: lengths of stroke and gap in
    # px. With a dash its mark is open; () is a solid line and a filled mark.
    dash: tuple[int, ...] = ()
    # in place of that of `mark`, where an open and a filled one do not tell all profiles of the
    # engine apart; "": that of `mark`
    shape: str = ""
    work: AccuracyParameter | None = None
    # a change of one setting, in a few words -> parameters of `make`; `crosscheck speed` measures
    # what it costs and breaks
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, hash=False)
    # name, used after a "+" -> a changed engine with which `crosscheck stability` tests a cause
    variants: Mapping[str, Variant] = field(default_factory=dict, hash=False)
    # returns the settings that `crosscheck tune` searches; None: there are none
    searched: Callable[[], Searched] | None = None
    # another engine whose numbers it reproduces to the last bit, at another cost, in every scene
    # without friction (`coulomb`: and without a torus); if only the numbers count, it plays beside
    # that engine only on request; "": there is none
    bits_of: str = ""
    # it plays scenes with friction, which that engine refuses; without friction it never plays
    # beside it
    adds_friction: bool = False
    # it uses time-of-impact ordering instead of end-of-step detection; it is ranked separately
    orders_collisions: bool = False
    # a probe of the protocol that it fails because of its physics, not its adapter -> the cause
    departs: Mapping[str, str] = field(default_factory=dict, hash=False)
    # the npm package, pinned in adapters/host/package.json, that is fetched once; "": it needs none
    package: str = ""
    # the distribution of which another version is fetched as a wheel, NAME@VERSION; "": none
    wheel: str = ""
    # a hash of a solver's file, which changes when the file is saved with another text, or of a
    # fetched version; "" for any other engine
    source: str = ""
    # it is a solver's file with the functions of the exercise, which `crosscheck check` judges
    exercise: bool = False
