"""The page of the game as text."""

from __future__ import annotations

from collections.abc import Sequence

from adapters.engines import ENGINES
from reports.game.divergence import DIVERGED
from reports.game.flight import FRAME, SUBSTEPS
from reports.page.documents import render
from reports.page.style import look
from scenarios.model import Scenario


def game_page(engines: Sequence[str], file: Scenario | None, mark: str) -> str:
    """The page, which begins with these engines; `file`: the flight it shows again; `mark`: its
    server's."""
    looks = {name: look(*name.split(":", 1)) for name in ENGINES}
    return render(
        "game/game.html.j2",
        generator="crosscheck play",
        scripts=["game/field.js", "game/game.js"],
        styles=["game/game.css"],
        looks=looks,
        connects=True,
        rows=ENGINES,
        flown=list(engines),
        steps={k: FRAME / k for k in SUBSTEPS},
        file=file,
        mark=mark,
        diverged=DIVERGED,
    )
