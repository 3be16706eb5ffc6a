"""The nouns: what is asked (`Scene`, `Thrust`, `Scenario`), what is answered (`State`,
`Collisions`, `Trajectory`).

SI units, float64, y up, counter-clockwise positive. n disks, w walls, k samples, h collisions;
arrays are read-only.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def frozen(value: ArrayLike, dtype: Any = np.float64) -> NDArray[Any]:
    """A read-only copy of `value` as an array of `dtype`."""
    array = np.array(value, dtype=dtype)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """Disks and walls at t = 0 and the physics they obey.

    Attributes:
        position: (n, 2) m.
        velocity: (n, 2) m/s.
        radius: (n,) m, positive.
        mass: (n,) kg, positive; `inf` makes the disk static (it must be at rest).
        restitution: normal speed after a collision over normal speed before it, 0 to 1, the same
            for all.
        angle: (n,) rad, default 0.
        angular_velocity: (n,) rad/s, default 0.
        inertia: (n,) kg m2, default m r2 / 2 of a solid disk.
        walls: (w, 2, 2) m, segments from walls[:, 0] to walls[:, 1]; static, struck from both
            sides.
        gravity: (2,) m/s2, default none; acts on every disk that is not static.
        wrap: None, or (2, 2) m, low and high corner of the exercise's box: a disk whose centre is
            beyond an edge is set onto the opposite edge; disks do not see each other across it.

    Raises:
        ValueError: naming every field that is not as described.
    """

    position: Array
    velocity: Array
    radius: Array
    mass: Array
    restitution: float
    angle: Array = None  # type: ignore[assignment]
    angular_velocity: Array = None  # type: ignore[assignment]
    inertia: Array = None  # type: ignore[assignment]
    walls: Array = None  # type: ignore[assignment]
    gravity: Array = None  # type: ignore[assignment]
    wrap: Array | None = None

    def __post_init__(self) -> None:
        """Fill the defaults, copy, freeze and check."""
        n = len(np.atleast_1d(np.asarray(self.radius)))
        radius, mass = np.asarray(self.radius, float), np.asarray(self.mass, float)
        defaults = {
            "angle": np.zeros(n),
            "angular_velocity": np.zeros(n),
            "inertia": mass * radius**2 / 2 if radius.shape == mass.shape else mass,
            "walls": np.zeros((0, 2, 2)),
            "gravity": np.zeros(2),
        }
        shapes = {
            "position": (n, 2),
            "velocity": (n, 2),
            "radius": (n,),
            "mass": (n,),
            "angle": (n,),
            "angular_velocity": (n,),
            "inertia": (n,),
            "gravity": (2,),
            "wrap": (2, 2),
        }
        for name in (*shapes, "walls"):
            given = getattr(self, name)
            if given is None and name == "wrap":
                continue
            object.__setattr__(self, name, frozen(defaults[name] if given is None else given))
        faults = [
            f"{name} has shape {getattr(self, name).shape}, must be {shape}"
            for name, shape in shapes.items()
            if getattr(self, name) is not None and getattr(self, name).shape != shape
        ]
        if self.walls.ndim != 3 or self.walls.shape[1:] != (2, 2):
            faults.append(f"walls has shape {self.walls.shape}, must be (w, 2, 2)")
        if faults := faults or self._value_faults():
            raise ValueError("; ".join(faults))

    def _value_faults(self) -> list[str]:
        faults = [] if self.n else ["radius is empty, must have at least one disk"]
        for name in ("position", "velocity", "angle", "angular_velocity", "walls", "gravity"):
            if not np.isfinite(getattr(self, name)).all():
                faults.append(f"{name} holds a value that is not finite")
        for i in range(len(self.radius)):
            if not (0 < self.radius[i] < np.inf):
                faults.append(f"radius[{i}] is {self.radius[i]:g} m, must be positive and finite")
            if not self.mass[i] > 0:
                faults.append(f"mass[{i}] is {self.mass[i]:g} kg, must be positive (inf: static)")
            if not self.inertia[i] > 0:
                faults.append(f"inertia[{i}] is {self.inertia[i]:g} kg m2, must be positive")
            if np.isinf(self.mass[i]) and (self.velocity[i].any() or self.angular_velocity[i]):
                faults.append(f"velocity[{i}] of a static disk (mass inf) must be zero")
        if not 0 <= self.restitution <= 1:
            faults.append(f"restitution is {self.restitution:g}, must be from 0 to 1")
        for w in np.flatnonzero((self.walls[:, 0] == self.walls[:, 1]).all(axis=1)):
            faults.append(f"walls[{w}] has no length, must go from one point to another")
        if self.wrap is not None:
            faults += self._wrap_faults(*self.wrap)
        return faults

    def _wrap_faults(self, low: Array, high: Array) -> list[str]:
        if not (low < high).all():
            return [
                f"wrap is {[low.tolist(), high.tolist()]}, must be [low, high] with low below high"
            ]
        outside = np.flatnonzero(((self.position < low) | (self.position > high)).any(axis=1))
        return [
            f"position[{i}] is {self.position[i].tolist()} m, must be inside the wrap box"
            for i in outside
        ]

    @property
    def n(self) -> int:
        """Number of disks."""
        return len(self.radius)

    @property
    def static(self) -> NDArray[np.bool_]:
        """(n,) True where a disk cannot move."""
        return np.isinf(self.mass)

    @property
    def state(self) -> State:
        """The initial state."""
        return State(self.position, self.velocity, self.angle, self.angular_velocity)


@dataclass(frozen=True, eq=False)
class Thrust:
    """A constant thrust on one disk from `start` to `stop`.

    Attributes:
        disk: index into the scene.
        start, stop: s; the thrust acts for start <= t < stop. Inside a step every engine is off
            (`thrust_grid.py`).
        force: (2,) N.
        torque: N m.
        frame: "world", or "body": the force turns with the disk's angle.
    """

    disk: int
    start: float
    stop: float
    force: Array
    torque: float = 0.0
    frame: Literal["world", "body"] = "world"

    def __post_init__(self) -> None:
        """Freeze and check."""
        object.__setattr__(self, "force", frozen(self.force))
        if self.force.shape != (2,) or not np.isfinite([*self.force, self.torque]).all():
            raise ValueError(
                f"thrust: force {self.force} and torque {self.torque} must be finite (2,) and"
                " scalar"
            )
        if not 0 <= self.start < self.stop:
            raise ValueError(
                f"thrust: start {self.start:g} s must be at least 0 and before stop {self.stop:g} s"
            )
        if self.frame not in ("world", "body"):
            raise ValueError(f"thrust: frame is {self.frame!r}, must be 'world' or 'body'")


@dataclass(frozen=True, eq=False)
class Scenario:
    """A scene, how long it runs, and its right answer where there is one.

    Attributes:
        name: lower-case words, digits, `_` and `-`; says what the scene shows.
        asks: the question, in one sentence; the caption of its charts.
        source: where the scene or its formula comes from.
        scene: the initial state and the physics.
        duration: s, a whole number of sample intervals.
        sample_interval: s; every engine is sampled at i * sample_interval.
        substeps: the dt ladder, dt = sample_interval / k, coarse to fine; the middle one is the
            page's.
        thrusts: piecewise-constant thrusts.
        truth: times (k,) s -> the exact `Trajectory` there, up to its horizon, or `NoTruth` (see
            `truth_at`); or None.
        without_truth: why there is no exact answer, in one sentence, where `truth` is None.
        seed: seed of a random scene, or None.
    """

    name: str
    asks: str
    source: str
    scene: Scene
    duration: float
    sample_interval: float
    substeps: Sequence[int] = (1, 2, 4, 8)
    thrusts: Sequence[Thrust] = ()
    truth: Callable[[Array], Trajectory] | None = None
    without_truth: str = ""
    seed: int | None = None

    def __post_init__(self) -> None:
        """Freeze and check."""
        object.__setattr__(self, "substeps", tuple(self.substeps))
        object.__setattr__(self, "thrusts", tuple(self.thrusts))
        if not re.fullmatch(r"[a-z0-9][a-z0-9_-]*", self.name):
            raise ValueError(
                f"name is {self.name!r}, must be lower-case letters, digits, '_' and '-'"
            )
        if not (0 < self.sample_interval < np.inf and 0 < self.duration < np.inf):
            raise ValueError("duration and sample_interval must be positive and finite")
        if abs(self.duration / self.sample_interval - self.samples) > 1e-9 * self.samples:
            raise ValueError(
                f"sample_interval {self.sample_interval:g} s does not divide the duration"
                f" {self.duration:g} s"
            )
        whole = all(k == int(k) and k >= 1 for k in self.substeps)
        if not self.substeps or not whole or sorted(set(self.substeps)) != list(self.substeps):
            raise ValueError(
                f"substeps is {list(self.substeps)}, must be whole numbers from 1, increasing"
            )
        for thrust in self.thrusts:
            if not 0 <= thrust.disk < self.scene.n:
                raise ValueError(
                    f"thrust: disk {thrust.disk} is not one of the {self.scene.n} disks"
                )

    @property
    def samples(self) -> int:
        """How many sample intervals the duration has; a trajectory has one sample more."""
        return max(1, round(self.duration / self.sample_interval))

    @property
    def times(self) -> Array:
        """(k,) s, the instants at which every trajectory of this scenario is sampled."""
        return frozen(np.arange(self.samples + 1) * self.sample_interval)

    def dt(self, substeps: int) -> float:
        """Step size in s when each sample interval is cut into `substeps`."""
        return self.sample_interval / substeps


@dataclass(frozen=True, eq=False)
class State:
    """Position (n, 2) m, velocity (n, 2) m/s, angle (n,) rad and angular velocity (n,) rad/s at one
    instant."""

    position: Array
    velocity: Array
    angle: Array
    angular_velocity: Array


@dataclass(frozen=True, eq=False)
class Collisions:
    """Collisions in order of time; one entry where the impulses of a contact begin, however long
    they last.

    Attributes:
        t: (h,) s; for a stepping engine the end of the step that resolved the collision.
        i: (h,) index of the first disk.
        j: (h,) index of the other disk, i < j; or -1 - w for wall w.
        impulse: (h,) N s along the normal; NaN where an engine does not report it.
    """

    t: Array
    i: NDArray[np.int64]
    j: NDArray[np.int64]
    impulse: Array

    @staticmethod
    def of(rows: Sequence[tuple[float, int, int, float]]) -> Collisions:
        """Collisions from (t, i, j, impulse) rows; sorted by time, the lower disk of a pair
        first."""
        ordered = sorted((t, i, j, J) if j < 0 or i < j else (t, j, i, J) for t, i, j, J in rows)
        t, i, j, impulse = zip(*ordered) if ordered else ((), (), (), ())
        return Collisions(frozen(t), frozen(i, np.int64), frozen(j, np.int64), frozen(impulse))

    def __len__(self) -> int:
        """Number of collisions."""
        return len(self.t)


NO_COLLISIONS = Collisions.of([])


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States at k instants, from an engine or from the truth.

    Attributes:
        t: (k,) s.
        position: (k, n, 2) m.
        velocity: (k, n, 2) m/s.
        angle: (k, n) rad, unwrapped.
        angular_velocity: (k, n) rad/s.
        collisions: the collisions up to t[-1].
        horizon: s, the horizon up to which engines are held to a truth: no sample lies beyond it.
        reason: why the truth ends there; "" if it does not.
        error_bound: m, how far a truth may be off before it; 0: a closed form, right to a few
            roundings.
    """

    t: Array
    position: Array
    velocity: Array
    angle: Array
    angular_velocity: Array
    collisions: Collisions = field(default_factory=lambda: NO_COLLISIONS)
    horizon: float = np.inf
    error_bound: float = 0.0
    reason: str = ""

    def __len__(self) -> int:
        return len(self.t)

    def at(self, k: int) -> State:
        """The state at sample `k`."""
        return State(self.position[k], self.velocity[k], self.angle[k], self.angular_velocity[k])
