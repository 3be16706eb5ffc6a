"""What every engine does otherwise than exact flight with collisions found at the end of a step: switch by switch.

Each habit can be switched on in `adapters.mechanisms.ablated_reference`; some can be switched off in the engine, too.
The numbers are read off the engine. With all of its habits the reference plays what the engine plays, mostly to
rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from adapters.engine import FLOAT32, NOT_TOLD, Engine
from adapters.engines import row_of
from adapters.mechanisms.switched import BOX2D, BOX2D_V3, PYMUNK, Switched
from scenarios.model import Scene

NAMES = (
    "flight", "restitution", "impulse", "friction", "wall skin", "position correction", "float32", "CCD, sleep",
)  # fmt: skip
FLIGHT, RESTITUTION, IMPULSE, FRICTION, SKIN, POSITION_CORRECTION, DIGITS, SWEPT = NAMES
# Exact flight; what overlaps at the end of a step gets its impulse there and then; nothing is moved out of it.
LATE: dict[str, Any] = {
    "order": ("move", "accelerate", "pairs", "walls"), "alpha": 0.5, "project": False, "project_walls": False,
}  # fmt: skip


@dataclass(frozen=True)
class Habit:
    """One thing an engine does otherwise.

    Attributes:
        name: one of `NAMES`.
        switches: of `Switched`; none: the reference has no switch for it.
        on_top: the habits it acts on, and is therefore switched on with.
        without: makes the engine without it, where it has a parameter for that.
    """

    name: str
    switches: Mapping[str, Any] = field(default_factory=dict)
    on_top: tuple[str, ...] = ()
    without: Callable[[], Engine] | None = None


def habits_of(name: str, settings: Mapping[str, tuple[Any, Any]], scene: Scene, dt: float) -> list[Habit]:
    """The habits of an engine in `HABITS`, in this scene at this dt; `settings` are those it told once loaded."""
    # What cannot be read back is as it was asked for.
    resolved = {setting: asked if used in NOT_TOLD else used for setting, (asked, used) in settings.items()}
    flight = Habit(FLIGHT, {"alpha": row_of(name).alpha})
    single = [Habit(DIGITS, {"precision": np.float32})] if row_of(name).rounding == FLOAT32 else []
    return [flight, *HABITS[name](resolved, scene, dt), *single]


def with_habits(habits: Sequence[Habit]) -> Switched:
    """The reference with all these habits that it has switches for."""
    switches = dict(LATE)
    for habit in habits:
        switches |= habit.switches
    return Switched(**switches)


def _exercise(_told: Mapping[str, Any], _scene: Scene, _dt: float) -> list[Habit]:
    return [Habit(POSITION_CORRECTION, {"project": True, "project_walls": True})]


def _lesson(_told: Mapping[str, Any], _scene: Scene, _dt: float) -> list[Habit]:
    # Walls come first, and flip a velocity without moving the disk.
    return [
        Habit(IMPULSE, {"order": ("move", "accelerate", "walls", "pairs")}),
        Habit(POSITION_CORRECTION, {"project": True}),
    ]


def _pymunk(told: Mapping[str, Any], _scene: Scene, dt: float, profile: str) -> list[Habit]:
    from adapters.pymunk import Pymunk

    # Its bounce reverses whatever speed a contact has, also one at which the two part (cpArbiterPreStep).
    impulse = {
        "order": PYMUNK, "iterations": told["iterations"], "threshold": -np.inf,
        "memory": told["collision_persistence"],
    }  # fmt: skip
    correction = {"correction_share": 1.0 - told["collision_bias"] ** dt, "slop": told["collision_slop"]}
    return [
        Habit(IMPULSE, impulse),
        Habit(POSITION_CORRECTION, correction, (IMPULSE,), partial(Pymunk, profile, collision_bias=1.0)),
    ]


def _pymunk_shipped(told: Mapping[str, Any], scene: Scene, dt: float) -> list[Habit]:
    from adapters.pymunk import Pymunk

    as_stated = partial(Pymunk, "shipped", elasticity=float(np.sqrt(scene.restitution)))
    return [Habit(RESTITUTION, {"mixing": "the product"}, without=as_stated), *_pymunk(told, scene, dt, "shipped")]


def _box2d(told: Mapping[str, Any], _scene: Scene, dt: float, profile: str) -> list[Habit]:
    from adapters.box2d import Box2DEngine

    velocity, position = (int(count) for count in told["velocity, position iterations"].split(","))
    cap = told["speed cap in m/s"] * dt
    impulse = {"order": BOX2D, "iterations": velocity, "touching": True, "cap": cap}
    # b2_baumgarte 0.2; b2_maxLinearCorrection 0.2 is a tenth of b2_maxTranslation, the cap.
    correction = {
        "correction_share": 0.2 if position else 0.0, "correction_iterations": position, "slop": told["linear slop in m"],
        "correction_most": 0.1 * cap,
    }  # fmt: skip
    without = partial(Box2DEngine, profile, position_iterations=0, elastic_position_iterations=0)
    return [
        Habit(RESTITUTION, {"threshold": told["restitution threshold in m/s"]}),
        Habit(IMPULSE, impulse),
        Habit(POSITION_CORRECTION, correction, (IMPULSE,), without),
    ]


def _box2d_matched(told: Mapping[str, Any], scene: Scene, dt: float) -> list[Habit]:
    from adapters.box2d import Box2DEngine

    unswept = partial(
        Box2DEngine, "matched", continuous=False, bullet=False, elastic_continuous=False, elastic_bullet=False
    )
    swept = [Habit(SWEPT, without=unswept)] if told["continuous collision"] else []
    return [*_box2d(told, scene, dt, "matched"), *swept]


def _box2d_shipped(told: Mapping[str, Any], scene: Scene, dt: float) -> list[Habit]:
    from adapters.box2d import Box2DEngine

    shipped = partial(Box2DEngine, "shipped")
    return [
        *_box2d(told, scene, dt, "shipped"),
        Habit(FRICTION, {"friction": told["friction"]}, (IMPULSE,), partial(shipped, friction=0.0)),
        # b2_polygonRadius, which an edge has, too: twice the slop.
        Habit(SKIN, {"skin": 2 * told["linear slop in m"]}, (IMPULSE, POSITION_CORRECTION)),
        Habit(SWEPT, without=partial(shipped, continuous=False, elastic_continuous=False, sleeping=False)),
    ]


def _box2d_v3(told: Mapping[str, Any], chosen: Mapping[str, Any]) -> list[Habit]:
    # b2_speculativeDistance: four slops of 0.005 units.
    impulse = {
        "order": BOX2D_V3, "touching": True, "margin": 0.02 * told["length unit in m"], "hertz": chosen["hertz"],
        "damping": chosen["damping_ratio"],
    }  # fmt: skip
    return [Habit(IMPULSE, impulse), Habit(POSITION_CORRECTION, {"push_speed": chosen["push_speed"]}, (IMPULSE,))]


def _box2d_v3_matched(told: Mapping[str, Any], _scene: Scene, _dt: float) -> list[Habit]:
    from adapters.box2d_v3 import MATCHED

    return _box2d_v3(told, MATCHED)


def _box2d_v3_shipped(told: Mapping[str, Any], _scene: Scene, _dt: float) -> list[Habit]:
    from adapters.box2d_v3 import SHIPPED, Box2DV3

    shipped = partial(Box2DV3, "shipped")
    # At the threshold itself it bounces, where Box2D 2.3 does not.
    threshold = float(np.nextafter(np.float32(told["restitution threshold in m/s"]), np.float32(0)))
    return [
        Habit(RESTITUTION, {"threshold": threshold}, without=partial(shipped, restitution_threshold=0.0)),
        *_box2d_v3(told, SHIPPED),
        Habit(FRICTION, {"friction": told["friction"]}, (IMPULSE,), partial(shipped, friction=0.0)),
        Habit(SWEPT, without=partial(shipped, continuous=False, sleeping=False)),
    ]


HABITS: dict[str, Callable[[Mapping[str, Any], Scene, float], list[Habit]]] = {
    "reference:exercise": _exercise,
    "reference:lesson": _lesson,
    "pymunk:shipped": _pymunk_shipped,
    "pymunk:matched": partial(_pymunk, profile="matched"),
    "box2d:shipped": _box2d_shipped,
    "box2d:matched": _box2d_matched,
    "box2d_v3:shipped": _box2d_v3_shipped,
    "box2d_v3:matched": _box2d_v3_matched,
}
"""The engines whose habits are known."""
