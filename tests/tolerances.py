"""Every known departure of an engine from the scenes it is given, with its size and its cause:
strict both ways."""

from __future__ import annotations

from math import atan, cos, hypot, pi, sin
from typing import NamedTuple

FLOAT32, FLOAT64 = 2.0**-24, 2.0**-53


class Departure(NamedTuple):
    """One probe that an engine refuses or does not keep.

    Attributes:
        engine: a key of `ENGINES`.
        probe: a key of `PROBES`.
        value: what the cause makes the probe read, or "refused".
        bound: how far rounding may take the reading from it.
        why: the cause, verified by turning it off or by its formula in test_conformance.py.
        source: where the engine says so.
    """

    engine: str
    probe: str
    value: float | str
    bound: float
    why: str
    source: str


PRODUCT = "the elasticities of the two shapes are multiplied, so e on every shape gives e2"
THRESHOLD = "collisions that close at less than 1 m/s are taken as inelastic"
ASLEEP = "a disk below the sleep tolerance for 0.5 s is put to sleep, and its velocity set to 0"
CAP = "a disk moves at most 2 units of length a step; the velocity is cut, not only the path"
NO_FRICTION_IN_BOUNCE = (
    "every shape has friction 0.6, bounded by the normal impulse before restitution is added: 0.6 /"
    " (1 + e)"
)
CONE_WITHOUT_E = (
    "friction is bounded by the normal impulse before restitution is added: mu / (1 + e)"
)
PRODUCT_OF_FRICTION = (
    "the frictions of the two shapes are multiplied, so mu on every shape gives mu2"
)
CARRIED_OFF = (
    "a gap is measured between the points that touched, which turn with the disk: it seems wider by"
    " r (1 - cos), so that a disk which turns is pressed less"
)
NORMALISED_EULER = (
    "(cos, sin) += w h (-sin, cos) and then normalised turns by atan(w h) a substep h = dt / 4"
)

STUCK = (
    "the default friction of a shape stops the sliding in the collision: it takes a third of the"
    " tangential velocity, as a disk turns, where (1 + e) of the normal one is taken"
)


def share_that_sticks(normal: float, tangential: float) -> float:
    """Tangential share of the impulse of a collision with e = 0.9 that ends without sliding."""
    return tangential / 3 / hypot(tangential / 3, 1.9 * normal)


MUNK_ARBITER = "Munk2D src/cpArbiter.c, cpArbiterUpdate: arb->e = a->e * b->e"
BOX2D_SETTINGS = "Box2D 2.3 Common/b2Settings.h: "
TURN = (
    "a disk turns at most by a quarter (3.1: an eighth) of a circle a step; the spin is cut, and"
    " matched refuses"
)
MAX_ROTATION = "Box2D 3.1 src/constants.h: B2_MAX_ROTATION (0.25f * B2_PI)"
BOX2D_TYPES = "Box2D 3.1 src/types.c: "

DEPARTURES = [
    # Two equal roundings of e2 in float64, in velocities of the order of the closing speed.
    *(
        Departure("pymunk:shipped", probe, 0.25, 8 * FLOAT64, PRODUCT, MUNK_ARBITER)
        for probe in (
            "restitution_0.01",
            "restitution_0.1",
            "restitution_0.5",
            "restitution_2",
            "restitution_10",
            "restitution_100",
            "restitution_wall",
        )
    ),
    *(
        Departure("pymunk:shipped", probe, 0.81, 8 * FLOAT64, PRODUCT, MUNK_ARBITER)
        for probe in ("pair_keeps_e", "wall_keeps_e")
    ),
    # The point that touches is off by up to v dt = 0.004 radii of a pair.
    *(
        Departure(engine, probe, share, 0.004, STUCK, source)
        for engine, source in (
            ("box2d:shipped", "Box2D 2.3 Dynamics/b2Fixture.h: b2FixtureDef, friction = 0.2f"),
            ("box2d_v3:shipped", BOX2D_TYPES + "b2DefaultSurfaceMaterial, friction = 0.6f"),
        )
        for probe, share in (
            ("off_centre_is_normal", share_that_sticks(2 * cos(pi / 6), 2 * sin(pi / 6))),
            ("wall_is_normal", share_that_sticks(10.0, 6.0)),
        )
    ),
    # What stops does so exactly: the two velocities of an inelastic collision agree to rounding in
    # float32.
    *(
        Departure(engine, probe, 0.0, 8 * FLOAT32, THRESHOLD, source)
        for engine, source in (
            ("box2d:shipped", BOX2D_SETTINGS + "b2_velocityThreshold 1.0f"),
            ("box2d_v3:shipped", BOX2D_TYPES + "b2DefaultWorldDef, restitutionThreshold = 1 m/s"),
        )
        for probe in ("restitution_0.01", "restitution_0.1", "restitution_0.5")
    ),
    Departure(
        "box2d:shipped",
        "slow_flight",
        0.0,
        0.0,
        ASLEEP,
        BOX2D_SETTINGS + "b2_linearSleepTolerance 0.01f",
    ),
    Departure(
        "box2d_v3:shipped",
        "slow_flight",
        0.0,
        0.0,
        ASLEEP,
        BOX2D_TYPES + "b2DefaultBodyDef, sleepThreshold = 0.05 m/s",
    ),
    # 2 units in 1/64 s, cut by a float32 ratio.
    Departure(
        "box2d:shipped",
        "fast_flight",
        128.0,
        128 * 4 * FLOAT32,
        CAP,
        BOX2D_SETTINGS + "b2_maxTranslation 2.0f",
    ),
    Departure(
        "box2d_v3:shipped",
        "fast_flight",
        400.0,
        400 * 4 * FLOAT32,
        "a disk is no faster than 400 m/s",
        BOX2D_TYPES + "b2DefaultWorldDef, maximumLinearSpeed = 4 m * 100 / s",
    ),
    # A quarter or half a turn a step, cut by a float32 ratio.
    Departure(
        "box2d:shipped",
        "fast_spin",
        32 * pi,
        32 * pi * 4 * FLOAT32,
        TURN,
        BOX2D_SETTINGS + "b2_maxRotation",
    ),
    Departure(
        "box2d:matched",
        "fast_spin",
        "refused",
        0.0,
        TURN,
        BOX2D_SETTINGS + "b2_maxRotation (0.5f * b2_pi)",
    ),
    Departure("box2d_v3:shipped", "fast_spin", 16 * pi, 16 * pi * 4 * FLOAT32, TURN, MAX_ROTATION),
    Departure("box2d_v3:matched", "fast_spin", "refused", 0.0, TURN, MAX_ROTATION),
    # A ratio of two momenta that round as often as a collision does.
    Departure(
        "box2d:shipped",
        "friction",
        0.2,
        8 * FLOAT32,
        "every shape has friction 0.2, and the pair sqrt(0.2 * 0.2)",
        "Box2D 2.3 Dynamics/b2Fixture.h: b2FixtureDef, friction = 0.2f",
    ),
    Departure(
        "box2d_v3:shipped",
        "friction",
        0.6 / 1.5,
        8 * FLOAT32,
        NO_FRICTION_IN_BOUNCE,
        BOX2D_TYPES
        + "b2DefaultSurfaceMaterial, friction = 0.6f; src/contact_solver.c: b2ApplyRestitutionTask",
    ),
    # A ratio of two momenta that round as often as a collision does; or, at rest, some speeds of 4
    # m/s.
    *(
        Departure(
            "pymunk:shipped",
            probe,
            0.04,
            512 * FLOAT64,
            PRODUCT_OF_FRICTION,
            "Munk2D src/cpArbiter.c, cpArbiterUpdate: arb->u = a->u * b->u",
        )
        for probe in ("friction_0", "friction_0.5", "friction_1", "friction_at_rest")
    ),
    *(
        Departure(
            engine,
            f"friction_{e:g}",
            0.2 / (1 + e),
            8 * FLOAT32,
            CONE_WITHOUT_E,
            "Box2D 3.1 src/contact_solver.c: b2ApplyRestitutionTask",
        )
        for engine in ("box2d_v3:shipped", "box2d_v3:matched")
        for e in (0.5, 1.0)
    ),
    # Which of 256 substeps press the disk hangs on digits of float32.
    Departure(
        "box2d_v3:matched",
        "friction_at_rest",
        0.19878,
        1e-5,
        CARRIED_OFF,
        "Box2D 3.1 src/contact_solver.c: b2SolveContactTwoPointsTask, moving anchors",
    ),
    # 1024 substeps, each of which rounds cos and sin.
    *(
        Departure(
            engine,
            "spins_freely",
            1024 * atan(20 / 1024),
            1024 * FLOAT32,
            NORMALISED_EULER,
            "Box2D 3.1 include/box2d/math_functions.h: b2IntegrateRotation",
        )
        for engine in ("box2d_v3:shipped", "box2d_v3:matched")
    ),
]
