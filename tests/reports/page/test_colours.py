"""The colours of engines: against the page, and beside each other."""

from __future__ import annotations

from collections import Counter
from itertools import combinations, product

import numpy as np
import pytest

from crosscheck2d.adapters.engine_row import Mark
from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.reports.page.style import PALETTE, PATHS
from crosscheck2d.scenarios.model import Array

MARKS = {
    name.partition(":")[0]: row.mark for name, row in {**ENGINES, **FETCHED}.items() if row.mark
} | {f"file {k}": mark for k, mark in enumerate(PALETTE)}
PAGES = {"light": "#fdfdfb", "dark": "#14171a"}
LEAST_CONTRAST, LEAST_DISTANCE = 3.0, 0.06  # WCAG 2 asks 3 : 1 of graphics
# What is seen, of linear RGB, without one kind of cones (Machado, Oliveira & Fernandes, IEEE TVCG
# 15, 1291, 2009, table 1, severity 1.0).
SEEN = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
# Ottosson, "A perceptual color space for image processing", 2020.
TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def linear(colour: str) -> Array:
    stored = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    # Of WCAG 2.
    bright, dark = sorted(
        (linear(c) @ [0.2126, 0.7152, 0.0722] for c in (one, other)), reverse=True
    )
    return float((bright + 0.05) / (dark + 0.05))


def distance(one: str, other: str, seen: Array) -> float:
    first, second = (
        TO_LAB @ np.cbrt(TO_CONES @ np.clip(seen @ linear(c), 0, 1)) for c in (one, other)
    )
    return float(np.linalg.norm(first - second))


def close(marks: dict[str, Mark], page: str, seen: Array) -> dict[tuple[str, str], float]:
    found = {
        (one, other): distance(getattr(marks[one], page), getattr(marks[other], page), seen)
        for one, other in combinations(marks, 2)
    }
    return {pair: round(apart, 3) for pair, apart in found.items() if apart < LEAST_DISTANCE}


@pytest.mark.parametrize("page", PAGES)
def test_a_colour_stands_out_from_the_page(page: str):
    found = {name: contrast(getattr(mark, page), PAGES[page]) for name, mark in MARKS.items()}

    assert {name: ratio for name, ratio in found.items() if ratio < LEAST_CONTRAST} == {}


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("cones", SEEN)
def test_two_engines_have_colours_that_everybody_can_tell_apart(cones: str, page: str):
    marks = {name: mark for name, mark in MARKS.items() if not name.startswith("file")}

    assert close(marks, page, SEEN[cones]) == {}, (
        f"nearer to each other than {LEAST_DISTANCE}; free on a {page} page: {free(marks, page)}"
    )


def free(marks: dict[str, Mark], page: str) -> str:
    taken = [getattr(mark, page) for mark in marks.values()]
    levels = range(0, 256, 51)
    return next(
        colour
        for r, g, b in product(levels, levels, levels)
        if contrast(colour := f"#{r:02x}{g:02x}{b:02x}", PAGES[page]) >= LEAST_CONTRAST
        and all(
            distance(colour, other, seen) >= LEAST_DISTANCE
            for other in taken
            for seen in SEEN.values()
        )
    )


def test_a_free_colour_is_free():
    marks = {name: mark for name, mark in MARKS.items() if not name.startswith("file")}
    new = Mark(free(marks, "light"), free(marks, "dark"), "")

    for page, seen in product(PAGES, SEEN.values()):
        assert close(marks | {"new": new}, page, seen) == {}
        assert contrast(getattr(new, page), PAGES[page]) >= LEAST_CONTRAST


def test_a_row_has_no_mark_of_a_solvers_file_and_no_shape_of_another_engine():
    rows = {name: row for name, row in {**FETCHED, **ENGINES}.items() if row.mark}
    shapes = {(name.partition(":")[0], row.shape or row.mark.shape) for name, row in rows.items()}
    taken = Counter(shape for _, shape in shapes) + Counter(mark.shape for mark in PALETTE)
    unused = PATHS.keys() - taken.keys()

    assert not {row.mark.light for row in rows.values()} & {mark.light for mark in PALETTE}
    assert {shape: count for shape, count in taken.items() if count > 1} == {}, (
        f"free: {', '.join(sorted(unused)) or 'none, draw another in PATHS'}"
    )


def test_two_colours_that_some_take_for_one_are_noticed():
    marks = {"red": Mark("#c80000", "#c80000", "circle"), "olive": Mark("#4d4400", "#4d4400", "x")}

    assert close(marks, "light", SEEN["all cones"]) == {}
    assert close(marks, "light", SEEN["protanopia"]) != {}
