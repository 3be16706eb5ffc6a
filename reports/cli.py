"""The command line. What a command needs is imported when it runs, so that `--help` answers at
once."""

from __future__ import annotations

import shlex
import sys
from functools import partial
from os.path import isdir  # unlike that of a path, it takes names that no file can have
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from crosscheck2d.reports.terminal.exits import refuse

app = typer.Typer(
    name="crosscheck",
    help=(
        "Play the same scenes of 2D disks through several physics engines, and measure each against"
        " the exact answer. Without a command: all scenes, all engines, to reports/out/latest/."
    ),
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
VARIED = "dt, speed, mass_ratio, restitution, scale, offset"


def place(text: str) -> Path:
    """A path as it was given; exits 2 for an empty one, which `Path` takes for the current
    folder."""
    if not text:
        refuse('"": is not there; name a file or a folder')
    return Path(text)


path_option = partial(Option, metavar="PATH", parser=place)
path_argument = partial(Argument, parser=place)
SCENE = "SCENARIO|FILE.toml"
AsJson = Annotated[bool, Option("--json", help="Print JSON.")]
ENGINES = (
    "Play only this engine: a name, at a version such as pymunk@6.8.1, or a file of your own."
    " Repeatable."
)
Engines = Annotated[
    list[str] | None, Option("--engine", metavar="NAME[@VERSION][:PROFILE]|FILE", help=ENGINES)
]
Seed = Annotated[int, Option(min=0, metavar="N", help="Seed of random scenes.")]
RESULTS = "Folder for the results. What was measured there before is not measured again."
Results = Annotated[Path, Option(metavar="DIR", help=RESULTS)]
Fresh = Annotated[bool, Option("--fresh", help="Ignore the results that --out has.")]
OneScene = Annotated[str, Argument(metavar=SCENE, help="A name of crosscheck list, or a file.")]
WORKERS = "Number of processes; 0: one for each core."
Workers = Annotated[int, Option(min=0, metavar="N", help=WORKERS)]
TIMEOUT = (
    "Time limit of each cell and of each exact answer. A cell is stopped even in C code; an exact"
    " answer ends earlier."
)
Timeout = Annotated[float, Option(min=0.1, max=1e6, metavar="S", help=TIMEOUT)]
PORT = "Port on this machine; if it is in use, the next free one."
Port = Annotated[int, Option(min=1, max=65535, metavar="N", help=PORT)]
Opens = Annotated[bool, Option("--open", help="Open the page in a browser.")]


def as_typed() -> str:
    """The command, as a shell would take it again."""
    return shlex.join(["crosscheck", *sys.argv[1:]])


@app.callback(invoke_without_command=True)
def default(context: typer.Context) -> None:
    """Without a command: all scenes through all engines, to reports/out/latest/."""
    if context.invoked_subcommand is None:
        app(["run"])


@app.command()
def run(
    scenes: list[str] | None = Argument(
        None, metavar=SCENE, help="Names of crosscheck list, or files. Default: all scenarios."
    ),
    engine: Engines = None,
    dt: list[float] | None = Option(
        None, metavar="S", help="Play this step size instead of those of the scene. Repeatable."
    ),
    full: bool = Option(False, "--full", help="Add two finer step sizes to every scene."),
    seed: Seed = 0,
    out: Results = Path("reports/out/latest"),
    timings: float = Option(
        12.0,
        min=0,
        max=3600,
        metavar="SECONDS",
        help="Time limit of the timing pass after the run; it doubles with JavaScript engines."
        " 0: no timing pass.",
    ),
    workers: Workers = 0,
    timeout: Timeout = 60.0,
    memory: int = Option(
        0,
        min=0,
        max=10**9,
        metavar="MB",
        help="Memory limit of a process; 0: an equal share of the machine's memory.",
    ),
    scheduler: str = Option(
        "", metavar="tcp://...", help="Play on the workers of this dask scheduler."
    ),
    fresh: Fresh = False,
    trajectories: bool = Option(
        False, "--trajectories", help="Write the trajectory of each cell as an .npz, too."
    ),
    bits: bool = Option(
        False,
        "--bits",
        help="Write hashes of all results at the middle step size to bits.csv, and compare them"
        " with those kept in reports/bits.csv. Exit status 1: an engine has other bits.",
    ),
) -> None:
    """Play scenes through engines, and write the report."""
    from crosscheck2d.reports.commands.run import means_of, run_plan

    means = means_of(workers, timeout, memory, scheduler)
    what = scenes or [], engine or [], dt or [], full, seed, timings, out
    run_plan(*what, fresh, trajectories, bits, means, as_typed())


@app.command()
def report(
    out: Path = Argument(..., metavar="OUT", help="The folder of a run, finished or not."),
    timings: float | None = Option(
        None, min=0.1, max=3600, metavar="SECONDS", help="Time the engines again, in so many s."
    ),
) -> None:
    """Write the tables and the page of a run again.

    They are made from what was played; no scene is played again. With --timings the engines are
    timed again.
    """
    from crosscheck2d.reports.commands.run import report_again

    report_again(out, timings)


@app.command()
def diff(
    before: Path = Argument(..., metavar="OUT_A", help="The folder of a run."),
    after: Path = Argument(..., metavar="OUT_B", help="The folder of a later one."),
) -> None:
    """Show what changed between two runs.

    Compares how the cells ended, their numbers, and how long they took. The exit status is 1 if
    anything got worse.
    """
    from crosscheck2d.reports.commands.diff import show_difference

    show_difference(before, after)


@app.command()
def truth(
    scene: OneScene,
    events: bool = Option(False, "--events", help="Print all collisions, not only twenty."),
    at: float | None = Option(
        None, metavar="SECONDS", help="Print where each disk is then, and how it moves."
    ),
    as_json: AsJson = False,
    seed: Seed = 0,
    timeout: Timeout = 60.0,
) -> None:
    """Print the exact answer to a scene.

    Shows its collisions, its horizon (the time up to which it holds, and what ends it), and its
    error bound. With --at, shows position, velocity, angle and spin of each disk at that time; at
    the instant of a collision, those after it.
    """
    from crosscheck2d.reports.commands.truth import show_truth

    show_truth(scene, seed, events, at, as_json, timeout)


@app.command()
def check(
    path: Path = path_argument(
        ...,
        metavar="FILE|DIR",
        help="An Exercise.js, a solver.py, or a folder of them, one for each student.",
    ),
    as_json: bool = Option(False, "--json", help="Print every question and its answer as JSON."),
    junit: Path | None = path_option(None, help="Write every question as a JUnit test, too."),
    page: Path | None = path_option(
        None,
        help="Where to write the page of the file, or of the class.  [default: check.html for a"
        " file, none for a class]",
    ),
    formats: list[str] | None = Option(
        None,
        "--format",
        metavar="NAME",
        help="Write the marks as table, json, junit, gradescope or csv. Repeatable, each with"
        " its --out.",
    ),
    outs: list[Path] | None = path_option(
        None,
        "--out",
        help="Where the --format goes.  [default: printed]  Without a --format, of a class: the"
        " folder (a name without a dot) for its marks and its page. What was checked there"
        " before is not checked again.",
    ),
    fresh: Fresh = False,
    points: Path | None = path_option(
        None,
        metavar="TASKS.toml",
        help="File with the points of each task or question.  [default: 20 in all]",
    ),
    id_pattern: str = Option(
        "",
        metavar="REGEX",
        help="Pattern of the student's id in the path: the match, or its first group."
        "  [default: name of the folder or file]",
    ),
    hints: str = Option(
        "full",
        metavar="full|low",
        help="Whether marks of a student name likely causes, or only wrong answers.",
    ),
    scaffold: str = Option(
        "", metavar="gradescope", help="Write an autograder to DIR, and check nothing."
    ),
    seed: int | None = Option(
        None,
        metavar="N",
        min=0,
        help="Numbers of the questions.  [default: 0 for a file, random for a class]",
    ),
    packages: list[str] | None = Option(
        None,
        "--package",
        metavar="NAME",
        help="An installed package that a solver.py may import beside numpy. Repeatable.",
    ),
    unprotected: bool = Option(
        False, "--unprotected", help="Check a folder with Python files even where no sandbox works."
    ),
) -> None:
    """Check a hand-written solver of the exercise.

    Says what is right, what is wrong, and what likely causes each fault, and gives points.

    A solver.py runs in a sandbox where one works, which is said. It may import numpy, Python's own
    modules, and modules beside it that are not named like one of those.
    """
    from crosscheck2d.reports.check import command

    grading = command.grading_of(points, id_pattern, hints)
    if scaffold:
        from crosscheck2d.reports.check.scaffold import write_scaffold

        write_scaffold(scaffold, path, points, hints)
        return
    folder = None
    # a name with a suffix is a file, such as marks.csv, of which --format has to say what it holds
    if outs and len(outs) == 1 and not formats and not outs[0].suffix and isdir(path):
        folder = outs.pop()
    if fresh and folder is None:
        refuse("--fresh: is for the results of a class that --out FOLDER keeps")
    outputs = command.outputs_of(as_json, junit, formats or [], outs or [])
    asking = command.Asking(seed, packages or (), unprotected, folder, fresh)
    command.check(path, page, outputs, grading, asking)


@app.command()
def play(
    flight: Path | None = path_argument(
        None, metavar="FLIGHT.toml", help="A saved flight to fly again."
    ),
    engine: Engines = None,
    port: Port = 8000,
    opens: Opens = False,
) -> None:
    """Fly the exercise's spaceship through several engines.

    All engines get the same thrusts at once; a browser shows how they diverge.
    """
    from crosscheck2d.reports.commands import serve

    serve.play(flight, engine or [], port, opens)


@app.command()
def lesson(
    name: str = Argument("", metavar="NAME", help="Its name or number. Default: the list."),
    port: Port = 8000,
    opens: Opens = False,
    export: Path | None = path_option(
        None, help="Write lesson NAME to a file, or all lessons to a folder, to open offline."
    ),
) -> None:
    """Show why engines differ, in lessons with sliders.

    A lesson is a page in a browser: a scene that runs, the exact answer beside it, and sliders.

    Each has a number and a name: 1 particle, 2 thrust, 3 box, 4 meeting, 5 crowd, 6.1
    threshold, 6.2 mixing, 6.3 order, 6.4 gravity, 6.5 correction, 6.6 substeps, 6.7 digits, 6.8
    cap, 6.9 row, 6.10 float32, 6.11 javascript, 7 horizon, 8 limits, 9.1 friction, 9.2 cone,
    9.3 lever, 9.4 rolling.
    """
    if export is None:
        from crosscheck2d.reports.commands import serve

        serve.lesson(name, port, opens)
    else:
        from crosscheck2d.reports.lessons.command import write_lessons

        write_lessons(name, export)


@app.command()
def speed(
    scenes: list[str] | None = Argument(
        None,
        metavar=SCENE,
        help="Names of crosscheck list, or files. Default: one of each kind, or with --full all.",
    ),
    engine: Engines = None,
    full: bool = Option(
        False,
        "--full",
        help="Measure all scenarios, finer steps, more rounds, up to 100 000 disks.",
    ),
    fresh: Fresh = False,
    seed: Seed = 0,
    out: Results = Path("reports/out/speed"),
) -> None:
    """Measure error against time for every engine.

    Let nothing else run on the machine meanwhile.
    """
    from crosscheck2d.reports.speed.command import run_speed

    run_speed(scenes or [], engine or [], full, fresh, seed, out, as_typed())


@app.command()
def advise(
    scene: OneScene,
    error: str = Option("1%", metavar="E", help="The largest error allowed: 1% or 0.01."),
    purpose: str = Option(
        "trajectory",
        "--for",
        metavar="PURPOSE",
        help="What the error is of: trajectory, energy or statistics.",
    ),
    engine: Engines = None,
    seed: Seed = 0,
    as_json: AsJson = False,
) -> None:
    """Find the cheapest engine and step size for a scene.

    Also shows which options of an engine the scene does not need, and what they cost in it.
    """
    from crosscheck2d.reports.speed.advise import give_advice

    give_advice(scene, error, purpose, engine or [], seed, as_json)


@app.command()
def stability(
    cases: list[str] | None = Argument(
        None,
        metavar="CASE|FILE.toml",
        help="Cases: rows of limits.csv, or scene files. Default: all cases.",
    ),
    vary: list[str] | None = Option(
        None,
        metavar="WHAT",
        help=f"What to vary in FILE.toml: {VARIED}. Repeatable. Default: each of them.",
    ),
    engine: Engines = None,
    full: bool = Option(
        False, "--full", help="Play all runs at more values, to brackets of 1 % instead of 5 %."
    ),
    fresh: Fresh = False,
    out: Results = Path("reports/out/stability"),
    workers: Workers = 0,
) -> None:
    """Find where each engine fails.

    Changes one parameter from gentle to harsh until the engine fails, and shows the failing run
    with its cause.
    """
    from crosscheck2d.reports.stability.command import find_limits

    find_limits(cases or [], vary or [], engine or [], full, fresh, out, workers, as_typed())


@app.command()
def tune(
    engine: list[str] | None = Argument(
        None,
        metavar="ENGINE",
        help="Engines to search. Default: all with settings to search that need no --extra.",
    ),
    fresh: Fresh = False,
    out: Results = Path("reports/out/tune"),
) -> None:
    """Search the public settings of engines.

    Finds those that bring an engine nearest to the exact answers at equal cost.
    """
    from crosscheck2d.reports.tune import command

    command.tune(engine or [], fresh, out)


@app.command()
def new_engine(
    name: Path = path_argument(
        ..., metavar="NAME", help="The file to write: NAME.js in JavaScript, NAME.py in Python."
    ),
    source: Path | None = path_option(
        None,
        "--from",
        metavar="FILE",
        help="Your ball code, which is copied into it. The other options say what it is like.",
    ),
    fields: str | None = Option(
        None,
        metavar="NAMES",
        help='Of a ball: x, y, vx, vy, radius, mass, as "x y dx dy r m" or "pos.x ...".',
    ),
    move: str | None = Option(
        None,
        metavar="CALL",
        help="Moves a ball: NAME, .METHOD or a call with ball, dt, width, height.",
    ),
    collide: str | None = Option(
        None, metavar="CALL", help="Collides two balls: NAME, .METHOD or a call with a and b."
    ),
    step: str | None = Option(
        None, metavar="CALL", help="Moves and collides all balls: NAME or a call with dt."
    ),
    ball: str | None = Option(
        None,
        metavar="EXPRESSION",
        help='Makes a ball from x, y, vx, vy, r, m: "new Ball(x, y, r)".',
    ),
    balls: str | None = Option(
        None, metavar="NAME", help="The list of all balls, if --step uses one."
    ),
    box: str | None = Option(
        None, metavar="NAMES", help='Width and height of its box: "canvas.width H".'
    ),
    gravity: str | None = Option(None, metavar="NAME", help="Its gravity, positive if down."),
    restitution: str | None = Option(
        None, metavar="NAME|NUMBER", help="Its restitution. Default: 1."
    ),
    per_frame: float | None = Option(
        None, metavar="N", help="Its speeds are per frame, with N frames a second."
    ),
    pixels: float | None = Option(None, metavar="N", help="Its pixels in 1 m."),
    y_down: bool = Option(False, "--y-down", help="Its y points down."),
) -> None:
    """Write an engine to begin with, in a file of your own.

    It works as it is. Put your own engine in its place, and judge it with --engine NAME.
    """
    from crosscheck2d.reports.commands.new_engine import Hints, write_engine

    hints = Hints(
        *(fields, move, collide, step, ball, balls, box, gravity, restitution),
        *(per_frame, pixels, y_down, source),
    )
    write_engine(name, hints)


@app.command()
def new_solver(
    name: Path = path_argument(
        ..., metavar="NAME", help="The file to write: Exercise.js or solver.py."
    ),
) -> None:
    """Write the two functions of the exercise, to be filled in."""
    from crosscheck2d.reports.commands.new_engine import write_solver

    write_solver(name)


@app.command(name="list")
def list_(
    kind: str = Argument(
        "", metavar="engines|scenarios|metrics|verdicts|cases|lessons", help="Default: all."
    ),
) -> None:
    """List engines, scenarios, metrics, verdicts, cases and lessons, and say what each is."""
    from crosscheck2d.reports.commands.listing import explain

    explain(kind)
