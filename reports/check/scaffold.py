"""`crosscheck check --scaffold NAME DIR`: the files that a grading system needs to run the
check."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from uuid import uuid4

from reports.check.points import DEFAULT, BadPoints, points_text, read_points
from reports.terminal.exits import refuse, say

KINDS = Path(__file__).parent / "autograder"


class ScaffoldKind(NamedTuple):
    """A kind of scaffold: the remaining steps by hand, and the path of the points in the folder."""

    next: str
    points: str = "tasks.toml"


SCAFFOLDS = {
    "gradescope": ScaffoldKind(
        "Now, where the project is: uv build --wheel --out-dir {folder}; then zip what is in"
        " {folder}, and upload the zip to Gradescope."
    ),
    "classroom": ScaffoldKind(
        "Now, where the project is: uv build --wheel --out-dir {folder}/.grading; then copy"
        " {folder}/.github and {folder}/.grading into the template repository of the assignment.",
        ".grading/tasks.toml",
    ),
    "prairielearn": ScaffoldKind(
        "Now, where the project is: uv build --wheel --out-dir {folder}/image; then docker build"
        " --platform linux/amd64 -t YOUR/IMAGE {folder}/image, push it, write its name into"
        " {folder}/question/info.json, and copy {folder}/question into the questions of the"
        " course.",
        "question/tests/tasks.toml",
    ),
}


def write_scaffold(kind: str, folder: Path, points: Path | None, hints: str) -> None:
    """Write the files of a kind to a new or empty folder; exits 2 if that fails."""
    if kind not in SCAFFOLDS:
        refuse([f"--scaffold {kind}: is none of {', '.join(SCAFFOLDS)}"])
    try:
        read_points(points or DEFAULT)
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            refuse([f"{folder}: is there and not empty; name another folder"])
        folder.mkdir(parents=True, exist_ok=True)
        for template in sorted(one for one in (KINDS / kind).rglob("*") if one.is_file()):
            text = template.read_text(encoding="utf-8").replace("HINTS", hints)
            text = text.replace("NEW_UUID", str(uuid4()))
            put(folder / template.relative_to(KINDS / kind), text)
        put(folder / SCAFFOLDS[kind].points, points_text(points or DEFAULT))
    except BadPoints as fault:
        refuse([f"--points {fault}"])
    except OSError as fault:
        refuse([f"{folder}: {fault.strerror or fault}; name a folder that can be written"])
    say(SCAFFOLDS[kind].next.format(folder=folder))


def put(path: Path, text: str) -> None:
    """Write a file with the line ends of Linux; a script may be executed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")
    if text.startswith("#!"):
        path.chmod(0o755)
