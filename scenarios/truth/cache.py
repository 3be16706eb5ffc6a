"""A cache of truth records: rows of one file in the user's cache folder. It only saves time: every
record can be computed again."""

from __future__ import annotations

import hashlib
import io
import json
import os
from contextlib import closing, suppress
from errno import ENOENT
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from platformdirs import user_cache_path

from crosscheck2d.scenarios.model import Scenario, frozen
from crosscheck2d.scenarios.rows import Damaged, Rows

HERE = Path(__file__).parent
FILE, KIND = "exact_answers.sqlite", "record"
ARRAYS = ("legs", "events", "outcomes", "orders")
"""The arrays of a record."""
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


def key_of(scenario: Scenario) -> str:
    """A hash of everything a record depends on: scene, thrusts, duration, the oracle's source."""
    thrusts = [value for thrust in scenario.thrusts for value in vars(thrust).values()]
    hashed = hashlib.sha256(source_hash().encode())
    for value in [*vars(scenario.scene).values(), *thrusts, scenario.duration]:
        data = np.ascontiguousarray([] if value is None else value)
        hashed.update(f"{data.dtype} {data.shape} ".encode() + data.tobytes())
    return hashed.hexdigest()[:32]


@cache
def source_hash(folder: Path = HERE) -> str:
    """So that records of another version of the oracle are never used."""
    files = sorted(folder.rglob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def look_up(key: str) -> dict[str, Any] | None:
    with suppress(OSError, Damaged), closing(opened_rows(writing=False)) as rows:
        row = rows.get(KIND, key)
        return None if row is None else unpacked(row.blob)
    return None


def keep(key: str, fields: dict[str, Any]) -> bool:
    with suppress(OSError, Damaged), closing(opened_rows()) as rows:
        rows.put(KIND, key, None, packed(fields), again=False)
        return True
    return False


def fault() -> str:
    """Why nothing is cached; "" if the cache can be used."""
    try:
        opened_rows().close()
    except OSError as error:
        named = f"{error.filename}: " if error.filename else ""
        return f"exact answers are not kept for later: {named}{error.strerror or error}"
    except Damaged as error:
        return f"exact answers are not kept for later: {error}"
    return ""


def opened_rows(writing: bool = True) -> Rows:
    """Opened for many processes; `writing` makes the file. Raises `OSError` or `Damaged`."""
    where = folder()
    if where is None:
        raise FileNotFoundError(ENOENT, "there is no home folder")
    if writing:
        where.mkdir(parents=True, exist_ok=True)
    return Rows(where / FILE, writing)


def packed(fields: dict[str, Any]) -> bytes:
    file = io.BytesIO()
    numbers = json.dumps({name: fields[name] for name in NUMBERS})
    np.savez_compressed(file, **{name: fields[name] for name in ARRAYS}, numbers=np.array(numbers))
    return file.getvalue()


def unpacked(data: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(data), allow_pickle=False) as saved:
        numbers = json.loads(str(saved["numbers"]))
        arrays = {name: frozen(saved[name]) for name in ARRAYS}
    return {**arrays, **numbers} | {"remains": tuple(numbers["remains"])}
