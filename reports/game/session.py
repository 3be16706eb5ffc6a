"""One open page of the game: answers its messages, one by one; no server in here."""

from __future__ import annotations

import json
from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np

from crosscheck2d.adapters.advance import turned
from crosscheck2d.reports.game.flight import EARTH, EARTH_SIZE, Flight, Flyer, field_scenario
from crosscheck2d.reports.game.messages import Fly, Frames, Key, Message, read_message
from crosscheck2d.reports.game.pilot import SHIP
from crosscheck2d.scenarios.files.scene_file import scene_text
from crosscheck2d.scenarios.model import Array, Scenario


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
        self.flight = self.begun(Fly(do="fly", engines=list(engines), restitution=restitution))

    def begun(self, wish: Fly) -> Flight:
        """A new flight as wished; a file's own field and step are kept."""
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
            self.flight = self.begun(message)
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
        """What stays as it is during a flight, and its first frame."""
        flight = self.flight
        scene = flight.scenario.scene
        return {
            "kind": "field",
            "name": flight.scenario.name,
            "radius": scene.radius.tolist(),
            "wrap": scene.wrap.ravel().tolist() if scene.wrap is not None else None,
            "walls": scene.walls.reshape(-1, 4).tolist(),
            "earth": [*EARTH, EARTH_SIZE] if flight.is_game else None,
            "interval": flight.scenario.sample_interval,
            "dt": flight.dt,
            "replayed": flight.replayed,
            "engines": [flyer.name for flyer in flight.flyers],
            "duration": flight.scenario.duration,
            "first": self.now(),
        }

    def now(self) -> dict[str, Any]:
        """Where everything is at the end of the last frame."""
        flight = self.flight
        ship = flight.solid.state
        return {
            "kind": "frame",
            "frame": flight.frame,
            "t": flight.frame * flight.scenario.sample_interval,
            "solid": flight.flyers.index(flight.solid),
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
            "set_back": self.set_back(),
        }

    def set_back(self) -> dict[str, Any] | None:
        """When the solid ship was set back last, s, and whether beside its start; None: never."""
        solid = self.flight.solid
        if not solid.edges:
            return None
        ends = (solid.edges[-1].frame + 1) * self.flight.scenario.sample_interval
        return {"t": ends, "beside": solid.beside}

    def force(self) -> list[float]:
        """What drives the ship: force N in the world frame, torque N m."""
        flight = self.flight
        time = flight.frame * flight.scenario.sample_interval
        thrusts = flight.scenario.thrusts if flight.replayed else flight.pilot.now
        on = [
            thrust
            for thrust in thrusts
            if thrust.disk == SHIP and thrust.start <= time < thrust.stop
        ]
        angle = float(flight.solid.state.angle[SHIP])
        forces = [
            turned(thrust.force, angle) if thrust.frame == "body" else thrust.force for thrust in on
        ]
        force = sum(forces, np.zeros(2))
        return [*force.tolist(), float(sum(thrust.torque for thrust in on))]

    def to_json(self, flyer: Flyer) -> dict[str, Any]:
        """One engine's disks, its measures, and where it diverged or why it left."""
        diverged = None
        if flyer.divergence is not None:
            at, solid, only = flyer.divergence
            ends = (at.frame + 1) * self.flight.scenario.sample_interval
            diverged = at._asdict() | {"t": ends, "solid": solid, "only": only}
        return self.flight.measures(flyer) | {
            "x": rounded(flyer.state.position.ravel()),
            "angle": rounded(flyer.state.angle),
            "left": flyer.left,
            "left_at": flyer.left_at,
            "diverged": diverged,
            "set_backs": flyer.set_backs,
        }

    def close(self) -> None:
        """Give the engines back."""
        self.flight.close()


def rounded(values: Array) -> list[float]:
    """To 0.1 mm or 0.1 mrad, finer than a pixel."""
    return [round(value, 4) for value in values.tolist()]


def as_json(answer: dict[str, Any]) -> str:
    """Compact; what is not finite was found out before."""
    return json.dumps(answer, separators=(",", ":"))
