"""What `crosscheck lesson` does: serves the lessons, or writes one as a file."""

from __future__ import annotations

import sys
from pathlib import Path

from reports.exits import refuse
from reports.game.command import FIRST
from reports.game.server import Game, application, serve
from reports.lessons.catalogue import LESSONS
from reports.lessons.pages import ROUTES, offline


def open_lesson(name: str, port: int, opens: bool, export: Path | None) -> None:
    """Serve the lessons, opened at `name` or their list, or write `name` to `export`; exits 2 on bad input."""
    if name and name not in LESSONS:
        refuse([f"lesson {name!r} is not known; there are {', '.join(LESSONS)}"])
    if export is not None:
        write_lesson(name, export)
        return
    try:
        serve(application(Game(list(FIRST)), ROUTES), port, f"/lesson/{name}".rstrip("/"), opens)
    except OSError as fault:
        refuse([f"--port {port}: {fault}; name another"])


def write_lesson(name: str, path: Path) -> None:
    """One self-contained page, from runs of every setting of its sliders."""
    if not name:
        refuse(["--export needs the name of a lesson: " + ", ".join(LESSONS)])

    def tell(done: int, of: int) -> None:
        print(f"\r{done} of {of} runs", end="\n" if done == of else "", file=sys.stderr, flush=True)

    try:
        path.write_text(offline(LESSONS[name], tell), encoding="utf-8")
    except OSError as fault:
        refuse([f"--export {path}: {fault.strerror or fault}"])
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB, opens without a server")
