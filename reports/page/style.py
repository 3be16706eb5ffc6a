"""How things look: a colour for each engine, a dash and fill for each profile, one format for
numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import PurePath
from typing import Any, NamedTuple
from zlib import crc32

from crosscheck2d.adapters.engine_row import Mark
from crosscheck2d.adapters.engines import ENGINES, FETCHED, OWN, known_row
from crosscheck2d.reports.compare.against import (
    TRUTH as TRUTH,  # its curve is drawn like that of an engine
)
from crosscheck2d.reports.terminal.foreign_text import encoded


class Look(NamedTuple):
    """How an engine and profile are drawn: hex colours on a light and on a dark page, lengths of
    stroke and gap in px (() for a solid line), a key of `PATHS`, and whether that shape is filled.

    Without colour the mark (shape, filled or not) distinguishes all of `ENGINES`, and the dash
    distinguishes the profiles of an engine.
    """

    light: str
    dark: str
    dash: tuple[int, ...]
    shape: str
    filled: bool

    @property
    def path(self) -> str:
        return PATHS[self.shape]


OF_TRUTH = Mark("#16191d", "#f4f4f2", "circle")
# The shapes as SVG paths about the origin, 8 px large.
# Those of `PALETTE`, such as the cross, are for rows without a mark and for files, not for a row to
# choose.
PATHS = {
    "circle": "M4,0A4,4 0 1 1 -4,0A4,4 0 1 1 4,0Z",
    "triangle-up": "M0,-4.6L4.3,3H-4.3Z",
    "square": "M-3.7,-3.7H3.7V3.7H-3.7Z",
    "diamond": "M0,-5L5,0L0,5L-5,0Z",
    "cross": "M-1.5,-4.4H1.5V-1.5H4.4V1.5H1.5V4.4H-1.5V1.5H-4.4V-1.5H-1.5Z",
    "triangle-down": "M0,4.6L4.3,-3H-4.3Z",
    "triangle-left": "M-4.6,0L3,4.3V-4.3Z",
    "triangle-right": "M4.6,0L-3,4.3V-4.3Z",
    "star-diamond": "M0,-5.4L1.6,-1.6L5.4,0L1.6,1.6L0,5.4L-1.6,1.6L-5.4,0L-1.6,-1.6Z",
    "diamond-wide": "M0,-3.2L5.6,0L0,3.2L-5.6,0Z",
    "hexagon": "M-2.3,-4H2.3L4.6,0L2.3,4H-2.3L-4.6,0Z",
    "pentagon": "M0,-4.6L4.4,-1.4L2.7,3.7H-2.7L-4.4,-1.4Z",
    "bowtie": "M-4.2,-3.2V3.2L0,0L4.2,3.2V-3.2L0,0Z",
    "hourglass": "M-3.4,-4.2H3.4L-3.4,4.2H3.4Z",
    "x": "M-4.2,-2.1L-2.1,-4.2L0,-2.1L2.1,-4.2L4.2,-2.1L2.1,0L4.2,2.1L2.1,4.2L0,2.1L-2.1,4.2"
    "L-4.2,2.1L-2.1,0Z",
    "star": "M0,-5L1.3,-1.7L4.8,-1.5L2.1,0.7L2.9,4L0,2.2L-2.9,4L-2.1,0.7L-4.8,-1.5L-1.3,-1.7Z",
}
PALETTE = (
    Mark("#5b6b7a", "#9fb0c0", "cross"),
    Mark("#a3123a", "#ff7a93", "triangle-down"),
    Mark("#0b5f73", "#7fd0e0", "hexagon"),
    Mark("#3d6b1f", "#a4d67a", "pentagon"),
    Mark("#7a4a21", "#e0a878", "bowtie"),
)
CHANGED = (1, 2)  # a profile with one thing changed, `matched+...`


_files: dict[str, Mark] = {}  # of the solvers' files that are drawn beside each other


def look(engine: str, profile: str = "") -> Look:
    """How `engine:profile`, or the truth, is drawn."""
    light, dark, shape = OF_TRUTH if engine == TRUTH else mark_of(engine)
    row = known_row(f"{engine}:{profile}")
    dash = CHANGED if "+" in profile else row.dash if row else ()
    return Look(light, dark, dash, row.shape or shape if row else shape, not dash)


def looks_of(names: Iterable[str]) -> dict[str, Look]:
    """How each `engine:profile` of a page is drawn, or the truth. Solvers' files on one page differ
    in colour and shape if there are at most as many as marks in `PALETTE`."""
    names = list(names)
    _files.clear()
    for name in sorted(names):
        mark_of(name.partition(":")[0])
    return {name: look(*name.split(":", 1)) for name in names}


def marks_of_rows() -> dict[str, Mark | None]:
    marks: dict[str, Mark | None] = {}
    for name, row in {**FETCHED, **ENGINES}.items():
        if not name.endswith(OWN):
            marks.setdefault(name.partition(":")[0], row.mark)
    return marks


def mark_of(engine: str) -> Mark:
    """The mark in the row of an engine; rows without one get the marks of `PALETTE` in order.

    The name of a solver's file selects its mark from `PALETTE`, the same in the game and in every
    report. If a file on the same page already has that mark, it gets the next.
    """
    rows = marks_of_rows()
    if engine not in rows:
        return _files.get(engine) or _files.setdefault(engine, mark_of_file(engine))
    unmarked = [name for name, mark in rows.items() if not mark]
    return rows[engine] or PALETTE[unmarked.index(engine) % len(PALETTE)]


def mark_of_file(path: str) -> Mark:
    """The first free mark, starting with the one that the name of the file selects."""
    first = crc32(encoded(PurePath(path).name)) % len(PALETTE)
    marks = PALETTE[first:] + PALETTE[:first]
    unmarked = sum(not mark for mark in marks_of_rows().values())
    taken = (*_files.values(), *PALETTE[:unmarked])
    return next((mark for mark in marks if mark not in taken), marks[0])


def marks() -> list[Mark]:
    rows = [mark for mark in marks_of_rows().values() if mark]
    return list(dict.fromkeys([*rows, *PALETTE, OF_TRUTH]))


def css_variables(dark: bool) -> str:
    return "".join(f"--{mark.light[1:]}:{mark[dark]};" for mark in marks())


SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: Any, digits: int = 3) -> str:
    """`value` to `digits` significant digits: 0.0123, 1.23×10⁻⁵, 0, ∞, – for nan; text as it is."""
    if isinstance(value, bool | str) or value is None:
        return {True: "yes", False: "no", None: "–", "": "–"}.get(value, str(value))
    try:
        x = float(value)
    except (TypeError, ValueError):
        return str(value)
    if not math.isfinite(x):
        return "–" if math.isnan(x) else ("∞" if x > 0 else "−∞")
    mantissa, _, exponent = f"{x:.{digits - 1}e}".partition("e")
    power = int(exponent)
    if x == 0 or -4 < power < 6:
        text = (
            f"{float(f'{x:.{digits}g}'):f}".rstrip("0").rstrip(".") if abs(x) < 1e15 else f"{x:g}"
        )
    else:
        short = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        text = ("" if short == "1" else f"{short}×") + f"10{str(power).translate(SUPERSCRIPT)}"
    return text.replace("-", "−")
