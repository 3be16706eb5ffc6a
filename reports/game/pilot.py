"""What the keys of the exercise's game do to the ship: one force and one torque at a time, kept as
thrusts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, inf, sin

import numpy as np

from crosscheck2d.scenarios.model import Array, Scene, Thrust

SHIP = 0  # the disk that is steered
THRUST, TURN = 0.25, 1.0  # m/s2 and rad/s2, of the exercise: force mass 0.25, torque MoI 1.0
FORWARD = {"w": 1.0, "s": -1.0}
LEFT = {"a": 1.0, "d": -1.0}
KEYS = (*FORWARD, *LEFT)


@dataclass
class Pilot:
    """Keys in, thrusts out. `interval`: s, of a frame; keys act at the start of one.

    W and S accelerate along the ship's heading as it is when the key event comes (a repeated event
    aims anew), A and D turn; releasing either key of a pair ends its thrust, as in the exercise.

    Attributes:
        held: the force and the torque that are on, without an end.
        past: those that have ended.
    """

    scene: Scene
    interval: float
    held: dict[str, Thrust] = field(default_factory=dict)
    past: list[Thrust] = field(default_factory=list)

    def key(self, key: str, down: bool, frame: int, angle: float) -> None:
        """Key `key` of `KEYS` goes down (again) or up at the start of frame `frame`, the ship's
        heading `angle` rad."""
        if key in FORWARD:
            force = down * FORWARD[key] * THRUST * float(self.scene.mass[SHIP])
            self.change("force", frame, force * np.array([cos(angle), sin(angle)]), 0.0)
        else:
            torque = down * LEFT[key] * TURN * float(self.scene.inertia[SHIP])
            self.change("torque", frame, np.zeros(2), torque)

    def change(self, kind: str, frame: int, force: Array, torque: float) -> None:
        """From frame `frame` on the force or the torque is this; a repeated key that aims as before
        changes nothing."""
        before, now = self.held.get(kind), frame * self.interval
        if before and np.array_equal(before.force, force) and before.torque == torque:
            return
        if before and before.start < now:
            self.past.append(replace(before, stop=now))
        self.held.pop(kind, None)
        if force.any() or torque:
            self.held[kind] = Thrust(SHIP, now, inf, force, torque)

    @property
    def now(self) -> list[Thrust]:
        """The thrusts that are on, without an end."""
        return list(self.held.values())

    def thrusts(self, frames: int) -> list[Thrust]:
        """All thrusts of the first `frames` frames, in order of time; they end there at the
        latest."""
        end = frames * self.interval
        begun = [thrust for thrust in (*self.past, *self.now) if thrust.start < end]
        cut = [replace(thrust, stop=min(thrust.stop, end)) for thrust in begun]
        return sorted(cut, key=lambda thrust: thrust.start)
