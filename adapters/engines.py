"""The table of engines: a row an engine and profile. To add one, write its file and its row."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from adapters.engine import FLOAT32, FLOAT64, Engine, EngineRow


def _exercise() -> Engine:
    from adapters.reference import Reference
    from reference_impl import verlet_list

    return Reference(verlet_list)


def _lesson() -> Engine:
    from adapters.reference import Reference
    from reference_impl import lesson

    return Reference(lesson)


def _ordered() -> Engine:
    from adapters.reference import Reference
    from reference_impl import ordered

    return Reference(ordered)


def _pymunk(profile: str) -> Engine:
    from adapters.pymunk import Pymunk

    return Pymunk(profile)


def _box2d(profile: str) -> Engine:
    from adapters.box2d import Box2DEngine

    return Box2DEngine(profile)


def _box2d_v3(profile: str) -> Engine:
    from adapters.box2d_v3 import Box2DV3

    return Box2DV3(profile)


def _event_driven() -> Engine:
    from adapters.event_driven.engine import EventDriven

    return EventDriven()


ENGINES: dict[str, EngineRow] = {
    "reference:exercise": EngineRow(
        _exercise, "hand-written solver of exercise 11: symplectic Euler, project, impulse", 1.0, FLOAT64
    ),
    "reference:lesson": EngineRow(
        _lesson, "hand-written solver of the lesson: explicit Euler, walls that flip", 0.0, FLOAT64
    ),
    "reference:ordered": EngineRow(
        _ordered, "hand-written: exact flight, collisions in the order in which they happen within a step", 0.5, FLOAT64
    ),
    "pymunk:shipped": EngineRow(
        partial(_pymunk, "shipped"), "pymunk 7.3 as it comes: elasticity e on every shape", 0.0, FLOAT64
    ),
    "pymunk:matched": EngineRow(
        partial(_pymunk, "matched"), "pymunk, matched: elasticity sqrt(e), small slop", 0.0, FLOAT64
    ),
    "box2d:shipped": EngineRow(
        partial(_box2d, "shipped"), "box2d-py 2.3.8 as it comes: friction, sleep, threshold 1 m/s", 1.0, FLOAT32
    ),
    "box2d:matched": EngineRow(
        partial(_box2d, "matched"),
        "box2d-py, matched: units that lift its thresholds; CCD; no friction, sleep", 1.0, FLOAT32
    ),
    "box2d_v3:shipped": EngineRow(
        partial(_box2d_v3, "shipped"),
        "Box2D 3.1 (pyb2d3) as it comes: friction, sleep, threshold 1 m/s", 0.625, FLOAT32
    ),
    "box2d_v3:matched": EngineRow(
        partial(_box2d_v3, "matched"),
        "Box2D 3.1, matched: no thresholds, length unit r / 2, stiff contacts, no friction", 0.625, FLOAT32
    ),
    "event_driven:float64": EngineRow(
        _event_driven, "event by event without steps: parabolas and contact times, in float64", 0.5, FLOAT64
    ),
}  # fmt: skip

OWN = ":own"  # the profile of a solver's file, whose path is its engine


_read: dict[str, EngineRow] = {}  # the rows of solvers' files, as they were when the command began


def row_of(name: str) -> EngineRow:
    """The row of an engine: of `ENGINES`, or of a solver's file as `PATH:own`, which is read once.

    Raises:
        KeyError: it is neither.
        NotASolver: the file cannot be one.
    """
    if name in ENGINES or not name.endswith(OWN):
        return ENGINES[name]
    return _read.get(name) or read_row(name)


def read_row(name: str) -> EngineRow:
    """The row of a solver's file, `PATH:own`, as it is now; `row_of` gives it from now on. Raises `NotASolver`."""
    from adapters.own_solver.engine import engine_file

    _read[name] = row = engine_file(Path(name.removesuffix(OWN)))
    return row
