"""Names the lines of a chart where they are: each name where it covers least, joined to its line if it is not near."""

from __future__ import annotations

from itertools import pairwise, product
from math import hypot
from typing import Any, NamedTuple

LETTER, HIGH = 7.3, 16.0  # px of a letter at 13 px, and of a line of them
NEAR, FAR = 11.0, (11.0, 24.0, 40.0, 60.0, 84.0)  # px from a point to the box of its name
MARK = 7.0  # px, half of a point and a little air
SWEEPS = 3
MARGIN = 60.0  # px to the right of the plot, where the longest lines end
GREY = "#57626e"
FRONTS = {"Pareto front": "front of all", "Pareto front of those who take steps": "front of those who take steps"}


class Box(NamedTuple):
    """A rectangle in px, y downwards."""

    left: float
    top: float
    right: float
    foot: float

    def meets(self, other: Box) -> bool:
        """Whether the two have a point in common."""
        return self.left < other.right and other.left < self.right and self.top < other.foot and other.top < self.foot


def named(lines: list[dict[str, Any]], size: tuple[float, float]) -> list[dict[str, Any]]:
    """Annotations for plotly; lines have name, colour and points in px within a plot of that size."""
    marks = [Box(x - MARK, y - MARK, x + MARK, y + MARK) for line in lines for x, y in line["points"]]
    ways = [spot for line in lines for a, b in pairwise(line["points"]) for spot in along(a, b)]
    chosen: dict[str, tuple[Box, list[float]]] = {}
    for line in lines * SWEEPS:  # again, now that the others are known
        others = [place for name, place in chosen.items() if name != line["name"]]
        leaders = [spot for box, at in others for spot in along(at, nearest(box, *at))]
        points = [halfway(line["points"])] if line["name"] in FRONTS else line["points"]
        chosen[line["name"]] = min(
            places(FRONTS.get(line["name"], line["name"]), points),
            key=lambda place: covered(place, marks, ways + leaders, [box for box, _ in others], size),
        )
    return [label(line, *chosen[line["name"]], size) for line in lines]


def along(a: list[float], b: list[float]) -> list[Box]:
    """Small boxes on the way from a to b."""
    count = max(1, int(hypot(b[0] - a[0], b[1] - a[1]) / 10))
    spots = [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(count + 1)]
    return [Box(x - 4, y - 4, x + 4, y + 4) for x, y in spots]


def halfway(points: list[list[float]]) -> list[float]:
    """The middle of the last way down of a front, where nothing else is."""
    falls = [(a, b) for a, b in pairwise(points) if b[1] > a[1]]
    (_, top), (x, foot) = falls[-1]
    return [x, (top + foot) / 2]


def places(text: str, points: list[list[float]]) -> list[tuple[Box, list[float]]]:
    """(box, point it belongs to), the ends of the line first."""
    wide = LETTER * len(text)
    found = []
    for (x, y), far, (right, down) in product(
        points[::-1], FAR, ((1, 0), (-1, 0), (0, -1), (0, 1), (1, -1), (1, 1), (-1, -1), (-1, 1))
    ):
        left = x + far if right > 0 else x - far - wide if right < 0 else x - wide / 2
        top = y + far if down > 0 else y - far - HIGH if down < 0 else y - HIGH / 2
        found.append((Box(left, top, left + wide, top + HIGH), [x, y]))
    return found


def covered(
    place: tuple[Box, list[float]], marks: list[Box], ways: list[Box], taken: list[Box], size: tuple[float, float]
) -> float:
    """How bad a place is: outside or on another name, on points and lines, and then how far from its point."""
    box, (x, y) = place
    outside = box.left < 0 or box.top < 0 or box.right > size[0] + MARGIN or box.foot > size[1]
    leader = along([x, y], nearest(box, x, y))
    crossed = sum(spot.meets(mark) for spot in leader[1:] for mark in marks)
    crossed += 7 * sum(spot.meets(name) for spot in leader for name in taken)
    crossed += sum(spot.meets(way) for spot in leader[1:] for way in ways) / 3  # a mark more than a line
    away = hypot(*(a - b for a, b in zip(nearest(box, x, y), (x, y))))
    return (
        1e4 * (outside + sum(box.meets(name) for name in taken))
        + 100 * sum(box.meets(mark) for mark in marks)
        + 40 * sum(box.meets(way) for way in ways)
        + 30 * crossed
        + 2 * away
    )


def nearest(box: Box, x: float, y: float) -> list[float]:
    """The point of a box that is nearest to (x, y)."""
    return [min(max(x, box.left), box.right), min(max(y, box.top), box.foot)]


def label(line: dict[str, Any], box: Box, at: list[float], size: tuple[float, float]) -> dict[str, Any]:
    """The name as plotly writes it, with a thin line to its point where it is not beside it."""
    front = FRONTS.get(line["name"])
    text, colour = front or line["name"], GREY if front else line["colour"]
    end = nearest(box, *at)
    beside = hypot(end[0] - at[0], end[1] - at[1]) <= NEAR + 4
    common = {"text": text, "font": {"color": colour, "size": 13}, "xref": "paper", "yref": "paper"}
    if beside:
        return common | {
            "x": (box.left + box.right) / 2 / size[0],
            "y": 1 - (box.top + box.foot) / 2 / size[1],
            "showarrow": False,
            "xanchor": "center",
            "yanchor": "middle",
        }
    return common | {
        "x": at[0] / size[0],
        "y": 1 - at[1] / size[1],
        "ax": (box.left + box.right) / 2 - at[0],
        "ay": (box.top + box.foot) / 2 - at[1],
        "showarrow": True,
        "arrowhead": 0,
        "arrowwidth": 0.8,
        "arrowcolor": colour,
        "standoff": 5,
    }
