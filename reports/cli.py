"""The command line. What a command needs is imported when it runs, so that `--help` answers at once."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="crosscheck",
    help="Cross-validation of 2D disk solvers: the same scenes through every engine, each against an exact answer.",
    no_args_is_help=False,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
DEFAULT_OUT = Path("reports/out/latest")

Scenes = Annotated[list[str] | None, typer.Argument(metavar="[SCENARIO|FILE.toml]...", help="Default: all scenarios.")]
Engines = Annotated[
    list[str] | None, typer.Option("--engine", metavar="NAME[:PROFILE]", help="Only these; repeatable.")
]
Dts = Annotated[
    list[float] | None, typer.Option("--dt", metavar="S", help="Step in s instead of each ladder; repeatable.")
]
Full = Annotated[bool, typer.Option("--full", help="Two finer steps for every scenario.")]
Seed = Annotated[int, typer.Option(min=0, help="What random scenes are drawn from.")]
Out = Annotated[
    Path, typer.Option(help="Folder for the results; an earlier run there is replaced when this one is done.")
]
Workers = Annotated[int, typer.Option(min=0, help="Processes that play at once; 0: one a core.")]


@app.callback(invoke_without_command=True)
def default(context: typer.Context) -> None:
    """Without a command: the main job, all scenarios through all engines, to reports/out/latest/."""
    if context.invoked_subcommand is None:
        from reports.commands import run_plan

        run_plan([], [], [], False, 0, DEFAULT_OUT, 0, "crosscheck")


@app.command()
def run(
    scenes: Scenes = None,
    engine: Engines = None,
    dt: Dts = None,
    full: Full = False,
    seed: Seed = 0,
    out: Out = DEFAULT_OUT,
    workers: Workers = 0,
) -> None:
    """Play some scenarios or scene files through some engines, compare, and report."""
    from reports.commands import run_plan

    command = "crosscheck " + shlex.join(sys.argv[1:])
    run_plan(scenes or [], engine or [], dt or [], full, seed, out, workers, command)


@app.command()
def report(out: Annotated[Path, typer.Argument(help="The folder of a run, finished or not.")]) -> None:
    """Make the tables and the page of a run again, from its journal."""
    from reports.commands import report_again

    report_again(out)


@app.command()
def truth(
    scene: Annotated[str, typer.Argument(metavar="SCENARIO|FILE.toml")],
    events: Annotated[bool, typer.Option("--events", help="All hits, not only the first and last ten.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="For programs: all of it as JSON.")] = False,
    seed: Seed = 0,
) -> None:
    """Print the exact answer to a scene: its hits, how far it reaches, how precise it is and what ends it."""
    from reports.truth_command import show_truth

    show_truth(scene, seed, events, as_json)


@app.command()
def stability(
    cases: Annotated[list[str] | None, typer.Argument(metavar="[CASE|FILE.toml]...", help="Default: all.")] = None,
    vary: Annotated[list[str] | None, typer.Option(help="What of FILE.toml to vary; repeatable. Default: all.")] = None,
    engine: Engines = None,
    full: Annotated[bool, typer.Option("--full", help="16 runs a value, every value, closer brackets.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Keep what an interrupted run in --out has ended.")] = False,
    out: Annotated[Path, typer.Option(help="Folder for the atlas.")] = Path("reports/out/stability"),
    workers: Workers = 0,
) -> None:
    """Find where every player fails: limits, with the first failing run of each to look at."""
    from reports.stability.command import find_limits

    command = "crosscheck " + shlex.join(sys.argv[1:])
    find_limits(cases or [], vary or [], engine or [], full, resume, out, workers, command)


@app.command(name="list")
def list_(what: Annotated[str, typer.Argument(metavar="[engines|scenarios|metrics]")] = "") -> None:
    """Explain every engine, scenario and metric in a line."""
    from reports.commands import explain

    explain(what)


def main() -> None:
    """The command `crosscheck`."""
    app()
