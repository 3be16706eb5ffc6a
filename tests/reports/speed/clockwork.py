"""Engines whose speed or error is known beforehand."""

from __future__ import annotations

from time import sleep
from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse
from crosscheck2d.scenarios.model import Array, Scene, State


class Sleeper:
    """Takes a fixed time a step, and much longer to build, to read, and to hear of collisions; it
    moves nothing."""

    listening, wrapping = True, 0.0

    def __init__(self, each: float, wrapping: float = 0.0) -> None:
        self.each, self.wraps = each, wrapping

    def load(self, scene: Scene, dt: float) -> None:
        self.scene, self.dt = scene, dt
        sleep(0.005)

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Nothing moves."""

    def step(self, count: int = 1) -> None:
        sleep(count * self.each)
        self.wrapping += count * self.wraps
        if self.listening:
            sleep(0.05)

    def read(self) -> State:
        raise AssertionError("read while timed")

    def collisions(self) -> list[ContactImpulse]:
        return []

    def settings(self) -> dict[str, tuple[Any, Any]]:
        return {}

    def versions(self) -> dict[str, str]:
        return {}

    def close(self) -> None:
        """Nothing is held."""


class Late(Sleeper):
    """Flies straight, but off by `size` dt^`order` m, and by `aside` m whatever dt is."""

    def __init__(self, order: int, size: float = 1.0, aside: float = 0.0) -> None:
        super().__init__(0.0)
        self.order, self.size, self.aside = order, size, aside

    def load(self, scene: Scene, dt: float) -> None:
        self.scene, self.dt, self.t = scene, dt, 0.0

    def step(self, count: int = 1) -> None:
        self.t += count * self.dt

    def read(self) -> State:
        scene = self.scene
        off = self.t * (self.size * self.dt**self.order + self.aside)
        return State(
            scene.position + scene.velocity * self.t + np.array([off, 0.0]),
            scene.velocity.copy(),
            scene.angle.copy(),
            scene.angular_velocity.copy(),
        )
