"""`crosscheck new-engine` and `new-solver`: write a file to begin with."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import NamedTuple

from crosscheck2d.adapters.host.engine import AROUND, EXERCISES, TEMPLATES
from crosscheck2d.adapters.host.file import KINDS, NotASolver, read_solver
from crosscheck2d.reports.run.arguments import faults_of_file
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import refuse

ENGINE = """{0} is an engine that works: put yours in its place. To judge it:
crosscheck run bouncing_ball_e09 box_billiard --engine {0} --engine pymunk --out mine
adapters/README.md explains its functions."""
PORTED = """{0} runs {1}. To judge it:
crosscheck run head_on_equal_e1 gas_of_100 --engine {0} --engine pymunk --out mine
What it says to crosscheck is in the class at its end; adapters/README.md explains it."""
SOLVER = """{0} has the two functions of the exercise, which do nothing yet. To check them:
crosscheck check {0}"""


class Hints(NamedTuple):
    """What a ball code calls its things; None where the hint was not given. The options of
    `crosscheck new-engine` explain each, `source` is its --from."""

    fields: str | None = None
    move: str | None = None
    collide: str | None = None
    step: str | None = None
    ball: str | None = None
    balls: str | None = None
    box: str | None = None
    gravity: str | None = None
    restitution: str | None = None
    per_frame: float | None = None
    pixels: float | None = None
    y_down: bool = False
    source: Path | None = None


FIELDS = "x y vx vy r m"
# Where ball codes keep the size of their box.
BOXES = ("canvas.width canvas.height", "WIDTH HEIGHT", "width height", "W H")


def write_engine(path: Path, hints: Hints = Hints()) -> None:  # noqa: B008 - a tuple
    kind = kind_of(path)
    if hints == Hints():
        write_new(path, TEMPLATES[kind].read_text(encoding="utf-8"), ENGINE)
        return
    runs = "as it is" if hints.source else "once it has your code at its top"
    write_new(path, ported(kind, hints), PORTED.replace("{1}", runs))


def ported(kind: str, hints: Hints) -> str:
    """An engine around a ball code; exits 2 for hints that do not fit."""
    # templates are slow to import
    from crosscheck2d.reports.page.documents import environment

    names = (hints.fields or FIELDS).split()
    if len(names) not in (5, 6):
        refuse(f'--fields "{hints.fields}": must be the names of x, y, vx, vy, radius and mass')
    fields = [name if name.startswith("[") else f".{name}" for name in names]
    plain = all(name.isidentifier() for name in names)
    if not plain and hints.ball is None:
        refuse(f'--fields "{hints.fields}": --ball has to say how such a ball is made')
    code = code_in(hints.source, kind)
    if code is not None and hints.box is None:
        words = set(re.findall(r"[\w.]+", code))
        hints = hints._replace(box=next((x for x in BOXES if {*x.split()} <= words), None))
    box = (hints.box or "").split()
    if len(box) not in (0, 2):
        refuse(f'--box "{hints.box}": must be the names of its width and its height')
    for option, value in (("--pixels", hints.pixels), ("--per-frame", hints.per_frame)):
        if value is not None and not 0 < value < 1e9:
            refuse(f"{option} {value:g}: must be above 0")
    try:
        restitution, variable = f"{float(hints.restitution or 1):g}", None
    except ValueError:
        restitution, variable = str(hints.restitution), hints.restitution
    sized = [name for name in box if code is None or name in code]  # else they are arguments
    settable = [x for x in (*sized, hints.gravity, variable) if x and x.isidentifier()]
    if code is not None and kind == "javascript":
        for name in settable:  # each scene sets it
            code = re.sub(rf"\bconst\b(?=[^;\n]*\b{name}\s*=[^=])", "let", code)
    move, collide = hints.move or "move", hints.collide or "collide"
    used = {"--step": hints.step} if hints.step else {"--move": move, "--collide": collide}
    for option, name in used.items() if code is not None else ():
        (function,) = re.findall(r"(\w+)$", name.partition("(")[0].strip()) or [name]
        if not re.search(rf"\b{re.escape(function)}\b", str(code)):
            refuse(
                f"{option} {name}: {hints.source} has no {function}; name a function that it has"
            )
    dt = [] if hints.per_frame else ["dt"]
    template = AROUND[kind].read_text(encoding="utf-8")
    return environment().overlay(autoescape=False).from_string(template).render(
        **dict(zip(FIELDS.split(), [*fields, ""])),
        fields=[*zip(FIELDS.split(), fields)],
        code=code,
        ball=hints.ball or {"javascript": "{}", "python": "SimpleNamespace()"}[kind],
        move_call=call(move, ["ball"], dt),
        collide_call=call(collide, ["a", "b"], []),
        step=hints.step and call(hints.step, [], dt),
        restitution=restitution,
        restitution_name=variable,
        settable=settable,
        sized=sized,
        **{name: getattr(hints, name) for name in ("balls", "gravity", "per_frame", "y_down")},
        pixels=f"{hints.pixels or 1:g}",
        box=box,
    )  # fmt: skip


def call(name: str, on: list[str], rest: list[str]) -> str:
    """The call of a function or a method; a whole call as it is."""
    if "(" in name:
        return name.rstrip(";")
    if name.startswith("."):
        return f"{on[0]}{name}({', '.join([*on[1:], *rest])})"
    return f"{name}({', '.join([*on, *rest])})"


def code_in(source: Path | None, kind: str) -> str | None:
    if source is None:
        return None
    try:
        solver = read_solver(source)
    except NotASolver as refusal:
        refuse(f"--from {refusal}")
    if solver.kind != kind:
        refuse(f"--from {source}: is in another language than the file to write")
    return solver.text.rstrip()


def write_solver(path: Path) -> None:
    write_new(path, EXERCISES[kind_of(path)].read_text(encoding="utf-8"), SOLVER)


def kind_of(path: Path) -> str:
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        refuse(f"{path}: ends in {path.suffix or 'nothing'}; name a .js or a .py file")
    if ":" in str(path):
        refuse(faults_of_file(path))
    return kind


def write_new(path: Path, text: str, done: str) -> None:
    name = shlex.quote(str(path))
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text.replace("THIS_FILE", name))
    except FileExistsError:
        refuse(f"{path}: exists; name another file")
    except OSError as fault:
        refuse(f"{path}: {fault.strerror or fault}; name a file that can be written")
    Console().print(done.format(name), highlight=False, soft_wrap=True)
