"""The mechanisms of every engine: how it differs from exact flight with end-of-step detection.

Each can be enabled in `adapters.mechanisms.ablated_reference`; some can be disabled in the
engine, too. The numbers are read from the engine. With all of its mechanisms the reference
reproduces the engine, mostly to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from adapters.engine import NOT_REPORTED, Engine
from adapters.engine_row import FLOAT32
from adapters.engines import row_of
from adapters.mechanisms.ablated import BOX2D, BOX2D_V3, PYMUNK, AblatedReference
from scenarios.model import Scene

NAMES = (
    "flight",
    "restitution",
    "impulse",
    "contact recycling",
    "friction",
    "wall skin",
    "position correction",
    "float32",
    "CCD, sleep",
    "friction of the air",
    "polygons for disks",
)
(
    FLIGHT,
    RESTITUTION,
    IMPULSE,
    RECYCLING,
    FRICTION,
    SKIN,
    POSITION_CORRECTION,
    DIGITS,
    SWEPT,
    AIR,
    SIDES,
) = NAMES
MANY_SIDES = 800  # of matter's disks, which are polygons: their effect is in the residual
# Exact flight; bodies that overlap at the end of a step exchange their impulse there; nothing is
# moved out of overlap.
END_OF_STEP: dict[str, Any] = {
    "order": ("move", "accelerate", "pairs", "walls"),
    "alpha": 0.5,
    "project": False,
    "project_walls": False,
}


# Of float32 engines: each move of a substep rounds the position.
ROUNDED_MOVES = ("rapier2d:shipped", "rapier2d:matched")
# Of float32 engines: the angle is stored as (cos, sin).
COS_AND_SIN = (*ROUNDED_MOVES, "box2d_v3:shipped", "box2d_v3:matched")


@dataclass(frozen=True)
class Mechanism:
    """One mechanism by which an engine differs from exact flight with end-of-step detection.

    Attributes:
        name: one of `NAMES`.
        parameters: of `AblatedReference`; empty: the reference does not have the mechanism.
        on_top: the mechanisms on which it acts, and with which it is enabled.
        without: makes the engine without it, if the engine has a parameter for that; of a mechanism
            that the reference does not have, without those before it, too.
    """

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    on_top: tuple[str, ...] = ()
    without: Callable[[], Engine] | None = None


def mechanisms_of(
    name: str, settings: Mapping[str, tuple[Any, Any]], scene: Scene, dt: float
) -> list[Mechanism]:
    """The mechanisms of an engine of `MECHANISMS`, in this scene at this dt; `settings` are those
    it reported once loaded."""
    # A setting that cannot be read back has its requested value.
    resolved = {
        setting: asked if used in NOT_REPORTED else used
        for setting, (asked, used) in settings.items()
    }
    flight = Mechanism(FLIGHT, {"alpha": row_of(name).alpha})
    single = []
    if row_of(name).rounding == FLOAT32:
        digits = {"summed": name not in ROUNDED_MOVES, "tangent": name in COS_AND_SIN}
        single = [Mechanism(DIGITS, {"precision": np.float32, **digits})]
    return [flight, *MECHANISMS[name](resolved, scene, dt), *single]


def with_mechanisms(mechanisms: Sequence[Mechanism]) -> AblatedReference:
    """The ablated reference with these mechanisms, as far as it has parameters for them."""
    parameters = dict(END_OF_STEP)
    for mechanism in mechanisms:
        parameters |= mechanism.parameters
    return AblatedReference(**parameters)


def _exercise(_reported: Mapping[str, Any], _scene: Scene, _dt: float) -> list[Mechanism]:
    return [Mechanism(POSITION_CORRECTION, {"project": True, "project_walls": True})]


def _lesson(_reported: Mapping[str, Any], _scene: Scene, _dt: float) -> list[Mechanism]:
    # Walls come first, and reverse a velocity without moving the disk.
    return [
        Mechanism(IMPULSE, {"order": ("move", "accelerate", "walls", "pairs")}),
        Mechanism(POSITION_CORRECTION, {"project": True}),
    ]


def _pymunk(reported: Mapping[str, Any], _scene: Scene, dt: float, profile: str) -> list[Mechanism]:
    from adapters.pymunk import Pymunk

    # Its bounce reverses any speed of a contact, also a separating one
    # (cpArbiterPreStep).
    impulse = {
        "order": PYMUNK,
        "iterations": reported["iterations"],
        "threshold": -np.inf,
        "memory": reported["collision_persistence"],
    }
    correction = {
        "correction_share": 1.0 - reported["collision_bias"] ** dt,
        "slop": reported["collision_slop"],
    }
    return [
        Mechanism(IMPULSE, impulse),
        Mechanism(
            POSITION_CORRECTION,
            correction,
            (IMPULSE,),
            partial(Pymunk, profile, collision_bias=1.0),
        ),
    ]


def _pymunk_shipped(reported: Mapping[str, Any], scene: Scene, dt: float) -> list[Mechanism]:
    from adapters.pymunk import Pymunk

    as_stated = partial(Pymunk, "shipped", elasticity=float(np.sqrt(scene.restitution)))
    rough = partial(Pymunk, "shipped", friction=float(np.sqrt(scene.friction)))
    mixed = [Mechanism(FRICTION, {"friction": reported["friction of a pair"]}, without=rough)]
    return [
        Mechanism(RESTITUTION, {"mixing": "the product"}, without=as_stated),
        *_pymunk(reported, scene, dt, "shipped"),
        *(mixed if scene.friction else []),
    ]


def _box2d(reported: Mapping[str, Any], _scene: Scene, dt: float, profile: str) -> list[Mechanism]:
    from adapters.box2d import Box2DEngine

    velocity, position = (
        int(count) for count in reported["velocity, position iterations"].split(",")
    )
    cap = reported["speed cap in m/s"] * dt
    impulse = {"order": BOX2D, "iterations": velocity, "touching": True, "cap": cap}
    # b2_baumgarte 0.2; b2_maxLinearCorrection 0.2 is a tenth of b2_maxTranslation, the cap.
    correction = {
        "correction_share": 0.2 if position else 0.0,
        "correction_iterations": position,
        "slop": reported["linear slop in m"],
        "correction_most": 0.1 * cap,
    }
    without = partial(Box2DEngine, profile, position_iterations=0, elastic_position_iterations=0)
    return [
        Mechanism(RESTITUTION, {"threshold": reported["restitution threshold in m/s"]}),
        Mechanism(IMPULSE, impulse),
        Mechanism(POSITION_CORRECTION, correction, (IMPULSE,), without),
    ]


def _box2d_matched(reported: Mapping[str, Any], scene: Scene, dt: float) -> list[Mechanism]:
    from adapters.box2d import Box2DEngine

    unswept = partial(
        Box2DEngine,
        "matched",
        continuous=False,
        bullet=False,
        elastic_continuous=False,
        elastic_bullet=False,
    )
    swept = [Mechanism(SWEPT, without=unswept)] if reported["continuous collision"] else []
    rubbed = _box2d_friction(reported) if scene.friction else []
    return [*_box2d(reported, scene, dt, "matched"), *rubbed, *swept]


def _box2d_friction(
    reported: Mapping[str, Any], without: Callable[[], Engine] | None = None
) -> list[Mechanism]:
    # Where the two touch is in the middle of the gap (b2WorldManifold::Initialize); friction is
    # solved before the normal impulse (b2ContactSolver::SolveVelocityConstraints).
    rubs = {"friction": reported["friction"], "lever": 0.5, "rub_first": True}
    return [Mechanism(FRICTION, rubs, (IMPULSE,), without)]


def _box2d_shipped(reported: Mapping[str, Any], scene: Scene, dt: float) -> list[Mechanism]:
    from adapters.box2d import Box2DEngine

    shipped = partial(Box2DEngine, "shipped")
    return [
        *_box2d(reported, scene, dt, "shipped"),
        *_box2d_friction(reported, None if scene.friction else partial(shipped, friction=0.0)),
        # b2_polygonRadius, which an edge has, too: twice the slop.
        Mechanism(SKIN, {"skin": 2 * reported["linear slop in m"]}, (IMPULSE, POSITION_CORRECTION)),
        Mechanism(
            SWEPT,
            without=partial(shipped, continuous=False, elastic_continuous=False, sleeping=False),
        ),
    ]


def _box2d_v3(reported: Mapping[str, Any], chosen: Mapping[str, Any]) -> list[Mechanism]:
    # b2_speculativeDistance: four slops of 0.005 units.
    impulse = {
        "order": BOX2D_V3,
        "touching": True,
        "margin": 0.02 * reported["length unit in m"],
        "carried": True,
        "hertz": chosen["hertz"],
        "damping": chosen["damping_ratio"],
    }
    return [
        Mechanism(IMPULSE, impulse),
        Mechanism(POSITION_CORRECTION, {"correction_speed": chosen["push_speed"]}, (IMPULSE,)),
    ]


def _box2d_v3_friction(
    reported: Mapping[str, Any], without: Callable[[], Engine] | None = None
) -> list[Mechanism]:
    # Where the two touch is in the middle of the gap (b2CollideCircles); what the sweep for
    # restitution adds to the normal impulse allows no more friction (b2ApplyRestitutionTask).
    rubs = {"friction": reported["friction"], "lever": 0.5, "rub_restituted": False}
    return [Mechanism(FRICTION, rubs, (IMPULSE,), without)]


def _box2d_v3_matched(reported: Mapping[str, Any], scene: Scene, _dt: float) -> list[Mechanism]:
    from adapters.box2d_v3 import MATCHED

    rubbed = _box2d_v3_friction(reported) if scene.friction else []
    return [*_box2d_v3(reported, MATCHED), *rubbed]


def _box2d_v3_shipped(reported: Mapping[str, Any], scene: Scene, _dt: float) -> list[Mechanism]:
    from adapters.box2d_v3 import SHIPPED, Box2DV3

    shipped = partial(Box2DV3, "shipped")
    # At the threshold itself it bounces, where Box2D 2.3 does not.
    threshold = float(
        np.nextafter(np.float32(reported["restitution threshold in m/s"]), np.float32(0))
    )
    return [
        Mechanism(
            RESTITUTION,
            {"threshold": threshold},
            without=partial(shipped, restitution_threshold=0.0),
        ),
        *_box2d_v3(reported, SHIPPED),
        *_box2d_v3_friction(reported, None if scene.friction else partial(shipped, friction=0.0)),
        Mechanism(SWEPT, without=partial(shipped, continuous=False, sleeping=False)),
    ]


def _planck(reported: Mapping[str, Any], scene: Scene, _dt: float, profile: str) -> list[Mechanism]:
    """The mechanisms of Box2D 2.3 in float64; its compiled-in numbers are settings here."""
    made = partial(_javascript, "planck", profile)
    still = {"continuous": False, "bullet": False}
    still |= {f"elastic_{name}": value for name, value in still.items()}
    velocity, position = reported["velocity, position iterations"].split(",")
    impulse = {
        "order": BOX2D,
        "iterations": int(velocity),
        "touching": True,
        "cap": reported["maxTranslation"],
    }
    correction = {
        "correction_share": 0.2 if int(position) else 0.0,  # Settings.baumgarte
        "correction_iterations": int(position),
        "slop": reported["linearSlop"],
        "correction_most": reported["maxLinearCorrection"],
    }
    uncorrected = made(position_iterations=0, elastic_position_iterations=0)
    common = [
        Mechanism(RESTITUTION, {"threshold": reported["velocityThreshold"]}),
        Mechanism(IMPULSE, impulse),
        Mechanism(POSITION_CORRECTION, correction, (IMPULSE,), uncorrected),
    ]
    if profile == "matched":
        rubbed = _box2d_friction(reported) if scene.friction else []
        swept = [Mechanism(SWEPT, without=made(**still))]
        return [*common, *rubbed, *(swept if reported["continuous collision"] else [])]
    return [
        *common,
        *_box2d_friction(reported, None if scene.friction else made(friction=0.0)),
        Mechanism(SKIN, {"skin": 2 * reported["linearSlop"]}, (IMPULSE, POSITION_CORRECTION)),
        Mechanism(SWEPT, without=made(**still, sleeping=False)),
    ]


def _rapier(reported: Mapping[str, Any], scene: Scene, _dt: float, profile: str) -> list[Mechanism]:
    """Soft substeps and one sweep for restitution, as in Box2D 3.1, with pairs that are not tested
    in every step.

    Not modelled: that each impulse is rounded to float32, which rows of collisions enlarge, and the
    order of contacts that begin in the same step.
    """
    made, unit = partial(_javascript, "rapier2d", profile), reported["length unit in m"]
    # The stiffness of contacts is that of Box2D 3.1: contact_erp is 0.1358 at 1/240 s. Friction is
    # solved without bias alone (IntegrationParameters, friction_in_bias_pass).
    impulse = {
        "order": BOX2D_V3,
        "margin": reported["prediction distance in m"],
        "carried": True,
        "rub_biased": False,
        "hertz": 30.0,
        "damping": 10.0,
    }
    # normalized_contact_recycle_distance, BroadPhaseBvh::CHANGE_DETECTION_FACTOR
    recycled = {
        "recycled": float(np.float32(0.05) * np.float32(unit)),
        "fattened": float(np.float32(0.04) * np.float32(unit)),
    }
    # normalized_max_corrective_velocity: 3 units of length in a second
    correction = {"correction_speed": 3.0 * unit}
    swept = made(continuous_steps=0, **({"sleeping": False} if profile == "shipped" else {}))
    rubbed = _box2d_v3_friction(reported, None if scene.friction else made(friction=0.0))
    return [
        Mechanism(RESTITUTION, {"rebounds": False}, (IMPULSE,)),
        Mechanism(IMPULSE, impulse),
        Mechanism(RECYCLING, recycled, (IMPULSE,)),
        Mechanism(POSITION_CORRECTION, correction, (IMPULSE,)),
        *(rubbed if scene.friction or profile == "shipped" else []),
        Mechanism(SWEPT, without=swept),
    ]


def _matter(
    _reported: Mapping[str, Any], scene: Scene, _dt: float, profile: str
) -> list[Mechanism]:
    """The mechanisms that can be disabled in matter, one after the other; the reference has none of
    them.

    Its disks are polygons, so that an impulse acts at a corner and turns them; without friction
    nothing else does. The iterations of a collision after the first stop pairs that are slow.
    """
    air = {"friction_air": 0} if profile == "shipped" else {}
    smooth = {"friction": 0} if profile == "shipped" or scene.friction else {}
    turning = {} if scene.friction else {"turning": False}
    steps = [
        (AIR, air),
        (FRICTION, smooth),
        (SIDES, {"sides": MANY_SIDES, **turning}),
        (RESTITUTION, {"velocity_iterations": 1}),
        (POSITION_CORRECTION, {"position_iterations": 0}),
    ]
    found, off = list[Mechanism](), dict[str, Any]()
    for name, options in steps:
        if options:
            off |= options
            found.append(Mechanism(name, without=_javascript("matter", profile, **off)))
    return found


def _javascript(name: str, profile: str, **changed: Any) -> Callable[[], Engine]:
    """Makes the engine of a row of `FETCHED` with these changes."""
    return partial(row_of(f"{name}:{profile}").make, **changed)


MECHANISMS: dict[str, Callable[[Mapping[str, Any], Scene, float], list[Mechanism]]] = {
    "reference:exercise": _exercise,
    "reference:lesson": _lesson,
    "pymunk:shipped": _pymunk_shipped,
    "pymunk:matched": partial(_pymunk, profile="matched"),
    "box2d:shipped": _box2d_shipped,
    "box2d:matched": _box2d_matched,
    "box2d_v3:shipped": _box2d_v3_shipped,
    "box2d_v3:matched": _box2d_v3_matched,
    "planck:shipped": partial(_planck, profile="shipped"),
    "planck:matched": partial(_planck, profile="matched"),
    "matter:shipped": partial(_matter, profile="shipped"),
    "matter:matched": partial(_matter, profile="matched"),
    "rapier2d:shipped": partial(_rapier, profile="shipped"),
    "rapier2d:matched": partial(_rapier, profile="matched"),
}
"""The engines whose mechanisms are known, of `ENGINES` and of `FETCHED`: a function of the settings
that the engine reports, the scene and dt in s."""
