"""A cache of truth records on disk, in the user's cache folder. It only saves time: every record
can be computed again."""

from __future__ import annotations

import hashlib
import io
import json
import os
import tempfile
import zipfile
import zlib
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from platformdirs import user_cache_path

from crosscheck2d.scenarios.model import Scenario, frozen
from crosscheck2d.scenarios.regular import opened

HERE = Path(__file__).parent
ARRAYS = {"legs": 15, "events": 5, "outcomes": 4, "orders": 3}
"""The arrays of a record and how many columns each has."""
NUMBERS = ("horizon", "error_bound", "bits", "method", "reason", "float64_horizon", "remains")


def folder() -> Path | None:
    """$CROSSCHECK_CACHE, or crosscheck2d in the user's cache folder, on Linux $XDG_CACHE_HOME or
    ~/.cache; None where there is no home."""
    if given := os.environ.get("CROSSCHECK_CACHE"):
        return Path(given)
    try:
        Path.home()
    except RuntimeError:
        if not os.environ.get("XDG_CACHE_HOME"):
            return None
    return user_cache_path("crosscheck2d", appauthor=False)


def key_of(scenario: Scenario, certifying: bool) -> str:
    """A hash of everything a record depends on: scene, thrusts, duration, the oracle's source, and
    whether it works with intervals (`certifying`)."""
    scene, hashed = scenario.scene, hashlib.sha256()
    parts = [
        scene.position,
        scene.velocity,
        scene.radius,
        scene.mass,
        scene.walls,
        scene.gravity,
        scene.restitution,
        [] if scene.wrap is None else scene.wrap,
        scenario.duration,
        *([p.disk, p.start, p.stop, *p.force, p.frame == "body"] for p in scenario.thrusts),
    ]
    # Else the record holds no rotation.
    if scene.friction or any(p.frame == "body" for p in scenario.thrusts):
        torques = [p.torque for p in scenario.thrusts]
        parts += [scene.friction, scene.inertia, scene.angle, scene.angular_velocity, torques]
    hashed.update(f"{source_hash()} {certifying} {[np.shape(part) for part in parts]}".encode())
    for part in parts:
        hashed.update(np.ascontiguousarray(part, dtype="<f8").tobytes())
    return hashed.hexdigest()[:32]


@cache
def source_hash(folder: Path = HERE) -> str:
    """A hash of the source in this folder, so that records of another version of the oracle are
    never used."""
    files = sorted(folder.rglob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def look_up(key: str) -> dict[str, Any] | None:
    """The fields of the record cached under `key`; None if there is none, or if it cannot be read
    in full."""
    where = folder()
    return None if where is None else unpacked(where / f"{key}.npz")


# Raised when an archive is damaged or not one of ours; the record then counts as missing. One wrong
# bit can look like an unknown compression (NotImplementedError), an encrypted file (RuntimeError),
# or an array larger than the memory (MemoryError).
UNREADABLE = (
    OSError,
    ValueError,
    LookupError,
    EOFError,
    TypeError,
    RuntimeError,
    MemoryError,
    SyntaxError,
    zipfile.BadZipFile,
    zlib.error,
    RecursionError,
)


def packed(fields: dict[str, Any]) -> bytes:
    """The fields of a record as the bytes of an .npz."""
    file = io.BytesIO()
    numbers = json.dumps({name: fields[name] for name in NUMBERS})
    np.savez_compressed(file, **{name: fields[name] for name in ARRAYS}, numbers=np.array(numbers))
    return file.getvalue()


def unpacked(path: Path) -> dict[str, Any] | None:
    """The fields of the record in a file written from `packed` bytes; None if it cannot be read in
    full."""
    try:
        with opened(path) as file, np.load(file, allow_pickle=False) as saved:
            arrays = {name: frozen(saved[name]) for name in ARRAYS}
            numbers = json.loads(str(saved["numbers"]))
    except UNREADABLE:
        return None
    fits = all(
        arrays[name].shape[1:] == (width,) for name, width in ARRAYS.items()
    ) and has_valid_types(numbers)
    return arrays | numbers | {"remains": tuple(numbers["remains"])} if fits else None


def has_valid_types(numbers: Any) -> bool:
    """Whether `numbers` has the names and types of `NUMBERS`: the file may have been edited."""
    if not isinstance(numbers, dict) or set(numbers) != set(NUMBERS):
        return False
    of = {type(numbers[name]) for name in ("horizon", "error_bound", "float64_horizon")}
    texts = numbers["remains"]
    return (
        of <= {int, float}
        and type(numbers["bits"]) is int
        and all(isinstance(numbers[name], str) for name in ("method", "reason"))
        and isinstance(texts, list)
        and all(isinstance(text, str) for text in texts)
    )


def keep(key: str, fields: dict[str, Any]) -> bool:
    """Write the fields of a record under `key`, all or nothing; False if the folder cannot be
    written to."""
    where = folder()
    if where is None:
        return False
    temporary = None
    try:
        where.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=where, suffix=".part")
        with os.fdopen(handle, "wb") as file:
            file.write(packed(fields))
        # Another process may write the same record at the same time: the last rename wins, and both
        # files are complete.
        os.replace(temporary, where / f"{key}.npz")
    except OSError:
        if temporary:
            with suppress(OSError):
                os.unlink(temporary)
        return False
    return True
