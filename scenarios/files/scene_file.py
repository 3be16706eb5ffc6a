"""Reads a scenario from a TOML file, naming all faults at once, and writes one that reads back bit
for bit."""

from __future__ import annotations

import difflib
import json
import math
import re
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError
from pydantic_core import ErrorDetails

from crosscheck2d.scenarios.families.placing import box
from crosscheck2d.scenarios.files.tables import TABLES, SceneToml
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust
from crosscheck2d.scenarios.regular import opened
from crosscheck2d.scenarios.truth.exact import with_oracle

MOST_BYTES = 5_000_000
LONG_NUMBER = re.compile(r"(?<![\w.])\d[\d_]{4000,}")
MOST_FAULTS = 100  # faults listed; n disks in one place would give n2 / 2 lines

# Disks that should touch are off by the rounding of their coordinates; a few thousand roundings are
# allowed.
TOUCHING = 1e-12


class SceneFileError(ValueError):
    """A scene file that cannot be used; `faults` holds one line per fault, str() all of them."""

    def __init__(self, faults: Iterable[str]) -> None:
        self.faults = list(faults)
        super().__init__("\n".join(self.faults))


_KINDS = {
    bool: "boolean",
    str: "string",
    int: "integer",
    float: "float",
    list: "array",
    dict: "table",
}


def read_scene_file(path: str | Path) -> Scenario:
    """The scenario in a TOML file; its source is the file's name, its truth comes from the oracle,
    if there is one.

    Raises:
        SceneFileError: with one line per fault, `FILE: KEY = VALUE: what is wrong; what is
            allowed`, at most `MOST_FAULTS`, and one that says that there are more.
    """
    named = str(path).replace("\n", "\\n")  # for a fault is a line
    return _read(lambda: _parsed(Path(path)), named, Path(path).name)


def scenario_of(table: dict[str, Any], source: str) -> Scenario:
    """The scenario in a table with the keys of a scene file; raises as `read_scene_file`, with
    `source` in place of the file."""
    return _read(lambda: table, source, source)


def _read(parse: Callable[[], dict[str, Any]], named: str, source: str) -> Scenario:
    try:
        table = parse()
        disks = table.get("disk")
        context = {"disks": len(disks) if isinstance(disks, list) else math.inf}
        file = SceneToml.model_validate(table, context=context)
        faults = _outside_wrap(file)
        if not faults:
            scenario = _scenario(file, source)
            faults = list(_overlaps(scenario.scene, len(file.wall)))
    except SceneFileError as error:
        faults = error.faults
    except ValidationError as error:
        faults = [_sentence(fault) for fault in error.errors(include_url=False)]
    except RecursionError:
        faults = ["arrays in arrays in arrays; must be as flat as a scene is"]
    except ValueError as error:  # what the types themselves refuse, say a radius whose square is 0
        faults = str(error).split("; ")
    if len(faults) > MOST_FAULTS:
        faults[MOST_FAULTS:] = [
            f"more than {MOST_FAULTS} faults; must be none (the rest is not listed)"
        ]
    if faults:
        raise SceneFileError(f"{named}: {fault}" for fault in faults)
    return scenario


def _parsed(path: Path) -> dict[str, Any]:
    text = ""
    try:
        with opened(path) as file:
            data = file.read(MOST_BYTES + 1)
        text = data[:MOST_BYTES].decode()
        if len(data) <= MOST_BYTES:
            # some editors start every file with a byte order mark
            return tomllib.loads(text.removeprefix("\ufeff"))
        fault = f"larger than {MOST_BYTES} bytes; must be smaller"
    except OSError as error:
        fault = f"{(error.strerror or str(error)).lower()}; must be a readable TOML file"
    except UnicodeDecodeError as error:
        line, byte = data.count(b"\n", 0, error.start) + 1, data[error.start]
        fault = f"line {line}: byte 0x{byte:02x} is not text; must be UTF-8"
    except tomllib.TOMLDecodeError as error:
        what, where = str(error)[:-1].rsplit(" (at ", 1)
        if where == "end of document":
            where = f"line {text.count(chr(10)) + 1}, column {len(text) - text.rfind(chr(10))}"
        fault = f"{where}: {what[0].lower()}{what[1:]}; must be TOML"
    except ValueError as error:
        # Python's own limits: a null byte in a path, an integer of 4300 digits
        fault = f"{str(error).split(';')[0].lower()}; must be a readable TOML file"
        if long := LONG_NUMBER.search(text):
            *before, last = text[: long.start()].split("\n")
            key, most = _shortened(last.partition("=")[0].strip()), sys.get_int_max_str_digits()
            what = f"line {len(before) + 1}: {key}: an integer of {len(long[0])} digits"
            fault = f"{what}; must be a number of at most {most}"
    raise SceneFileError([fault])


def _sentence(fault: ErrorDetails) -> str:
    """A fault that pydantic found, as `KEY = VALUE: what is wrong; what is allowed`."""
    where, value, kind = fault["loc"], fault["input"], fault["type"]
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{_bare(part)}" for part in where)[1:]
    words = [part for part in where if isinstance(part, str)]
    fields = (TABLES[words[0]] if len(words) > 1 else SceneToml).model_fields
    if kind == "missing":
        return f"{key}: missing; must be {fields[words[-1]].description}"
    said = f"{key} = {_shortened(value)}: "
    if kind == "value_error":
        return f"{said}{fault['ctx']['error']}"
    if kind == "extra_forbidden":
        near = difflib.get_close_matches(words[-1], fields, n=1)
        known = f"did you mean {near[0]}?" if near else f"must be one of {', '.join(fields)}"
        return f"{said}unknown key; {known}"
    if kind == "model_type":
        return f"{said}of type {_KINDS.get(type(value), 'date')}; must be a table"
    if kind in ("too_short", "too_long"):
        return (
            f"{said}{len(value)} item{'s'[: len(value) != 1]}; must be"
            f" {fields[words[-1]].description}"
        )
    wrong = f"of type {_KINDS.get(type(value), 'date')}; " if kind.endswith("_type") else ""
    return f"{said}{wrong}must be {fields[words[-1]].description}"


def _shortened(value: object) -> str:
    text = _toml(value)
    return text if len(text) <= 60 else f"{text[:56]} ..."


def _bare(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]{1,60}", key) else _shortened(key)


def _toml(value: object) -> str:
    """`value` as TOML; a table only as a hint, an integer too long for TOML in hexadecimal."""
    if isinstance(value, list):
        return f"[{', '.join(_toml(item) for item in value)}]"
    if isinstance(value, str):
        # TOML wants DEL escaped, which json does not, and whole emoji, which json would escape in
        # halves.
        text = json.dumps(value, ensure_ascii=False)
        return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in text)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and value.bit_length() > 64:
        return hex(value)
    return "{...}" if isinstance(value, dict) else str(value)


def _scenario(file: SceneToml, source: str) -> Scenario:
    disks = file.disk
    columns = {
        key: np.array([getattr(disk, key) for disk in disks])
        for key in ("position", "radius", "angle", "angular_velocity")
    }
    mass = np.array([np.inf if disk.static else disk.mass for disk in disks], float)
    inertia = np.array([np.nan if disk.inertia is None else disk.inertia for disk in disks])
    walls = [[wall.start, wall.end] for wall in file.wall]
    if file.box:
        walls += box(file.box.low, file.box.high).tolist()
    question = Scenario(
        name=file.name,
        asks=file.asks or f"What do the engines make of {file.name}?",
        source=source,
        scene=Scene(
            **columns,
            velocity=np.array([disk.velocity or [0.0, 0.0] for disk in disks]),
            mass=mass,
            inertia=np.where(np.isnan(inertia), mass * columns["radius"] ** 2 / 2, inertia),
            walls=np.reshape(walls, (-1, 2, 2)),
            gravity=np.array(file.gravity),
            restitution=file.restitution,
            friction=file.friction,
            wrap=np.array([file.wrap.low, file.wrap.high]) if file.wrap else None,
        ),
        duration=file.duration,
        sample_interval=file.sample_interval,
        substeps=file.substeps,
        thrusts=[Thrust(**dict(thrust)) for thrust in file.thrust],
    )
    return with_oracle(question)


def _outside_wrap(file: SceneToml) -> list[str]:
    if not file.wrap:
        return []
    low, high = file.wrap.low, file.wrap.high
    return [
        f"disk[{i}].position = {disk.position}: outside [wrap]; must be from {low} to {high} (m)"
        for i, disk in enumerate(file.disk)
        if not all(a <= x <= b for a, x, b in zip(low, disk.position, high))
    ]


def _overlaps(scene: Scene, free_walls: int) -> Iterator[str]:
    """A line for each disk on a wall or an earlier disk, at most one more than `MOST_FAULTS`."""
    names = [f"wall[{w}]" for w in range(free_walls)]
    sides = ("left", "bottom", "right", "top")
    names += [f"the {side} of [box]" for side in sides[: len(scene.walls) - free_walls]]
    names += [f"disk[{i}]" for i in range(scene.n)]
    found = sorted(islice(_overlapping(scene), MOST_FAULTS + 1), key=lambda each: each[:2])
    for first, second, overlap, (x, y) in found:
        where = f"{names[second]}.position = {scene.position[second - len(scene.walls)].tolist()}"
        remedy = f"must be shifted by [{x:.15g}, {y:.15g}] m or more"
        yield f"{where}: overlaps {names[first]} by {overlap:.6g} m; {remedy}"


def _overlapping(scene: Scene) -> Iterator[tuple[int, int, float, Array]]:
    """Each (first, second, overlap m, smallest shift (2,) m of the second to end it); walls count
    before disks.

    A disk counts as a thick wall of zero length, so that one function measures both. The disks are
    sorted by their left edges, and each row is measured against a slice of them: a wall against all
    disks that may reach it, a disk against those whose left edge is within it. Memory stays linear.
    """
    # "left" is along the longer side
    w, x = len(scene.walls), np.argmax(np.ptp(scene.position, axis=0))
    order = np.argsort(scene.position[:, x] - scene.radius, kind="stable")
    position, radius = scene.position[order], scene.radius[order]
    number = np.concatenate([np.arange(w), w + order])
    start = np.concatenate([scene.walls[:, 0], position])
    along = np.concatenate([scene.walls[:, 1], position]) - start
    thick = np.concatenate([np.zeros(w), radius])
    edge, left = position[:, x] - radius, scene.walls[:, :, x].min(axis=1)
    first = np.concatenate(
        [np.searchsorted(edge, left - 2 * radius.max()), np.arange(1, scene.n + 1)]
    )
    last = np.searchsorted(edge, start[:, x] + np.maximum(along[:, x], 0) + thick, "right")
    for row, length in enumerate(np.hypot(along[:, 0], along[:, 1])):
        near = slice(first[row], last[row])
        unit = along[row] / length if length else np.array([0.0, -1.0])
        offset = position[near] - start[row]
        away = offset - np.clip(offset @ unit, 0, length)[:, None] * unit
        distance = np.hypot(away[:, 0], away[:, 1])
        overlap = thick[row] + radius[near] - distance
        for k in np.flatnonzero(overlap > 0):
            rounding = (
                TOUCHING
                * np.abs([*position[near][k], *offset[k], thick[row] + radius[near][k]]).max()
            )
            # Beside a wall this is its own normal: away / distance is inexact near its line.
            normal = np.array([-unit[1], unit[0]])
            if distance[k] > rounding:
                beside = 0.0 < offset[k] @ unit < length
                normal = normal * np.sign(away[k] @ normal) if beside else away[k] / distance[k]
            one, two = number[row], number[w + first[row] + k]
            if overlap[k] > rounding:
                # If the side is not known, the shift may lead across the middle: then it is longer
                # by that.
                reach = thick[row] + radius[near][k] - away[k] @ normal
                yield (
                    min(one, two),
                    max(one, two),
                    overlap[k],
                    normal * reach * np.sign(two - one) + 0.0,
                )


def scene_text(scenario: Scenario) -> str:
    """The scenario as a scene file, every float so that it reads back bit for bit; truth and seed
    are left out."""
    scene = scenario.scene
    keys = ("name", "asks", "duration", "sample_interval")
    top = {key: getattr(scenario, key) for key in keys} | {
        "substeps": list(scenario.substeps),
        "gravity": scene.gravity.tolist(),
        "restitution": scene.restitution,
        **({"friction": scene.friction} if scene.friction else {}),
    }
    blocks = [(f"# from {_toml(scenario.source)}", top)]
    blocks += [("[[disk]]", _disk_row(scene, i)) for i in range(scene.n)]
    blocks += [("[[wall]]", {"start": start, "end": end}) for start, end in scene.walls.tolist()]
    if scene.wrap is not None:
        blocks += [("[wrap]", dict(zip(("low", "high"), scene.wrap.tolist())))]
    blocks += [
        ("[[thrust]]", vars(thrust) | {"force": thrust.force.tolist()})
        for thrust in scenario.thrusts
    ]
    texts = [
        "\n".join([head, *(f"{key} = {_toml(row[key])}" for key in row)]) for head, row in blocks
    ]
    return "\n\n".join(texts) + "\n"


def _disk_row(scene: Scene, i: int) -> dict[str, object]:
    keys = ("position", "velocity", "radius", "mass", "inertia", "angle", "angular_velocity")
    row = {key: getattr(scene, key)[i].tolist() for key in keys}
    if scene.static[i]:
        row["mass"], row["static"] = None, True
    solid = scene.mass[i] * (scene.radius[i] * scene.radius[i]) / 2
    usual = {"mass": None, "inertia": float(solid), "angle": 0.0, "angular_velocity": 0.0}
    # Compared as text, because -0.0 == 0.0 although the numbers differ.
    return {
        key: value
        for key, value in row.items()
        if key not in usual or repr(value) != repr(usual[key])
    }
