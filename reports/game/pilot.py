"""What the keys of the exercise's game do to the ship: one force and one torque at a time, kept as
thrusts."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, inf, sin

import numpy as np

from scenarios.model import Array, Scene, Thrust

SHIP = 0  # the disk that is steered
THRUST, TURN = 0.25, 1.0  # m/s2 and rad/s2, of the exercise: force mass 0.25, torque MoI 1.0
FORWARD = {"w": 1.0, "s": -1.0}
LEFT = {"a": 1.0, "d": -1.0}
KEYS = (*FORWARD, *LEFT)


@dataclass(frozen=True)
class Held:
    """A thrust that is on since the start of frame `since`: (2,) N in the world frame, N m."""

    since: int
    force: Array
    torque: float

    def thrust(self, interval: float, until: float = inf) -> Thrust:
        """As a thrust up to frame `until`; a frame lasts `interval` s."""
        return Thrust(SHIP, self.since * interval, until * interval, self.force, self.torque)


@dataclass
class Pilot:
    """Keys in, thrusts out. `interval`: s, of a frame; keys act at the start of one.

    W and S accelerate along the ship's heading as it is when the key event comes (a repeated event
    aims anew), A and D turn; releasing either key of a pair ends its thrust, as in the exercise.
    """

    scene: Scene
    interval: float
    held: dict[str, Held] = field(default_factory=dict)
    past: list[Thrust] = field(default_factory=list)

    def key(self, key: str, down: bool, frame: int, angle: float) -> None:
        """Key `key` of `KEYS` goes down (again) or up at the start of frame `frame`, the ship's
        heading `angle` rad."""
        if key in FORWARD:
            force = FORWARD[key] * THRUST * float(self.scene.mass[SHIP])
            self.change(
                "force",
                frame,
                force * np.array([cos(angle), sin(angle)]) if down else np.zeros(2),
                0.0,
            )
        else:
            self.change(
                "torque",
                frame,
                np.zeros(2),
                down * LEFT[key] * TURN * float(self.scene.inertia[SHIP]),
            )

    def change(self, kind: str, frame: int, force: Array, torque: float) -> None:
        """From frame `frame` on the force or the torque is this; a repeated key that aims as before
        changes nothing."""
        before = self.held.get(kind)
        if before and np.array_equal(before.force, force) and before.torque == torque:
            return
        if before and before.since < frame:
            self.past.append(before.thrust(self.interval, frame))
        self.held.pop(kind, None)
        if force.any() or torque:
            self.held[kind] = Held(frame, force, torque)

    @property
    def now(self) -> list[Thrust]:
        """The thrusts that are on, without an end."""
        return [held.thrust(self.interval) for held in self.held.values()]

    def thrusts(self, frames: int) -> list[Thrust]:
        """All thrusts of the first `frames` frames, those still on cut there, in order of time."""
        ends = [
            held.thrust(self.interval, frames) for held in self.held.values() if held.since < frames
        ]
        return sorted(self.past + ends, key=lambda thrust: thrust.start)
