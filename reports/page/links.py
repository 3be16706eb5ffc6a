"""Where the other pages are, seen from the folder of one: only those that are there."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class Neighbour(NamedTuple):
    """Another page: what it answers, the command that makes it, and its address from the folder of
    this one, "" if it is not there.
    """

    title: str
    says: str
    command: str
    href: str


class Place(NamedTuple):
    """A page by default: title, what it says, the command that makes it, and where that puts it,
    from the folder of all results."""

    title: str
    says: str
    command: str
    place: str


PAGES = {
    "report": Place("Report", "every scene, engine by engine", "crosscheck", "latest/report.html"),
    "speed": Place(
        "Speed",
        "what an accuracy costs, measured with care",
        "crosscheck speed",
        "speed/speed.html",
    ),
    "stability": Place(
        "Limits",
        "how fast, how dense, how far until an engine fails",
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

    A page is looked for where its command puts it by default, beside the folder of `page`. While a
    folder is written it stands beside the one that it will be, so what is found from it is right.
    """
    beside = page.absolute().parent.parent
    return [
        Neighbour(title, says, command, f"../{place}" if (beside / place).is_file() else "")
        for key, (title, says, command, place) in PAGES.items()
        if key != own
    ]
