"""`crosscheck check --scaffold gradescope DIR`: what Gradescope needs to run the check."""

from __future__ import annotations

from pathlib import Path

from crosscheck2d.reports.check.points import DEFAULT, BadPoints, points_text, read_points
from crosscheck2d.reports.terminal.exits import refuse, say

TEMPLATES = Path(__file__).parent / "autograder"
NEXT = (
    "Now, where the project is: uv build --wheel --out-dir {folder}; then zip what is in {folder},"
    " and upload the zip to Gradescope."
)


def write_scaffold(kind: str, folder: Path, points: Path | None, hints: str) -> None:
    """Write the files to a new or empty folder; exits 2 if that fails."""
    if kind != "gradescope":
        refuse([f"--scaffold {kind}: must be gradescope"])
    try:
        read_points(points or DEFAULT)
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            refuse([f"{folder}: is there and not empty; name another folder"])
        folder.mkdir(parents=True, exist_ok=True)
        for template in sorted(TEMPLATES.iterdir()):
            text = template.read_text(encoding="utf-8").replace("HINTS", hints)
            put(folder / template.name, text)
        put(folder / "tasks.toml", points_text(points or DEFAULT))
    except BadPoints as fault:
        refuse([f"--points {fault}"])
    except OSError as fault:
        refuse([f"{folder}: {fault.strerror or fault}; name a folder that can be written"])
    say(NEXT.format(folder=folder))


def put(path: Path, text: str) -> None:
    """Write a file with the line ends of Linux; a script may be executed."""
    path.write_text(text, encoding="utf-8", newline="\n")
    if text.startswith("#!"):
        path.chmod(0o755)
