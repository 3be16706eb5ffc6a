"""Engines that do what engines do at their worst, each at its 100th step: what the runner is there
to survive."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.scenarios.model import State

FATAL = 100  # the step
SLOW = 4.0  # s


class Controlled:
    """Disks that fly straight through everything, and `misbehave` when the 100th step is due.

    It is plain numpy, so that a worker that has to be replaced is soon there again.
    """

    def load(self, scene, dt):
        self.dt, self.steps, self.start = dt, 0, scene
        self.position, self.velocity = np.array(scene.position), np.array(scene.velocity)

    def apply_force(self, disk, force, torque):
        pass

    def step(self, count=1):
        for _ in range(count):
            if self.steps == FATAL - 1:
                self.misbehave()
            self.position += self.velocity * self.dt
            self.steps += 1

    def misbehave(self):
        """Nothing: the control of the controls."""

    def read(self):
        return State(
            self.position.copy(),
            self.velocity.copy(),
            self.start.angle,
            self.start.angular_velocity,
        )

    def collisions(self):
        return []

    def settings(self):
        return {}

    def versions(self):
        return {}

    def close(self):
        pass


class Raises(Controlled):
    """As a binding does that is older than its library."""

    def misbehave(self):
        raise RuntimeError("no such luck")


class Aborts(Controlled):
    """As pymunk does on a negative mass: a line on standard error, then abort() in C."""

    def misbehave(self):
        os.write(2, b"assertion failed: mass > 0\n")
        ctypes.CDLL(None).abort()


class Segfaults(Controlled):
    """As Box2D 3 does on a body that is gone."""

    def misbehave(self):
        ctypes.string_at(0)


class Hangs(Controlled):
    """In C, where no Python signal handler runs."""

    def misbehave(self):
        ctypes.CDLL(None).sleep(1000)


class Devours(Controlled):
    """Allocates without end."""

    def misbehave(self):
        taken = []
        while True:
            taken.append(np.ones(1_000_000))


class TurnsToNan(Controlled):
    """Without a word."""

    def misbehave(self):
        self.velocity[0] = np.nan


class Prints(Controlled):
    """20 MB to each stream."""

    def misbehave(self):
        for _ in range(20):
            sys.stdout.write("x" * 999_999 + "\n")
            sys.stderr.write("y" * 999_999 + "\n")


class Leaves(Controlled):
    """Ends the process as if all were well."""

    def misbehave(self):
        os._exit(0)


class IsKilled(Controlled):
    """By `kill -9`, every time."""

    def misbehave(self):
        os.kill(os.getpid(), signal.SIGKILL)


class LoadsSlowly(Controlled):
    """As one that is compiled first: longer than the time-out that its test gives it."""

    def load(self, scene, dt):
        time.sleep(SLOW)
        super().load(scene, dt)


class LoadsSlowlyAndHangs(LoadsSlowly):
    """The control of the one before."""

    def misbehave(self):
        time.sleep(1000)


class HangsInLoad(Controlled):
    """Before its first step is due."""

    def load(self, scene, dt):
        super().load(scene, dt)
        ctypes.CDLL(None).sleep(1000)


class Remembers(Controlled):
    """Each world it makes is faster than the one before: a global that `load` does not reset."""

    worlds = 0

    def load(self, scene, dt):
        super().load(scene, dt)
        Remembers.worlds += 1
        self.velocity *= Remembers.worlds


class Once(Controlled):
    """Killed by `kill -9` the first time only: where it is asked to, it leaves a mark that it has
    been here."""

    def misbehave(self):
        mark = Path(os.environ["CONTROL_MARK"])
        if not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)


def row(make: type[Controlled], leaves_state: bool = False) -> EngineRow:
    """As a row of `ENGINES`."""
    return EngineRow(make, "a control", alpha=0.5, rounding=2.0**-53, leaves_state=leaves_state)


CONTROLS = {
    f"{make.__name__.lower()}:control": row(make)
    for make in (Raises, Aborts, Segfaults, Hangs, Devours, TurnsToNan, Prints, Leaves, IsKilled)
}
