"""Links from one page to the other pages that exist."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class Neighbour(NamedTuple):
    """A page; `href`: in `PAGES` below the folder of all results, in a page relative to it, "" if
    it does not exist."""

    title: str
    says: str
    command: str
    href: str


PAGES = {
    "report": Neighbour(
        "Report", "every scene, engine by engine", "crosscheck", "latest/report.html"
    ),
    "speed": Neighbour(
        "Speed",
        "the cost of an accuracy, and what each error is made of",
        "crosscheck speed",
        "speed/speed.html",
    ),
    "stability": Neighbour(
        "Limits",
        "the speed, density or distance at which an engine fails",
        "crosscheck stability",
        "stability/stability.html",
    ),
    "lessons": Neighbour(
        "Lessons",
        "why engines differ, with scenes that run",
        "crosscheck lesson",
        "lessons/index.html",
    ),
}


def neighbours(page: Path, own: str) -> list[Neighbour]:
    """The pages of `PAGES` besides `own`, as seen from the file `page`: each is looked for at its
    default path, beside the folder of `page`."""
    # a folder that is being written is beside its final place, so links found from it are right
    beside = page.absolute().parent.parent
    return [
        page._replace(href=f"../{page.href}" if (beside / page.href).is_file() else "")
        for key, page in PAGES.items()
        if key != own
    ]
