"""The smallest scene that shows a fault as a PNG, for systems that show no page."""

from __future__ import annotations

import struct
import zlib
from base64 import b64encode
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from reports.check.scene_words import faults_of, scene_lines
from scenarios.model import Array, Scene

if TYPE_CHECKING:
    from reports.check.smallest import Smallest

SIDE = 480  # pixels, of the longer side
MARGIN = 0.2  # m around what is drawn
FARTHEST = 20.0  # m: what is farther away is not drawn
START, EXACT, YOURS = (150, 150, 150), (30, 30, 30), (163, 18, 58)  # as on the page of a file
THIN, THICK = 1.6, 3.2  # pixels
EVERY = 2  # samples from dot to dot
LEGEND = (
    "Grey: the start. Black: the exact answer after {t:g} s. Red: your solver after {t:g} s. The"
    " line from a centre shows the angle; dots show the way."
)


def data_url(one: Smallest) -> str:
    """The picture as a text that a browser shows."""
    return f"data:image/png;base64,{b64encode(png(drawn(one))).decode()}"


def label(one: Smallest) -> str:
    """What the picture shows, in words, and what is wrong in it."""
    said = f"The smallest scene that shows {faults_of(one)}: {one.fault}."
    spheres = [f"Sphere {k} starts {line}." for k, line in enumerate(scene_lines(one.scenario))]
    return " ".join([said, *spheres, LEGEND.format(t=one.scenario.duration)])


def drawn(one: Smallest) -> Array:
    """The pixels (height, width, 3), 0 to 255: where the spheres start, where each motion ends, and
    the ways there."""
    scene = one.scenario.scene
    motions = [(one.truth, EXACT, THICK), (one.yours, YOURS, THIN)]
    there = [(motion, colour, width) for motion, colour, width in motions if motion is not None]
    paper = Paper(np.concatenate([motion.position.reshape(-1, 2) for motion, _, _ in there]), scene)
    for k in range(scene.n):
        paper.sphere(k, scene.position[k], scene.angle[k], START, THIN)
    for motion, colour, width in there:
        for k in range(scene.n):
            for place in motion.position[::EVERY, k]:
                paper.dot(place, width, colour)
            paper.sphere(k, motion.position[-1, k], motion.angle[-1, k], colour, width)
    return paper.pixels


class Paper:
    """Pixels (height, width, 3), y up, on which these places (m, 2) and the start of a scene have
    room. What is farther away than `FARTHEST`, or nowhere (NaN), is not drawn."""

    def __init__(self, places: Array, scene: Scene) -> None:
        seen = np.concatenate([scene.position, places[(np.abs(places) <= FARTHEST).all(axis=1)]])
        self.radius, room = scene.radius, scene.radius.max() + MARGIN
        low, high = seen.min(axis=0) - room, seen.max(axis=0) + room
        self.scale = SIDE / (high - low).max()  # pixels per m
        width, height = np.ceil((high - low) * self.scale).astype(int)
        self.x = low[0] + (np.arange(width) + 0.5) / self.scale
        self.y = (high[1] - (np.arange(height) + 0.5) / self.scale)[:, np.newaxis]
        self.pixels: Array = np.full((height, width, 3), 255.0)

    def dot(self, place: Array, radius: float, colour: tuple[int, int, int]) -> None:
        """A filled disk; its radius in pixels."""
        self.ink(place, radius, lambda x, y: np.hypot(x, y) * self.scale - radius, colour)

    def sphere(
        self, k: int, place: Array, angle: float, colour: tuple[int, int, int], width: float
    ) -> None:
        """The outline of a sphere, and its radius at its angle, rad."""
        radius = self.radius[k]
        n = np.array([np.cos(angle), np.sin(angle)]) if np.isfinite(angle) else np.zeros(2)

        def outside(x: Array, y: Array) -> Array:
            along = np.clip(x * n[0] + y * n[1], 0.0, radius)
            line = np.hypot(x - along * n[0], y - along * n[1])
            ring = np.abs(np.hypot(x, y) - radius)
            gap: Array = np.minimum(ring, line) * self.scale - width / 2
            return gap

        self.ink(place, radius * self.scale + width, outside, colour)

    def ink(
        self,
        place: Array,
        reach: float,
        outside: Callable[[Array, Array], Array],
        colour: tuple[int, int, int],
    ) -> None:
        """Colour a shape around a place, with a smooth edge.

        reach: pixels beyond which nothing of it is; outside: how many pixels a point, in metres
        from the place, is outside of the shape.
        """
        if not (np.abs(place) <= FARTHEST).all():
            return
        far = (reach + 1) / self.scale
        rows = np.flatnonzero(np.abs(self.y[:, 0] - place[1]) <= far)
        columns = np.flatnonzero(np.abs(self.x - place[0]) <= far)
        here = np.ix_(rows, columns)
        gap = outside(self.x[columns] - place[0], self.y[rows] - place[1])
        share = np.clip(0.5 - gap, 0.0, 1.0)[..., np.newaxis]
        self.pixels[here] += share * (np.array(colour) - self.pixels[here])


def png(pixels: Array) -> bytes:
    """The pixels as a file (W3C, Portable Network Graphics, 2003): 8 bits a colour, no filter."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each begins with its filter: 0, none
    rows[:, 1:] = np.round(pixels).reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = [(b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 9)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    )
