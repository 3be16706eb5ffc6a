"""`crosscheck new-engine`: writes a working engine to a file."""

from __future__ import annotations

import shlex
from pathlib import Path

from crosscheck2d.adapters.own_engine.engine import TEMPLATES
from crosscheck2d.adapters.own_solver.file import KINDS
from crosscheck2d.reports.run.arguments import faults_of_file
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import refuse


def write_engine(path: Path) -> None:
    """Write the template of the language given by the suffix, and print how to judge it; exits 2 if
    it cannot be written or exists."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        refuse([f"{path}: ends in {path.suffix or 'nothing'}; name a .js or a .py file"])
    if ":" in str(path):
        refuse(faults_of_file(path))
    shown = shlex.quote(str(path))
    text = TEMPLATES[kind].read_text(encoding="utf-8").replace("THIS_FILE", shown)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        refuse([f"{path}: exists; name another file"])
    except OSError as fault:
        refuse([f"{path}: {fault.strerror or fault}; name a file that can be written"])
    Console().print(
        f"{path} is an engine that works: put yours in its place. To judge it:\n"
        f"crosscheck run bouncing_ball_e09 box_billiard --engine {shown} --engine pymunk --out mine"
        f"\nadapters/README.md explains its functions.",
        highlight=False,
        soft_wrap=True,
    )
