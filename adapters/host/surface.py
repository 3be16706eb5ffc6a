"""What a file is and models: the functions that it defines make it a solver of the exercise or an
engine; a scene with features that the line `models` of an engine leaves out is refused."""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterable, Iterator

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.friction import Frictionless
from crosscheck2d.adapters.host.file import NotASolver, SolverFailed, SolverText, module_of
from crosscheck2d.adapters.host.restitution import code_of
from crosscheck2d.scenarios.model import Scene

ENGINE = ("create", "step", "read")
# Names of the exercise: those that an engine may also use, and those that it does not.
SHARED = ("integrate", "advance", "initScene")
EXERCISE = ("sphereSphereCollisionHandling", "performSimStep", "projectObjects")
CLASS = re.compile(r"^class\s+(\w+)(.*?)(?=^class\s|\Z)", re.MULTILINE | re.DOTALL)
HOW = "crosscheck new-engine NAME.js (or NAME.py) writes an engine that works"


def is_engine(solver: SolverText) -> bool:
    """Whether a file is an engine; otherwise it counts as a solver of the exercise.

    An engine may have its own functions `integrate` or `advance` if it has all of `ENGINE`. Raises
    `NotASolver` for a mixture of both.
    """
    names = defined_in(solver.text, solver.kind)
    whole, theirs = names.issuperset(ENGINE), names.intersection(EXERCISE)
    if whole and theirs:
        raise NotASolver(
            f"{solver.path}: has {listed(ENGINE)}, as an engine has, and {listed(sorted(theirs))},"
            " as a solver of the exercise has; leave out one or the other"
        )
    return whole or bool(
        names.intersection(ENGINE) and not names.intersection((*EXERCISE, *SHARED))
    )


def holder_of(solver: SolverText) -> str | None:
    """The class of a file that has the functions of an engine; None if the file has them itself, or
    no class has all."""
    if defined_in(solver.text, solver.kind).issuperset(ENGINE):
        return None
    if solver.kind == "python":
        module = module_of(solver.text)
        classes = [x for x in module.body if isinstance(x, ast.ClassDef)] if module else []
        return next((c.name for c in classes if {*ENGINE} <= {*names_of(c.body)}), None)
    for name, body in CLASS.findall(code_of(solver.text)):
        methods = re.findall(r"^\s+(?:static\s+)?(\w+)\s*\(", body, re.MULTILINE)
        if {*ENGINE} <= {*methods}:
            return str(name)
    return None


def must_be_either(solver: SolverText) -> None:
    names = defined_in(solver.text, solver.kind)
    known = (*ENGINE, *EXERCISE, *SHARED)
    if names and not any(re.search(rf"\b{name}\b", solver.text) for name in known):
        raise NotASolver(
            f"{solver.path}: has neither the functions of the exercise"
            f" (integrate, sphereSphereCollisionHandling) nor those of an engine"
            f" ({listed(ENGINE)}); {HOW}"
        )


def defined_in(text: str, kind: str) -> set[str]:
    """The names that a text defines: for valid Python those of the module, else everything that
    looks like a definition."""
    if kind == "python":
        if module := module_of(text):
            return set(names_of(module.body))
        return set(re.findall(r"^(?:async\s+)?def\s+(\w+)", text, re.MULTILINE))
    code = code_of(text)
    functions = re.findall(r"\bfunction\s*\*?\s*(\w+)\s*\(", code)
    values = re.findall(r"(?<![\w.])(?:(?:const|let|var|class)\s+|globalThis\.)(\w+)", code)
    return {*functions, *values, *re.findall(r"^\s*(\w+)\s*=(?!=)", code, re.MULTILINE)}


def names_of(body: Iterable[ast.stmt]) -> Iterator[str]:
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            yield from (alias.asname or alias.name for alias in node.names)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            yield from (x.id for t in targets for x in ast.walk(t) if isinstance(x, ast.Name))
        else:
            for part in ("body", "orelse", "finalbody"):
                yield from names_of(getattr(node, part, ()))
            for handler in getattr(node, "handlers", ()):
                yield from names_of(handler.body)


def listed(names: Iterable[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


# ---- the line `models` ---------------------------------------------------------------------------

# Word in the line -> its name in a sentence.
FEATURES = {
    "disks": "more than one disk",
    "walls": "walls",
    "gravity": "gravity",
    "static": "disks that cannot move",
    "forces": "forces on disks",
    "rotation": "rotation",
    "friction": "friction",
    "wrap": "the wrap at the edges",
}


def features_of(line: object) -> list[str]:
    asked = f"models must be a text with some of the words {', '.join(FEATURES)}"
    if not isinstance(line, str):
        raise SolverFailed("error", f"has no line models; {asked}")
    if unknown := [word for word in line.split() if word not in FEATURES]:
        raise SolverFailed("error", f"models has the word {unknown[0]!r}; {asked}")
    return line.split()


def must_model(scene: Scene, models: Collection[str], who: str) -> None:
    has = {
        "disks": scene.n > 1,
        "walls": len(scene.walls) > 0,
        "gravity": scene.gravity.any(),
        "static": scene.static.any(),
        "rotation": scene.angular_velocity.any(),
        "friction": scene.friction > 0,
        "wrap": scene.wrap is not None,
    }
    if more := [word for word, there in has.items() if there and word not in models]:
        kind = Frictionless if more == ["friction"] else Unsupported
        raise kind(refusal(who, more))


def refusal(who: str, more: Collection[str]) -> str:
    return f"{who} does not model {', '.join(FEATURES[word] for word in more)}"
