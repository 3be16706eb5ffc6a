"""The features of scenes, in the words of the line `models` of an engine's file; a scene with other
features is refused, naming them."""

from __future__ import annotations

from collections.abc import Collection

from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.friction import Frictionless
from crosscheck2d.adapters.host.file import SolverFailed
from crosscheck2d.scenarios.model import Scene

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
