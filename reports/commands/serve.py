"""`crosscheck play` and `crosscheck lesson`: one web application, the game at / and the lessons
below /lesson."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from starlette.applications import Starlette

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.commands.own_solvers import said_of
from crosscheck2d.reports.game.command import FIRST, game_of
from crosscheck2d.reports.game.server import Game, routes
from crosscheck2d.reports.lessons.command import checked_lesson
from crosscheck2d.reports.lessons.pages import ROUTES
from crosscheck2d.reports.page import server


def application(game: Game) -> Starlette:
    return server.application([*routes(game), *ROUTES])


def play(flight: Path | None, engines: Sequence[str], port: int, opens: bool) -> None:
    """Serve the game, or a saved flight, until Ctrl-C; exits 2 if the file or an engine is
    invalid."""
    game = game_of(flight, engines)
    game.said = said_of([name for name in game.engines if ENGINES[name].exercise])
    server.serve(application(game), port, "/", opens)


def lesson(name: str, port: int, opens: bool) -> None:
    """Serve the lessons, opened at `name` or their list, until Ctrl-C; exits 2 if there is no such
    lesson."""
    path = f"/lesson/{checked_lesson(name)}".rstrip("/")
    server.serve(application(Game(list(FIRST))), port, path, opens)
