"""Links from one page to the other pages that exist."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class Neighbour(NamedTuple):
    """Another page: its question, the command that makes it, and its address relative to this page,
    "" if it does not exist.
    """

    title: str
    says: str
    command: str
    href: str


class Place(NamedTuple):
    """The defaults of a page: title, content, the command that makes it, and its path below the
    folder of all results."""

    title: str
    says: str
    command: str
    place: str


PAGES = {
    "report": Place("Report", "every scene, engine by engine", "crosscheck", "latest/report.html"),
    "speed": Place(
        "Speed",
        "the cost of an accuracy, and what each error is made of",
        "crosscheck speed",
        "speed/speed.html",
    ),
    "stability": Place(
        "Limits",
        "the speed, density or distance at which an engine fails",
        "crosscheck stability",
        "stability/stability.html",
    ),
    "lessons": Place(
        "Lessons",
        "why engines differ, with scenes that run",
        "crosscheck lesson",
        "lessons/index.html",
    ),
}


def neighbours(page: Path, own: str) -> list[Neighbour]:
    """The pages of `PAGES` besides `own`, as seen from the file `page`.

    A page is looked for at its default path, beside the folder of `page`. A folder that is being
    written is beside its final place, so links found from it are right.
    """
    beside = page.absolute().parent.parent
    return [
        Neighbour(title, says, command, f"../{place}" if (beside / place).is_file() else "")
        for key, (title, says, command, place) in PAGES.items()
        if key != own
    ]
