"""The exercise's solver with a switch for everything engines do otherwise: plain arithmetic, for a handful of disks.

An engine is an order of stages. With nothing switched on a step is the exercise's: accelerate, move, then for each pair
that overlaps project and bounce.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from adapters.engine import Hit
from scenarios.model import Array, Scene, State

EXERCISE = ("accelerate", "move", "detect", "pair_by_pair")
POSITION_FIRST = ("move", "detect", "pair_by_pair", "accelerate")
# Collide where they are, then aim at a velocity after gravity, then move (Box2D 2.3, b2Island::Solve).
BOX2D = ("detect", "last_first", "accelerate", "aim", "warm_start", "bounce", "cap", "move", "push_out")
# Move, collide there, aim at a velocity before gravity (Munk2D, cpSpaceStep).
PYMUNK = ("move", "detect", "aim", "accelerate", "bounce")

MIXING: dict[str, Callable[[float, float], float]] = {
    "as stated": lambda a, _: a,
    "the larger": max,
    "the smaller": min,
    "the mean": lambda a, b: (a + b) / 2,
    "the product": lambda a, b: a * b,
}


@dataclass(frozen=True)
class Switches:
    """What may be other than in the exercise.

    Attributes:
        order: the stages of a step.
        substeps: how many steps a step is cut into.
        mixing: how the restitutions of two disks make that of the pair, a key of `MIXING`.
        threshold: m/s, closing speeds up to which a hit is taken as inelastic.
        iterations: how often all contacts are gone through in stage `bounce`.
        push_share: of the overlap beyond the slop, undone in each of `push_iterations` a step.
        slop: m, of overlap that is left.
        cap: m, by which a disk moves at most in a step; its velocity is cut.
        digits: binary digits of every number: 53 or 24.
    """

    order: tuple[str, ...] = EXERCISE
    substeps: int = 1
    mixing: str = "as stated"
    threshold: float = 0.0
    iterations: int = 8
    push_share: float = 0.0
    push_iterations: int = 3
    slop: float = 0.0
    cap: float = np.inf
    digits: int = 53


class Switched:
    """A player that takes switches: load, push, step, read, as every engine; walls are not needed here, a floor is."""

    listening, wrapping = True, 0.0

    def __init__(self, switches: Switches) -> None:
        self.on = switches
        self.kind: Any = np.float32 if switches.digits == 24 else np.float64

    def load(self, scene: Scene, dt: float) -> None:
        """Disks, and walls that lie level: each a floor for what is above it."""
        self.scene = scene
        self.h = self.kind(dt / self.on.substeps)
        self.x, self.v = scene.position.astype(self.kind), scene.velocity.astype(self.kind)
        self.gravity = scene.gravity.astype(self.kind)
        self.weight = 1 / scene.mass
        self.floors = [float(wall[0, 1]) for wall in scene.walls]
        self.angle, self.spin = scene.angle.copy(), scene.angular_velocity.copy()
        self.contacts: list[Contact] = []
        self.before: dict[tuple[int, int], float] = {}

    def step(self, count: int = 1) -> None:
        """`count` steps, each its substeps, each its stages."""
        for _ in range(count * self.on.substeps):
            for stage in self.on.order:
                getattr(self, stage)()

    def accelerate(self) -> None:
        """v += g h, of what can move."""
        self.v[self.weight > 0] += self.gravity * self.h

    def move(self) -> None:
        """x += v h."""
        self.x += self.h * self.v

    def detect(self) -> None:
        """All pairs that overlap, and disks below a floor, with the restitution of each."""
        e = MIXING[self.on.mixing](self.scene.restitution, self.scene.restitution)
        radius = self.scene.radius
        self.before = {(contact.i, contact.j): contact.impulse for contact in self.contacts}
        self.contacts = [
            Contact(i, j, e) for i in range(len(radius)) for j in range(i + 1, len(radius))
            if self.weight[i] + self.weight[j] > 0 and self.gap(i, j)[0] <= 0
        ]  # fmt: skip
        self.contacts += [
            Contact(i, -1 - w, e) for i in range(len(radius)) for w in range(len(self.floors))
            if self.weight[i] > 0 and self.gap(i, -1 - w)[0] <= 0
        ]  # fmt: skip

    def gap(self, i: int, j: int) -> tuple[float, Array]:
        """m between the surfaces, and the unit normal from j to i."""
        if j < 0:
            return float(self.x[i, 1]) - self.floors[-1 - j] - float(self.scene.radius[i]), np.array([0.0, 1.0])
        apart = (self.x[i] - self.x[j]).astype(float)
        distance = float(np.hypot(*apart))
        return distance - float(self.scene.radius[i] + self.scene.radius[j]), apart / distance

    def closing(self, contact: Contact) -> float:
        """m/s along the normal, negative while they close in."""
        other = self.v[contact.j] if contact.j >= 0 else 0.0
        return float((self.v[contact.i] - other) @ self.gap(contact.i, contact.j)[1])

    def pair_by_pair(self) -> None:
        """The exercise's task 2 for one contact after the other: project, then bounce if they still close in."""
        for contact in self.contacts:
            gap, _ = self.gap(contact.i, contact.j)
            self.part(contact, -min(gap, 0.0))
            if gap < 0 and self.closing(contact) < 0:
                self.set_target(contact)
                self.push_to_target(contact)

    def last_first(self) -> None:
        """Go through the contacts from the last disks to the first, as an engine does whose lists grow at the front."""
        self.contacts.reverse()

    def warm_start(self) -> None:
        """Begin with the impulses of the last step, where a contact has stayed."""
        for contact in self.contacts:
            self.push_by(contact, self.before.get((contact.i, contact.j), 0.0))

    def aim(self) -> None:
        """Fix, for every contact at once, the velocity it shall have after the bounce."""
        for contact in self.contacts:
            self.set_target(contact)

    def set_target(self, contact: Contact) -> None:
        """e times the closing speed; 0 for slow hits and for what does not close in."""
        speed = self.closing(contact)
        contact.target = -contact.e * speed if speed < -self.on.threshold else 0.0

    def bounce(self) -> None:
        """Sequential impulses: go through all contacts again and again; what was pushed may be taken back."""
        for _ in range(self.on.iterations):
            for contact in self.contacts:
                self.push_to_target(contact)

    def push_to_target(self, contact: Contact) -> None:
        """The impulse that gives a contact its target velocity, if that is a push in all."""
        wanted = (contact.target - self.closing(contact)) / self.inverse_mass(contact)
        self.push_by(contact, max(contact.impulse + wanted, 0.0) - contact.impulse)

    def push_by(self, contact: Contact, impulse: float) -> None:
        """N s more along the normal."""
        contact.impulse += impulse
        _, n = self.gap(contact.i, contact.j)
        self.v[contact.i] += impulse * self.weight[contact.i] * n
        if contact.j >= 0:
            self.v[contact.j] -= impulse * self.weight[contact.j] * n

    def inverse_mass(self, contact: Contact) -> float:
        """1/kg, of the two together; a floor has none."""
        return float(self.weight[contact.i] + (self.weight[contact.j] if contact.j >= 0 else 0.0))

    def part(self, contact: Contact, by: float) -> None:
        """Move the two apart by `by` m, shared by inverse mass."""
        _, n = self.gap(contact.i, contact.j)
        share = self.weight[contact.i] / self.inverse_mass(contact)
        self.x[contact.i] += by * share * n
        if contact.j >= 0:
            self.x[contact.j] -= by * (1 - share) * n

    def push_out(self) -> None:
        """Undo a share of every overlap beyond the slop, some times; stop where all are within three slops."""
        for _ in range(self.on.push_iterations if self.on.push_share else 0):
            gaps = [self.gap(contact.i, contact.j)[0] for contact in self.contacts]
            for contact in self.contacts:
                gap = self.gap(contact.i, contact.j)[0]
                self.part(contact, min(max(-self.on.push_share * (gap + self.on.slop), 0.0), 0.2))
            if min(gaps, default=0.0) >= -3 * self.on.slop:
                return

    def cap(self) -> None:
        """Cut velocities that would move a disk too far."""
        far = np.hypot(*self.v.T) * self.h
        fast = far > self.on.cap
        self.v[fast] *= (self.on.cap / far[fast])[:, None].astype(self.kind)

    def read(self) -> State:
        """Copies in float64; nothing turns here."""
        return State(self.x.astype(float), self.v.astype(float), self.angle.copy(), self.spin.copy())

    def push(self, disk: int, force: Array, torque: float) -> None:
        """Not needed by any lesson that switches."""
        raise NotImplementedError

    def hits(self) -> list[Hit]:
        """Not told."""
        return []

    def settings(self) -> dict[str, tuple[Any, Any]]:
        """What is switched on."""
        return {name: (value, value) for name, value in vars(self.on).items()}

    def versions(self) -> dict[str, str]:
        """Plain arithmetic."""
        return {"numpy": np.__version__}

    def close(self) -> None:
        """Nothing is held."""


@dataclass
class Contact:
    """Disks i and j (a floor w as -1 - w) with the pair's restitution, its target velocity m/s and impulse N s."""

    i: int
    j: int
    e: float
    target: float = 0.0
    impulse: float = 0.0
