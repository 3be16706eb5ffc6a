"""Who is put to the test: every row of `ENGINES`, and engines with one thing switched, to test a reason by."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from adapters.engine import Engine
from adapters.engines import ENGINES, changed
from adapters.play import Run, play_once
from scenarios.model import Scenario, Scene


class Player(NamedTuple):
    """A name, engine:profile; how to make its engine; and what is switched in it: "" for a row of `ENGINES`."""

    name: str
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


def varied(name: str, variant: str) -> Any:
    """The engine of a row of `ENGINES` as one of the row's variants."""
    settings, _, loaded = ENGINES[name].variants[variant]
    engine = changed(name, **settings)
    return Switched(engine, loaded) if loaded else engine


def with_variant(variant: str) -> tuple[str, ...]:
    """The keys of `PLAYERS` of all engines that have this variant."""
    return tuple(f"{name}+{variant}" for name, row in ENGINES.items() if variant in row.variants)


SWITCHED = tuple(
    Player(f"{name}+{variant}", partial(varied, name, variant), what)
    for name, row in ENGINES.items()
    for variant, (_, what, _) in row.variants.items()
)
PLAYERS: dict[str, Player] = {
    player.name: player for player in (*(Player(name, row.make) for name, row in ENGINES.items()), *SWITCHED)
}


def played(player: Player, scenario: Scenario) -> Run:
    """Play a scenario at its only step size."""
    return play_once(player.make, player.name, scenario, scenario.dt(scenario.substeps[0]))


def play_as(player: str, scenario: Scenario) -> Run:
    """`played` by a key of `PLAYERS`."""
    return played(PLAYERS[player], scenario)
