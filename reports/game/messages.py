"""What a page may ask of the game: four kinds of message, everything in them checked."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.game.flight import SUBSTEPS
from crosscheck2d.reports.game.pilot import KEYS
from crosscheck2d.reports.page.server import MOST_BYTES

MOST_FRAMES = 4  # that one message may ask for
MOST_ENGINES = 16  # in a flight


def known(name: str) -> str:
    """A name that is a row of `ENGINES` by now."""
    if name not in ENGINES:
        raise ValueError(f"{name!r} is no engine")
    return name


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class Fly(_Message):
    """Begin a flight: through a new field, or, where there is a file, that flight again."""

    do: Literal["fly"]
    engines: list[Annotated[str, AfterValidator(known)]] = Field(
        min_length=1, max_length=MOST_ENGINES
    )
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    asteroids: Annotated[int, Field(ge=0, le=40)] = 20
    restitution: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 0.9
    substeps: Literal[SUBSTEPS] = 16  # type: ignore[valid-type]


class Frames(_Message):
    """Fly on by so many frames, and tell where everything is."""

    do: Literal["frames"]
    count: int = Field(ge=1, le=MOST_FRAMES)


class Key(_Message):
    """A key went down (again) or up."""

    do: Literal["key"]
    key: Literal[KEYS]  # type: ignore[valid-type]
    down: bool


class Save(_Message):
    """Give the flight as a scene file."""

    do: Literal["save"]


Message = Fly | Frames | Key | Save
_ANY: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="do")])


def read_message(text: str | bytes) -> Message:
    """The message in `text`, JSON.

    Raises:
        ValueError: one sentence that names every fault.
    """
    if len(text) > MOST_BYTES:
        raise ValueError(f"the message has {len(text)} bytes; must have at most {MOST_BYTES}")
    try:
        return _ANY.validate_json(text)
    except ValidationError as error:
        faults = (
            f"{'.'.join(map(str, fault['loc'])) or 'message'}: {fault['msg']}"
            for fault in error.errors()
        )
        raise ValueError("; ".join(faults)[:500]) from error
