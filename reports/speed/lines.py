"""The format of the journal of `crosscheck speed`: what each line holds, and the checks that it
fits its scene and task."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from math import isnan
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field, ValidationError, model_validator

from adapters.run import STATUSES
from reports.run.journal import numbers
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
    Step,
    Words,
    number,
    sentence,
)
from reports.run.stepping import CALL, EMPTY, READ
from reports.run.timing import WARM_UP
from scenarios.model import Scenario


def length(value: Any) -> Any:
    """A number that is not negative, or not known; raises `ValueError`."""
    if (
        isinstance(number(value), str | int | float)
        and value != "-inf"
        and (isinstance(value, str) or value >= 0)
    ):
        return value
    raise ValueError("must be a number that is not negative")


Length = Annotated[Any, AfterValidator(length)]
Cost = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]  # s: no task may take as long
Substeps = Annotated[int, Field(ge=1, le=10**7)]


class SpeedHeader(Line):
    """The measurement that was asked for; only exactly the same one can be resumed."""

    scenes: list[File]
    files: dict[File, Words]
    engines: list[EngineProfile]
    effort: dict[Words, Any]
    whole: bool
    seed: Seed
    versions: dict[Words, Words]
    machine: Machine


class SpeedHeaderLine(Line):
    """The first line."""

    header: SpeedHeader


class Row(Line):
    """The fields that the rows of all tables have."""

    scenario: Words
    engine: Words
    profile: Words

    @property
    def name(self) -> str:
        """Of the engine."""
        return f"{self.engine}:{self.profile}"


class ErrorRow(Row):
    """A row that `ladder.errors_of` returns."""

    seed: Seed
    dt_s: Step
    substeps: Substeps
    status: Literal[STATUSES]  # type: ignore[valid-type]
    reason: Words
    until_s: Seconds
    duration_s: Seconds
    error_radii: Length
    change_radii: Length


class BudgetRow(Row):
    """A row that `budget.budget_of` returns; a number that it does not know is left out."""

    seed: Seed
    dt_s: Step
    until_s: Seconds
    horizon_s: Seconds
    duration_s: Seconds
    contribution: Words
    note: Words
    position_radii: Length = 0.0
    energy: Length = 0.0
    share: Number = 0.0
    off_engine_radii: Length = 0.0
    off_reference_radii: Length = 0.0
    off_deviation_radii: Length = 0.0
    closed_deviation_radii: Length = 0.0


class SampleRow(Row):
    """A row that `measure.sample_row` returns."""

    kind: Words
    change: Words
    dt_s: Length
    n: Count
    copy_of: Literal[0, 1]
    round: Annotated[int, Field(ge=WARM_UP, le=10**6)]
    place: Count
    cost: Cost
    wrapping: Cost
    runs: Annotated[int, Field(ge=1, le=10**6)]


class TaskResult(Line):
    """What the tasks of one kind give; `parts`: from and to how many parts their names have."""

    parts: ClassVar[tuple[int, int]] = (3, 3)

    def misfit(self, _: list[Any], /) -> str:
        """Why it is not of the task of this name, as the end of a sentence; "" if it is."""
        return ""


class Errors(TaskResult):
    """The errors of an engine at several step sizes."""

    parts = 7, 64
    result: Annotated[list[ErrorRow], Field(min_length=1)]

    def misfit(self, task: list[Any]) -> str:
        """A row belongs to each step size."""
        here = [(row.seed, row.name, row.substeps) for row in self.result]
        if here == [(task[3], task[4], step_size) for step_size in task[6:]]:
            return ""
        return "result: must have a row for each step that the task names, of its seed and engine"


class BudgetResult(TaskResult):
    """The contributions to an error."""

    result: Annotated[list[BudgetRow], Field(min_length=1)]

    def misfit(self, task: list[Any]) -> str:
        """All rows are of one engine."""
        same = all(row.name == task[2] for row in self.result)
        return "" if same else "result: must be of the engine that the task names"


class Samples(TaskResult):
    """What was timed together: every round of each thing, the warm-up first."""

    result: list[SampleRow]

    @model_validator(mode="after")
    def whole(self) -> Samples:
        """No round is missing, and none is there twice."""
        rounds = defaultdict[tuple[Any, ...], list[int]](list[Any])
        for row in self.result:
            whose = row.kind, row.scenario, row.name, row.change
            what = (*whose, str(row.dt_s), row.n, row.copy_of)
            rounds[what].append(row.round)
        for what, those in rounds.items():
            if sorted(those) != list(range(WARM_UP, WARM_UP + len(those))):
                raise ValueError(
                    f"result: must have each round of {what[2]} once, from {WARM_UP} on"
                )
        if any((*what[:-1], 0) not in rounds for what in rounds):
            raise ValueError("result: must have a copy_of 0 of each engine")
        return self

    def misfit(self, task: list[Any]) -> str:
        """With the steps of a scene the overheads are timed, too."""
        kinds = {task[1]} | ({EMPTY, CALL, READ} if task[1] == "scene" else set())
        same = all(row.kind in kinds for row in self.result)
        return "" if same else "result: must be of the kind that the task names"


class SizesOf(Line):
    """The cost of a step by number of disks, and which engines were not measured at which sizes."""

    samples: list[SampleRow]
    stopped: list[Annotated[list[Any], Field(min_length=3, max_length=3)]]

    @model_validator(mode="after")
    def known(self) -> SizesOf:
        """The samples are as in `Samples`, and each of `stopped` is an engine, a number of disks
        and why it was not measured with so many."""
        Samples(result=self.samples)
        for name, n, why in self.stopped:
            if not (
                isinstance(name, str)
                and name.count(":") == 1
                and type(n) is int
                and isinstance(why, str)
            ):
                raise ValueError(
                    "result.stopped: must be of [ENGINE:PROFILE, number of disks, why]"
                )
        return self


class Sizes(TaskResult):
    """The costs of a step by number of disks."""

    parts = 2, 2
    result: SizesOf


class Closed(Line):
    """What `cheapest.closed_form` returns: what answers the scene, and its cost."""

    scenario: Words
    truth: Words
    closed_us: Length


class Truth(TaskResult):
    """The cost of a closed form."""

    result: Closed


RESULTS: dict[tuple[str, ...], type[TaskResult]] = {
    ("error", "scene"): Errors,
    ("error", "option"): Errors,
    ("error", "sweep"): Errors,
    ("budget",): BudgetResult,
    ("time", "scene"): Samples,
    ("time", "option"): Samples,
    ("time", "sweep"): Samples,
    ("time", "size"): Sizes,
    ("time", "truth"): Truth,
}
"""How a task begins -> what it gives."""


class SpeedTaskLine(Line):
    """What a task gave."""

    task: Annotated[list[Words | Count], Field(min_length=2, max_length=64)]
    result: Any

    @model_validator(mode="after")
    def of_its_task(self) -> SpeedTaskLine:
        """The result is of that kind, and its rows are of what the task names."""
        task = self.task
        begins = tuple(map(str, task[:2]))
        model = RESULTS.get(begins, RESULTS.get(begins[:1]))
        if model is None:
            raise ValueError(
                f"task = {str(task)[:60]}: must begin as one of {', '.join(map(' '.join, RESULTS))}"
            )
        low, high = model.parts
        if not low <= len(task) <= high:
            raise ValueError(f"task = {str(task)[:60]}: must have as many parts as one of its kind")
        try:
            found = model.model_validate({"result": self.result})
        except ValidationError as error:
            raise ValueError(sentence(error.errors(include_url=False)[0])) from None
        if fault := found.misfit(task):
            raise ValueError(fault)
        return self


# columns of results that hold text, and what holds numbers and text
TEXT = {"status", "stopped", "task"} | {
    name
    for row in (ErrorRow, BudgetRow, SampleRow, Closed)
    for name, field in row.model_fields.items()
    if field.annotation is str
}
KINDS = Kinds(
    {"header": SpeedHeaderLine, "task": SpeedTaskLine},
    "delete that line, and --resume measures again what it was of",
    "without it the plan of the run is not known: delete the folder, or name another --out",
)


def numbered(value: Any) -> Any:
    """As `numbers`, but for what is text, which may be "nan"."""
    if isinstance(value, list):
        return [numbered(item) for item in value]
    if isinstance(value, dict):
        return {key: item if key in TEXT else numbered(item) for key, item in value.items()}
    return numbers(value)


def misfit(line: Mapping[str, Any], scenarios: Mapping[str, Scenario]) -> str:
    """Why a line belongs to none of the scenarios, as the end of a sentence; "" if it belongs to
    one, or is of no scene."""
    task = line["task"]
    scene = "".join(map(str, task[1:2] if task[0] == "budget" else task[2:3]))
    if not scene:
        return ""
    if scene not in scenarios:
        return f"task = {str(task)[:60]}: must be of a scene that is measured"
    scenario, result = scenarios[scene], numbered(line["result"])
    for k, row in enumerate(result if isinstance(result, list) else [result]):
        if row["scenario"] != scenario.name:
            return f"result[{k}].scenario = {row['scenario']!r}: must be {scenario.name!r}"
        if "dt_s" in row and row.get("kind") not in (EMPTY, CALL, READ):  # these have no step size
            dt = row["dt_s"]
            asked = 1 if isnan(dt) else round(scenario.sample_interval / dt)
            if dt != scenario.dt(max(row.get("substeps") or asked, 1)):
                return (
                    f"result[{k}].dt_s = {row['dt_s']!r}: must divide the scene's sample interval"
                    " as the task does"
                )
        if row.get("duration_s", scenario.duration) != scenario.duration:
            return f"result[{k}].duration_s = {row['duration_s']!r}: must be {scenario.duration!r}"
        # a rounding of samples times interval
        if row.get("until_s", 0.0) > scenario.duration * (1 + 1e-9):
            return (
                f"result[{k}].until_s = {row['until_s']!r}: must be at most {scenario.duration!r}"
            )
    return ""
