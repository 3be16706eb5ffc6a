"""The smallest scene that shows a fault as a PNG, for systems without HTML pages."""

from __future__ import annotations

from base64 import b64encode
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageDraw

from reports.check.scene_words import faults_of, scene_lines
from scenarios.model import Array, Scene

if TYPE_CHECKING:
    from reports.check.smallest_scene import Smallest

SIDE = 480  # pixels, of the longer side
MARGIN = 0.2  # margin, m
FARTHEST = 20.0  # m: what is farther away is not drawn
START, RIGHT, YOURS = (150, 150, 150), (30, 30, 30), (163, 18, 58)  # as on the page of a file
THIN, THICK = 2, 3  # pixels
FINER = 4  # drawn this many times larger and scaled down, for smooth edges
EVERY = 2  # samples between two dots
LEGEND = (
    "Grey: the start. Black: {right} after {t:g} s. Red: your solver after {t:g} s. The"
    " line from a centre shows the angle; dots show the way."
)


def data_url(one: Smallest) -> str:
    """The picture as a data URL."""
    return f"data:image/png;base64,{b64encode(png(drawn(one))).decode()}"


def label(one: Smallest) -> str:
    """A caption: what the picture shows and what is wrong in it."""
    said = f"The smallest scene that shows {faults_of(one)}: {one.fault}."
    spheres = [f"Sphere {k} starts {line}." for k, line in enumerate(scene_lines(one.scenario))]
    return " ".join([said, *spheres, legend(one)])


def legend(one: Smallest) -> str:
    """What is drawn in which colour."""
    return LEGEND.format(right=one.right_is, t=one.scenario.duration)


def png(picture: Image.Image) -> bytes:
    """The bytes of the picture as a PNG file."""
    file = BytesIO()
    picture.save(file, "png", optimize=True)
    return file.getvalue()


def drawn(one: Smallest) -> Image.Image:
    """The picture: start of the spheres, end of each motion, and the paths."""
    scene = one.scenario.scene
    motions = [(one.right, RIGHT, THICK), (one.yours, YOURS, THIN)]
    there = [(motion, colour, width) for motion, colour, width in motions if motion is not None]
    paper = Paper(np.concatenate([motion.position.reshape(-1, 2) for motion, _, _ in there]), scene)
    for k in range(scene.n):
        paper.sphere(k, scene.position[k], scene.angle[k], START, THIN)
    for motion, colour, width in there:
        for k in range(scene.n):
            for place in motion.position[::EVERY, k]:
                paper.disk(place, width / paper.scale, fill=colour)
            paper.sphere(k, motion.position[-1, k], motion.angle[-1, k], colour, width)
    return paper.picture.reduce(FINER)


class Paper:
    """A picture, y up, with room for these places (m, 2) and the start of a scene. Places farther
    away than `FARTHEST`, or NaN, are not drawn."""

    def __init__(self, places: Array, scene: Scene) -> None:
        seen = np.concatenate([scene.position, places[(np.abs(places) <= FARTHEST).all(axis=1)]])
        self.radius, room = scene.radius, scene.radius.max() + MARGIN
        low, high = seen.min(axis=0) - room, seen.max(axis=0) + room
        self.corner = np.array([low[0], high[1]])
        self.scale = SIDE / (high - low).max()  # pixels per m
        width, height = np.ceil((high - low) * self.scale).astype(int).tolist()
        self.picture = Image.new("RGB", (width * FINER, height * FINER), "white")
        self.draw = ImageDraw.Draw(self.picture)

    def at(self, place: Array) -> Array:
        """The pixel of a place."""
        there: Array = (place - self.corner) * [1, -1] * self.scale * FINER
        return there

    def disk(self, place: Array, radius: float, **how: Any) -> None:
        """A circle around a place; its radius in m."""
        if (np.abs(place) <= FARTHEST).all():
            reach = np.array([radius, -radius])
            self.draw.ellipse([*self.at(place - reach), *self.at(place + reach)], **how)

    def sphere(
        self, k: int, place: Array, angle: float, colour: tuple[int, int, int], width: int
    ) -> None:
        """The outline of a sphere, and its radius at its angle, rad."""
        self.disk(place, self.radius[k], outline=colour, width=width * FINER)
        if (np.abs(place) <= FARTHEST).all() and np.isfinite(angle):
            end = place + self.radius[k] * np.array([np.cos(angle), np.sin(angle)])
            self.draw.line([*self.at(place), *self.at(end)], colour, width * FINER)
