"""What the rows of a run say of its present plan: the nouns from which tables and page are made.

kind           key is a hash of                        value; blob
run            "plan", "table"                         the plan, with the keys of its tasks; -,
                                                       deviations.csv
cell           scene, engine, step, source, versions   how it ended; its trajectory
probes, check  engine, source, versions                findings of the probes; verdict of the check
known_answer   its definition, source, versions        the number computed here
truth          scene, source of the exact answers      status; the record
comparison     the cells, the answer, the metrics      -; the scene's part of deviations.csv
timing         the timed cells, the machine            the samples of all rounds, and their date
export         name of a file                          the digests that it may have
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from crosscheck2d.reports.run.comparing import file_of, run_of
from crosscheck2d.reports.run.playing import load_trajectory
from crosscheck2d.reports.run.scenes import SceneSource
from crosscheck2d.reports.run.store import FILE, Store
from crosscheck2d.reports.terminal.exits import Unusable
from crosscheck2d.scenarios.model import Trajectory

COMMAND = "crosscheck run"


@dataclass(frozen=True, eq=False)
class RunResults:
    """The rows of one run that its present plan uses.

    Attributes:
        store: where they are.
        header: the plan: command, seed, started, machine, versions, and the request.
        records: the rows of the cells that have ended, in reading order of scenes and engines,
            coarse dt first; with the keys `cell`, `scene`, `seed` and `digest`.
        conformance: `engine:profile` -> the findings of the probes.
        known_answers: the reproduced known answers.
        checked: solver's file, `PATH:own` -> the verdict of `crosscheck check`.
        timing: the timing pass: its `taken` date, and what `time_cells` returns; empty if there is
            none.
        complete: whether everything requested has ended.
    """

    store: Store
    header: dict[str, Any]
    records: list[dict[str, Any]]
    conformance: dict[str, list[dict[str, Any]]]
    known_answers: list[dict[str, Any]]
    checked: dict[str, dict[str, Any]]
    timing: Mapping[str, Any]
    complete: bool

    @staticmethod
    def read(store: Store) -> RunResults:
        row = store.get("run", "plan")
        if row is None:
            raise Unusable(f"{store.folder / FILE}: has no plan, so nothing was played")
        header, missing = row.value, 0
        of: dict[str, list[tuple[Any, Any]]] = {}
        for kind, tasks in header["tasks"].items():
            for key, what in tasks:
                row = store.get(kind, key)
                if row is None:
                    missing += 1
                    continue
                of.setdefault(kind, []).append((what, row.value))
                if kind == "cell":
                    about = {"cell": key, "scene": what, "seed": header["seed"]}
                    of[kind][-1] = what, row.value | about | {"digest": row.digest}
        timing = store.get("timing", header["timing"])
        return RunResults(
            store,
            header,
            [record for _, record in of.get("cell", [])],
            {engine: value["findings"] for engine, value in of.get("probes", [])},
            [value for _, value in of.get("known_answer", [])],
            dict(of.get("check", [])),
            timing.value if timing is not None else {},
            not missing,
        )

    @property
    def folder(self) -> Path:
        return self.store.folder

    @cached_property
    def by_scene(self) -> dict[str, list[dict[str, Any]]]:
        by_scene: dict[str, list[dict[str, Any]]] = {}
        for record in self.records:
            by_scene.setdefault(record["scene"], []).append(record)
        return by_scene

    @cached_property
    def sources(self) -> dict[str, SceneSource]:
        return {
            scene: SceneSource(**source | {"substeps": tuple(source["substeps"])})
            for scene, source in self.header["sources"].items()
        }

    @property
    def times(self) -> dict[str, dict[str, Any]]:
        """Key of a cell that was timed -> its times, see `time_cells`."""
        times: dict[str, dict[str, Any]] = self.timing.get("cells", {})
        return times

    def trajectory(self, record: Mapping[str, Any]) -> Trajectory | None:
        file = file_of(self.store, dict(record))
        return load_trajectory(file) if file else None

    def run(self, record: Mapping[str, Any], with_trajectory: bool = True) -> Any:
        return run_of(dict(record), file_of(self.store, dict(record)) if with_trajectory else b"")

    def table(self) -> bytes:
        """deviations.csv as it was last made; raises `Unusable` if it was not."""
        row = self.store.get("run", "table")
        if row is None:
            raise Unusable(
                f"{self.folder}: has no complete tables; make them: crosscheck report {self.folder}"
            )
        return row.blob
