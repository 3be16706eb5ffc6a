"""Why an engine fails at its limit: a row says which engines fail so in which cases, the id of its
cause, the limit that follows from it, and the engine or variant that shows it."""

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
from crosscheck2d.reports.compare.causes import B2_SETTINGS, LATE, THRESHOLD, THRESHOLDS
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import NEVER_FAILS, Limit


class Law(NamedTuple):
    text: str  # what happens
    source: str
    # of adapters/mechanisms, or `LATE`: an ablation that has the limit must have it
    mechanism: str = ""


GEOMETRY = "geometry: (v dt)² = (2R)² - b² between disks, v dt = R at a thin wall"
DISCRETE = (
    "contacts are detected at the ends of steps only, and missed once the centres have passed each"
    " other"
)
CHATTER = "fixed point of v' = e (v + g dt)"
CATTO = "Catto, Iterative dynamics with temporal coherence, 2005"
B3_CONSTANTS, B3_SOLVER = "Box2D 3.1 src/constants.h: ", "Box2D 3.1 src/contact_solver.c"
APPLY = B3_SOLVER + ": b2ApplyRestitutionTask"
MAP = "determinant of the step's map, 1 + (w dt)² (1 - alpha); alpha of ENGINES"
QUARTER = "rotation is limited to pi/2 a step"
EIGHTH = "rotation is limited to pi/4 a step"
BY_ATAN = EIGHTH + ", and a substep rotates by atan(w h) only"
B2_ROTATION = B2_SETTINGS + "b2_maxRotation"
B3_ROTATION = B3_CONSTANTS + "B2_MAX_ROTATION; pyb2d3 does not hand on b2BodyDef::allowFastRotation"
PLANCK, RAPIER = "planck Settings.maxRotation", "a probe of it: 300 rad/s after 4 steps"
NO_CONE = (
    "restitution is applied in one pass after the substeps, without further friction: its limit is"
    " mu times the normal impulse of the substeps, not mu (1 + e) m v"
)
FORESEEN = (
    "; a contact is foreseen within four slops, 20 mm, and where a step ends with a gap that a"
    " substep would close, the substeps have taken only a part of m v"
)
LAWS = {
    "discrete": Law(DISCRETE, GEOMETRY, LATE),
    "no_bullet": Law(
        DISCRETE + "; disks are not swept unless one is a bullet", "Box2D manual, bullets", LATE
    ),
    "chord": Law(
        DISCRETE + "; the chord of a grazing collision is shorter than v dt", GEOMETRY, LATE
    ),
    "speed_cap": Law(
        "speed is limited to 400 of its length units a second; refused",
        "Rapier IntegrationParameters: normalized_max_linear_velocity, not in the npm package",
    ),
    "floor_corrected": Law(
        "the position correction at the floor adds height",
        "Munk2D src/cpSpaceStep.c, collision_bias",
        POSITION_CORRECTION,
    ),
    "floor_missed": Law("v dt exceeds the radius, and the floor is missed", GEOMETRY, LATE),
    "gravity_reflected": Law(
        "the velocity after gravity is reflected: every bounce gains |v| dt of height",
        "order of operations in a step: gravity, then restitution",
        IMPULSE,
    ),
    "gravity_until_found": Law(
        "a collision is found up to a step late, and the speed that gravity adds until then is"
        " reflected, too: up to |v| dt of height",
        "order of operations in a step: gravity, flight, then restitution",
        FLIGHT,
    ),
    "soft": Law(
        "the soft contact loses about |v| dt of height a bounce",
        B3_SOLVER + ", soft step",
        IMPULSE,
    ),
    "soft_substeps": Law(
        "the soft contact loses up to |v| dt / substeps of height a bounce",
        B3_SOLVER + ", soft step",
        IMPULSE,
    ),
    "far": Law(
        "positions are float32: beyond 4096 m a displacement of 1/240 m is 9 units in the last"
        " place, not 8.5",
        "IEEE 754",
        DIGITS,
    ),
    "b2_quarter": Law(QUARTER, B2_ROTATION),
    "b2_quarter_refused": Law(QUARTER + "; refused", B2_ROTATION),
    "planck_quarter": Law(QUARTER, PLANCK),
    "b3_eighth": Law(EIGHTH, B3_ROTATION),
    "b3_eighth_atan": Law(BY_ATAN, B3_ROTATION),
    "b3_eighth_refused": Law(EIGHTH + "; refused", B3_ROTATION),
    "rapier_eighth": Law(EIGHTH, RAPIER),
    "rapier_eighth_atan": Law(BY_ATAN, RAPIER),
    "rapier_eighth_refused": Law(EIGHTH + "; refused", RAPIER),
    "symplectic": Law("symplectic Euler is unstable from w dt = 2 on", "linear stability"),
    "swing_cap": Law(
        "the swing reaches 2 units a step, the engine's limit of displacement; refused",
        B2_SETTINGS + "b2_maxTranslation",
    ),
    "explicit": Law(
        "explicit Euler: x' = x + v dt with the old v, and the force at the old x; the oscillator's"
        " map grows by 1 + (w dt)²",
        MAP,
    ),
    "four_substeps": Law(
        "the force is constant over four substeps: the map grows by 1 + 3/8 (w dt)²", MAP
    ),
    "constant_force": Law(
        "the force is constant during a step: the map grows by 1 + (w dt)² / 2", MAP
    ),
    "no_continuation": Law(
        "it refuses motions without a single continuation: overlaps, and collisions that"
        " accumulate",
        "adapters/event_driven/events.py",
    ),
    "no_friction": Law("it models no friction, and refuses the scene", "adapters/friction.py"),
    "no_cone_foreseen": Law(NO_CONE + FORESEEN, B3_CONSTANTS + "B2_SPECULATIVE_DISTANCE", FRICTION),
    "no_cone": Law(NO_CONE, APPLY, FRICTION),
    "in_turn": Law(
        "the contacts of a step are solved once, one after the other: the second wall brings back"
        " slip at the first",
        "reference_impl/coulomb.py",
    ),
    "most_collisions": Law(
        "the number of collisions a step is limited, and unresolved ones show as overlap",
        "reference_impl/ordered.py",
    ),
    "overlap_stays": Law(
        "overlaps that no collision made are not corrected", "reference_impl/ordered.py"
    ),
    "projected_once": Law(
        "each pair is projected once a step, without regard to the others",
        "exercise 11, task 2",
        POSITION_CORRECTION,
    ),
    "share_a_step": Law(
        "overlaps are corrected by a share per step, down to a slop a contact",
        "Munk2D src/cpArbiter.c, cpArbiterPreStep",
        POSITION_CORRECTION,
    ),
    "ten_impulses": Law(
        "10 sequential impulses do not carry a heavy disk on a light one", CATTO, IMPULSE
    ),
    "slow_convergence": Law(
        "sequential impulses converge slowly if the masses are unequal", CATTO, IMPULSE
    ),
    "slop": Law(
        "every contact may keep an overlap of a slop, and soft contacts yield as the load grows",
        "Box2D, b2_linearSlop; contact softness in 3.1",
        POSITION_CORRECTION,
    ),
    "beyond_wall": Law(
        "position correction moves disks beyond a wall, and from there further outwards",
        "walls have two sides",
        POSITION_CORRECTION,
    ),
    "chatter": Law("without a threshold a resting disk chatters at e g dt / (1 - e)", CHATTER),
    "chatter_above": Law("chatter above the threshold of 1 m/s goes on for ever", CHATTER),
    "chatter_gravity": Law(
        "gravity is added before the bounce, so a resting disk chatters", CHATTER
    ),
    **{
        f"{box}_threshold": Law(f"{THRESHOLD}; friction", THRESHOLDS[box], RESTITUTION)
        for box in ("box2d", "box2d_v3")
    },
    "one_pass": Law(
        "restitution is applied in one pass after the substeps, so a disk that touches two others"
        " in a step loses energy",
        APPLY,
        IMPULSE,
    ),
    "ten_impulses_gas": Law(
        "10 sequential impulses do not solve a cluster of contacts", CATTO, IMPULSE
    ),
    "rounded_impulses": Law(
        "impulses are rounded to float32, and the rounding errors add up", "IEEE 754", DIGITS
    ),
    "two_targets": Law(
        "one solve has the target velocity 0 for separating contacts and e v for closing ones",
        "Box2D 2.3 Dynamics/Contacts/b2ContactSolver.cpp",
        IMPULSE,
    ),
    "one_step": Law(
        "sequential impulses do not solve a cluster of contacts in a step", CATTO, IMPULSE
    ),
    "lasts_a_step": Law(
        "a collision is detected up to a step late, and lasts about a step too long",
        "penetration and return: one dt a collision",
        LATE,
    ),
    "unequal_loss": Law(
        "energy is lost at unequal rates by light and heavy disks", "e < 1 in some collisions"
    ),
    "order": Law(
        "sums and contacts follow the order of insertion, and chaos magnifies the difference",
        "Lyapunov exponent of the gas",
    ),
    "warm_start": Law(
        "the impulses and contacts of the last step are not part of the state that can be read",
        "warm starting: a step begins with the impulses of the last one; contact caches",
    ),
}


class Reason(NamedTuple):
    """One row: the first that fits a limit is its reason.

    Attributes:
        cases, engines: patterns of names, as of files, with spaces between them.
        law: a key of `LAWS`.
        predicts: the limit that follows from it.
        variant: an engine that differs in this alone, or in little else, and must get farther;
            "+bullets": the engine itself with bullets.
    """

    cases: str
    engines: str
    law: str
    predicts: float | None = None
    variant: str = ""

    def fits(self, limit: Limit) -> bool:
        pairs = (limit.case, self.cases), (limit.engine, self.engines)
        return all(any(fnmatch(name, p) for p in patterns.split()) for name, patterns in pairs)


def growth_limit(share: float) -> float:
    """w dt at which the mean energy doubles in 300 steps, growing by 1 + share (w dt)² a step."""
    return sqrt((2 ** (1 / 300) - 1) / share)


DETECTING = "reference:* pymunk:*"
SWEEPING = f"{DETECTING} box2d_v3:matched"
# what moves is no bullet
UNSWEPT = "box2d*:shipped planck:shipped matter:* rapier2d:*"
UNFOUND = "reference:exercise reference:lesson"
ROUGH = (
    "friction_in_bounce strong_friction spin_in_bounce friction_mass_ratio slide_to_roll"
    " critical_slope creep_at_rest"
)
GASES = "dense_gas fast_gas long_gas heavy_in_gas equipartition thermometer"
# that of the cap, at which 2 % of the angle are missing
QUARTER_OFF, EIGHTH_OFF = pi / 2 / 0.98, 4 * atan(pi / 16) / 0.98

REASONS = (
    # One collision.
    Reason("tunnelling_head_on", SWEEPING, "discrete", 2.0, "+bullets"),
    Reason("tunnelling_offset", SWEEPING, "discrete", 2 * sqrt(1 - 0.49), "+bullets"),
    Reason("tunnelling_thin_wall", SWEEPING, "discrete", 1.0, "+bullets"),
    Reason("tunnelling_thick_wall", SWEEPING, "discrete", 11.0, "+bullets"),
    Reason("grazing", DETECTING, "discrete", 1 - sqrt(1 - 0.01), "+bullets"),
    # a length unit of half a radius, 1/64 s
    Reason("tunnelling_thin_wall", "rapier2d:matched", "speed_cap", 400 * 0.5 / 64),
    Reason("tunnelling_*", UNSWEPT, "no_bullet"),
    Reason("grazing", f"{UNSWEPT} box2d_v3:matched", "chord"),
    # One disk, or two.
    Reason(
        "bounce_drift",
        "pymunk:matched",
        "floor_corrected",
        None,
        "pymunk:matched+no_correction",
    ),
    Reason("bounce_drift", "pymunk:matched+no_correction", "floor_missed"),
    Reason("bounce_drift", "box2d:* reference:lesson", "gravity_reflected", 0.005),
    Reason("bounce_drift", "reference:exercise", "gravity_until_found", 0.005),
    Reason("bounce_drift", "box2d_v3:shipped", "soft", None, "box2d_v3:matched"),
    Reason(
        "bounce_drift", "box2d_v3:matched*", "soft_substeps", None, "box2d_v3:matched+16_substeps"
    ),
    Reason("far_from_origin", "box2d*", "far", 4096.0),
    Reason("spin", "box2d:shipped", "b2_quarter", QUARTER_OFF),
    Reason("spin", "box2d:matched", "b2_quarter_refused", pi / 2),
    Reason("spin", "planck:shipped", "planck_quarter", QUARTER_OFF),
    Reason("spin", "rapier2d:shipped", "rapier_eighth_atan", EIGHTH_OFF),
    Reason("spin", "rapier2d:matched", "rapier_eighth_refused", pi / 4),
    Reason("spin", "box2d_v3:shipped", "b3_eighth_atan", EIGHTH_OFF),
    Reason("spin", "box2d_v3:matched*", "b3_eighth_refused", pi / 4),
    # 1.7 rad/s: the spin when the thrusts have ended
    Reason("dt_body_frame_thrust", "box2d_v3:shipped", "b3_eighth", pi / 4 / 1.7),
    Reason("stiff_force", "reference:exercise", "symplectic", 2.0),
    Reason("stiff_force", "box2d:matched", "swing_cap"),
    Reason("stiff_force", "reference:lesson pymunk:*", "explicit", growth_limit(1.0)),
    Reason("stiff_force", "box2d_v3:*", "four_substeps", growth_limit(0.375)),
    Reason("stiff_force", "event_driven:* reference:ordered", "constant_force", growth_limit(0.5)),
    # Refused by every exact method.
    Reason("*", "event_driven:*", "no_continuation"),
    # Friction.
    Reason(ROUGH, UNFOUND, "no_friction"),
    Reason("friction_in_bounce", "box2d_v3:shipped", "no_cone_foreseen", None, "box2d_v3:matched"),
    # 1 / (1 + e) of the friction is nine tenths of it
    Reason("friction_in_bounce", "box2d_v3:*", "no_cone", 1 / 9),
    # the disk rolls at 2/3 of its initial speed
    *(
        Reason(case, engine, law, times * cap)
        for engine, cap, law in (
            ("box2d:*", pi / 2, "b2_quarter"),
            ("box2d_v3:*", pi / 4, "b3_eighth"),
            ("planck:shipped", pi / 2, "planck_quarter"),
            ("rapier2d:*", pi / 4, "rapier_eighth"),
        )
        for case, times in (("spin_in_bounce", 1.0), ("slide_to_roll", 1.5))
    ),
    Reason("creep_at_rest", "reference:coulomb", "in_turn"),
    # Stacks.
    Reason("pile_comes_to_rest dt_*", "reference:ordered", "most_collisions"),
    Reason("overlap_recovery", "reference:ordered", "overlap_stays"),
    Reason("column heavy_on_light", "reference:*", "projected_once"),
    Reason("column", "pymunk:*", "share_a_step"),
    Reason("heavy_on_light", "pymunk:shipped", "ten_impulses", None, "pymunk:matched"),
    Reason("heavy_on_light", "*", "slow_convergence"),
    Reason("column", "*", "slop"),
    Reason("overfull_box", "*", "beyond_wall"),
    Reason("*_comes_to_rest", "box2d:matched", "chatter", None, "box2d:shipped"),
    Reason("*_comes_to_rest", "box2d:shipped", "chatter_above"),
    Reason("*_comes_to_rest", "reference:*", "chatter_gravity"),
    # Gases.
    Reason(GASES, "box2d:shipped", "box2d_threshold", None, "box2d:matched"),
    Reason(GASES, "box2d_v3:shipped", "box2d_v3_threshold", None, "box2d_v3:matched"),
    Reason(GASES, "box2d_v3:*", "one_pass"),
    Reason("dense_gas", "pymunk:shipped", "ten_impulses_gas", None, "pymunk:matched"),
    Reason("fast_gas long_gas", "pymunk:*", "ten_impulses_gas", None, "pymunk:matched"),
    Reason("long_wrapped_gas", "box2d*", "rounded_impulses"),
    Reason("*_gas", "box2d:matched", "two_targets"),
    Reason("*_gas", "*", "one_step"),
    Reason("thermometer", "*", "lasts_a_step"),
    Reason("equipartition", "*", "unequal_loss"),
    Reason("insertion_order", "*", "order"),
    Reason("restart", "*", "warm_start"),
)


def reason_of(limit: Limit) -> Reason | None:
    """The first row that fits; None if nothing failed. For a user's own scene only rows that
    hold in every scene."""
    if limit.verdict == NEVER_FAILS:
        return None
    rows = (row for row in REASONS if limit.case in CASES or row.cases == "*")
    return next((row for row in rows if row.fits(limit)), None)
