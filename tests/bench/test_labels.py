"""The names in the README's picture can be read: none covers another, none is cut off, each is near its line."""

from __future__ import annotations

import sys
from itertools import combinations
from math import hypot
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / ".ci"))  # no package

from labels import HIGH, LETTER, MARGIN, Box, covered, named, places

SIZE = (800.0, 480.0)


def box_of(label: dict) -> Box:
    """Where a label is, px."""
    x, y = label["x"] * SIZE[0] + label.get("ax", 0.0), (1 - label["y"]) * SIZE[1] + label.get("ay", 0.0)
    wide = LETTER * len(label["text"])
    return Box(x - wide / 2 + 1, y - HIGH / 2 + 1, x + wide / 2 - 1, y + HIGH / 2 - 1)


@pytest.mark.parametrize("seed", range(5))
def test_no_name_covers_another_or_is_cut_off(seed: int):
    """Ten lines of four points that fall side by side in a corner, as those of the engines do."""
    rng = np.random.default_rng(seed)
    start = rng.uniform([300, 40], [600, 120], (10, 2))
    lines = [
        {"name": f"engine_{k}:matched", "colour": "#000", "points": (at + np.outer(range(4), [45, 18])).tolist()}
        for k, at in enumerate(start)
    ]
    labels = named(lines, SIZE)
    boxes = [box_of(label) for label in labels]

    assert [label["text"] for label in labels] == [line["name"] for line in lines]
    assert not any(one.meets(other) for one, other in combinations(boxes, 2))
    assert all(
        box.left >= 0 and box.top >= 0 and box.right <= SIZE[0] + MARGIN and box.foot <= SIZE[1] for box in boxes
    )


def test_a_name_with_room_stands_beside_the_end_of_its_line():
    """Without a line to it, right of the last point."""
    (label,) = named([{"name": "a:b", "colour": "#000", "points": [[100.0, 100.0], [200.0, 150.0]]}], SIZE)
    box = box_of(label)

    assert not label["showarrow"]
    assert 200 < box.left < 200 + 20
    assert hypot(0, (box.top + box.foot) / 2 - 150) < 1


def test_a_name_gives_way_to_a_point_that_lies_where_it_would_stand():
    """Negative control of the choice: without the point it stands there, with it elsewhere."""
    spots = places("a:b", [[200.0, 150.0]])
    free = min(spots, key=lambda place: covered(place, [], [], [], SIZE))
    mark = free[0]

    assert not min(spots, key=lambda place: covered(place, [mark], [], [], SIZE))[0].meets(mark)
