"""The event-driven engine in float64. Its states are read at the end of each step."""

from __future__ import annotations

from typing import Any

import numpy as np

from crosscheck2d.adapters.engine import ContactImpulse, Unsupported
from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.adapters.library_versions import version
from crosscheck2d.scenarios.model import Array, Scene, State
from crosscheck2d.scenarios.no_truth import NoTruth


class EventDriven:
    """Plays exactly, except for rounding. dt only sets when states are read and how long a force
    acts."""

    # It needs its list of collisions anyway: not reporting them would save no time.
    listening, wrapping = True, 0.0

    def load(self, scene: Scene, dt: float) -> None:
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
        if not self.scene.static[disk]:
            self.force[disk] += force
            self.torque[disk] += torque
            self.forced.add(disk)

    def step(self, count: int = 1) -> None:
        """Carry out the events of `count` steps; a force is a constant acceleration during the
        first of them."""
        if self.forced and count:
            turning = self.torque / self.scene.inertia
            self.keep_rotation()  # without torque up to here
            self.accelerate(self.scene.gravity + self.force / self.scene.mass[:, None], turning)
            self.advance(1)
            self.accelerate(np.broadcast_to(self.scene.gravity, (self.scene.n, 2)), 0 * turning)
            self.keep_rotation(turning)
            self.force[:], self.torque[:] = 0.0, 0.0
            self.forced.clear()
            count -= 1
        self.advance(count)

    def accelerate(self, acceleration: Array, turning: Array) -> None:
        """Set, from now on, the acceleration (n, 2) m/s2 and the angular acceleration (n,) rad/s2
        of each disk with a force."""
        for disk in sorted(self.forced):
            self.engine.accelerate(disk, self.steps * self.dt, acceleration[disk], turning[disk])

    def advance(self, count: int) -> None:
        self.steps += count
        try:
            self.engine.advance(self.steps * self.dt)
        except NoTruth as refusal:
            raise Unsupported(str(refusal)) from refusal

    def keep_rotation(self, turning: Array | float = 0.0) -> None:
        """Store the present angle and spin; `turning`: the angular acceleration since they were
        stored last, rad/s2."""
        self.angle, self.spin = self.rotation(turning)
        self.turned_at = self.steps

    def rotation(self, turning: Array | float = 0.0) -> tuple[Array, Array]:
        """The present angle rad and angular velocity rad/s (n,); `turning` as above."""
        since = (self.steps - self.turned_at) * self.dt
        return self.angle + (self.spin + turning * since / 2) * since, self.spin + turning * since

    def read(self) -> State:
        now = self.steps * self.dt
        turned = self.engine.rotation_at(now) if self.scene.friction else self.rotation()
        return State(*self.engine.motion_at(now), *turned)

    def collisions(self) -> list[ContactImpulse]:
        # All collisions, each in the step that contains its time.
        found = []
        for t, i, j, impulse in self.engine.collisions.tolist():
            step = int(t / self.dt)
            found.append(
                ContactImpulse(step - (step * self.dt >= t and step > 0), int(i), int(j), impulse)
            )
        return found

    def settings(self) -> dict[str, tuple[Any, Any]]:
        return {
            "contact times": (None, "roots of the gap"),
            "a force within a step": (None, "constant acceleration"),
        }

    def versions(self) -> dict[str, str]:
        return {"numba": version("numba"), "numpy": version("numpy")}

    def close(self) -> None:
        """Nothing to release."""
