"""`crosscheck list`: a line for every engine, scenario, metric, verdict, case and lesson."""

from __future__ import annotations

from crosscheck2d.adapters.engines import all_rows, packages
from crosscheck2d.adapters.npm_packages import missing
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.scales import SCALES
from crosscheck2d.reports.compare.verdicts import VERDICTS
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.run.arguments import unknown
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.terminal.console import Console, print_texts
from crosscheck2d.reports.terminal.exits import refuse
from crosscheck2d.scenarios.catalogue import RANDOM, SCENARIOS, scenario
from crosscheck2d.scenarios.truth.exact import answered_by

VERSIONS = f"Any version of {', '.join(packages())} plays as NAME@VERSION: --engine pymunk@6.8.1"


def explain(what: str) -> None:
    """Print a line for everything that has a name, or for all of one kind."""
    engines, scenarios = {}, {}
    for name, row in all_rows().items():
        reason = missing(row.package) if row.package else ""
        engines[name] = f"{row.summary} ({reason})" if reason else row.summary
    for name in SCENARIOS:
        scene, drawn = scenario(name), "; random: --seed" if name in RANDOM else ""
        scenarios[name] = f"{scene.asks} ({answered_by(scene)}{drawn})"
    kinds = {
        "engines": engines,
        "scenarios": scenarios,
        "metrics": {with_unit(name, row.unit): row.summary for name, row in METRICS.items()},
        "verdicts": {with_unit(name, row.unit): row.means for name, row in VERDICTS.items()},
        "cases": {name: case.asks for name, case in CASES.items()},
        "lessons": {f"{row.number} {name}": row.asks for name, row in LESSONS.items()},
    }
    if what and what not in kinds:
        refuse(unknown("list", what, kinds))
    console = Console()
    for kind, lines in kinds.items():
        if what in ("", kind):
            print_texts(console, lines, f"{len(lines)} {kind}")
            if kind == "engines":
                console.print(VERSIONS, highlight=False)
            console.print()
    if what in ("", "metrics"):
        print_texts(console, SCALES, "Scales, by which errors are divided")


def with_unit(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name}, {unit}"
