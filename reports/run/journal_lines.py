"""The schema of a run's journal: what every kind of line holds, and in a sentence what does not fit."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, InstanceOf, ValidationError, model_validator
from pydantic_core import ErrorDetails

from adapters.play import STATUSES

MOST_ROUNDS = 10_000  # of timings: each takes as long as all middle steps of a run
NOT_FINITE = ("nan", "inf", "-inf")  # as `plain` of journal.py writes them
SHOWN = 60  # characters of a value that does not fit


def path(text: str) -> str:
    """Text that may name a file; raises `ValueError`."""
    if not text or "\0" in text:
        raise ValueError("must be text without a null byte")
    return text


def player(text: str) -> str:
    """`engine:profile`; raises `ValueError`."""
    if path(text).count(":") != 1 or text.startswith(":") or text.endswith(":"):
        raise ValueError("must be ENGINE:PROFILE")
    return text


def engine(text: str) -> str:
    """What stands before the colon; raises `ValueError`."""
    return player(f"{text}:any").removesuffix(":any")


def number(value: Any) -> Any:
    """A number that need not be finite; raises `ValueError`."""
    if value in NOT_FINITE if isinstance(value, str) else finite(value):
        return value
    raise ValueError(f"must be a number, or {', '.join(NOT_FINITE)}")


def said(value: Any) -> Any:
    """A number or a text; raises `ValueError`."""
    if isinstance(value, str) or finite(value):
        return value
    raise ValueError("must be a number or text")


def setting(value: Any) -> Any:
    """A value of a setting; raises `ValueError`."""
    if value is None or isinstance(value, bool | str) or finite(value):
        return value
    raise ValueError("must be a number, text, true, false or null")


def finite(value: Any) -> bool:
    """Whether it is a number that float64 can hold."""
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


Words = InstanceOf[str]  # not `str`, as pydantic takes no bytes of a path that are not UTF-8
File = Annotated[Words, AfterValidator(path)]
Player = Annotated[Words, AfterValidator(player)]
Engine = Annotated[Words, AfterValidator(engine)]
Profile = Annotated[str, Field(pattern=r"\A[A-Za-z0-9_.-]{1,100}\z")]
Name = Annotated[str, Field(pattern=r"\A[a-z0-9][a-z0-9_-]{0,99}\z")]  # it becomes the name of a file
Digest = Annotated[str, Field(pattern=r"\A[0-9a-f]{16}\z")]
Number = Annotated[Any, AfterValidator(number)]
Said = Annotated[Any, AfterValidator(said)]
Setting = Annotated[Any, AfterValidator(setting)]
Count = Annotated[int, Field(ge=0, le=2**53)]
Seed = Annotated[int, Field(ge=0)]
Seconds = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Step = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Line(BaseModel):
    """What all lines have in common: types are as they are written; of fields that are not named nothing is asked."""

    model_config = ConfigDict(strict=True)


class Machine(Line):
    """Where a run was made."""

    system: Words
    architecture: Words
    processor: Words
    cores: Annotated[int, Field(ge=1, le=10**6)]


class Header(Line):
    """What was asked for, and by what it was played."""

    command: Words
    seed: Seed
    started: Words
    versions: dict[Words, Words]
    machine: Machine
    scenes: list[File]
    engines: list[Player]
    dts: list[Step]
    full: bool
    timings: Annotated[int, Field(ge=0, le=MOST_ROUNDS)]
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
    """What one probe found, as `Finding`."""

    engine: Engine
    profile: Profile
    probe: Words
    asked: Words
    got: Said
    expected: Said
    bound: Number
    verdict: Literal["keeps", "departs", "breaks"]
    note: Words


class ConformanceLine(Line):
    """What the probes found in an engine."""

    conformance: list[Probed]
    of: Player
    key: Literal[""] | Digest

    @model_validator(mode="after")
    def of_one(self) -> ConformanceLine:
        """All are of the engine that the line is of."""
        if any(f"{one.engine}:{one.profile}" != self.of for one in self.conformance):
            raise ValueError("conformance: must be of one engine, which `of` names")
        return self


class Known(Line):
    """A published number and ours."""

    column: Words
    dt_s: Step
    published_J2: Number
    made_by: Words
    source: Words
    ours_J2: Number


class KnownAnswerLine(Line):
    """A known answer that was made again."""

    known_answer: Known
    of: Words
    key: Literal[""] | Digest


class TimingLine(Line):
    """A timing of a cell."""

    timing: Digest
    round: Count
    seconds: Seconds


class Footer(Line):
    """How much was done."""

    tasks: Count
    played: Count
    seconds: Seconds


class HeaderLine(Line):
    """The first line."""

    header: Header


class FooterLine(Line):
    """The last line."""

    footer: Footer


KINDS: dict[str, type[Line]] = {
    "header": HeaderLine, "cell": CellLine, "conformance": ConformanceLine, "known_answer": KnownAnswerLine,
    "timing": TimingLine, "footer": FooterLine,
}  # fmt: skip


def kind_of(line: Any) -> str:
    """Which of `KINDS` a line is; raises `ValueError`, as the end of a sentence, if it is none or does not fit."""
    kinds = [kind for kind in KINDS if kind in line] if isinstance(line, dict) else []
    if len(kinds) != 1:
        raise ValueError(f"must be one of {', '.join(KINDS)}")
    try:
        KINDS[kinds[0]].model_validate(line)
    except ValidationError as error:
        raise ValueError(sentence(error.errors(include_url=False)[0])) from None
    return kinds[0]


def sentence(fault: ErrorDetails) -> str:
    """What pydantic found, as `KEY = VALUE: what is allowed`."""
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in fault["loc"])[1:]
    if fault["type"] == "missing":
        return f"{key}: missing"
    allowed = re.sub(r"^(Input|String) should", "must", str(fault.get("ctx", {}).get("error", fault["msg"])))
    value = repr(fault["input"])
    return f"{key} = {value if len(value) <= SHOWN else value[:SHOWN] + ' ...'}: {allowed}" if key else allowed
