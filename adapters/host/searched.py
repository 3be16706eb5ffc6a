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
            "length_unit": 1e-5,
            "step_unit": 0.0,
            "continuous": True,
            "bullet": True,
            "warm_starting": True,
        },
        {
            "velocity_iterations": ((4, 8, 20), "passes of the impulse solver; the manual has 8"),
            "position_iterations": (
                (0, 3, 8),
                "passes of the position correction; the manual has 3",
            ),
            "baumgarte": ((0.1, 0.2, 0.8), "share of an overlap a pass undoes; 0.2 by default"),
            "length_unit": (
                (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.25),
                "smallest radii; sets slop (0.005 units) and the least speed that bounces",
            ),
            "step_unit": (
                (0.0, 2.0),
                "ways of the fastest disk in a step: a unit of length at least; 0: whatever it is",
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
        ((("length_unit", "step_unit"), (1e-4, 0.01), (2.0,)),),
        {
            "time_unit": "as of box2d:matched: velocityThreshold",
            "maxTranslation, maxRotation": "1e9: no speed or spin is cut",
            "radius of an edge (wall skin)": f"0: {GEOMETRY}",
            "friction, restitution, sleeping": STATED,
        },
    ),
    "matter": Searched(
        {
            "pixels_in_radius": 1e5,
            "sides": 200,
            "position_iterations": 12,
            "velocity_iterations": 8,
        },
        {
            "pixels_in_radius": (
                (1e3, 1e5, 1e7),
                "of the smallest disk; all thresholds are in pixels",
            ),
            "sides": ((26, 50, 100, 200, 400), "of the polygon of a disk; 26 at most by default"),
            "position_iterations": (
                (2, 6, 12, 24),
                "passes of the position correction; 6 by default",
            ),
            "velocity_iterations": ((2, 4, 8, 16), "passes of the impulse solver; 4 by default"),
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
            "hertz": 120,
            "prediction": 0.02,
            "continuous_steps": 1,
            "continuous": False,
            "soft_ccd": 0.0,
        },
        {
            "length_unit": (
                (0.1, 0.25, 0.5, 1.0),
                (
                    "smallest radii; sets the margin in which contacts are foreseen and how far a"
                    " pair moves until it is looked at again (0.05 units)"
                ),
            ),
            "iterations": ((2, 4, 8), "substeps of a step; 4 by default"),
            "pgs_iterations": ((1, 2), "passes of a substep; 1 by default"),
            "hertz": (
                (10, 30, 120, 1000, 1e5),
                "natural frequency of a contact of disks that move; 30 by default",
            ),
            "prediction": (
                (0.002, 0.02, 0.05),
                "length units, of the margin in which contacts are foreseen; 0.02 by default",
            ),
            "continuous_steps": (
                (0, 1, 4),
                "steps of continuous collision of fast disks with walls; 1 by default, 0: none",
            ),
            "continuous": ((False, True), "the same between disks; off by default"),
            "soft_ccd": (
                (0.0, 0.1, 1.0),
                "smallest radii, setSoftCcdPrediction: contacts foreseen farther; 0 by default",
            ),
        },
        ((("iterations", "hertz"), (2, 8), (1000,)), (("length_unit", "hertz"), (1.0,), (1000,))),
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
