"""The engines that are tested: every row of `ENGINES`, and its variants: engines with one thing
changed, by which a reason is tested."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES, changed, row_of
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.scenarios.model import Scenario, Scene


class DrivenEngine(NamedTuple):
    """An engine or a variant: its name, `engine:profile` or `engine:profile+variant`; the function
    that makes it; and what is changed in it, "" for an engine as in its row."""

    name: str
    make: Callable[[], Engine]
    change: str = ""


def make_variant(name: str, variant: str) -> Any:
    """The engine of a row of `ENGINES`, changed as one of the row's variants says: at once, and
    right after `load`."""
    settings, _, loaded = ENGINES[name].variants[variant]
    engine: Any = changed(name, **settings)
    if loaded is None:
        return engine
    load, change = engine.load, loaded

    def load_and_change(scene: Scene, dt: float) -> None:
        load(scene, dt)
        change(engine)

    engine.load = load_and_change
    return engine


def with_variant(variant: str) -> tuple[str, ...]:
    """The keys in `DRIVEN_ENGINES` of all engines that have this variant."""
    return tuple(f"{name}+{variant}" for name, row in ENGINES.items() if variant in row.variants)


WITH_FRICTION_ONLY = tuple(name for name, row in ENGINES.items() if row.adds_friction)

# `engine:profile`, and after all of these `engine:profile+variant` -> the engine.
DRIVEN_ENGINES: dict[str, DrivenEngine] = {
    name: DrivenEngine(name, row.make) for name, row in ENGINES.items()
} | {
    f"{name}+{variant}": DrivenEngine(
        f"{name}+{variant}", partial(make_variant, name, variant), what
    )
    for name, row in ENGINES.items()
    for variant, (_, what, _) in row.variants.items()
}


@contextmanager
def taking_part(rows: Mapping[str, EngineRow]) -> Iterator[None]:
    """In this context engines' own files, `PATH:own`, and rows of `FETCHED` are tested in this
    process like the rows of `ENGINES`."""
    ENGINES.update(rows)
    DRIVEN_ENGINES.update({name: DrivenEngine(name, row.make) for name, row in rows.items()})
    try:
        yield
    finally:
        for name in rows:
            del ENGINES[name], DRIVEN_ENGINES[name]


def played(driven: DrivenEngine, scenario: Scenario) -> Run:
    """Play a scenario at its only step size."""
    return play_once(driven.make, driven.name, scenario, scenario.dt(scenario.substeps[0]))


def play_as(engine: str, scenario: Scenario) -> Run:
    """`played`, by a key of `DRIVEN_ENGINES`, or a row that does not take part."""
    return played(DRIVEN_ENGINES.get(engine) or DrivenEngine(engine, row_of(engine).make), scenario)
