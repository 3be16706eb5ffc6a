"""A run of two scenes, one of them a file, on two engines, made in this process and so within a
second or two."""

from pathlib import Path

from crosscheck2d.adapters.conformance.conform import Finding
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.run.cells import Cell, scene_hash
from crosscheck2d.reports.run.folders import RUN, open_new, part_of, replace_folder
from crosscheck2d.reports.run.known_answers import KNOWN_ANSWERS
from crosscheck2d.reports.run.playing import play_here
from crosscheck2d.reports.run.results import keep_cell, keep_known_answer, keep_probes
from crosscheck2d.reports.run.suite import begin
from crosscheck2d.reports.run.tasks import Means, RunPlan, tasks_of

PLAYED = ("pymunk:shipped", "pymunk:matched")


def make(folder: Path, scene_file: Path) -> Path:
    """Its folder, complete but for its tables: every kind of line is in its journal."""
    plan = RunPlan(
        ["slow_collision", str(scene_file)],
        {name: ENGINES[name] for name in PLAYED},
        0,
        [],
        False,
        0,
        "made by a test",
    )
    scenarios = {scene: plan.scenario(scene) for scene in plan.scenes}
    cells = [task for task in tasks_of(plan, scenarios) if isinstance(task, Cell)]
    with open_new(folder) as journal:
        begin(plan, journal, scenarios, len(cells))
        for name in PLAYED:
            finding = Finding(
                *name.split(":"),
                "read_copies",
                "Does read give copies?",
                "copies",
                "copies",
                0.0,
                "keeps",
            )
            keep_probes(journal, plan, name, [finding])
        keep_known_answer(journal, KNOWN_ANSWERS[0], 18808.3)
        for cell in cells:
            scenario, row = scenarios[cell.scene], ENGINES[cell.engine]
            key = cell.key(scene_hash(scenario), row.source)
            line = keep_cell(journal, scenario, Means(1), cell, key, play_here(cell, row, scenario))
        journal.append(
            {"timing": line["cell"], "copy": 0, "timed_s": 1.0, "cost": [0.5], "wrapping": [0.0]}
        )
        journal.append({"overhead": "read", "of": PLAYED[0], "scenario": "", "cost": [1e-6]})
        journal.append({"footer": {"tasks": len(cells), "played": len(cells), "seconds": 1.0}})
    replace_folder(part_of(folder), folder, RUN)
    return folder
