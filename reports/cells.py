"""A cell: one scenario, one engine and profile, one dt, one seed; independent of every other."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from adapters.engines import OWN, row_of
from adapters.play import Run, play
from scenarios.catalogue import scenario as from_catalogue
from scenarios.file_tables import MOST_STEPS
from scenarios.files import read_scene_file
from scenarios.model import Scenario

DECIDING = ("pymunk", "box2d-py", "pyb2d3", "mini-racer", "numba", "numpy", "crosscheck2d")


@dataclass(frozen=True)
class Cell:
    """What a worker needs to play it.

    Attributes:
        scene: a name of the catalogue, or the path of a scene file (ends in .toml).
        seed: what a drawn scene is drawn from.
        engine: a key of `ENGINES`, or a solver's file as `PATH:own`.
        substeps: steps in a sample interval.
    """

    scene: str
    seed: int
    engine: str
    substeps: int

    def play(self) -> Run:
        """Play it here and now; the engine is closed again, whatever happens."""
        scenario = open_scene(self.scene, self.seed)
        try:
            engine = row_of(self.engine).make()
        except ImportError as missing:
            name, profile = self.engine.split(":")
            reason = f"{missing.name or missing} cannot be imported: {missing}"
            return Run(name, profile, scenario.name, scenario.dt(self.substeps), "unsupported", reason)
        try:
            return play(engine, self.engine, scenario, scenario.dt(self.substeps))
        finally:
            engine.close()

    def key(self, scenario: Scenario) -> str:
        """16 hex digits of a hash over all that decides the numbers: scene, engine, dt, versions, our own source."""
        own = Path(self.engine.removesuffix(OWN)).read_bytes() if self.engine.endswith(OWN) else b""
        deciding = (scene_hash(scenario), self.engine, self.substeps, versions(), source_hash(), own)
        return hashlib.sha256(repr(deciding).encode()).hexdigest()[:16]


def scene_hash(scenario: Scenario) -> str:
    """16 hex digits of a hash over what is played: the scene, its thrusts, duration and sampling."""
    digest = hashlib.sha256(repr((scenario.name, scenario.duration, scenario.sample_interval)).encode())
    scene = scenario.scene
    arrays = [scene.position, scene.velocity, scene.radius, scene.mass, scene.angle, scene.angular_velocity]
    arrays += [scene.inertia, scene.walls, scene.gravity, np.array(scene.restitution)]
    arrays += [scene.wrap] if scene.wrap is not None else []
    for array in arrays:
        digest.update(repr(array.shape).encode() + array.tobytes())
    for t in scenario.thrusts:
        digest.update(repr((t.disk, t.start, t.stop, t.force.tolist(), t.torque, t.frame)).encode())
    return digest.hexdigest()[:16]


def open_scene(scene: str, seed: int) -> Scenario:
    """A scenario by catalogue name or file path; raises `KeyError` or `SceneFileError`."""
    return read_scene_file(Path(scene)) if scene.endswith(".toml") else from_catalogue(scene, seed)


def with_steps(scenario: Scenario, dts: Sequence[float], full: bool) -> Scenario:
    """The scenario with the dt ladder asked for: `dts` in s instead of its own, two finer steps if `full`.

    Raises:
        ValueError: naming the scenario and the dt that does not divide its sample interval, or is too small.
    """
    ladder = tuple(scenario.substeps)
    most = MOST_STEPS // scenario.samples
    for dt in dts:
        if 0 < dt < scenario.sample_interval / most:
            raise ValueError(f"--dt {dt:g} gives {scenario.name} more than {MOST_STEPS} steps: allowed is "
                             f"{scenario.sample_interval / most:.4g} s or more")  # fmt: skip
        k = round(scenario.sample_interval / dt) if dt > 0 else 0
        if k < 1 or abs(k * dt / scenario.sample_interval - 1) > 1e-9:
            raise ValueError(
                f"--dt {dt:g} does not fit {scenario.name}: allowed is its sample interval "
                f"{scenario.sample_interval:g} s divided by a whole number, e.g. {scenario.dt(ladder[-1]):g}"
            )
    if dts:
        ladder = tuple(sorted({round(scenario.sample_interval / dt) for dt in dts}))
    if full:
        ladder += (ladder[-1] * 2, ladder[-1] * 4)
    return replace(scenario, substeps=ladder)


@cache
def versions() -> dict[str, str]:
    """Package -> version of all that decides a number; "missing" if it is not installed."""
    found = {}
    for package in DECIDING:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "missing"
    return found


@cache
def source_hash() -> str:
    """A hash over the players' source, so that a changed adapter is a changed cell."""
    root = Path(__file__).parent.parent
    files = sorted(path for folder in ("adapters", "reference_impl") for path in (root / folder).glob("*.[pj][ys]"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]
