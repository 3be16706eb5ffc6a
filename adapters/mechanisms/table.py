"""The mechanisms of every engine: how it differs from exact flight with end-of-step detection.

Each can be enabled in `ablated_reference.py`; some can be disabled in the engine, too. The numbers
are read from the engine. With all of its mechanisms the reference reproduces the engine, mostly to
rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import NOT_REPORTED, Engine
from crosscheck2d.adapters.engine_row import FLOAT32
from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.ablated import BOX2D, BOX2D_V3, PYMUNK, AblatedReference
from crosscheck2d.scenarios.model import Scene

FLIGHT, RESTITUTION, IMPULSE, RECYCLING = "flight", "restitution", "impulse", "contact recycling"
EDGES, FRICTION, SKIN = "edges of the box", "friction", "wall skin"
POSITION_CORRECTION, DIGITS, SWEPT = "position correction", "float32", "CCD, sleep"
AIR, SIDES = "friction of the air", "polygons for disks"
NAMES = (
    *(FLIGHT, RESTITUTION, IMPULSE, RECYCLING, EDGES, FRICTION, SKIN, POSITION_CORRECTION),
    *(DIGITS, SWEPT, AIR, SIDES),
)
MANY_SIDES = 800  # of matter's disks, which are polygons: their effect is in the residual
# Exact flight; bodies that overlap at the end of a step exchange their impulse there; nothing is
# moved out of overlap.
END_OF_STEP: dict[str, Any] = {
    "order": ("move", "accelerate", "pairs", "walls"),
    "alpha": 0.5,
    "project": False,
    "project_walls": False,
    "onto_edge": False,
}


# Of float32 engines: each move of a substep rounds the position.
ROUNDED_MOVES = ("rapier2d:shipped", "rapier2d:matched")
# Of float32 engines: the angle is stored as (cos, sin).
COS_AND_SIN = (*ROUNDED_MOVES, "box2d_v3:shipped", "box2d_v3:matched")


@dataclass(frozen=True)
class Mechanism:
    """One mechanism by which an engine differs from exact flight with end-of-step detection."""

    name: str  # one of `NAMES`
    # of `AblatedReference`; empty: the reference does not have the mechanism
    parameters: Mapping[str, Any] = field(default_factory=dict)
    on_top: tuple[str, ...] = ()  # the mechanisms on which it acts, and with which it is enabled
    # makes the engine without it, if the engine has a parameter for that; of a mechanism that the
    # reference does not have, without those before it, too
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


def _exercise(_reported: Mapping[str, Any], scene: Scene, _dt: float) -> list[Mechanism]:
    # projectObjects sets a disk that leaves onto the edge, wherever the step ends.
    return [
        *([] if scene.wrap is None else [Mechanism(EDGES, {"onto_edge": True})]),
        Mechanism(POSITION_CORRECTION, {"project": True, "project_walls": True}),
    ]


def _lesson(_reported: Mapping[str, Any], _scene: Scene, _dt: float) -> list[Mechanism]:
    # Walls come first, and reverse a velocity without moving the disk.
    return [
        Mechanism(IMPULSE, {"order": ("move", "accelerate", "walls", "pairs")}),
        Mechanism(POSITION_CORRECTION, {"project": True}),
    ]


def _without(name: str, **changed: Any) -> Callable[[], Engine]:
    return partial(row_of(name).make, **changed)


def _pymunk(reported: Mapping[str, Any], scene: Scene, dt: float, name: str) -> list[Mechanism]:
    # Its bounce reverses any speed of a contact, also a separating one (cpArbiterPreStep).
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
    uncorrected = _without(name, collision_bias=1.0)
    mechanisms = [
        Mechanism(IMPULSE, impulse),
        Mechanism(POSITION_CORRECTION, correction, (IMPULSE,), uncorrected),
    ]
    if name.endswith(":matched"):
        return mechanisms
    as_stated = _without(name, elasticity=float(np.sqrt(scene.restitution)))
    mechanisms.insert(0, Mechanism(RESTITUTION, {"mixing": "the product"}, without=as_stated))
    if scene.friction:
        rough = _without(name, friction=float(np.sqrt(scene.friction)))
        mixed = {"friction": reported["friction of a pair"]}
        mechanisms.append(Mechanism(FRICTION, mixed, without=rough))
    return mechanisms


def _box2d(reported: Mapping[str, Any], scene: Scene, dt: float, name: str) -> list[Mechanism]:
    """The mechanisms of Box2D 2.3, in float32 and as planck in float64; what is compiled into the
    one is a setting of the other."""
    if name.startswith("planck"):
        threshold, slop = reported["velocityThreshold"], reported["linearSlop"]
        cap, most = reported["maxTranslation"], reported["maxLinearCorrection"]
    else:
        threshold, slop = reported["restitution threshold in m/s"], reported["linear slop in m"]
        cap = reported["speed cap in m/s"] * dt
        most = 0.1 * cap  # b2_maxLinearCorrection 0.2 is a tenth of b2_maxTranslation, the cap
    without, shipped = partial(_without, name), name.endswith(":shipped")
    velocity, position = map(int, reported["velocity, position iterations"].split(","))
    impulse = {"order": BOX2D, "iterations": velocity, "touching": True, "cap": cap}
    correction = {
        "correction_share": 0.2 if position else 0.0,  # b2_baumgarte
        "correction_iterations": position,
        "slop": slop,
        "correction_most": most,
    }
    uncorrected = without(position_iterations=0)
    unswept = {"continuous": False, "bullet": False}
    mechanisms = [
        Mechanism(RESTITUTION, {"threshold": threshold}),
        Mechanism(IMPULSE, impulse),
        Mechanism(POSITION_CORRECTION, correction, (IMPULSE,), uncorrected),
        # before the normal impulse (b2ContactSolver::SolveVelocityConstraints)
        *_friction(name, reported, scene, rub_first=True),
    ]
    if shipped:
        # b2_polygonRadius, which an edge has, too: twice the slop.
        mechanisms.append(Mechanism(SKIN, {"skin": 2 * slop}, (IMPULSE, POSITION_CORRECTION)))
        unswept["sleeping"] = False
    if shipped or reported["continuous collision"]:
        mechanisms.append(Mechanism(SWEPT, without=without(**unswept)))
    return mechanisms


def _friction(name: str, reported: Mapping[str, Any], scene: Scene, **how: bool) -> list[Mechanism]:
    """Friction of an engine that, as shipped, has some where the scene has none. Where the two
    touch is in the middle of the gap (b2WorldManifold::Initialize, b2CollideCircles)."""
    if not scene.friction and name.endswith(":matched"):
        return []
    rubs = {"friction": reported["friction"], "lever": 0.5, **how}
    smooth = None if scene.friction else _without(name, friction=0.0)
    return [Mechanism(FRICTION, rubs, (IMPULSE,), smooth)]


def _box2d_v3(reported: Mapping[str, Any], scene: Scene, _dt: float, name: str) -> list[Mechanism]:
    from crosscheck2d.adapters.box2d_v3 import MATCHED, SHIPPED

    chosen: Mapping[str, Any] = SHIPPED if name.endswith(":shipped") else MATCHED
    # b2_speculativeDistance: four slops of 0.005 units.
    impulse = {
        "order": BOX2D_V3,
        "touching": True,
        "margin": 0.02 * reported["length unit in m"],
        "carried": True,
        "hertz": chosen["hertz"],
        "static_hertz": chosen["hertz"],
        "damping": chosen["damping_ratio"],
    }
    correction = {"correction_speed": chosen["push_speed"], "share_capped": True}
    awake = {"sleeping": False} if name.endswith(":shipped") else {}
    mechanisms = [
        Mechanism(IMPULSE, impulse),
        Mechanism(POSITION_CORRECTION, correction, (IMPULSE,)),
        # What the sweep for restitution adds to the normal impulse allows no more friction
        # (b2ApplyRestitutionTask).
        *_friction(name, reported, scene, rub_restituted=False),
        Mechanism(SWEPT, without=_without(name, continuous=False, **awake)),
    ]
    if name.endswith(":shipped"):
        # At the threshold itself it bounces, where Box2D 2.3 does not.
        stated = np.float32(reported["restitution threshold in m/s"])
        threshold = {"threshold": float(np.nextafter(stated, np.float32(0)))}
        bouncing = _without(name, restitution_threshold=0.0)
        mechanisms.insert(0, Mechanism(RESTITUTION, threshold, without=bouncing))
    return mechanisms


def _rapier(reported: Mapping[str, Any], scene: Scene, _dt: float, name: str) -> list[Mechanism]:
    """Soft substeps and one sweep for restitution, as in Box2D 3.1, with pairs that are not tested
    in every step.

    Not modelled: that each impulse is rounded to float32, which rows of collisions enlarge, and the
    order of contacts that begin in the same step.
    """
    unit = reported["length unit in m"]
    # The stiffness of contacts is that of Box2D 3.1: contact_erp is 0.1358 at 1/240 s. Friction is
    # solved without bias alone (IntegrationParameters, friction_in_bias_pass).
    impulse = {
        "order": BOX2D_V3,
        "margin": reported["prediction distance in m"],
        "carried": True,
        "rub_biased": False,
        # contact_natural_frequency leaves the stiffness of contacts with static bodies as it is
        "hertz": 30.0 if name.endswith(":shipped") else 120.0,
        "damping": 10.0,
    }
    # normalized_contact_recycle_distance, BroadPhaseBvh::CHANGE_DETECTION_FACTOR
    recycled = {
        "recycled": float(np.float32(0.05) * np.float32(unit)),
        "fattened": float(np.float32(0.04) * np.float32(unit)),
    }
    # normalized_max_corrective_velocity: 3 units of length in a second
    correction = {"correction_speed": 3.0 * unit}
    awake = {"sleeping": False} if name.endswith(":shipped") else {}
    return [
        Mechanism(RESTITUTION, {"rebounds": False}, (IMPULSE,)),
        Mechanism(IMPULSE, impulse),
        Mechanism(RECYCLING, recycled, (IMPULSE,)),
        Mechanism(POSITION_CORRECTION, correction, (IMPULSE,)),
        *_friction(name, reported, scene, rub_restituted=False),
        Mechanism(SWEPT, without=_without(name, continuous_steps=0, **awake)),
    ]


def _matter(_reported: Mapping[str, Any], scene: Scene, _dt: float, name: str) -> list[Mechanism]:
    """The mechanisms that can be disabled in matter, one after the other; the reference has none of
    them.

    Its disks are polygons, so that an impulse acts at a corner and turns them; without friction
    nothing else does. The iterations of a collision after the first stop pairs that are slow.
    """
    shipped = name.endswith(":shipped")
    steps = [
        (AIR, {"friction_air": 0} if shipped else {}),
        (FRICTION, {"friction": 0} if shipped or scene.friction else {}),
        (SIDES, {"sides": MANY_SIDES} | ({} if scene.friction else {"turning": False})),
        (RESTITUTION, {"velocity_iterations": 1}),
        (POSITION_CORRECTION, {"position_iterations": 0}),
    ]
    mechanisms, off = list[Mechanism](), dict[str, Any]()
    for mechanism, options in steps:
        if options:
            off |= options
            mechanisms.append(Mechanism(mechanism, without=_without(name, **off)))
    return mechanisms


LIBRARIES = {
    "pymunk": _pymunk,
    "box2d": _box2d,
    "box2d_v3": _box2d_v3,
    "planck": _box2d,
    "matter": _matter,
    "rapier2d": _rapier,
}
MECHANISMS: dict[str, Callable[[Mapping[str, Any], Scene, float], list[Mechanism]]] = {
    "reference:exercise": _exercise,
    "reference:lesson": _lesson,
    **{
        f"{library}:{profile}": partial(make, name=f"{library}:{profile}")
        for library, make in LIBRARIES.items()
        for profile in ("shipped", "matched")
    },
}
"""The engines whose mechanisms are known, of `ENGINES` and of `FETCHED`: a function of the settings
that the engine reports, the scene and dt in s."""
