"""What `crosscheck play` is asked for, checked: a flight, engines, solvers' files."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import cast

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, OWN, row_of
from crosscheck2d.adapters.host.engine import GuestEngine, row_of_file
from crosscheck2d.adapters.host.file import KINDS
from crosscheck2d.adapters.host.restitution import EXERCISE
from crosscheck2d.reports.game.flight import FRAME, field_scenario
from crosscheck2d.reports.game.server import Game
from crosscheck2d.reports.game.session import MOST_ENGINES
from crosscheck2d.reports.run.arguments import checked_engines
from crosscheck2d.reports.terminal.exits import refuse
from crosscheck2d.scenarios.files.scene_file import SceneFileError, read_scene_file
from crosscheck2d.scenarios.model import Scenario

MOST_DISKS = 200  # of a scene file: more are no longer drawn sixty times a second
PATIENCE = 2.0  # s that a solver's file may take for a frame, while the others wait for it
# beside a solver's file if nothing else is named: a right solver of the exercise, and the exact
# answer in float64
BESIDE = ("reference:exercise", "event_driven:float64")
FIRST = ("reference:exercise", "pymunk:shipped", "box2d:matched", "event_driven:float64")


def game_of(flight: Path | None, engines: Sequence[str]) -> Game:
    """The game, or a saved flight, through these engines, of which a solver's file is the solid
    one; exits 2 if the file or an engine is none."""
    chosen = checked_engines(engines) if engines else list(FIRST)
    own = [name for name in chosen if name.endswith(OWN)]
    others = [name for name in chosen if name not in own]
    if len(chosen) > MOST_ENGINES:
        refuse([f"--engine: {len(chosen)} engines; at most {MOST_ENGINES} fly at once: name fewer"])
    file = read_flight(flight) if flight else None
    # A solver's file is a row like any other while it flies; one that cannot fly at all is reported
    # before.
    rows, restitution = own_rows(own)
    ENGINES.update(rows | {name: row_of(name) for name in others if name not in ENGINES})
    beside = others or BESIDE[: MOST_ENGINES - len(own)]
    return Game([*own, *beside], file, restitution)


def own_rows(names: Sequence[str]) -> tuple[dict[str, EngineRow], float]:
    """The rows of solvers' files, `PATH:own`, each loaded with a ship and an asteroid, and the
    restitution that the first of them is written for; exits 2 with a line for each that cannot be
    loaded. One that fails later leaves the flight, where the page says why."""
    rows, faults, restitutions = {}, [], []
    for name in names:
        path = Path(name.removesuffix(OWN))
        rows[name] = row_of_file(path, PATIENCE, collected=True)
        with closing(cast(GuestEngine, rows[name].make())) as engine:
            try:
                assert engine.process  # it is started, and its restitution known
                restitutions.append(engine.own_restitution)
                engine.load(field_scenario(asteroids=1, restitution=restitutions[-1]).scene, FRAME)
            except Exception as error:  # somebody's solver may raise anything
                reason = str(error) or type(error).__name__
                reason = reason.removeprefix(f"{path.name}: ").removeprefix(f"{path.name} ")
                faults.append(f"{path}: {reason}")
    if faults:
        refuse(faults)
    return rows, next(iter(restitutions), EXERCISE)


def read_flight(path: Path) -> Scenario:
    if path.suffix.lower() in KINDS:
        flag = f"--engine {shlex.quote(str(path))}"
        refuse([f"{path}: is a solver, not a flight; fly it with {flag}"])
    try:
        scenario = read_scene_file(path)
    except SceneFileError as error:
        refuse(error.faults)
    if scenario.scene.n > MOST_DISKS:
        refuse([f"{path}: {scenario.scene.n} disks; the page shows at most {MOST_DISKS}"])
    return scenario
