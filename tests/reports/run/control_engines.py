"""Engines that do what engines do at their worst, each at its 100th step: what the runner is there
to survive."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.scenarios.model import State

FATAL = 100  # the step
SLOW = 4.0  # s, longer than the time-out that a test gives an engine that loads slowly


def nothing() -> None:
    pass


class Controlled:
    """Disks that fly straight through everything, with what happens when the 100th step is due, and
    when a scene is loaded.

    It is plain numpy, so that a worker that has to be replaced is soon there again.
    """

    def __init__(
        self, misbehave: Callable[[], object] = nothing, in_load: Callable[[], object] = nothing
    ) -> None:
        self.misbehave, self.in_load = misbehave, in_load

    def load(self, scene, dt):
        self.dt, self.steps, self.start = dt, 0, scene
        self.position, self.velocity = np.array(scene.position), np.array(scene.velocity)
        self.in_load()

    def apply_force(self, disk, force, torque):
        pass

    def step(self, count=1):
        for _ in range(count):
            if self.steps == FATAL - 1:
                self.misbehave()
            self.position += self.velocity * self.dt
            self.steps += 1

    def read(self):
        angle, spin = self.start.angle, self.start.angular_velocity
        return State(self.position.copy(), self.velocity.copy(), angle, spin)

    def collisions(self):
        return []

    def settings(self):
        return {}

    def versions(self):
        return {}

    def close(self):
        pass


class TurnsToNan(Controlled):
    def __init__(self):
        super().__init__(lambda: np.copyto(self.velocity[0], np.nan))


class Remembers(Controlled):
    """Each world it makes is faster than the one before: a global that `load` does not reset."""

    worlds = 0

    def load(self, scene, dt):
        super().load(scene, dt)
        Remembers.worlds += 1
        self.velocity *= Remembers.worlds


def raises():
    raise RuntimeError("no such luck")


def aborts():
    os.write(2, b"assertion failed: mass > 0\n")  # as pymunk does on a negative mass
    ctypes.CDLL(None).abort()


def segfaults():
    ctypes.string_at(0)


def hangs():
    ctypes.CDLL(None).sleep(1000)  # in C, where no Python signal handler runs


def devours():
    taken = []
    while True:
        taken.append(np.ones(1_000_000))


def prints():
    for _ in range(20):
        sys.stdout.write("x" * 999_999 + "\n")
        sys.stderr.write("y" * 999_999 + "\n")


def leaves():
    os._exit(0)  # as if all were well


def is_killed():
    os.kill(os.getpid(), signal.SIGKILL)


def is_killed_once():
    mark = Path(os.environ["CONTROL_MARK"])
    if not mark.exists():
        mark.touch()
        is_killed()


loads_slowly = partial(time.sleep, SLOW)


def row(make: Callable[[], Controlled], leaves_state: bool = False) -> EngineRow:
    """As a row of `ENGINES`."""
    return EngineRow(make, "a control", alpha=0.5, rounding=2.0**-53, leaves_state=leaves_state)


FAULTS = (raises, aborts, segfaults, hangs, devours, prints, leaves, is_killed)
CONTROLS = {f"{fault.__name__}:control": row(partial(Controlled, fault)) for fault in FAULTS}
CONTROLS["turns_to_nan:control"] = row(TurnsToNan)
