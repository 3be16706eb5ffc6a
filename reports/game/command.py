"""What `crosscheck play` does: checks what is asked for, and serves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from adapters.engines import ENGINES, row_of
from reports.commands import checked_engines
from reports.exits import refuse
from reports.game.server import Game, application, serve
from reports.lessons.pages import ROUTES
from scenarios.files import SceneFileError, read_scene_file
from scenarios.model import Scenario

MOST_DISKS = 200  # of a scene file: more are no longer drawn sixty times a second
FIRST = ("reference:exercise", "pymunk:shipped", "box2d:matched", "event_driven:float64")


def play_game(flight: Path | None, engines: Sequence[str], port: int, opens: bool) -> None:
    """Serve the game, or a saved flight, until Ctrl-C; exits 2 if the file or an engine is none."""
    chosen = checked_engines(engines) if engines else list(FIRST)
    ENGINES.update((name, row_of(name)) for name in chosen)  # a solver's file is a row like any other while it flies
    game = Game(chosen, read_flight(flight) if flight else None)
    try:
        serve(application(game, ROUTES), port, "/", opens)
    except OSError as fault:
        refuse([f"--port {port}: {fault}; name another"])


def read_flight(path: Path) -> Scenario:
    """The scenario in a scene file; exits 2 with a line a fault."""
    try:
        scenario = read_scene_file(path)
    except SceneFileError as error:
        refuse(error.faults)
    if scenario.scene.n > MOST_DISKS:
        refuse([f"{path}: {scenario.scene.n} disks; the page shows at most {MOST_DISKS}"])
    return scenario
