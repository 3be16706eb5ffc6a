"""The table of engines: a row for each engine and profile. To add one, write its file and its
row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engine_row import (
    FLOAT32,
    FLOAT64,
    AccuracyParameter,
    EngineRow,
    Mark,
    Variant,
)
from crosscheck2d.adapters.library_at_version import FORM, LibraryAtVersion
from crosscheck2d.adapters.library_versions import BOX2D
from crosscheck2d.adapters.matched import read_searched
from crosscheck2d.scenarios.model import Scene


def _made(place: str, *arguments: Any, **settings: Any) -> Engine:
    # An engine of the class "module.Class", imported only now, so that a missing library is a
    # refusal of this engine alone.
    module, _, name = place.rpartition(".")
    engine: Engine = getattr(import_module(module), name)(*arguments, **settings)
    return engine


def _reference(variant: str, **settings: Any) -> Engine:
    solver = import_module(f"crosscheck2d.reference_impl.{variant}")
    return _made("crosscheck2d.adapters.reference.Reference", solver, **settings)


def _what_moves_is_a_bullet(engine: Any) -> None:
    # For Box2D 3.1: make the moving disks bullets; bullets do not detect each other.
    for body, velocity in zip(engine.bodies, engine.scene.velocity):
        body.bullet = bool(velocity.any())


def _profiles(
    engine: str,
    make: Callable[..., Engine],
    shipped: str,
    matched: str,
    *,
    of_shipped: dict[str, Any] | None = None,
    of_matched: dict[str, Any] | None = None,
    **shared: Any,
) -> dict[str, EngineRow]:
    # The two rows of a library: `make` takes the profile; shipped, matched: their summaries; then
    # the fields of one row, and those of both.
    rows = {
        "shipped": {"summary": shipped, "dash": (6, 3)} | (of_shipped or {}),
        "matched": {"summary": matched} | (of_matched or {}),
    }
    return {
        f"{engine}:{profile}": EngineRow(partial(make, profile), outside=True, **shared, **row)
        for profile, row in rows.items()
    }


_Reference = partial(EngineRow, rounding=FLOAT64, mark=Mark("#0a4f9e", "#6cb8ff", "circle"))

ENGINES: dict[str, EngineRow] = {
    "reference:exercise": _Reference(
        partial(_reference, "exercise"),
        "hand-written, exercise 11: symplectic Euler; 171 lines, tests every pair, sets a disk that"
        " leaves a torus onto its edge",
        1.0,
        options={"kept in float32": {"precision": np.float32}},
    ),
    "reference:neighbours": _Reference(
        partial(_reference, "neighbours"),
        "same bits as reference:exercise in less time: 597 lines, no pair tested that is far",
        1.0,
        dash=(7, 5),
        shape="x",
        bits_of="reference:exercise",
    ),
    "reference:lesson": _Reference(
        partial(_reference, "lesson"),
        "hand-written, the lesson: explicit Euler; 126 lines, tests every pair",
        0.0,
        dash=(2, 3),
    ),
    "reference:coulomb": _Reference(
        partial(_reference, "coulomb"),
        "hand-written, the exercise with friction; 89 lines, tests every pair",
        1.0,
        dash=(12, 3),
        shape="triangle-left",
        bits_of="reference:exercise",
        adds_friction=True,
    ),
    "reference:ordered": _Reference(
        partial(_reference, "ordered"),
        "hand-written: exact flight, time-of-impact ordering, friction; 905 lines, no projection",
        0.5,
        dash=(9, 3, 2, 3),
        shape="hourglass",
        orders_collisions=True,
    ),
    **_profiles(
        "pymunk",
        partial(_made, "crosscheck2d.adapters.pymunk.Pymunk"),
        "pymunk 7.3 (float64), own defaults: elasticity e on every shape",
        "pymunk, matched: elasticity sqrt(e), small slop",
        alpha=0.0,
        rounding=FLOAT64,
        distributions=("pymunk",),
        wheel="pymunk",
        mark=Mark("#d1540a", "#ff9a4d", "triangle-up"),
        searched=partial(read_searched, "pymunk"),
        work=AccuracyParameter("iterations", "iterations", (1, 2, 5, 10, 20, 50, 100, 200)),
        of_matched={
            "options": {
                "50 iterations, not 10": {"iterations": 50},
                "200 iterations, not 10": {"iterations": 200},
                "sleeping": {"sleep_time_threshold": 0.5},
                "no rotation": {"turning": False},
                "hash, not tree": {"spatial_hash": (0.6, 1000)},
            },
            "variants": {
                "fifty_iterations": Variant({"iterations": 50}, "50 iterations instead of 10"),
                "no_correction": Variant({"collision_bias": 1.0}, "no position correction"),
            },
        },
    ),
    **_profiles(
        "box2d",
        partial(_made, "crosscheck2d.adapters.box2d.Box2DEngine"),
        "box2d-py 2.3.8 (float32), own defaults: friction, sleep, threshold 1 m/s",
        "box2d-py, matched: units that lift its thresholds; CCD; no sleep; friction as stated",
        alpha=1.0,
        rounding=FLOAT32,
        distributions=(BOX2D,),
        wheel="box2d",
        mark=Mark("#00876c", "#5be0b5", "square"),
        searched=partial(read_searched, "box2d"),
        work=AccuracyParameter("iterations", "velocity_iterations", (1, 2, 4, 8, 16, 32, 64)),
        of_matched={
            "options": {
                "1 iteration, not 8": {"velocity_iterations": 1},
                "30 iterations, not 8": {"velocity_iterations": 30},
                "no position correction": {"position_iterations": 0},
                "no CCD": {"continuous": False, "bullet": False},
                "sleeping": {"sleeping": True},
                "no warm start": {"warm_starting": False},
                "no rotation": {"turning": False},
            }
        },
    ),
    **_profiles(
        "box2d_v3",
        partial(_made, "crosscheck2d.adapters.box2d_v3.Box2DV3"),
        "Box2D 3.1 (pyb2d3, float32), own defaults: friction, sleep, threshold 1 m/s",
        "Box2D 3.1, matched: no thresholds, length unit 0.3 r, stiffer contacts; CCD",
        alpha=0.625,
        rounding=FLOAT32,
        distributions=("pyb2d3",),
        wheel="pyb2d3",
        mark=Mark("#b84fb0", "#c46bd8", "diamond"),
        searched=partial(read_searched, "box2d_v3"),
        work=AccuracyParameter("substeps", "substeps", (1, 2, 4, 8, 16)),
        of_matched={
            "options": {
                "1 substep, not 4": {"substeps": 1},
                "16 substeps, not 4": {"substeps": 16},
                "no CCD": {"continuous": False},
                "all bullets": {"bullet": True},
                "sleeping": {"sleeping": True},
                "no rotation": {"turning": False},
            },
            "variants": {
                "bullets": Variant({}, "moving disks are bullets", _what_moves_is_a_bullet),
                "16_substeps": Variant({"substeps": 16}, "16 substeps instead of 4"),
            },
        },
    ),
    "event_driven:float64": EngineRow(
        partial(_made, "crosscheck2d.adapters.event_driven.engine.EventDriven"),
        "event-driven, without steps: parabolas and contact times, in float64",
        0.5,
        FLOAT64,
        mark=Mark("#6a5a10", "#e6c918", "star"),
        orders_collisions=True,
    ),
}

# engines whose numbers differ from each other in scenes without friction
DISTINCT = {name: row for name, row in ENGINES.items() if not row.bits_of}
# the engines that play by default: those, and the ones that differ from them with friction
UNASKED = {name: row for name, row in ENGINES.items() if name in DISTINCT or row.adds_friction}

PACKAGE = "crosscheck2d.adapters.host.engine.PackageEngine"
# Engines in npm packages, which the extra `js` fetches once; they play on request.
FETCHED: dict[str, EngineRow] = {
    **_profiles(
        "planck",
        partial(_made, PACKAGE, "planck", "planck"),
        "planck 1.5, own defaults: Box2D 2.3 in JavaScript and float64",
        "planck, matched: CCD, also between disks, to 1e-7 of a radius; no thresholds, no sleep",
        alpha=1.0,
        rounding=FLOAT64,
        package="planck",
        mark=Mark("#6940da", "#8472fe", "triangle-right"),
        searched=partial(read_searched, "planck"),
    ),
    **_profiles(
        "matter",
        partial(_made, PACKAGE, "matter", "matter-js"),
        "matter-js 0.20 (float64), own defaults: 100 pixels a metre, disks are polygons, air",
        "matter-js, matched: pixels that lift its thresholds, 200 sides, no air",
        alpha=1.0,
        # of velocities, which are differences of two positions: at 5 m they are known to 1e-15 m,
        # of a path in a step of some 1e-4 m
        rounding=2.0**-36,
        package="matter-js",
        mark=Mark("#ec4f90", "#e39bcd", "star-diamond"),
        searched=partial(read_searched, "matter"),
        of_shipped={
            "departs": dict.fromkeys(
                ("steps_obey_dt", "force_lasts_one_step", "same_instant"),
                "friction of the air: 1 % of the speed in 1/60 s, its default",
            )
        },
    ),
    **_profiles(
        "rapier2d",
        partial(_made, PACKAGE, "rapier2d", "@dimforge/rapier2d-compat", float32=True),
        "Rapier 0.21 (WebAssembly, float32), own defaults: friction, sleep, length unit 1 m",
        "Rapier, matched: length unit r / 2, no friction, no sleep",
        alpha=0.625,
        rounding=FLOAT32,
        package="@dimforge/rapier2d-compat",
        mark=Mark("#6d9154", "#8cf078", "diamond-wide"),
        searched=partial(read_searched, "rapier2d"),
    ),
}

# An engine that plays only where it is named: no table or page has its results.
NAMED: dict[str, EngineRow] = {
    **_profiles(
        "box2d_wasm",
        partial(_made, PACKAGE, "box2d_wasm", "box2d3-wasm", float32=True),
        "Box2D after 3.1 (box2d3-wasm 5.2, float32), own defaults, as box2d_v3:shipped",
        "Box2D after 3.1, matched as box2d_v3 is; allowFastRotation: no cap on spins",
        alpha=0.625,
        rounding=FLOAT32,
        package="box2d3-wasm",
    )
}

OWN = ":own"  # the profile of a solver's file; its engine is the path


_read: dict[str, EngineRow] = {}  # the rows of solvers' files, as they were when the command began


def row_of(name: str) -> EngineRow:
    """The row of an engine: from `ENGINES`, `FETCHED` or `NAMED`, of one at another version, or for
    a solver's file `PATH:own`, which is read once.

    Raises:
        KeyError: it is none of them.
        NotASolver: the file cannot be one.
    """
    row = known_row(name)
    if row is None and name.endswith(OWN):
        return _read.get(name) or read_row(name)
    return row or ENGINES[name]


def all_rows() -> dict[str, EngineRow]:
    """The engines of this project by name, also those that play only where they are asked for."""
    return ENGINES | FETCHED | NAMED


def packages() -> dict[str, tuple[str, bool]]:
    # Engine -> the package that other versions of it come in, and whether it is npm's.
    rows = ((name.partition(":")[0], row) for name, row in all_rows().items())
    return {
        name: (row.package or row.wheel, bool(row.package))
        for name, row in rows
        if row.package or row.wheel
    }


def parsed(name: str) -> tuple[str, LibraryAtVersion | None]:
    """A name of an engine or a row without its version, and its library at that version; None for
    a name without one, or of another form."""
    engine, _, rest = name.partition("@")
    version, colon, profile = rest.partition(":")
    if not FORM.fullmatch(version) or engine not in (known := packages()):
        return name, None
    package, npm = known[engine]
    return f"{engine}{colon}{profile}", LibraryAtVersion(package, version, npm)


def known_row(name: str) -> EngineRow | None:
    usual, library = parsed(name)
    row = all_rows().get(usual)
    if row is None or library is None:
        return row
    assert isinstance(row.make, partial)
    return replace(
        row,
        make=partial(row.make, library=library)
        if row.package
        else partial(
            _made, "crosscheck2d.adapters.host.apart.EngineApart", library, *row.make.args
        ),
        summary=f"{library.package} {library.version}, {usual.partition(':')[2]}",
        mark=None,
        distributions=(),
        package="",
        wheel="",
        source=library.recorded,
        bits_of="",
    )


def told_apart(rows: Mapping[str, EngineRow], scene: Scene) -> list[str]:
    """The engines of `rows`; in a scene without friction without those that only add friction to
    another one."""
    return [
        name
        for name, row in rows.items()
        if scene.friction or not row.adds_friction or row.bits_of not in rows
    ]


def read_row(name: str) -> EngineRow:
    """The row of a solver's file, `PATH:own`, read again; later calls of `row_of` return it. Raises
    `NotASolver`."""
    from crosscheck2d.adapters.host.engine import row_of_file

    _read[name] = row = row_of_file(Path(name.removesuffix(OWN)))
    return row


def changed(name: str, **settings: Any) -> Engine:
    return ENGINES[name].make(**settings)
