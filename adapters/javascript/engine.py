"""A JavaScript engine behind the protocol: one exchange with its process for any number of
steps, and for all the readings that are expected."""

from __future__ import annotations

import os
from base64 import b64decode
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from crosscheck2d.adapters.advance import Foreseen
from crosscheck2d.adapters.engine import ContactImpulse, NotLoaded, Unsupported
from crosscheck2d.adapters.float32 import must_fit, rounding
from crosscheck2d.adapters.javascript.v8 import Packaged
from crosscheck2d.adapters.own_solver.file import SolverFailed
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.scenarios.model import Array, Scene, State

STEP_LIMIT = 60.0  # s that one call for some steps may take

# To start one takes half a second, which is longer than most scenes. By the process that started
# it: a fork cannot talk to it. It ends when that one does.
IDLE: dict[tuple[int, Packaged], SolverProcess] = {}


class JavaScriptEngine:
    """The engine of `NAME.js` in this folder, in a process of its own.

    Its file says what the profiles choose; `changed` are keys of that choice. `listening`,
    `wrapping`: as the protocol has them; the wrap is done in V8, and its time is in that of `step`.

    Attributes:
        inside: s that V8 took for the steps so far, of the time of `step`: the rest is the exchange
            with the process.
    """

    listening, wrapping = True, 0.0

    def __init__(
        self, name: str, package: str, profile: str, *, float32: bool = False, **changed: Any
    ) -> None:
        self.packaged, self.profile, self.changed = Packaged(name, package), profile, changed
        self.float32 = float32
        self.started: SolverProcess | None = None
        self.inside, self.failed = 0.0, False

    @property
    def process(self) -> SolverProcess:
        """The process, an idle one or a new one, when it is first needed; raises `NotLoaded` if
        the engine cannot be loaded."""
        if self.started is None:
            self.started = IDLE.pop((os.getpid(), self.packaged), None)
        if self.started is None:
            try:
                self.started = SolverProcess(self.packaged)
            except SolverFailed as failure:
                raise NotLoaded(f"{self.packaged.package}: {failure}") from None
        return self.started

    def do(self, command: str, argument: Any = None) -> Any:
        """What the driver answers; `seconds` is its time in V8. Raises `Unsupported` where the
        engine's file refuses."""
        try:
            answer = self.process.do(command, argument, STEP_LIMIT)
        except SolverFailed as failure:
            if failure.kind == "refused":
                raise Unsupported(failure.what) from None
            self.failed = True
            raise
        self.seconds = float(answer["seconds"])
        return answer["done"]

    def load(self, scene: Scene, dt: float) -> None:
        """Build a new world; raises `Unsupported` if a number of the scene overflows in float32,
        where the engine computes in it."""
        if self.float32:
            must_fit(scene)
        self.scene, self.forces = scene, dict[int, Array]()
        self.log: list[ContactImpulse] = []
        self.steps, self.expected = 0, (0, 0)
        self.ahead, self.thrown = deque[Array](), dict[str, str]()
        answer = self.do(
            "load",
            {
                "scene": to_json(scene, dt),
                "profile": self.profile,
                "changed": self.changed,
                "listening": self.listening,
            },
        )
        self.rows: Array | None = self.readings(answer)[0]
        self.resolved: list[tuple[str, Any, Any]] = answer["settings"]

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Add to what acts during the next step; nothing moves a static disk."""
        if not self.scene.static[disk]:
            acting = np.array([*force, torque], float)
            self.forces[disk] = self.forces.get(disk, np.zeros(3)) + acting

    def expect(self, count: int, times: int, thrusts: Sequence[Foreseen] = ()) -> None:
        """The next `times` calls are `step(count)`, each followed by `read`, and only `thrusts`
        act: all of them are played in as few exchanges as can be, of some tenths of a second
        each."""
        self.expected, self.thrusts = (count, times), thrusts

    def step(self, count: int = 1) -> None:
        """One exchange with the process for all the steps, or none if they have been played ahead.

        Raises:
            ValueError: other steps were expected, and have been played.
        """
        forces = [[disk, *acting.tolist()] for disk, acting in self.forces.items()]
        self.steps += count
        if self.expected[1] and self.expected[0] == count and not forces:
            self.rows = self.next_expected()
            return
        if self.ahead:
            raise ValueError("steps were expected that have been played, and do not come")
        self.forces, self.rows, self.expected = {}, None, (0, 0)
        self.do("step", {"count": count, "forces": forces})
        self.inside += self.seconds

    def next_expected(self) -> Array:
        """The reading after the steps that come next, which are played now or have been."""
        count, times = self.expected
        if not self.ahead and not self.thrown:
            thrusts = [
                thrust for thrust in self.thrusts if not self.scene.static[thrust.disk]
            ]  # nothing moves a static disk
            answer = self.do("ahead", {"count": count, "times": times, "thrusts": thrusts})
            self.inside += self.seconds
            self.ahead.extend(self.readings(answer))
            self.thrown = answer["thrown"]
        if not self.ahead:
            if "refused" in self.thrown:
                raise Unsupported(self.thrown["refused"])
            raise SolverFailed("error", self.thrown["failed"])
        self.expected = (count, times - 1)
        return self.ahead.popleft()

    def look(self) -> Array:
        """(n, 6) x, y, u, v, angle, spin; collisions are noted, too."""
        if self.rows is None:
            self.rows = self.readings(self.do("look"))[0]
        return self.rows

    def readings(self, answer: dict[str, Any]) -> Array:
        """(readings, n, 6) of what the driver hands back; the collisions behind them are noted."""
        numbers = np.frombuffer(b64decode(answer["numbers"]))
        shape = (answer["readings"], self.scene.n, 6)
        rows, heard = np.split(numbers, [np.prod(shape)])
        self.log += [
            ContactImpulse(int(step), int(i), int(j), float(impulse))
            for step, i, j, impulse in heard.reshape(-1, 4)
        ]
        return rows.reshape(shape)

    def read(self) -> State:
        """All disks in one exchange; static disks stay as the scene states them."""
        rows, scene = self.look(), self.scene
        still = scene.static
        return State(
            np.where(still[:, None], scene.position, rows[:, 0:2]),
            np.where(still[:, None], 0.0, rows[:, 2:4]),
            np.where(still, scene.angle, rows[:, 4]),
            np.where(still, scene.angular_velocity, rows[:, 5]),
        )

    def collisions(self) -> list[ContactImpulse]:
        """From the engine's own events."""
        self.look()
        return [one for one in self.log if one.step < self.steps]

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """As the engine's file reads them back."""
        rows = {name: (asked, found) for name, asked, found in self.resolved}
        if self.float32:
            rows["float32 rounding of the start in m"] = (None, rounding(self.scene))
        return rows

    def versions(self) -> dict[str, str]:
        """The package, whose hash was checked, and V8."""
        return self.process.versions

    def close(self) -> None:
        """Leave the process to the next engine of its kind, which loads a world of its own; end it
        if something failed in it, or if one is idle already."""
        process, self.started = self.started, None
        if process is None:
            return
        if self.failed or IDLE.setdefault((os.getpid(), self.packaged), process) is not process:
            process.close()


def to_json(scene: Scene, dt: float) -> dict[str, Any]:
    """A scene as the engines' files take it: plain lists in SI units, static disks with mass 1."""
    moving = ~scene.static
    return {
        "n": scene.n,
        "dt": dt,
        "position": scene.position.tolist(),
        "velocity": scene.velocity.tolist(),
        "angle": scene.angle.tolist(),
        "spin": scene.angular_velocity.tolist(),
        "radius": scene.radius.tolist(),
        "mass": np.where(moving, scene.mass, 1.0).tolist(),
        "inertia": np.where(moving & np.isfinite(scene.inertia), scene.inertia, 1.0).tolist(),
        "fixed": scene.static.tolist(),
        "walls": scene.walls.tolist(),
        "gravity": scene.gravity.tolist(),
        "restitution": scene.restitution,
        "friction": scene.friction,
        "wrap": None if scene.wrap is None else scene.wrap.tolist(),
    }
