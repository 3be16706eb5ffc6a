"""The format of the journal of `crosscheck stability`: what each line holds, and the checks that
it fits its case or map."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from math import isnan
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from adapters.engines import ENGINES
from reports.run.journal_lines import (
    Count,
    EngineProfile,
    File,
    Kinds,
    Line,
    Machine,
    Number,
    Seconds,
    Seed,
    Words,
)
from reports.stability.ablations import reason_by_ablation
from reports.stability.cases import CASES
from reports.stability.interventions import INTERVENTIONS
from reports.stability.limits import (
    FORMS,
    LIMIT,
    NEVER_FAILS,
    NEVER_WORKS,
    ONLY_BEYOND,
    Case,
    Limit,
    Trial,
    engines_of,
)
from reports.stability.maps import MAPS, MapOf
from reports.stability.touching import GAPS, TOUCHING, LawOf
from reports.stability.vary import VARIES

MOST = 10**6  # runs, and disks
Ended = Literal["ok", "crashed", "timeout", "error"]
Sha256 = Annotated[str, Field(pattern=r"\A[0-9a-f]{64}\z")]
Some = Annotated[int, Field(ge=0, le=MOST)]


class StabilityHeader(Line):
    """What was asked for, and the versions that played it."""

    command: Words
    seed: Seed
    started: Words
    versions: dict[Words, Words]
    machine: Machine
    form: Literal[tuple(FORMS)]  # type: ignore[valid-type]
    files: dict[File, Sha256]


class StabilityHeaderLine(Line):
    """The first line, and another for each time the run was resumed."""

    header: StabilityHeader


class StabilityFooter(Line):
    """How much was done."""

    tasks: Count
    seconds: Seconds


class StabilityFooterLine(Line):
    """The last line."""

    footer: StabilityFooter


class TaskOf(Line):
    """The part of a line of the journal that names a `Task`."""

    kind: Literal["limit", "map", "law"]
    name: File
    engine: EngineProfile
    form: Literal[tuple(FORMS)]  # type: ignore[valid-type]


class TrialRow(Line):
    """The part of a line of the journal that holds a `Trial`."""

    value: Number
    runs: Annotated[int, Field(ge=1, le=MOST)]
    failed: Some
    worst: Number
    first: Annotated[int, Field(ge=-1, le=MOST)]
    at: Number
    event: Words
    broken: Words
    disk: Annotated[int, Field(ge=-1, le=MOST)]  # -1: all
    allowed: Some
    left: bool


class LimitRow(Line):
    """The part of a line of the journal that holds a `Limit`."""

    case: File
    engine: EngineProfile
    form: Literal[tuple(FORMS)]  # type: ignore[valid-type]
    verdict: Literal[LIMIT, NEVER_FAILS, NEVER_WORKS, ONLY_BEYOND]  # type: ignore[valid-type]
    works_at: Number
    fails_at: Number
    trials: Annotated[list[TrialRow], Field(min_length=1, max_length=10_000)]
    monotone: bool
    spacing: Number
    intervention: Literal["", *INTERVENTIONS]  # type: ignore[valid-type]
    mechanisms: Words
    reason: Words
    source: Words
    tested: Words
    seconds: Number
    status: Ended


class MapRow(Line):
    """The part of a line of the journal that holds a `MapOf`; a cell is x, y, reading, whether it
    failed, what broke."""

    name: Literal[tuple(MAPS)]  # type: ignore[valid-type]
    engine: EngineProfile
    cells: list[Annotated[list[Any], Field(min_length=5, max_length=5)]]
    status: Ended
    seconds: Number

    @model_validator(mode="after")
    def on_the_grid(self) -> MapRow:
        """Whether these are all cells of the map, in its order, or none if the task was lost."""
        grid = [*product(MAPS[self.name].x, MAPS[self.name].y)] if self.status == "ok" else []
        if [tuple(cell[:2]) for cell in self.cells] != grid:
            raise ValueError("cells: must be those of the map's grid, in order")
        for k, (_, _, value, failed, broken) in enumerate(self.cells):
            must_be(
                f"cells[{k}]",
                number_like(value) and isinstance(failed, bool) and isinstance(broken, str),
            )
        return self


class LawRow(Line):
    """The part of a line of the journal that holds a `LawOf`; a gap has the fields of `AtGap`."""

    name: Literal[tuple(TOUCHING)]  # type: ignore[valid-type]
    engine: EngineProfile
    gaps: list[Annotated[list[Any], Field(min_length=6, max_length=6)]]
    status: Ended

    @model_validator(mode="after")
    def at_all_gaps(self) -> LawRow:
        """Whether these are all gaps in their order, each with a velocity for every disk or
        none, or no gap if the task was lost."""
        if [gap[0] for gap in self.gaps] != (list(GAPS) if self.status == "ok" else []):
            raise ValueError("gaps: must be those that are played, in order")
        for k, (_, law, *numbers, velocity) in enumerate(self.gaps):
            must_be(f"gaps[{k}]", isinstance(law, str) and all(map(number_like, numbers)))
            whole = isinstance(velocity, list) and len(velocity) in (
                0,
                len(TOUCHING[self.name].position),
            )
            pairs = whole and all(
                isinstance(v, list) and len(v) == 2 and all(map(number_like, v)) for v in velocity
            )
            must_be(f"gaps[{k}][5]", pairs)
        return self


def must_be(where: str, whole: bool) -> None:
    """Raise `ValueError` if a list does not hold what it should."""
    if not whole:
        raise ValueError(
            f"{where}: must hold numbers and text as `crosscheck stability` writes them"
        )


def number_like(value: Any) -> bool:
    """Whether it is a number, or the text of one that is not finite."""
    if isinstance(value, str):
        return value in ("nan", "inf", "-inf")
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 1e308


class StabilityTaskLine(Line):
    """The line of the journal that holds the result of a task: one of the three, under the name of
    its kind."""

    task: TaskOf
    limit: LimitRow | None = None
    map: MapRow | None = None
    law: LawRow | None = None

    @model_validator(mode="after")
    def of_its_task(self) -> StabilityTaskLine:
        """Whether a result has the kind, the name and the engine of its task."""
        given = {"limit": self.limit, "map": self.map, "law": self.law}
        one = given.pop(self.task.kind)
        if one is None or any(given.values()):
            raise ValueError(f"{self.task.kind}: missing, or not alone")
        name = one.case if isinstance(one, LimitRow) else one.name
        if (name, one.engine) != (self.task.name, self.task.engine):
            raise ValueError(f"{self.task.kind}: must be of the task's name and engine")
        if isinstance(one, LimitRow) and one.form != self.task.form:
            raise ValueError(f"limit.form = {one.form!r}: must be that of the task")
        return self


KINDS = Kinds(
    {"header": StabilityHeaderLine, "task": StabilityTaskLine, "footer": StabilityFooterLine},
    "delete that line; --resume then plays its task again",
    "without it the plan of the run is not known: delete the folder, or name another --out",
)


def unknown_engine(one: Limit | MapOf | LawOf, files: Mapping[str, str]) -> str:
    """Why there is no such case or engine, as the end of a sentence; "" if there is.
    `files`: the scene files of the header."""
    if isinstance(one, Limit):
        path, _, what = one.case.rpartition(":")
        if one.case not in CASES and (path not in files or what not in VARIES):
            return f"limit.case = {one.case!r}: must be a case, or one of a file of the header"
        engines = engines_of(CASES[one.case], ENGINES) if one.case in CASES else [*ENGINES]
    else:
        engines = MAPS[one.name].engines([*ENGINES]) if isinstance(one, MapOf) else [*ENGINES]
    return "" if one.engine in engines else f"engine = {one.engine!r}: must be one that plays this"


def impossible(limit: Limit, case: Case) -> str:
    """Why no search of the case can end like this, as the end of a sentence; "" if one
    can."""
    if limit.status != "ok":
        lost = (
            isnan(limit.works_at)
            and isnan(limit.fails_at)
            and all(isnan(trial.value) for trial in limit.trials)
        )
        return "" if lost else f"limit.status = {limit.status!r}: must be 'ok', as there are values"
    values = [trial.value for trial in limit.trials]
    low, high = min(case.values), max(case.values)
    for k, trial in enumerate(limit.trials):
        if not low <= trial.value <= high or (case.whole and trial.value != round(trial.value)):
            return (
                f"limit.trials[{k}].value = {trial.value!r}: must be from {low} to {high}, as the"
                " case has it"
            )
        if fault := miscounted(trial, case, trial.value == limit.fails_at):
            return f"limit.trials[{k}]: {fault}"
    if values != sorted(set(values), key=lambda value: case.harsher * value):
        return "limit.trials: must be of each value once, from gentle to harsh"
    ends = {"works_at": limit.verdict != NEVER_WORKS, "fails_at": limit.verdict != NEVER_FAILS}
    for name, there in ends.items():
        value = getattr(limit, name)
        if (value not in values) if there else not isnan(value):
            return (
                f"limit.{name} = {value!r}: must be {'one of the values tried' if there else 'nan'}"
            )
    try:
        if limit.mechanisms:
            reason_by_ablation(limit)
    except KeyError:
        return f"limit.mechanisms = {limit.mechanisms[:60]!r}: must name mechanisms"
    return ""


def miscounted(trial: Trial, case: Case, at_the_limit: bool) -> str:
    """Why no runs at a value of the case can give this, as the end of a sentence; "" if
    they can."""
    if trial.runs > case.runs or trial.failed > trial.runs or trial.allowed > case.runs:
        return (
            f"runs = {trial.runs}, failed = {trial.failed}: must be at most {case.runs}, as the"
            " case has it"
        )
    if not -1 <= trial.first < trial.runs or (trial.first < 0) != (trial.failed == 0):
        return f"first = {trial.first}: must be that of a run that failed, or -1"
    if trial.left and (at_the_limit or not trial.failed):
        return "left = True: must be false at the limit, and where none failed"
    return ""
