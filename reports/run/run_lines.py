"""The schema of a run's journal: the fields of every kind of line."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from adapters.run import STATUSES
from reports.run.journal_lines import (
    Count,
    Digest,
    Engine,
    EngineProfile,
    File,
    Kinds,
    Line,
    Machine,
    Name,
    Number,
    Profile,
    Said,
    Seconds,
    Seed,
    Setting,
    Step,
    Words,
)
from reports.run.stepping import CALL, EMPTY, READ

LONGEST_PASS = 3600.0  # s, of timings


class RunHeader(Line):
    """The request, and the versions that played it."""

    command: Words
    seed: Seed
    started: Words
    versions: dict[Words, Words]
    machine: Machine
    scenes: list[File]
    engines: list[EngineProfile]
    dts: list[Step]
    full: bool
    timings: Annotated[float, Field(ge=0, le=LONGEST_PASS)]
    folder: File
    names: dict[File, Name]
    tasks: Count


class CellLine(Line):
    """How a cell ended."""

    cell: Digest
    scene_hash: Digest
    scene: File
    seed: Seed
    substeps: Annotated[int, Field(ge=1, le=2**53)]
    scenario: Name
    engine: Engine
    profile: Profile
    dt_s: Step
    status: Literal[STATUSES]  # type: ignore[valid-type]
    reason: Words
    step: Annotated[int, Field(ge=-1, le=2**53)]
    until_s: Number
    seconds: Number
    timeout_s: Annotated[float, Field(ge=0, le=1e6)]
    outside: bool
    file: Literal[""] | Digest
    settings: dict[Words, Annotated[list[Setting], Field(min_length=2, max_length=2)]]
    versions: dict[Words, Words]


class Probed(Line):
    """The result of one probe, with the fields of `Finding`."""

    engine: Engine
    profile: Profile
    probe: Words
    asked: Words
    got: Said
    expected: Said
    bound: Number
    verdict: Literal["keeps", "not asked", "departs", "breaks"]
    note: Words


class ConformanceLine(Line):
    """What the probes found in an engine."""

    conformance: list[Probed]
    of: EngineProfile
    key: Literal[""] | Digest

    @model_validator(mode="after")
    def of_one(self) -> ConformanceLine:
        """All findings are of the engine in `of`."""
        if any(f"{one.engine}:{one.profile}" != self.of for one in self.conformance):
            raise ValueError("conformance: must be of one engine, which `of` names")
        return self


class Known(Line):
    """A published number and the one computed here."""

    column: Words
    dt_s: Step
    published_J2: Number
    made_by: Words
    source: Words
    ours_J2: Number


class KnownAnswerLine(Line):
    """A reproduced known answer."""

    known_answer: Known
    of: Words
    key: Literal[""] | Digest


class Checked(Line):
    """What `crosscheck check` says of a solver's file: whether it found no fault, its sentences,
    and for each the lines of the file and the exercise's formula."""

    passed: bool
    says: list[Words]
    shown: list[list[Words]] = Field(default_factory=list)  # runs of 0.1 have none


class CheckedLine(Line):
    """The check of a solver's file that takes part in the run."""

    checked: Checked
    of: EngineProfile
    key: Literal[""] | Digest


Costs = Annotated[list[Seconds], Field(min_length=1, max_length=1000)]


class TimingLine(Line):
    """The cost of a cell in the first `timed_s` of its scenario: s per simulated second, one number
    per round; and in the same form the part spent in Python on wrapping disks at the edges."""

    timing: Digest
    copy_: Annotated[Literal[0, 1], Field(alias="copy")]
    timed_s: Step
    cost: Costs
    wrapping: Costs


class OverheadLine(Line):
    """An overhead of an engine, as `stepping.overheads` times it: s, one number per round."""

    overhead: Literal[EMPTY, CALL, READ]  # type: ignore[valid-type]
    of: EngineProfile
    scenario: Literal[""] | Name
    cost: Costs


class RunFooter(Line):
    """Totals of the run."""

    tasks: Count
    played: Count
    seconds: Seconds


class RunHeaderLine(Line):
    """The first line."""

    header: RunHeader


class RunFooterLine(Line):
    """The last line."""

    footer: RunFooter


KINDS = Kinds(
    {
        "header": RunHeaderLine,
        "cell": CellLine,
        "conformance": ConformanceLine,
        "known_answer": KnownAnswerLine,
        "checked": CheckedLine,
        "timing": TimingLine,
        "overhead": OverheadLine,
        "footer": RunFooterLine,
    },
    "delete that line; run --resume then plays its cell again",
    "without it the plan of the run is not known: play it again into another --out",
)
