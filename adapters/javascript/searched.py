"""What `crosscheck tune` searches of planck, matter and Rapier: the public settings of their
matched profiles, as the files of this folder name them."""

from __future__ import annotations

from crosscheck2d.adapters.matched import GEOMETRY, Searched

STATED = "as the scene states"

SEARCHED = {
    "planck": Searched(
        {
            "velocity_iterations": 8,
            "position_iterations": 3,
            "baumgarte": 0.2,
            "length_unit": 0.25,
            "continuous": True,
            "bullet": True,
            "warm_starting": True,
        },
        {
            "velocity_iterations": ((8, 20), "passes of the impulse solver; the manual has 8"),
            "position_iterations": (
                (0, 3, 8),
                "passes of the position correction at e < 1; the manual: 3",
            ),
            "baumgarte": (
                (0.1, 0.2, 0.8),
                "share of an overlap a pass undoes; 0.2 by default",
            ),
            "length_unit": (
                (0.05, 0.25, 1.0),
                "smallest radii; sets slop (0.005 units) and the least speed that bounces",
            ),
            "continuous": (
                (False, True),
                "continuous collision with walls and static disks; on by default",
            ),
            "bullet": ((False, True), "the same between disks that move, where `continuous` is on"),
            "warm_starting": (
                (False, True),
                "begin with the impulses of the last step; on by default",
            ),
        },
        (),
        {
            "elastic_position_iterations, elastic_continuous, elastic_bullet": (
                "as of box2d:matched, which is searched"
            ),
            "time_unit, step_unit": "as of box2d:matched: velocityThreshold, maxTranslation",
            "radius of an edge (wall skin)": f"0: {GEOMETRY}",
            "friction, restitution, sleeping": STATED,
        },
    ),
    "matter": Searched(
        {
            "pixels_in_radius": 1e5,
            "sides": 200,
            "position_iterations": 6,
            "velocity_iterations": 4,
        },
        {
            "pixels_in_radius": (
                (1e3, 1e5, 1e7),
                "of the smallest disk; all thresholds are in pixels",
            ),
            "sides": ((50, 200), "of the polygon of a disk; 26 at most by default"),
            "position_iterations": ((2, 6, 12), "passes of the position correction; 6 by default"),
            "velocity_iterations": ((4, 8), "passes of the impulse solver; 4 by default"),
        },
        (),
        {
            "slop": "0.05 pixels: moved by the pixels alone",
            "friction of the air, static friction": "0 and the default: as the scene has it",
            "friction, restitution, sleeping": STATED,
        },
    ),
    "rapier2d": Searched(
        {
            "length_unit": 0.5,
            "iterations": 4,
            "pgs_iterations": 1,
            "hertz": 30,
            "prediction": 0.02,
            "continuous_steps": 1,
        },
        {
            "length_unit": (
                (0.1, 0.5, 1.0),
                (
                    "smallest radii; sets the margin in which contacts are foreseen and how far a"
                    " pair moves until it is looked at again (0.05 units)"
                ),
            ),
            "iterations": ((2, 4, 8), "substeps of a step; 4 by default"),
            "pgs_iterations": ((1, 2), "passes of a substep; 1 by default"),
            "hertz": (
                (10, 30, 1000),
                "natural frequency of a contact of disks that move; 30 by default",
            ),
            "prediction": (
                (0.002, 0.02, 0.05),
                "length units, of the margin in which contacts are foreseen; 0.02 by default",
            ),
            "continuous_steps": (
                (0, 1),
                "steps of continuous collision of fast disks with walls; 1 by default, 0: none",
            ),
        },
        (),
        {
            "normalizedAllowedLinearError": (
                "of continuous collision alone; see adapters/mechanisms/table.py"
            ),
            "contact_recycling, static_contact_softness": "not in the binding",
            "contactSkin": GEOMETRY,
            "friction, restitution, sleeping": STATED,
        },
    ),
}
