"""The float64 event engine of `scenarios` as an engine: event by event, and asked at the end of
each step."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.engine import ContactImpulse, Unsupported
from adapters.event_driven.events import EventEngine
from adapters.library_versions import version
from scenarios.model import Array, Scene, State
from scenarios.no_truth import NoTruth


class EventDriven:
    """Plays exactly but for rounding; dt says when it is looked at, and for how long a force
    acts."""

    listening, wrapping = (
        True,
        0.0,
    )  # its own list of collisions is what it works with: not hearing of them would save nothing

    def load(self, scene: Scene, dt: float) -> None:
        """Find every disk's first event; a start without a single continuation is refused."""
        try:
            self.engine = EventEngine(scene)
            self.engine.advance(0.0)
        except NoTruth as refusal:
            raise Unsupported(str(refusal)) from refusal
        self.scene, self.dt, self.steps = scene, dt, 0
        self.angle, self.spin, self.turned_at = scene.angle.copy(), scene.angular_velocity.copy(), 0
        self.force, self.torque = np.zeros((scene.n, 2)), np.zeros(scene.n)
        self.forced: set[int] = set()

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        """Add to what accelerates the disk during the next step; a static one stays."""
        if not self.scene.static[disk]:
            self.force[disk] += force
            self.torque[disk] += torque
            self.forced.add(disk)

    def step(self, count: int = 1) -> None:
        """Let the events of `count` steps happen; a force is an acceleration from the first one's
        start to its end."""
        if self.forced and count:
            turning = self.torque / self.scene.inertia
            self.settle()  # it turned freely up to here
            self.accelerate(self.scene.gravity + self.force / self.scene.mass[:, None], turning)
            self.advance(1)
            self.accelerate(np.broadcast_to(self.scene.gravity, (self.scene.n, 2)), 0 * turning)
            self.settle(turning)
            self.force[:], self.torque[:] = 0.0, 0.0
            self.forced.clear()
            count -= 1
        self.advance(count)

    def accelerate(self, acceleration: Array, turning: Array) -> None:
        """Give each disk with a force its row of acceleration (n, 2) m/s2 from now on, and of
        angular acceleration (n,) rad/s2."""
        for disk in sorted(self.forced):
            self.engine.accelerate(disk, self.steps * self.dt, acceleration[disk], turning[disk])

    def advance(self, count: int) -> None:
        """Let the events of `count` steps happen."""
        self.steps += count
        try:
            self.engine.advance(self.steps * self.dt)
        except NoTruth as refusal:
            raise Unsupported(str(refusal)) from refusal

    def settle(self, turning: Array | float = 0.0) -> None:
        """Keep angle and spin as they are now, under an angular acceleration since they were kept
        last."""
        self.angle, self.spin = self.turn(turning)
        self.turned_at = self.steps

    def turn(self, turning: Array | float = 0.0) -> tuple[Array, Array]:
        """Angle rad and angular velocity rad/s (n,) now, under an angular acceleration since they
        were kept."""
        since = (self.steps - self.turned_at) * self.dt
        return self.angle + (self.spin + turning * since / 2) * since, self.spin + turning * since

    def read(self) -> State:
        """Every disk flown from its own last event to now."""
        now = self.steps * self.dt
        turned = self.engine.look_turned(now) if self.scene.friction else self.turn()
        return State(*self.engine.look(now), *turned)

    def collisions(self) -> list[ContactImpulse]:
        """Every collision in the step at whose end it had happened."""
        found = []
        for t, i, j, impulse in self.engine.collisions.tolist():
            step = int(t / self.dt)
            found.append(
                ContactImpulse(step - (step * self.dt >= t and step > 0), int(i), int(j), impulse)
            )
        return found

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """There is nothing to set: the scene is all."""
        return {
            "contact times": (None, "roots of the gap"),
            "a force within a step": (None, "constant acceleration"),
        }

    def versions(self) -> dict[str, str]:
        """The compiler decides the last bit."""
        return {"numba": version("numba"), "numpy": version("numpy")}

    def close(self) -> None:
        """Nothing is held outside Python."""
