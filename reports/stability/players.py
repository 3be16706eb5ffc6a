"""Who is put to the test: every row of `ENGINES`, and engines with one thing switched, to test a reason by."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from adapters.engine import Engine
from adapters.engines import ENGINES
from adapters.play import Run, play
from scenarios.model import Scenario, Scene


class Player(NamedTuple):
    """How to make an engine, and what is switched in it; "" for a row of `ENGINES`."""

    make: Callable[[], Engine]
    switch: str = ""


class Switched:
    """An engine with one thing changed right after `load`; all else is passed on."""

    def __init__(self, engine: Engine, change: Callable[[Any], None]) -> None:
        self.engine, self.change = engine, change

    def load(self, scene: Scene, dt: float) -> None:
        """As the engine, then the change."""
        self.engine.load(scene, dt)
        self.change(self.engine)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.engine, name)


def switched(row: str, change: Callable[[Any], None]) -> Callable[[], Any]:
    """What makes the engine of a row with `change` applied to its adapter after every `load`."""
    return lambda: Switched(ENGINES[row].make(), change)


def bullets(engine: Any) -> None:
    """Box2D 2.3: continuous collision, and the disks that move at the start are bullets."""
    engine.world.continuousPhysics = True
    fly(engine)


def bullets_v3(engine: Any) -> None:
    """Box2D 3.1: the same."""
    engine.world.continuous_enabled = True
    fly(engine)


def fly(engine: Any) -> None:
    """Make bullets of the disks that move: a bullet sees no other bullet in Box2D 3.1."""
    for body, velocity in zip(engine.bodies, engine.scene.velocity):
        body.bullet = bool(velocity.any())


def default_bias(engine: Any) -> None:
    """pymunk: overlaps are pushed out as shipped."""
    engine.space.collision_bias = (1 - 0.1) ** 60


def ten_iterations(engine: Any) -> None:
    """pymunk: as many sequential impulses a contact as it does unasked."""
    engine.space.iterations = 10


def substeps_16(engine: Any) -> None:
    """Box2D 3.1: four times as many substeps."""
    engine.substeps = 16


PLAYERS: dict[str, Player] = {name: Player(row.make) for name, row in ENGINES.items()} | {
    "pymunk:matched+ten_iterations": Player(switched("pymunk:matched", ten_iterations), "10 iterations for 50"),
    "pymunk:matched+push_out": Player(switched("pymunk:matched", default_bias), "overlaps pushed out as shipped"),
    "box2d:matched+bullets": Player(switched("box2d:matched", bullets), "continuous collision, what moves is a bullet"),
    "box2d_v3:matched+bullets": Player(
        switched("box2d_v3:matched", bullets_v3), "continuous collision, what moves is a bullet"
    ),
    "box2d_v3:matched+16_substeps": Player(switched("box2d_v3:matched", substeps_16), "16 substeps for 4"),
}


def play_as(player: str, scenario: Scenario) -> Run:
    """Play a scenario at its only step size; the engine is closed again. A library that is missing is a refusal."""
    dt = scenario.dt(scenario.substeps[0])
    try:
        engine = PLAYERS[player].make()
    except ImportError as missing:
        name, profile = player.split(":")
        return Run(name, profile, scenario.name, dt, "unsupported", f"{missing.name or missing} cannot be imported")
    try:
        return play(engine, player, scenario, dt)
    finally:
        engine.close()
