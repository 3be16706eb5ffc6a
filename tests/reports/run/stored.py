"""Changes the rows of a run as another run would have written them."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd

from crosscheck2d.reports.run.comparing import csv_of
from crosscheck2d.reports.run.results import COMMAND
from crosscheck2d.reports.run.store import writing

Change = Callable[[dict], object]


def change_plan(folder: Path, change: Change) -> None:
    with writing(folder, COMMAND) as store:
        plan = store.get("run", "plan").value
        change(plan)
        store.put("run", "plan", plan)


def change_cells(folder: Path, change: Change) -> None:
    with writing(folder, COMMAND) as store:
        plan = store.get("run", "plan").value
        for task in plan["tasks"]["cell"]:
            row = store.get("cell", task[0])
            value = row.value | {"cell": task[0]}
            change(value)
            task[0] = value.pop("cell")
            store.put("cell", task[0], value, row.blob)
        store.put("run", "plan", plan)


def change_timings(folder: Path, change: Change) -> None:
    with writing(folder, COMMAND) as store:
        key = store.get("run", "plan").value["timing"]
        timing = store.get("timing", key).value
        for line in timing["lines"]:
            change(line)
        store.put("timing", key, timing)


def put_table(table: pd.DataFrame, folder: Path) -> None:
    with writing(folder, COMMAND) as store:
        store.put("comparison", "changed", None, csv_of(table))
        store.put("run", "comparisons", {"all": "changed"})
