"""`crosscheck new-engine` and `new-solver`: write a file to begin with."""

from __future__ import annotations

import shlex
from pathlib import Path

from crosscheck2d.adapters.host.engine import EXERCISES, TEMPLATES
from crosscheck2d.adapters.host.file import KINDS
from crosscheck2d.reports.run.arguments import faults_of_file
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import refuse

ENGINE = """{0} is an engine that works: put yours in its place. To judge it:
crosscheck run bouncing_ball_e09 box_billiard --engine {0} --engine pymunk --out mine
adapters/README.md explains its functions."""
SOLVER = """{0} has the two functions of the exercise, which do nothing yet. To check them:
crosscheck check {0}"""


def write_engine(path: Path) -> None:
    """Write an engine that works, in the language given by the suffix."""
    write_template(path, TEMPLATES, ENGINE)


def write_solver(path: Path) -> None:
    """Write the skeleton of the exercise."""
    write_template(path, EXERCISES, SOLVER)


def write_template(path: Path, templates: dict[str, Path], done: str) -> None:
    """Write a template, and print what to do next; exits 2 if it cannot be written or exists."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        refuse([f"{path}: ends in {path.suffix or 'nothing'}; name a .js or a .py file"])
    if ":" in str(path):
        refuse(faults_of_file(path))
    name = shlex.quote(str(path))
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(templates[kind].read_text(encoding="utf-8").replace("THIS_FILE", name))
    except FileExistsError:
        refuse([f"{path}: exists; name another file"])
    except OSError as fault:
        refuse([f"{path}: {fault.strerror or fault}; name a file that can be written"])
    Console().print(done.format(name), highlight=False, soft_wrap=True)
