"""A cell: one scenario, one engine and profile, one dt, one seed; and what decides its numbers: the
scene, the source, the versions. The machine is in the header of each table, but decides no key."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Hashable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.system import LIMITED_BY
from crosscheck2d.scenarios.model import Scenario

# The source that decides a trajectory, and the source that decides what is said of it; including
# subfolders.
SOURCES = (
    *("adapters/**/*.py", "adapters/**/*.js*", "adapters/*.toml", "reference_impl/**/*.py"),
    *("scenarios/model.py", "reports/run/playing.py", "reports/run/known_answers.py"),
)
JUDGE_SOURCE = ("reports/compare/**/*.py", "reports/run/comparing.py", "scenarios/**/*.py")
CHECK_SOURCE = ("reports/check/**/*.py", "reports/check/**/*.toml", "scenarios/**/*.py")
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

    def key(self, hash_of_scene: str, source: str) -> str:
        return content_key(hash_of_scene, self.engine, source, self.substeps)


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def content_key(*what: Hashable) -> str:
    """16 hex digits of a hash over all that decides a result: `what`, the versions, the engines'
    source.

    For a solver's file `what` includes `EngineRow.source`, a hash of the text read when the command
    started.
    """
    return digest(repr((*what, versions(), source_hash())).encode())


def scene_hash(scenario: Scenario) -> str:
    """16 hex digits over what is played: the scene, its thrusts, duration and sampling."""
    parts = [repr((scenario.name, scenario.duration, scenario.sample_interval)).encode()]
    scene = scenario.scene
    names = ("position", "velocity", "radius", "mass", "angle", "angular_velocity", "inertia")
    arrays = [getattr(scene, name) for name in (*names, "walls", "gravity")]
    arrays += [np.array(scene.restitution)]
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
    of_engines = (package for row in ENGINES.values() for package in row.distributions)
    installed = {}
    for package in dict.fromkeys((*of_engines, *DECIDING)):
        try:
            installed[package] = version(package)
        except PackageNotFoundError:
            installed[package] = "missing"
    return installed


@cache
def source_hash(patterns: tuple[str, ...] = SOURCES, root: Path = ROOT) -> str:
    files = sorted(path for pattern in patterns for path in root.glob(pattern))
    return digest(b"".join(path.read_bytes() for path in files))


@cache
def judge_hash() -> str:
    return digest(repr((source_hash(JUDGE_SOURCE), versions(), version("pandas"))).encode())


def about(command: str, seed: int) -> dict[str, Any]:
    """The header of a run: command, seed, date, versions and machine."""
    return {
        "command": command,
        "seed": seed,
        "started": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "versions": {
            **versions(),
            "Python": platform.python_version(),
            "engines' source": source_hash(),
        },
        "machine": {
            "system": f"{platform.system()} {platform.release()}",
            "architecture": platform.machine(),
            "processor": processor(),
            "cores": os.cpu_count() or 1,
            "memory limited by": LIMITED_BY,
        },
    }


def busy_cores(seconds: float = 0.5) -> float:
    """Number of cores that other processes keep busy while this one sleeps for `seconds`; nan if
    the system does not report it."""
    try:
        share = psutil.cpu_percent(seconds) / 100
    except (OSError, ValueError):
        return float("nan")
    return float(share) * (os.cpu_count() or 1)


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"
