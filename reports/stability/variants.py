"""Who is put to the test: every row of `ENGINES`, and engines with one thing changed, to test a reason by."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from adapters.engine import Engine
from adapters.engines import ENGINES
from adapters.mechanisms.options import changed_box2d, changed_box2d_v3, changed_pymunk
from adapters.play import Run, play
from scenarios.model import Scenario, Scene


class Variant(NamedTuple):
    """A name, engine:profile; how to make its engine; and what is changed in it: "" for a row of `ENGINES`."""

    name: str
    make: Callable[[], Engine]
    change: str = ""


class Changed:
    """An engine with one thing changed right after `load`; all else is passed on."""

    def __init__(self, engine: Engine, change: Callable[[Any], None]) -> None:
        self.engine, self.change = engine, change

    def load(self, scene: Scene, dt: float) -> None:
        """As the engine, then the change."""
        self.engine.load(scene, dt)
        self.change(self.engine)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.engine, name)


def fly(engine: Any) -> None:
    """Make bullets of the disks that move: a bullet sees no other bullet in Box2D 3.1."""
    for body, velocity in zip(engine.bodies, engine.scene.velocity):
        body.bullet = bool(velocity.any())


def with_bullets(make: Callable[..., Engine]) -> Callable[[], Any]:
    """What makes an engine with continuous collision in which the disks that move at the start are bullets."""
    return lambda: Changed(make(continuous=True), fly)


BULLETS = "continuous collision, what moves is a bullet"
CHANGED = (
    Variant("pymunk:matched+fifty_iterations", partial(changed_pymunk, iterations=50), "50 iterations for 10"),
    Variant(
        "pymunk:matched+position_correction", partial(changed_pymunk, collision_bias=(1 - 0.1) ** 60),
        "position correction as shipped",
    ),
    Variant("box2d:matched+bullets", with_bullets(partial(changed_box2d, elastic_continuous=True)), BULLETS),
    Variant("box2d_v3:matched+bullets", with_bullets(changed_box2d_v3), BULLETS),
    Variant("box2d_v3:matched+16_substeps", partial(changed_box2d_v3, substeps=16), "16 substeps for 4"),
)  # fmt: skip
VARIANTS: dict[str, Variant] = {
    variant.name: variant for variant in (*(Variant(name, row.make) for name, row in ENGINES.items()), *CHANGED)
}


def played(variant: Variant, scenario: Scenario) -> Run:
    """Play a scenario at its only step size; the engine is closed again. A library that is missing is a refusal."""
    dt = scenario.dt(scenario.substeps[0])
    try:
        engine = variant.make()
    except ImportError as missing:
        name, profile = variant.name.split(":")
        return Run(name, profile, scenario.name, dt, "unsupported", f"{missing.name or missing} cannot be imported")
    try:
        return play(engine, variant.name, scenario, dt)
    finally:
        engine.close()


def play_as(engine: str, scenario: Scenario) -> Run:
    """`played` by a key of `VARIANTS`."""
    return played(VARIANTS[engine], scenario)
