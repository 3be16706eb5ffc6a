"""`crosscheck list`: a line for every engine, scenario and metric."""

from __future__ import annotations

from rich.table import Table

from adapters.engines import ENGINES
from reports.compare.metrics import METRICS
from reports.run.arguments import unknown
from reports.terminal.console import Console
from reports.terminal.exits import refuse
from scenarios.catalogue import RANDOM, SCENARIOS, scenario
from scenarios.truth.exact import answered_by


def explain(what: str) -> None:
    """A line for every engine, scenario and metric, or for one of the three kinds."""
    kinds = {
        "engines": ("engine:profile", {name: row.summary for name, row in ENGINES.items()}),
        "scenarios": ("scenario", {name: _line(name) for name in SCENARIOS}),
        "metrics": (
            "metric, unit",
            {f"{name}, {row.unit}": row.summary for name, row in METRICS.items()},
        ),
    }
    if what and what not in kinds:
        refuse([unknown("list", what, kinds)])
    console = Console()
    for kind, (heading, lines) in kinds.items():
        if what in ("", kind):
            table = Table(heading, "what it is", title=f"{len(lines)} {kind}", title_justify="left")
            for name, line in lines.items():
                table.add_row(name, line)
            console.print(table)


def _line(name: str) -> str:
    one = scenario(name)
    return f"{one.asks} ({answered_by(one)}{'; random, from --seed' if name in RANDOM else ''})"
