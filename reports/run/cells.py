"""A cell: one scenario, one engine and profile, one dt, one seed; independent of every other."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.scenarios.model import Scenario

# The source that decides a trajectory, and the source that decides what is said of it; including
# subfolders.
SOURCES = (
    *("adapters/**/*.py", "adapters/**/*.js*", "reference_impl/**/*.py", "scenarios/model.py"),
    *("reports/run/playing.py", "reports/run/trajectories.py", "reports/run/known_answers.py"),
)
JUDGE_SOURCE = ("reports/compare/**/*.py", "reports/run/comparing.py", "scenarios/**/*.py")
CHECK_SOURCE = ("reports/check/**/*.py", "reports/check/**/*.toml")
ROOT = Path(__file__).parents[2]
# besides the distributions of the engines
DECIDING = ("mini-racer", "numba", "numpy", "crosscheck2d")


@dataclass(frozen=True)
class Cell:
    """What is played.

    Attributes:
        scene: a name of the catalogue, or the path of a scene file (ends in .toml).
        seed: seed of a random scene.
        engine: `engine:profile`, or a solver's file as `PATH:own`.
        substeps: steps in a sample interval.
    """

    scene: str
    seed: int
    engine: str
    substeps: int

    @property
    def names(self) -> tuple[str, str]:
        """Engine and profile."""
        name, profile = self.engine.split(":")
        return name, profile

    def key(self, hash_of_scene: str, source: str) -> str:
        """Its `content_key`, from the `scene_hash` of the scenario and the `source` of the engine's
        row."""
        return content_key(hash_of_scene, self.engine, source, self.substeps)


def digest(data: bytes) -> str:
    """The first 16 hex digits of SHA-256 over some bytes, such as those of a file."""
    return hashlib.sha256(data).hexdigest()[:16]


def content_key(*what: Hashable) -> str:
    """16 hex digits of a hash over all that decides a result: `what`, the versions, the engines'
    source.

    For a solver's file `what` includes `EngineRow.source`, a hash of the text read when the command
    started.
    """
    return digest(repr((*what, versions(), source_hash())).encode())


def scene_hash(scenario: Scenario) -> str:
    """16 hex digits of a hash over what is played: the scene, its thrusts, duration and
    sampling."""
    parts = [repr((scenario.name, scenario.duration, scenario.sample_interval)).encode()]
    scene = scenario.scene
    arrays = [
        scene.position,
        scene.velocity,
        scene.radius,
        scene.mass,
        scene.angle,
        scene.angular_velocity,
    ]
    arrays += [scene.inertia, scene.walls, scene.gravity, np.array(scene.restitution)]
    arrays += [scene.wrap] if scene.wrap is not None else []
    arrays += [np.array(scene.friction)] if scene.friction else []
    for array in arrays:
        parts += [repr(array.shape).encode(), array.tobytes()]
    for t in scenario.thrusts:
        parts.append(repr((t.disk, t.start, t.stop, t.force.tolist(), t.torque, t.frame)).encode())
    return digest(b"".join(parts))


@cache
def versions() -> dict[str, str]:
    """Package -> version, for every package that affects a number; "missing" if it is not
    installed."""
    found = {}
    for package in dict.fromkeys(
        (*(each for row in ENGINES.values() for each in row.distributions), *DECIDING)
    ):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "missing"
    return found


@cache
def source_hash(patterns: tuple[str, ...] = SOURCES, root: Path = ROOT) -> str:
    """A hash over source files, by default the engines', so that a changed adapter is a changed
    cell."""
    files = sorted(path for pattern in patterns for path in root.glob(pattern))
    return digest(b"".join(path.read_bytes() for path in files))


@cache
def judge_hash() -> str:
    """A hash of the source and the versions that compare runs: if a metric changes, scenes are
    compared again."""
    return digest(repr((source_hash(JUDGE_SOURCE), versions(), version("pandas"))).encode())
