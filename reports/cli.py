"""The command line. What a command needs is imported when it runs, so that `--help` answers at
once."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from reports.terminal.exits import refuse

app = typer.Typer(
    name="crosscheck",
    help=(
        "Cross-validation of 2D disk solvers: the same scenes through every engine, each against an"
        " exact answer."
    ),
    no_args_is_help=False,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
DEFAULT_OUT = Path("reports/out/latest")

Scenes = Annotated[
    list[str] | None,
    typer.Argument(metavar="[SCENARIO|FILE.toml]...", help="Default: all scenarios."),
]
Engines = Annotated[
    list[str] | None,
    typer.Option(
        "--engine", metavar="NAME[:PROFILE]|FILE", help="Play only this engine; repeatable."
    ),
]
Dts = Annotated[
    list[float] | None,
    typer.Option(
        "--dt", metavar="S", help="Use this step size instead of the scenario's own; repeatable."
    ),
]
Full = Annotated[bool, typer.Option("--full", help="Add two finer step sizes to every scenario.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of random scenes.")]
Out = Annotated[
    Path,
    typer.Option(
        help="Folder for the results; an earlier run there is replaced when this one is done."
    ),
]
Workers = Annotated[int, typer.Option(min=0, help="Number of processes; 0: one per core.")]
Timeout = Annotated[
    float,
    typer.Option(
        min=0.1,
        max=1e6,
        metavar="S",
        help=(
            "That a cell, or an exact answer, may take; then it is stopped, in C too (truth: given"
            " up to there)."
        ),
    ),
]
Memory = Annotated[
    int,
    typer.Option(
        min=0,
        max=10**9,
        metavar="MB",
        help="Memory limit of a process; 0: its share of this machine's.",
    ),
]
Scheduler = Annotated[
    str, typer.Option(metavar="tcp://...", help="Play on the workers of this dask scheduler.")
]
Timings = Annotated[
    int,
    typer.Option(
        min=0,
        max=10_000,
        metavar="N",
        help="Rounds of timings after the run, one process at a time.",
    ),
]
Resume = Annotated[
    Path | None,
    typer.Option(
        metavar="OUT", help="Complete an earlier run: play what is missing or has changed."
    ),
]
Port = Annotated[int, typer.Option(min=1, max=65535, help="Port on this machine.")]
Opens = Annotated[bool, typer.Option("--open", help="Open it in a browser.")]


def place(text: str) -> Path:
    """A path as it was given; exits 2 for an empty one, which `Path` takes for the current
    folder."""
    if not text:
        refuse(['"": is not there; name a file or a folder'])
    return Path(text)


@app.callback(invoke_without_command=True)
def default(context: typer.Context) -> None:
    """Without a command: the main job, all scenarios through all engines, to
    reports/out/latest/."""
    if context.invoked_subcommand is None:
        run()


@app.command()
def run(
    scenes: Scenes = None,
    engine: Engines = None,
    dt: Dts = None,
    full: Full = False,
    seed: Seed = 0,
    out: Out = DEFAULT_OUT,
    timings: Timings = 0,
    workers: Workers = 0,
    timeout: Timeout = 60.0,
    memory: Memory = 0,
    scheduler: Scheduler = "",
    resume: Resume = None,
) -> None:
    """Play some scenarios or scene files through some engines, compare, and report."""
    from reports.commands import run as run_command

    means = run_command.means_of(workers, timeout, memory, scheduler)
    if resume is None:
        command = shlex.join(["crosscheck", *sys.argv[1:]])
        run_command.run_plan(
            scenes or [], engine or [], dt or [], full, seed, timings, out, means, command
        )
    asked = [scenes, engine, dt, full, seed, timings, out != DEFAULT_OUT]
    run_command.resume(resume, means, alone=not any(asked))


@app.command()
def report(
    out: Annotated[Path, typer.Argument(help="The folder of a run, finished or not.")],
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCENE]...", help="With --print: scenes to have on paper."),
    ] = None,
    printed: Annotated[
        bool, typer.Option("--print", help="Give each SCENE half a page where the page is printed.")
    ] = False,
) -> None:
    """Make the tables and the page of a run again, from its journal."""
    from reports.commands.report import report_again

    report_again(out, scenes or [], printed)


@app.command()
def replay(
    cell: Annotated[str, typer.Argument(help="Cell of runs.csv, or its first characters.")],
    out: Annotated[Path, typer.Option(help="The folder of the run.")] = DEFAULT_OUT,
    timeout: Timeout = 60.0,
) -> None:
    """Play one cell again, step by step: a failed one from its last good state, others from the
    start."""
    from reports.commands import replay as replay_command

    replay_command.replay(cell, out, timeout)


@app.command()
def diff(
    before: Annotated[Path, typer.Argument(metavar="OUT_A", help="The folder of a run.")],
    after: Annotated[Path, typer.Argument(metavar="OUT_B", help="The folder of a later one.")],
) -> None:
    """What changed between two runs: statuses, numbers, timings; exit 1 if something got worse."""
    from reports.commands import diff as diff_command

    diff_command.show_difference(before, after)


@app.command()
def truth(
    scene: Annotated[str, typer.Argument(metavar="SCENARIO|FILE.toml")],
    events: Annotated[
        bool, typer.Option("--events", help="All collisions, not only the first and last ten.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    seed: Seed = 0,
    timeout: Timeout = 60.0,
) -> None:
    """Print the exact answer to a scene: its collisions, its horizon, and its error bound."""
    from reports.commands.truth import show_truth

    show_truth(scene, seed, events, as_json, timeout)


@app.command()
def check(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FILE|DIR",
            parser=place,
            help="An Exercise.js, a solver.py, or a folder of them.",
        ),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print all rows as JSON.")] = False,
    junit: Annotated[
        Path | None,
        typer.Option(metavar="PATH", parser=place, help="Write the rows as JUnit XML, too."),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(metavar="PATH", parser=place, help="File of the page.  [default: check.html]"),
    ] = None,
) -> None:
    """Check a hand-written solver of the exercise, and say what is wrong with it. The file is run
    as you.

    A Python file may import installed packages, and modules in its own folder whose names differ
    from theirs.
    """
    from reports.check.command import check as check_and_say

    check_and_say(path, as_json, junit, page)


@app.command()
def play(
    flight: Annotated[
        Path | None,
        typer.Argument(metavar="[FLIGHT.toml]", parser=place, help="Fly a saved flight again."),
    ] = None,
    engine: Engines = None,
    port: Port = 8000,
    opens: Opens = False,
) -> None:
    """Fly the exercise's spaceship through several engines at once, in a browser."""
    from reports.commands import serve

    serve.play(flight, engine or [], port, opens)


@app.command()
def lesson(
    name: Annotated[str, typer.Argument(metavar="[NAME]", help="Lesson to begin with.")] = "",
    port: Port = 8000,
    opens: Opens = False,
    export: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            parser=place,
            help="Write NAME as one page that needs no server, or all to a folder.",
        ),
    ] = None,
) -> None:
    """Learn why engines differ: short pages with scenes that run and the exact answer beside
    them."""
    if export is None:
        from reports.commands import serve

        serve.lesson(name, port, opens)
    else:
        from reports.lessons.command import write_lessons

        write_lessons(name, export)


@app.command()
def speed(
    scenes: Scenes = None,
    engine: Engines = None,
    full: Annotated[
        bool, typer.Option("--full", help="All scenarios, finer steps, more rounds, more disks.")
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted run in --out.")
    ] = False,
    seed: Seed = 0,
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("reports/out/speed"),
) -> None:
    """Measure error against time for every engine. Do not use the machine meanwhile."""
    from reports.speed.command import run_speed

    run_speed(
        scenes or [],
        engine or [],
        full,
        resume,
        seed,
        out,
        "crosscheck " + shlex.join(sys.argv[1:]),
    )


VARIED = "dt, speed, mass_ratio, restitution, scale, offset"


@app.command()
def stability(
    cases: Annotated[
        list[str] | None, typer.Argument(metavar="[CASE|FILE.toml]...", help="Default: all.")
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help=(
                "Of FILE.toml, repeatable: dt, speed, mass_ratio, restitution, scale, offset."
                " Default: all."
            )
        ),
    ] = None,
    engine: Engines = None,
    full: Annotated[
        bool, typer.Option("--full", help="16 runs per value, all values, narrower brackets.")
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted run in --out.")
    ] = False,
    out: Annotated[
        Path, typer.Option(help="Folder for the stability report; one that is there is replaced.")
    ] = Path("reports/out/stability"),
    workers: Workers = 0,
) -> None:
    """Find the limit of every engine, and keep the first failing run."""
    from reports.stability.command import find_limits

    command = "crosscheck " + shlex.join(sys.argv[1:])
    find_limits(cases or [], vary or [], engine or [], full, resume, out, workers, command)


@app.command()
def tune(
    engine: Annotated[
        list[str] | None, typer.Argument(metavar="[ENGINE]...", help="Default: all with settings.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for matched.csv.")] = Path("reports/out/tune"),
) -> None:
    """Search the public settings of engines for those nearest to the exact answers at equal
    cost."""
    from reports.tune.command import tune as search_settings

    search_settings(engine or [], out)


@app.command(name="list")
def list_(what: Annotated[str, typer.Argument(metavar="[engines|scenarios|metrics]")] = "") -> None:
    """List engines, scenarios and metrics, with one line each."""
    from reports.commands.listing import explain

    explain(what)
