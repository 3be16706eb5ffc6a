"""One open page of the game: what it may ask, checked, and the answers; no server in here."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from crosscheck2d.adapters.advance import turned
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.game.flight import (
    EARTH,
    EARTH_SIZE,
    KEYS,
    SHIP,
    SUBSTEPS,
    Flight,
    Flyer,
    field_scenario,
)
from crosscheck2d.reports.page.server import MOST_BYTES
from crosscheck2d.scenarios.files.scene_file import scene_text
from crosscheck2d.scenarios.model import Scenario

MOST_FRAMES = 4  # that one message may ask for
MOST_ENGINES = 16  # in a flight


def known(name: str) -> str:
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
    do: Literal["frames"]
    count: int = Field(ge=1, le=MOST_FRAMES)


class Key(_Message):
    do: Literal["key"]
    key: Literal[KEYS]  # type: ignore[valid-type]
    down: bool


class Save(_Message):
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


class Session:
    """A page and its flight. `file`: the flight that is flown again, instead of one that is
    steered.

    Attributes:
        given_up: nobody waits for its answer any more, and it may still be at it.
    """

    def __init__(
        self, engines: Sequence[str], file: Scenario | None = None, restitution: float = 0.9
    ) -> None:
        self.file, self.given_up = file, False
        self.flight = self.begin(Fly(do="fly", engines=list(engines), restitution=restitution))

    def begin(self, wish: Fly) -> Flight:
        if self.file is not None:
            return Flight(self.file, wish.engines, replayed=True)
        scenario = field_scenario(wish.seed, wish.asteroids, wish.restitution, wish.substeps)
        return Flight(scenario, wish.engines)

    def answer(self, text: str | bytes) -> dict[str, Any] | None:
        """The answer to a message, for JSON; None where there is nothing to say. Raises ValueError
        if it is faulty."""
        message: Message = read_message(text)
        if isinstance(message, Fly):
            self.flight.close()
            self.flight = self.begin(message)
            return self.field()
        if isinstance(message, Frames):
            started = perf_counter()
            self.flight.advance(message.count)
            return self.now() | {"ms": (perf_counter() - started) * 1e3 / message.count}
        if isinstance(message, Key):
            self.flight.key(message.key, message.down)
            return None
        scenario = self.flight.saved()
        return {
            "kind": "file",
            "name": f"{scenario.name}.toml",
            "text": scene_text(scenario),
            "seconds": scenario.duration,
            "cut": self.flight.left_at >= 0,
        }

    def field(self) -> dict[str, Any]:
        flight = self.flight
        scene = flight.scenario.scene
        return {
            "kind": "field",
            "radius": scene.radius.tolist(),
            "wrap": scene.wrap.ravel().tolist() if scene.wrap is not None else None,
            "walls": scene.walls.reshape(-1, 4).tolist(),
            "earth": [*EARTH, EARTH_SIZE] if flight.is_game else None,
            "interval": flight.scenario.sample_interval,
            "replayed": flight.replayed,
            "engines": [flyer.name for flyer in flight.flyers],
            "first": self.now(),
        }

    def now(self) -> dict[str, Any]:
        flight, interval = self.flight, self.flight.scenario.sample_interval
        solid, ship = flight.solid, flight.solid.state
        last = solid.edges[-1] if solid.edges else None
        return {
            "kind": "frame",
            "frame": flight.frame,
            "t": flight.frame * interval,
            "solid": flight.flyers.index(solid),
            "solid_since": flight.solid_since,
            "flyers": [self.to_json(flyer) for flyer in flight.flyers],
            "ship": [
                *ship.position[SHIP].tolist(),
                *ship.velocity[SHIP].tolist(),
                float(ship.angle[SHIP]),
                float(ship.angular_velocity[SHIP]),
            ],
            "force": self.force(),
            "won": flight.won,
            "over": flight.over,
            # when the solid ship was set back last, s, and whether beside its start
            "set_back": last and {"t": (last.frame + 1) * interval, "beside": solid.beside},
        }

    def force(self) -> list[float]:
        """What drives the ship: force N in the world frame, torque N m."""
        flight = self.flight
        time = flight.frame * flight.scenario.sample_interval
        steered = flight.pilot.held.values()
        thrusts = flight.scenario.thrusts if flight.replayed else steered
        thrusts = [t for t in thrusts if t.disk == SHIP and t.start <= time < t.stop]
        angle = float(flight.solid.state.angle[SHIP])
        forces = [turned(t.force, angle) if t.frame == "body" else t.force for t in thrusts]
        return [*sum(forces, np.zeros(2)).tolist(), float(sum(t.torque for t in thrusts))]

    def to_json(self, flyer: Flyer) -> dict[str, Any]:
        """One engine's disks, its measures, and where it diverged or why it left."""
        diverged = None
        if flyer.divergence is not None:
            at, solid, only = flyer.divergence
            ends = (at.frame + 1) * self.flight.scenario.sample_interval
            diverged = at._asdict() | {"t": ends, "solid": solid, "only": only}
        return self.flight.measures(flyer) | {
            # to 0.1 mm or 0.1 mrad, finer than a pixel
            "x": [round(x, 4) for x in flyer.state.position.ravel().tolist()],
            "angle": [round(angle, 4) for angle in flyer.state.angle.tolist()],
            "left": flyer.left,
            "left_at": flyer.left_at,
            "diverged": diverged,
        }

    def close(self) -> None:
        self.flight.close()
