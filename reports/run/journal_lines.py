"""Checks the lines of a journal against a table of models, one for each kind, and says in a
sentence what does not fit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, InstanceOf, ValidationError
from pydantic_core import ErrorDetails

from reports.run.journal import JOURNAL, lines_of

NOT_FINITE = ("nan", "inf", "-inf")  # as written by `plain` of journal.py
SHOWN = 60  # characters of a wrong value that a message shows


def path(text: str) -> str:
    """Text that may name a file; raises `ValueError`."""
    if not text or "\0" in text:
        raise ValueError("must be text without a null byte")
    return text


def engine_profile(text: str) -> str:
    """`engine:profile`; raises `ValueError`."""
    if path(text).count(":") != 1 or text.startswith(":") or text.endswith(":"):
        raise ValueError("must be ENGINE:PROFILE")
    return text


def engine(text: str) -> str:
    """The part before the colon; raises `ValueError`."""
    return engine_profile(f"{text}:any").removesuffix(":any")


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
        return (
            isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        )
    except OverflowError:
        return False


Words = InstanceOf[str]  # not `str`, as pydantic takes no bytes of a path that are not UTF-8
File = Annotated[Words, AfterValidator(path)]
EngineProfile = Annotated[Words, AfterValidator(engine_profile)]
Engine = Annotated[Words, AfterValidator(engine)]
Profile = Annotated[str, Field(pattern=r"\A[A-Za-z0-9_.-]{1,100}\z")]
# because it becomes a file name
Name = Annotated[str, Field(pattern=r"\A[a-z0-9][a-z0-9_-]{0,99}\z")]
Digest = Annotated[str, Field(pattern=r"\A[0-9a-f]{16}\z")]
Number = Annotated[Any, AfterValidator(number)]
Said = Annotated[Any, AfterValidator(said)]
Setting = Annotated[Any, AfterValidator(setting)]
Count = Annotated[int, Field(ge=0, le=2**53)]
Seed = Annotated[int, Field(ge=0)]
Seconds = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Step = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Line(BaseModel):
    """The base of all lines: types are strict, unknown fields are allowed."""

    model_config = ConfigDict(strict=True)


class Machine(Line):
    """Where a run was made."""

    system: Words
    architecture: Words
    processor: Words
    cores: Annotated[int, Field(ge=1, le=10**6)]


class Kinds(NamedTuple):
    """The kinds of lines that a journal may have.

    Attributes:
        models: the key that identifies a kind -> its model.
        missed: what the user can do about an unusable line.
        asked: what the user can do about an unusable header.
    """

    models: Mapping[str, type[Line]]
    missed: str
    asked: str = "without it the plan of the run is not known: name another --out"


def checked_lines(folder: Path, kinds: Kinds) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Number, kind and line, for each line of a folder's journal.

    Raises:
        ValueError: a line is not JSON or does not fit; names line, key, value, what is allowed and
            what to do.
    """
    for number, line in enumerate(lines_of(folder, kinds.missed), 1):
        try:
            kind = kind_of(line, kinds.models)
        except (ValueError, RecursionError) as fault:
            head = isinstance(line, dict) and "header" in line
            raise ValueError(
                no_use(folder, number, str(fault), kinds.asked if head else kinds.missed)
            ) from None
        yield number, kind, line


def no_use(folder: Path, number: int, fault: str, remedy: str) -> str:
    """A sentence on an unusable line, and what to do."""
    return f"{folder / JOURNAL}: line {number}: {fault}; {remedy}"


def kind_of(line: Any, models: Mapping[str, type[Line]]) -> str:
    """The kind of a line; raises `ValueError`, with the end of a sentence, if it has none or does
    not fit."""
    kinds = [kind for kind in models if kind in line] if isinstance(line, dict) else []
    if len(kinds) != 1:
        raise ValueError(f"must be one of {', '.join(models)}")
    try:
        models[kinds[0]].model_validate(line)
    except ValidationError as error:
        raise ValueError(sentence(error.errors(include_url=False)[0])) from None
    return kinds[0]


def sentence(fault: ErrorDetails) -> str:
    """The first fault that pydantic found, as `KEY = VALUE: what is allowed`."""
    key = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in fault["loc"])[1:]
    if fault["type"] == "missing":
        return f"{key}: missing"
    allowed = re.sub(
        r"^(Input|String) should", "must", str(fault.get("ctx", {}).get("error", fault["msg"]))
    )
    value = repr(fault["input"])
    return (
        f"{key} = {value if len(value) <= SHOWN else value[:SHOWN] + ' ...'}: {allowed}"
        if key
        else allowed
    )
