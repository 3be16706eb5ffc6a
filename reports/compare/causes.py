"""Why something fails, told in one place for the report, the limits, speed and the terminal: a
cause has a kind, and its sentence is made from that; nothing reads the sentence back."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from fnmatch import fnmatch
from typing import NamedTuple

from crosscheck2d.adapters.mechanisms.settings import Remedy
from crosscheck2d.adapters.mechanisms.table import (
    AIR,
    DIGITS,
    EDGES,
    FLIGHT,
    FRICTION,
    IMPULSE,
    POSITION_CORRECTION,
    RECYCLING,
    RESTITUTION,
    SIDES,
    SKIN,
    SWEPT,
)

LATE = "end-of-step detection"  # what is left of an engine without any of its mechanisms


class CauseKind(StrEnum):
    LAW = "law"  # a row of a table: a formula, a source
    SETTING = "setting"  # of the engine: with another value the failure goes
    MECHANISM = "mechanism"  # the reference with it alone has the failure
    INTERVENTION = "intervention"  # without it the failing run works
    REFUSAL = "refusal"  # the engine says so itself
    UNKNOWN = "unknown"


class Cause(NamedTuple):
    """Why something fails: in words, the source of these, and how the cause was shown, "" if it was
    not."""

    kind: CauseKind
    text: str
    source: str = ""
    shown: str = ""

    @property
    def sentence(self) -> str:
        """The cause; one that was not shown is called likely."""
        known = self.shown or self.kind is CauseKind.UNKNOWN
        return self.text if known else f"likely: {self.text}"

    @property
    def told(self) -> str:
        return f"{self.text}: {self.shown}" if self.shown else self.text


def unknown(shown: str = "", *tried: str) -> Cause:
    """No cause was found; what shows that, and what was tried, in words."""
    return Cause(CauseKind.UNKNOWN, "; ".join(["not known", *filter(None, tried)]), shown=shown)


def by_settings(remedy: Remedy, engine: str, shown: str) -> Cause:
    return Cause(CauseKind.SETTING, remedy.sentence(engine), shown=shown)


def by_mechanisms(names: Sequence[str], engine: str) -> Cause:
    """The mechanisms with which the reference fails as the engine does; `LATE`: with none."""
    rows = [mechanism_words(name, engine) for name in names]
    text, source = ("; ".join(dict.fromkeys(row[k] for row in rows)) for k in (2, 3))
    *most, last = names
    listed = f"{', '.join(most)} and {last}" if most else last
    more = "nothing else" if listed == LATE else f"the engine's {listed}"
    shown = f"the reference with end-of-step detection and {more} has this limit"
    return Cause(CauseKind.MECHANISM, text, source, shown)


B2_SETTINGS, B2_TYPES = "Box2D 2.3 Common/b2Settings.h: ", "Box2D 3.1 src/types.c: "
ACTS_AT_END = "a collision takes effect at the end of the step in which it is found"
THRESHOLD = "collisions that close at less than 1 m/s are played as inelastic"
THRESHOLDS = {
    "box2d": B2_SETTINGS + "b2_velocityThreshold",
    "box2d_v3": B2_TYPES + "restitutionThreshold",
    "planck": "planck Settings.velocityThreshold",
}
PRODUCT = "the elasticities of the two shapes are multiplied: e on every shape gives e²"
TOGETHER = "the contacts of a step are solved together, in the engine's own order of stages"
GRADUAL = "overlaps are corrected gradually, separately from the velocities"
AT_ONCE = "an overlap is corrected at once, which moves disks before they collide"
BORNE = "a contact that bore an impulse in the step before does not bounce unless e is 1"
NOT_STATED = "not every collision has the restitution that the scene states"
SLOWS = "friction reduces the speed along the contact"
OWN_ORDER = "adapters/mechanisms/ablated.py, from the engine's own step"
MECHANISM_WORDS = (
    (LATE, "*", ACTS_AT_END, "contacts are detected once per step"),
    (
        FLIGHT,
        "*",
        "under a force the displacement in a step is not v dt + a dt² / 2",
        "alpha of ENGINES",
    ),
    (RESTITUTION, "pymunk:*", PRODUCT, "Munk2D src/cpArbiter.c, cpArbiterUpdate"),
    *((RESTITUTION, f"{box}:*", THRESHOLD, source) for box, source in THRESHOLDS.items()),
    (RESTITUTION, "rapier2d:*", BORNE, OWN_ORDER),
    (RESTITUTION, "*", NOT_STATED, OWN_ORDER),
    (RECYCLING, "*", "a pair that has hardly moved is not looked at again", OWN_ORDER),
    (EDGES, "*", "a disk that leaves a torus is set onto its edge", "exercise 11, projectObjects"),
    (IMPULSE, "reference:*", "walls come first, then pairs", "reference_impl/lesson.py"),
    (IMPULSE, "*", TOGETHER, OWN_ORDER),
    (POSITION_CORRECTION, "reference:*", AT_ONCE, "exercise 11, task 2"),
    (POSITION_CORRECTION, "*", GRADUAL, OWN_ORDER),
    (FRICTION, "*", SLOWS, "the engine's default"),
    (SKIN, "*", "walls are thicker than the scene states", B2_SETTINGS + "b2_polygonRadius"),
    (DIGITS, "*", "numbers are float32", "IEEE 754"),
    (SWEPT, "*", "a fast disk is swept along its path, a slow one sleeps", OWN_ORDER),
    (AIR, "*", "friction of the air slows every disk", OWN_ORDER),
    (SIDES, "*", "disks are polygons, so that an impulse acts at a corner", OWN_ORDER),
)
"""Mechanism, engines, what it does, and the source; the last row of each mechanism is for "*"."""


def mechanism_words(mechanism: str, engine: str) -> tuple[str, str, str, str]:
    """The row of `MECHANISM_WORDS` for a mechanism of an engine; raises `KeyError` if none is."""
    for row in MECHANISM_WORDS:
        if row[0] == mechanism and fnmatch(engine, row[1]):
            return row
    raise KeyError(mechanism)
