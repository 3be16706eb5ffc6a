"""The table of reasons: why an engine fails at its limit, in a sentence with its source, and how
the reason is tested."""

from __future__ import annotations

from fnmatch import fnmatch
from math import atan, pi, sqrt
from typing import NamedTuple

from crosscheck2d.adapters.mechanisms.table import (
    DIGITS,
    FLIGHT,
    FRICTION,
    IMPULSE,
    POSITION_CORRECTION,
    RESTITUTION,
)
from crosscheck2d.reports.stability.ablations import (
    B2_SETTINGS,
    END_OF_STEP,
    THRESHOLD,
    THRESHOLDS,
)
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import NEVER_FAILS, Limit


class Reason(NamedTuple):
    """One row: the first that fits a limit is its reason.

    Attributes:
        cases, engines: patterns of names, as of files, with spaces between them.
        text: the sentence.
        source: of the sentence.
        predicts: the limit that follows from it.
        variant: an engine that differs in this alone, or in little else, and must get farther;
            "+bullets": the engine itself with bullets.
        mechanism: the one that the sentence is about, of `adapters/mechanisms/table.py`, or
            `END_OF_STEP`; an ablation that has the limit must have it.
    """

    cases: str
    engines: str
    text: str
    source: str
    predicts: float | None = None
    variant: str = ""
    mechanism: str = ""

    def fits(self, limit: Limit) -> bool:
        """Whether the row is about this case and this engine."""
        return matches(limit.case, self.cases) and matches(limit.engine, self.engines)

    def variant_of(self, engine: str) -> str:
        """The name of `variant` for an engine that has the reason."""
        return engine + self.variant if self.variant.startswith("+") else self.variant


def matches(name: str, patterns: str) -> bool:
    """Whether a name fits one of the patterns."""
    return any(fnmatch(name, pattern) for pattern in patterns.split())


DETECTING = "reference:* pymunk:* box2d:matched"
DISCRETE = (
    "contacts are detected at the ends of steps only, and missed once the centres have passed each"
    " other"
)
CHATTER = "fixed point of v' = e (v + g dt)"
CATTO = "Catto, Iterative dynamics with temporal coherence, 2005"
B3_CONSTANTS, B3_SOLVER = "Box2D 3.1 src/constants.h: ", "Box2D 3.1 src/contact_solver.c"
GEOMETRY = "geometry: (v dt)² = (2R)² - b² between disks, v dt = R at a thin wall"
EULER_OUT = (
    "explicit Euler: x' = x + v dt with the old v, and the force at the old x; the oscillator's map"
    " grows by 1 + (w dt)²"
)
QUARTER = "rotation is limited to pi/2 a step"
EIGHTH = "rotation is limited to pi/4 a step"
BY_ATAN = ", and a substep rotates by atan(w h) only"
PLANCK, RAPIER = "planck Settings.maxRotation", "a probe of it: 300 rad/s after 4 steps"
RAPIER_SPEED = (
    "Rapier IntegrationParameters: normalized_max_linear_velocity, not in the npm package"
)
B2_ROTATION = B2_SETTINGS + "b2_maxRotation"
B3_ROTATION = B3_CONSTANTS + "B2_MAX_ROTATION; pyb2d3 does not hand on b2BodyDef::allowFastRotation"
MAP = "determinant of the step's map, 1 + (w dt)² (1 - alpha); alpha of ENGINES"
SWEEP = (
    "restitution is applied in one pass after the substeps, so a disk that touches two others in a"
    " step loses energy"
)
NO_CONE = (
    "restitution is applied in one pass after the substeps, without further friction: its limit is"
    " mu times the normal impulse of the substeps, not mu (1 + e) m v"
)
FORESEEN = (
    "; a contact is foreseen within four slops, 20 mm, and where a step ends with a gap that a"
    " substep would close, the substeps have taken only a part of m v"
)
IN_TURN = (
    "the contacts of a step are solved once, one after the other: the second wall brings back slip"
    " at the first"
)
OF_FRICTION = (
    "friction_in_bounce strong_friction spin_in_bounce friction_mass_ratio slide_to_roll"
    " critical_slope creep_at_rest"
)
GASES = "dense_gas fast_gas long_gas heavy_in_gas equipartition thermometer"


def growth_limit(share: float) -> float:
    """w dt at which the mean energy doubles in 300 steps, growing by 1 + share (w dt)² a step."""
    return sqrt((2 ** (1 / 300) - 1) / share)


REASONS = (
    # One collision.
    *(
        Reason(case, f"{DETECTING} {more}", DISCRETE, GEOMETRY, limit, "+bullets", END_OF_STEP)
        for case, limit, more in (
            ("tunnelling_head_on", 2.0, "box2d_v3:matched"),
            ("tunnelling_offset", 2 * sqrt(1 - 0.49), "box2d_v3:matched"),
            ("tunnelling_thin_wall", 1.0, "box2d_v3:matched"),
            ("tunnelling_thick_wall", 11.0, "box2d_v3:matched"),
            ("grazing", 1 - sqrt(1 - 0.01), ""),
        )
    ),
    Reason(
        "tunnelling_thin_wall",
        "rapier2d:matched",
        "speed is limited to 400 of its length units a second; refused",
        RAPIER_SPEED,
        400 * 0.5 / 64,  # a length unit of half a radius, 1/64 s
    ),
    Reason(
        "tunnelling_*",
        "*",
        DISCRETE + "; disks are not swept unless one is a bullet",
        "Box2D manual, bullets",
        mechanism=END_OF_STEP,
    ),
    Reason(
        "grazing",
        "*",
        DISCRETE + "; the chord of a grazing collision is shorter than v dt",
        GEOMETRY,
        mechanism=END_OF_STEP,
    ),
    # One disk, or two.
    Reason(
        "bounce_drift",
        "pymunk:matched+position_correction",
        "the position correction at the floor adds height",
        "Munk2D src/cpSpaceStep.c, collision_bias",
        variant="pymunk:matched",
        mechanism=POSITION_CORRECTION,
    ),
    Reason(
        "bounce_drift",
        "pymunk:matched",
        "v dt exceeds the radius, and the floor is missed",
        GEOMETRY,
        mechanism=END_OF_STEP,
    ),
    Reason(
        "bounce_drift",
        "box2d:* reference:lesson",
        "the velocity after gravity is reflected: every bounce gains |v| dt of height",
        "order of operations in a step: gravity, then restitution",
        0.005,
        mechanism=IMPULSE,
    ),
    Reason(
        "bounce_drift",
        "reference:exercise",
        "a collision is found up to a step late, and the speed that gravity adds until then is"
        " reflected, too: up to |v| dt of height",
        "order of operations in a step: gravity, flight, then restitution",
        0.005,
        mechanism=FLIGHT,
    ),
    Reason(
        "bounce_drift",
        "box2d_v3:shipped",
        "the soft contact loses about |v| dt of height a bounce",
        B3_SOLVER + ", soft step",
        variant="box2d_v3:matched",
        mechanism=IMPULSE,
    ),
    Reason(
        "bounce_drift",
        "box2d_v3:matched*",
        "the soft contact loses up to |v| dt / substeps of height a bounce",
        B3_SOLVER + ", soft step",
        variant="box2d_v3:matched+16_substeps",
        mechanism=IMPULSE,
    ),
    Reason(
        "far_from_origin",
        "box2d*",
        "positions are float32: beyond 4096 m a displacement of 1/240 m is 9 units in the last"
        " place, not 8.5",
        "IEEE 754",
        4096.0,
        mechanism=DIGITS,
    ),
    Reason("spin", "box2d:shipped", QUARTER, B2_ROTATION, pi / 2 / 0.98),
    Reason("spin", "box2d:matched", QUARTER + "; refused", B2_ROTATION, pi / 2),
    Reason("spin", "planck:shipped", QUARTER, PLANCK, pi / 2 / 0.98),
    Reason("spin", "rapier2d:shipped", EIGHTH + BY_ATAN, RAPIER, 4 * atan(pi / 16) / 0.98),
    Reason("spin", "rapier2d:matched", EIGHTH + "; refused", RAPIER, pi / 4),
    Reason("spin", "box2d_v3:shipped", EIGHTH + BY_ATAN, B3_ROTATION, 4 * atan(pi / 16) / 0.98),
    Reason("spin", "box2d_v3:matched*", EIGHTH + "; refused", B3_ROTATION, pi / 4),
    # 1.7 rad/s: the spin when the thrusts have ended
    Reason("dt_body_frame_thrust", "box2d_v3:shipped", EIGHTH, B3_ROTATION, pi / 4 / 1.7),
    Reason(
        "stiff_force",
        "reference:exercise",
        "symplectic Euler is unstable from w dt = 2 on",
        "linear stability",
        2.0,
    ),
    Reason(
        "stiff_force",
        "box2d:matched",
        "the swing reaches 2 units a step, the engine's limit of displacement; refused",
        B2_SETTINGS + "b2_maxTranslation",
    ),
    Reason("stiff_force", "reference:lesson pymunk:*", EULER_OUT, MAP, growth_limit(1.0)),
    Reason(
        "stiff_force",
        "box2d_v3:*",
        "the force is constant over four substeps: the map grows by 1 + 3/8 (w dt)²",
        MAP,
        growth_limit(0.375),
    ),
    Reason(
        "stiff_force",
        "event_driven:* reference:ordered",
        "the force is constant during a step: the map grows by 1 + (w dt)² / 2",
        MAP,
        growth_limit(0.5),
    ),
    # Refused by every exact method.
    Reason(
        "*",
        "event_driven:*",
        "it refuses motions without a single continuation: overlaps, and collisions that"
        " accumulate",
        "adapters/event_driven/events.py",
    ),
    # Friction.
    Reason(
        OF_FRICTION,
        "reference:exercise reference:lesson",
        "it models no friction, and refuses the scene",
        "adapters/friction.py",
    ),
    Reason(
        "friction_in_bounce",
        "box2d_v3:shipped",
        NO_CONE + FORESEEN,
        B3_CONSTANTS + "B2_SPECULATIVE_DISTANCE",
        variant="box2d_v3:matched",
        mechanism=FRICTION,
    ),
    Reason(
        "friction_in_bounce",
        "box2d_v3:*",
        NO_CONE,
        B3_SOLVER + ": b2ApplyRestitutionTask",
        # 1 / (1 + e) of the friction is nine tenths of it
        1 / 9,
        mechanism=FRICTION,
    ),
    *(
        Reason(case, engine, text, source, limit)
        for engine, most, text, source in (
            ("box2d:*", pi / 2, QUARTER, B2_ROTATION),
            ("box2d_v3:*", pi / 4, EIGHTH, B3_ROTATION),
            ("planck:shipped", pi / 2, QUARTER, PLANCK),
            ("rapier2d:*", pi / 4, EIGHTH, RAPIER),
        )
        # the disk rolls at 2/3 of its initial speed
        for case, limit in (("spin_in_bounce", most), ("slide_to_roll", 1.5 * most))
    ),
    Reason("creep_at_rest", "reference:coulomb", IN_TURN, "reference_impl/coulomb.py"),
    # Stacks.
    Reason(
        "pile_comes_to_rest dt_*",
        "reference:ordered",
        "the number of collisions a step is limited, and unresolved ones show as overlap",
        "reference_impl/ordered.py",
    ),
    Reason(
        "overlap_recovery",
        "reference:ordered",
        "overlaps that no collision made are not corrected",
        "reference_impl/ordered.py",
    ),
    Reason(
        "column heavy_on_light",
        "reference:*",
        "each pair is projected once a step, without regard to the others",
        "exercise 11, task 2",
        mechanism=POSITION_CORRECTION,
    ),
    Reason(
        "column",
        "pymunk:*",
        "overlaps are corrected by a share per step, down to a slop a contact",
        "Munk2D src/cpArbiter.c, cpArbiterPreStep",
        mechanism=POSITION_CORRECTION,
    ),
    Reason(
        "heavy_on_light",
        "pymunk:shipped",
        "10 sequential impulses do not carry a heavy disk on a light one",
        CATTO,
        variant="pymunk:matched",
        mechanism=IMPULSE,
    ),
    Reason(
        "heavy_on_light",
        "*",
        "sequential impulses converge slowly if the masses are unequal",
        CATTO,
        mechanism=IMPULSE,
    ),
    Reason(
        "column",
        "*",
        "every contact may keep an overlap of a slop, and soft contacts yield as the load grows",
        "Box2D, b2_linearSlop; contact softness in 3.1",
        mechanism=POSITION_CORRECTION,
    ),
    Reason(
        "overfull_box",
        "*",
        "position correction moves disks beyond a wall, and from there further outwards",
        "walls have two sides",
        mechanism=POSITION_CORRECTION,
    ),
    Reason(
        "*_comes_to_rest",
        "box2d:matched",
        "without a threshold a resting disk chatters at e g dt / (1 - e)",
        CHATTER,
        variant="box2d:shipped",
    ),
    Reason(
        "*_comes_to_rest",
        "box2d:shipped",
        "chatter above the threshold of 1 m/s goes on for ever",
        CHATTER,
    ),
    Reason(
        "*_comes_to_rest",
        "reference:*",
        "gravity is added before the bounce, so a resting disk chatters",
        CHATTER,
    ),
    # Gases.
    *(
        Reason(
            GASES,
            f"{box}:shipped",
            f"{THRESHOLD}; friction",
            source,
            variant=f"{box}:matched",
            mechanism=RESTITUTION,
        )
        for box, source in THRESHOLDS.items()
    ),
    Reason(GASES, "box2d_v3:*", SWEEP, B3_SOLVER + ": b2ApplyRestitutionTask", mechanism=IMPULSE),
    *(
        Reason(
            cases,
            engines,
            "10 sequential impulses do not solve a cluster of contacts",
            CATTO,
            variant="pymunk:matched",
            mechanism=IMPULSE,
        )
        for cases, engines in (("dense_gas", "pymunk:shipped"), ("fast_gas long_gas", "pymunk:*"))
    ),
    Reason(
        "long_wrapped_gas",
        "box2d*",
        "impulses are rounded to float32, and the rounding errors add up",
        "IEEE 754",
        mechanism=DIGITS,
    ),
    Reason(
        "*_gas",
        "box2d:matched",
        "one solve has the target velocity 0 for separating contacts and e v for closing ones",
        "Box2D 2.3 Dynamics/Contacts/b2ContactSolver.cpp",
        mechanism=IMPULSE,
    ),
    Reason(
        "*_gas",
        "*",
        "sequential impulses do not solve a cluster of contacts in a step",
        CATTO,
        mechanism=IMPULSE,
    ),
    Reason(
        "thermometer",
        "*",
        "a collision is detected up to a step late, and lasts about a step too long",
        "penetration and return: one dt a collision",
        mechanism=END_OF_STEP,
    ),
    Reason(
        "equipartition",
        "*",
        "energy is lost at unequal rates by light and heavy disks",
        "e < 1 in some collisions",
    ),
    Reason(
        "insertion_order",
        "*",
        "sums and contacts follow the order of insertion, and chaos magnifies the difference",
        "Lyapunov exponent of the gas",
    ),
    Reason(
        "restart",
        "*",
        "the impulses and contacts of the last step are not part of the state that can be read",
        "warm starting: a step begins with the impulses of the last one; contact caches",
    ),
)


def reason_of(limit: Limit) -> Reason | None:
    """The first row that fits; None if nothing failed. For a user's own scene only rows that
    hold in every scene."""
    if limit.verdict == NEVER_FAILS:
        return None
    rows = (row for row in REASONS if limit.case in CASES or row.cases == "*")
    return next((row for row in rows if row.fits(limit)), None)
