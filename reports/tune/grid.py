"""What is searched: every public setting of every engine that has one, the values tried, and why; and what is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from adapters.engine import Engine
from adapters.mechanisms.options import changed_box2d, changed_box2d_v3, changed_pymunk


@dataclass(frozen=True)
class Setting:
    """One setting of an engine.

    Attributes:
        engine: a key of `ENGINES` without its profile.
        name: a key of its adapter's `MATCHED`.
        values: what is tried, beside what is chosen.
        what: what it does, and in which unit it is.
    """

    engine: str
    name: str
    values: tuple[Any, ...]
    what: str


@dataclass(frozen=True)
class Pair:
    """Two settings that act on the same thing, tried together; values of the first, values of the second."""

    engine: str
    names: tuple[str, str]
    values: tuple[tuple[Any, ...], tuple[Any, ...]]


@dataclass(frozen=True)
class NotSearched:
    """A setting of an engine that is not chosen by a search, and why."""

    engine: str
    name: str
    why: str


MAKES: dict[str, Callable[..., Engine]] = {
    "pymunk": changed_pymunk, "box2d": changed_box2d, "box2d_v3": changed_box2d_v3,
}  # fmt: skip

DEFAULT_BIAS = (1 - 0.1) ** 60
GRID: tuple[Setting, ...] = (
    Setting("pymunk", "iterations", (5, 10, 20, 50, 100, 200), "passes of the impulse solver; 10 by default"),
    Setting(
        "pymunk", "slop", (0.01, 1e-3, 1e-4, 1e-6, 0.0), "overlap left alone, in smallest radii; 0.1 m by default"
    ),
    Setting(
        "pymunk", "bias", (1.0, 0.3, DEFAULT_BIAS, 1e-12, 1e-24, 1e-48, 0.0),
        "share of an overlap that is left after 1 s, at e < 1; 0.0018 by default",
    ),
    Setting("pymunk", "elastic_bias", (1.0, 0.3, DEFAULT_BIAS, 1e-24, 0.0), "the same at e = 1"),
    Setting(
        "pymunk", "persistence", (1, 2, 3), "steps for which a lost contact keeps its impulses; 3 by default"
    ),
    Setting("box2d", "velocity_iterations", (8, 20, 50, 100), "passes of the impulse solver; the manual has 8"),
    Setting("box2d", "position_iterations", (0, 1, 3, 8), "passes of the position correction at e < 1; the manual: 3"),
    Setting("box2d", "elastic_position_iterations", (0, 3), "the same at e = 1"),
    Setting("box2d", "continuous", (False, True), "continuous collision with walls and static disks; on by default"),
    Setting("box2d", "bullet", (False, True), "the same between disks that move, where `continuous` is on"),
    Setting("box2d", "elastic_continuous", (False, True), "as `continuous`, at e = 1 without gravity"),
    Setting("box2d", "elastic_bullet", (False, True), "as `bullet`, at e = 1 without gravity"),
    Setting("box2d", "sub_stepping", (False, True), "one continuous collision a call, where `continuous` is on"),
    Setting("box2d", "warm_starting", (True, False), "begin with the impulses of the last step; on by default"),
    Setting(
        "box2d", "time_unit", (1.0, 1e3, 1e4),
        "s; closing speeds below a unit of length in a unit of time are inelastic, which is compiled in",
    ),
    Setting(
        "box2d", "length_unit", (0.125, 0.25, 0.5, 1.0, 3.0),
        "smallest radii; slop 0.005, tolerance of continuous collision 0.015 and cap 2 units are compiled in",
    ),
    Setting("box2d", "step_unit", (1.0, 2.0, 4.0), "ways of the fastest disk in a step: a unit of length at least"),
    Setting(
        "box2d_v3", "length_unit", (0.02, 0.1, 0.3, 0.5, 0.7, 1.0, 2.0),
        "smallest radii; sets slop (0.005 units) and the margin in which contacts are foreseen (0.02 units)",
    ),
    Setting("box2d_v3", "substeps", (1, 2, 4, 8), "of a step; the manual has 4"),
    Setting(
        "box2d_v3", "hertz", (10.0, 30.0, 120.0, 1e6),
        "stiffness of a contact; 30 by default; cut at an eighth of the substeps a second",
    ),
    Setting("box2d_v3", "damping_ratio", (1.0, 3.0, 10.0, 30.0), "of a contact; 10 by default"),
    Setting("box2d_v3", "push_speed", (0.0, 0.3, 3.0, 30.0), "m/s, at most, of a position correction; 3 by default"),
    Setting("box2d_v3", "continuous", (False, True), "continuous collision with walls and static disks; on by default"),
    Setting("box2d_v3", "bullet", (False, True), "the same between disks that move, where `continuous` is on"),
)  # fmt: skip

PAIRS: tuple[Pair, ...] = (
    Pair("pymunk", ("slop", "bias"), ((1e-2, 1e-4, 0.0), (DEFAULT_BIAS, 1e-12, 1e-48, 0.0))),
    Pair("pymunk", ("slop", "elastic_bias"), ((1e-3, 0.0), (DEFAULT_BIAS, 1e-24, 0.0))),
    Pair("box2d", ("continuous", "bullet"), ((False, True), (False, True))),
    Pair("box2d", ("elastic_continuous", "elastic_bullet"), ((True,), (True,))),
    Pair("box2d", ("bullet", "length_unit"), ((False, True), (0.125, 0.5, 1.0))),
    Pair("box2d_v3", ("length_unit", "hertz"), ((0.02, 0.3, 0.5), (30.0, 1e6))),
    Pair("box2d_v3", ("substeps", "hertz"), ((2, 8), (30.0, 1e6))),
    Pair("box2d_v3", ("hertz", "damping_ratio"), ((30.0, 1e6), (1.0, 3.0))),
    Pair("box2d_v3", ("continuous", "bullet"), ((True,), (True,))),
)

GEOMETRY = "it would move what the scene states, so that the detection delay and a wrong place make up for each other"
NOT_SEARCHED: tuple[NotSearched, ...] = (
    NotSearched("pymunk", "elasticity", "sqrt(e) on every shape: the engine multiplies two"),
    NotSearched("pymunk", "shape radius of a wall", GEOMETRY),
    NotSearched("pymunk", "position_func, velocity_func", "Python code in place of the engine's own integrator"),
    NotSearched("pymunk", "pre_solve callbacks", "Python code in place of the engine's own collision law"),
    NotSearched("pymunk", "damping, friction, sleep_time_threshold", "1, 0 and none by default: as the scene states"),
    NotSearched("pymunk", "use_spatial_hash, threads", "change the time alone: see the engine options in crosscheck speed"),
    NotSearched("box2d", "radius of an edge (wall skin)", f"0: {GEOMETRY}"),
    NotSearched("box2d", "walls of boxes or chains", "two-sided segments are what the scene states"),
    NotSearched("box2d", "b2_velocityThreshold, b2_linearSlop, b2_maxTranslation, b2_baumgarte, b2_toiSlop",
                "compiled in; the binding's attributes of these names are copies; moved by the units alone"),
    NotSearched("box2d", "contact.restitution in PreSolve", "Python code in place of the engine's own collision law"),
    NotSearched("box2d", "friction, linearDamping, sleeping", "0, 0 and off: as the scene states"),
    NotSearched("box2d_v3", "restitution_threshold", "0: as the scene states"),
    NotSearched("box2d_v3", "maximum_linear_speed", "1e9 m/s: no speed is cut"),
    NotSearched("box2d_v3", "warm starting, speculative contacts", "not in the binding"),
    NotSearched("box2d_v3", "linear slop, speculative margin", "compiled in; moved by the length unit alone"),
    NotSearched("box2d_v3", "joint tuning", "no joints here"),
    NotSearched("box2d_v3", "walls of chains or boxes", "a chain is one-sided, a segment of the scene is not"),
    NotSearched("box2d_v3", "friction, damping, sleeping", "0, 0 and off: as the scene states"),
    NotSearched("box2d_v3", "thread_pool", "changes the time alone"),
)  # fmt: skip


def settings_of(engine: str) -> list[Setting]:
    """The settings of an engine that are searched."""
    return [each for each in GRID if each.engine == engine]


def matched_of(engine: str) -> dict[str, Any]:
    """The settings that an engine's adapter has for its matched profile now."""
    if engine == "pymunk":
        from adapters.pymunk import MATCHED
    elif engine == "box2d":
        from adapters.box2d import MATCHED
    else:
        from adapters.box2d_v3 import MATCHED
    return dict(MATCHED)
