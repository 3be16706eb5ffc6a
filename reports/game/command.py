"""What `crosscheck play` is asked for, checked: a flight, engines, solvers' files."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import closing
from math import inf
from pathlib import Path

from adapters.engine import EngineRow
from adapters.engines import ENGINES, OWN
from adapters.own_solver.engine import engine_file
from adapters.own_solver.file import KINDS
from adapters.play import fault_of
from reports.game.flight import FRAME, field_scenario
from reports.game.messages import MOST_ENGINES
from reports.game.server import Game
from reports.run.arguments import checked_engines
from reports.terminal.exits import refuse
from scenarios.files.scene_file import SceneFileError, read_scene_file
from scenarios.model import Scenario

MOST_DISKS = 200  # of a scene file: more are no longer drawn sixty times a second
PATIENCE = 2.0  # s that a solver's file may take for a frame, while the others wait for it
FIRST = ("reference:exercise", "pymunk:shipped", "box2d:matched", "event_driven:float64")


def game_of(flight: Path | None, engines: Sequence[str]) -> Game:
    """The game, or a saved flight, through these engines; exits 2 if the file or an engine is
    none."""
    chosen = checked_engines(engines) if engines else list(FIRST)
    if len(chosen) > MOST_ENGINES:
        refuse([f"--engine: {len(chosen)} engines; at most {MOST_ENGINES} fly at once: name fewer"])
    file = read_flight(flight) if flight else None
    # A solver's file is a row like any other while it flies; one that cannot fly at all is reported
    # before.
    ENGINES.update(own_rows([name for name in chosen if name.endswith(OWN)]))
    return Game(chosen, file)


def own_rows(names: Sequence[str]) -> dict[str, EngineRow]:
    """The rows of solvers' files, `PATH:own`, each tried on a lone ship; exits 2 with a line for
    each that fails."""
    rows, faults = {}, []
    for name in names:
        path = Path(name.removesuffix(OWN))
        rows[name] = engine_file(path, PATIENCE, collected=True)
        if reason := grounded(rows[name]):
            faults.append(f"{path}: {reason.removeprefix(f'{path.name} ')}")
    if faults:
        refuse(faults)
    return rows


def grounded(row: EngineRow) -> str:
    """Why an engine cannot take a lone ship through a step; "" if it can."""
    with closing(row.make()) as engine:
        try:
            engine.load(field_scenario(asteroids=0).scene, FRAME)
            engine.step()
            return fault_of(engine.read(), inf)
        except Exception as error:  # somebody's solver may raise anything
            return str(error) or type(error).__name__


def read_flight(path: Path) -> Scenario:
    """The scenario in a scene file; exits 2 with a line a fault."""
    if path.suffix.lower() in KINDS:
        refuse([f"{path}: is a solver and no flight; fly it by --engine {shlex.quote(str(path))}"])
    try:
        scenario = read_scene_file(path)
    except SceneFileError as error:
        refuse(error.faults)
    if scenario.scene.n > MOST_DISKS:
        refuse([f"{path}: {scenario.scene.n} disks; the page shows at most {MOST_DISKS}"])
    return scenario
