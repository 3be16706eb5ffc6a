"""How many points each question of each task gives: tasks.toml, or the file that --points names."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from crosscheck2d.reports.check.rows import TASKS

DEFAULT = Path(__file__).parent / "tasks.toml"
# The questions that may have points, by task. "loop" and "scenes" have none by default: the
# exercise provides the step, and a scene is wrong only if a task is.
QUESTIONS = {
    "1": (
        *("velocity", "position", "spin", "angle", "turns"),
        *("coasting", "force kept", "sphere kept", "input only"),
    ),
    "2a": ("overlap", "just touching", "same centre", "input only"),
    "2b": ("one point", "normal", "velocities", "shares", "separating pair"),
    "2c": (
        *("impulse", "tangential part", "energy", "restitution"),
        *("restitution at other speeds", "separating", "A and B exchanged"),
    ),
    "2d": ("velocity of A", "velocity of B", "momentum", "rest kept"),
    "loop": ("all spheres", "pairs", "integration first", "edges in a step", "edges", "ufo"),
    "scenes": ("forced", "head_on", "oblique", "row", "crowd", "first wrong collision"),
}
AS_A_WHOLE = "write 2c = 4 above the first [header], and delete [2c] with its questions"
DECIMAL_COMMA = re.compile(r"=\s*\d+,\d")
Points = Mapping[str, Mapping[str, float]]
"""Task -> question -> points. A task that is not in it gives none."""


class BadPoints(ValueError):
    """An unusable file of points; the message names it and says what to change."""


def read_points(path: Path = DEFAULT) -> Points:
    """The points of a file, tasks in the order of the exercise; raises `BadPoints`."""
    try:
        text = points_text(path)
        given = tomllib.loads(text)
    except OSError as fault:
        raise BadPoints(
            f"{path}: {fault.strerror or fault}; name a file that can be read"
        ) from None
    except UnicodeDecodeError as fault:
        line = 1 + bytes(fault.object[: fault.start]).count(b"\n")
        raise BadPoints(f"{path}: line {line} is not UTF-8; save the file as UTF-8") from None
    except ValueError as fault:
        hint = "; write 4.5, not 4,5" if DECIMAL_COMMA.search(text) else ""
        twice = re.search("overwrite|twice|declare", str(fault))
        hint = f"; a task has points as a whole or by question: {AS_A_WHOLE}" if twice else hint
        raise BadPoints(f"{path}: is not TOML: {' '.join(str(fault).split())}{hint}") from None
    if unknown := [task for task in given if task not in QUESTIONS]:
        raise BadPoints(f"{path}: there is no task {unknown[0]!r}; tasks: {', '.join(QUESTIONS)}")
    points = {task: of_task(path, task, given[task]) for task in TASKS if task in given}
    total = sum(sum(questions.values()) for questions in points.values())
    if not total or not math.isfinite(total):
        raise BadPoints(
            f"{path}: gives {'more than can be added' if total else 'no points at all'}"
        )
    return points


def points_text(path: Path) -> str:
    """The text of a file of points; editors of Windows put a mark before UTF-8."""
    return path.read_text(encoding="utf-8-sig")


def of_task(path: Path, task: str, given: Any) -> dict[str, float]:
    """The points of the questions of a task: as given, or one number distributed in the default
    proportions.

    Raises `BadPoints`.
    """
    if not isinstance(given, dict):
        share = shares(task)
        whole = amount(path, task, given)
        return {name: whole * part / sum(share.values()) for name, part in share.items()}
    for name in given:
        if name not in QUESTIONS[task]:
            known = ", ".join(QUESTIONS[task])
            why = f"{path}: task {task} has no question {name!r}; questions: {known}"
            # the name of a task stands below the header of another
            hint = f"; for the points of a task: {AS_A_WHOLE}" if name in QUESTIONS else ""
            raise BadPoints(f"{why}{hint}")
    return {name: amount(path, f"{task}, {name}", value) for name, value in given.items()}


def shares(task: str) -> dict[str, float]:
    """The default points of the questions of a task; equal if it has none."""
    given = tomllib.loads(DEFAULT.read_text(encoding="utf-8"))
    return given.get(task) or dict.fromkeys(QUESTIONS[task], 1.0)


def amount(path: Path, what: str, value: Any) -> float:
    """A number of points; raises `BadPoints`."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or value < 0:
        raise BadPoints(f"{path}: task {what}: {value!r} is no number of points, 0 or more")
    return float(value)
