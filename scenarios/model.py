"""The data types of a scene (`Scene`, `Thrust`, `Scenario`) and of its motion (`State`,
`Collisions`, `Trajectory`).

SI units, float64, y up, counter-clockwise positive. n disks, w walls, k samples, h collisions;
arrays are read-only. A field that is not as described raises a `ValueError` that names it, its
value and what it must be.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crosscheck2d.scenarios.faults import check_scenario, check_scene, check_thrust

Array = NDArray[np.float64]
DEFAULT: Any = None  # stands for the default value in the comment of the field


def frozen(value: ArrayLike, dtype: Any = np.float64) -> NDArray[Any]:
    """A read-only copy of `value` as an array of `dtype`, row after row: a kernel is compiled for
    each order in memory."""
    array = np.array(value, dtype=dtype, order="C")
    array.setflags(write=False)
    return array


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """Disks and walls at t = 0, and their physics."""

    position: Array  # (n, 2) m
    velocity: Array  # (n, 2) m/s
    radius: Array  # (n,) m, positive
    mass: Array  # (n,) kg, positive; `inf` makes the disk static (it must be at rest)
    restitution: float  # normal speed after a collision over that before it, 0 to 1, one for all
    friction: float = 0.0  # Coulomb's coefficient, 0 or more, one for all disks and walls
    angle: Array = DEFAULT  # (n,) rad, default 0
    angular_velocity: Array = DEFAULT  # (n,) rad/s, default 0
    inertia: Array = DEFAULT  # (n,) kg m2, default m r2 / 2 of a solid disk
    walls: Array = DEFAULT  # (w, 2, 2) m, default none; segments [:, 0] to [:, 1], with two sides
    gravity: Array = DEFAULT  # (2,) m/s2, default none; acts on every disk that is not static
    # None, or (2, 2) m, low and high corner of a box: a disk whose centre reaches an edge flies on
    # from the opposite edge; disks do not see each other across it.
    wrap: Array | None = None

    def __post_init__(self) -> None:
        given = {name: value for name, value in vars(self).items() if value is not None}
        radius, mass = np.asarray(self.radius, float), np.asarray(self.mass, float)
        zero = np.zeros(len(np.atleast_1d(radius)))
        solid = mass * radius**2 / 2 if radius.shape == mass.shape else mass
        defaults = {"angle": zero, "angular_velocity": zero, "inertia": solid}
        defaults |= {"walls": np.zeros((0, 2, 2)), "gravity": np.zeros(2)}
        for name, value in (defaults | given).items():
            scalar = name in ("restitution", "friction")
            object.__setattr__(self, name, value if scalar else frozen(value))
        check_scene(self)

    @property
    def n(self) -> int:
        return len(self.radius)

    @property
    def static(self) -> NDArray[np.bool_]:
        """(n,) True where a disk cannot move."""
        return np.isinf(self.mass)

    @property
    def state(self) -> State:
        return State(self.position, self.velocity, self.angle, self.angular_velocity)


@dataclass(frozen=True, eq=False)
class Thrust:
    """A constant thrust on one disk for `start` <= t < `stop`."""

    disk: int  # index into the scene
    start: float  # s
    stop: float  # s
    force: Array  # (2,) N
    torque: float = 0.0  # N m
    frame: Literal["world", "body"] = "world"  # "body": the force turns with the disk's angle

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", frozen(self.force))
        check_thrust(self)


@dataclass(frozen=True, eq=False)
class Scenario:
    """A scene, its duration, and its exact answer if there is one."""

    name: str  # lower-case words, digits, `_` and `-`; says what the scene shows
    asks: str  # the question, in one sentence; the caption of its charts
    source: str  # where the scene or its formula comes from
    scene: Scene  # the initial state and the physics
    duration: float  # s, a whole number of sample intervals
    sample_interval: float = 1 / 60  # s; every engine is sampled at i * sample_interval
    substeps: Sequence[int] = (1, 2, 4, 8)  # k of dt = sample_interval / k, coarse to fine
    thrusts: Sequence[Thrust] = ()  # piecewise-constant
    # Times (k,) s -> the exact `Trajectory` at these times, up to its horizon; raises `NoTruth`.
    # None: there is no exact answer, and `without_truth` says why in one sentence.
    truth: Callable[[Array], Trajectory] | None = None
    without_truth: str = ""
    seed: int | None = None  # of a random scene

    def __post_init__(self) -> None:
        object.__setattr__(self, "substeps", tuple(self.substeps))
        object.__setattr__(self, "thrusts", tuple(self.thrusts))
        check_scenario(self)

    @property
    def intervals(self) -> int:
        """Sample intervals in the duration; a trajectory has one sample more."""
        return max(1, round(self.duration / self.sample_interval))

    @property
    def times(self) -> Array:
        """(k,) s, the instants at which every trajectory of this scenario is sampled."""
        return frozen(np.arange(self.intervals + 1) * self.sample_interval)

    @property
    def middle_substeps(self) -> int:
        """Substeps of the middle step size, whose errors are the scores of the report; of an even
        number of step sizes the finer of the two in the middle."""
        return self.substeps[len(self.substeps) // 2]

    def dt(self, substeps: int) -> float:
        """Step size in s when each sample interval is cut into `substeps`."""
        return self.sample_interval / substeps


@dataclass(frozen=True, eq=False)
class State:
    position: Array  # (n, 2) m
    velocity: Array  # (n, 2) m/s
    angle: Array  # (n,) rad
    angular_velocity: Array  # (n,) rad/s


@dataclass(frozen=True, eq=False)
class Collisions:
    """Collisions in order of time, one for the start of each contact, however long it lasts."""

    t: Array  # (h,) s; for a stepping engine the end of the step that resolved the collision
    i: NDArray[np.int64]  # (h,) index of the first disk
    j: NDArray[np.int64]  # (h,) index of the other disk, i < j; or -1 - w for wall w
    impulse: Array  # (h,) N s along the normal; NaN where an engine does not report it

    @staticmethod
    def of(rows: Sequence[tuple[float, int, int, float]]) -> Collisions:
        # from (t, i, j, impulse) in any order, a pair's disks too
        ordered = sorted((t, i, j, J) if j < 0 or i < j else (t, j, i, J) for t, i, j, J in rows)
        t, i, j, impulse = zip(*ordered) if ordered else ((), (), (), ())
        return Collisions(frozen(t), frozen(i, np.int64), frozen(j, np.int64), frozen(impulse))

    def __len__(self) -> int:
        return len(self.t)


NO_COLLISIONS = Collisions.of([])


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States at k instants, from an engine or from the truth."""

    t: Array  # (k,) s
    position: Array  # (k, n, 2) m
    velocity: Array  # (k, n, 2) m/s
    angle: Array  # (k, n) rad, unwrapped
    angular_velocity: Array  # (k, n) rad/s
    collisions: Collisions = NO_COLLISIONS  # those up to t[-1]
    # Only of a truth: the time in s up to which it has samples; its largest error in m (0: a closed
    # form, exact to a few roundings); why the horizon is before the end, "" if it is not.
    horizon: float = np.inf
    error_bound: float = 0.0
    reason: str = ""

    def __len__(self) -> int:
        return len(self.t)

    def at(self, k: int) -> State:
        return State(self.position[k], self.velocity[k], self.angle[k], self.angular_velocity[k])
