"""The one loop that plays a scenario on an engine, and the `Run` it gives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from math import cos, sin
from time import perf_counter
from typing import Any

import numpy as np

from adapters.engine import ContactImpulse, Engine, NotStarted, Unsupported
from scenarios.model import Array, Collisions, Scenario, Scene, State, Thrust, Trajectory, frozen

STATUSES = ("ok", "unsupported", "diverged", "error", "crashed", "timeout")
# times as far as anything can fly in a scene: a disk beyond that has been thrown by the engine
RUNAWAY = 1e3


@dataclass(frozen=True, eq=False)
class Run:
    """What one engine made of one scenario at one dt.

    Attributes:
        engine, profile: the row of `ENGINES`, `engine:profile`.
        scenario: its name.
        dt: s.
        status: one of `STATUSES`.
        reason: why the status is not "ok", else "".
        trajectory: the samples, up to where a diverged run left off; None if nothing was played.
        seconds: wall time inside `step`, with the collision log on; no benchmark.
        settings: setting -> (asked for, resolved).
        versions: library -> version.
    """

    engine: str
    profile: str
    scenario: str
    dt: float
    status: str = "ok"
    reason: str = ""
    trajectory: Trajectory | None = None
    seconds: float = 0.0
    settings: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """`engine:profile`, the key in `ENGINES`."""
        return f"{self.engine}:{self.profile}"


def unwatched(state: State) -> None:
    """Nobody looks on."""


def play_once(
    make: Callable[[], Engine],
    name: str,
    scenario: Scenario,
    dt: float,
    watch: Callable[[State], None] = unwatched,
) -> Run:
    """`play` on a new engine, which is closed again whatever happens; `make` is `Row.make`, `name`
    `engine:profile`.

    A library that is missing is a refusal, with its name. Raises what `play` raises.
    """
    try:
        engine = make()
    except ImportError as missing:
        engine_name, profile = name.split(":")
        reason = f"{missing.name or missing} cannot be imported: {missing}"
        return Run(engine_name, profile, scenario.name, dt, "unsupported", reason)
    with closing(engine):
        return play(engine, name, scenario, dt, watch)


def play(
    engine: Engine,
    name: str,
    scenario: Scenario,
    dt: float,
    watch: Callable[[State], None] = unwatched,
) -> Run:
    """Play `scenario` in steps of `dt` s, which must divide its sample interval; `name` is
    `engine:profile`.

    `watch` is shown every good sample as soon as it is there, the start first: a crash leaves no
    other trace. Refusals, exceptions and runaways become the run's status; only a dt that does not
    fit raises `ValueError`, want of memory `MemoryError`, and an engine whose process cannot be had
    `NotStarted`.
    """
    engine_name, profile = name.split(":")
    substeps = round(scenario.sample_interval / dt)
    if (
        substeps < 1
        or abs(substeps * dt - scenario.sample_interval) > 1e-9 * scenario.sample_interval
    ):
        raise ValueError(
            f"dt {dt:g} s does not divide the sample interval {scenario.sample_interval:g} s"
        )
    states: list[State] = []
    collisions: list[ContactImpulse] = []
    settings: dict[str, tuple[Any, Any]] = {}
    versions: dict[str, str] = {}
    seconds, farthest = 0.0, RUNAWAY * reach(scenario)
    status, reason = "ok", ""
    try:
        engine.load(scenario.scene, dt)
        settings, versions = engine.settings(), engine.versions()
        states.append(engine.read())
        watch(states[0])
        for k in range(scenario.samples):
            seconds += advance(engine, scenario, k * substeps, substeps, dt)
            state = engine.read()
            if fault := fault_of(state, farthest):
                status, reason = "diverged", f"{fault} at {(k + 1) * scenario.sample_interval:g} s"
                break
            states.append(state)
            watch(state)
    except Unsupported as refusal:
        status, reason = "unsupported", str(refusal)
    except (MemoryError, NotStarted):  # not the engine's fault: left to whoever set the limit
        raise
    except Exception as error:  # an engine may raise anything; the run says what
        status, reason = getattr(error, "status", "error"), f"{type(error).__name__}: {error}"
    if states:
        collisions = collisions_of(engine)
    trajectory = (
        gather(
            scenario, states, first_collisions(collisions, dt, weight_impulse(scenario.scene, dt))
        )
        if states
        else None
    )
    return Run(
        engine_name,
        profile,
        scenario.name,
        dt,
        status,
        reason,
        trajectory,
        seconds,
        settings,
        versions,
    )


def collisions_of(engine: Engine) -> list[ContactImpulse]:
    """The collisions of an engine that may have failed; none if it cannot tell any more."""
    try:
        return engine.collisions()
    except Exception:  # the run already carries the reason
        return []


def advance(engine: Engine, scenario: Scenario, first: int, count: int, dt: float) -> float:
    """Advance `count` steps from step number `first`, applying the thrusts that are on; the seconds
    inside `step`."""
    seconds = 0.0
    for step, acting in thrust_steps(scenario.thrusts, first, count, dt):
        for thrust, share in acting:
            engine.apply_force(
                thrust.disk, world_force(thrust, engine) * share, thrust.torque * share
            )
        started = perf_counter()
        engine.step(step)
        seconds += perf_counter() - started
    return seconds


def thrust_steps(
    thrusts: Sequence[Thrust], first: int, count: int, dt: float
) -> Iterator[tuple[int, list[tuple[Thrust, float]]]]:
    """Cut steps first .. first + count into (how many, acting): one by one where a thrust is on,
    else in one go.

    A thrust carries the share of the step during which its thrust is on, so that its impulse is
    exact. It acts over all of the step: what that displaces a disk by is reported by
    thrust_grid.py.
    """
    if not thrusts:
        yield count, []
        return
    free = 0
    for step in range(first, first + count):
        shares = [(t, min(t.stop / dt, step + 1) - max(t.start / dt, step)) for t in thrusts]
        # less is rounding of start / dt
        if acting := [(t, share) for t, share in shares if share > 1e-9]:
            if free:
                yield free, []
            yield 1, acting
            free = 0
        else:
            free += 1
    if free:
        yield free, []


def world_force(thrust: Thrust, engine: Engine) -> Array:
    """(2,) N in the world frame; a body-frame force is turned by the disk's angle at the start of
    the step."""
    if thrust.frame == "world":
        return thrust.force
    return turned(thrust.force, engine.read().angle[thrust.disk])


def turned(force: Array, angle: float) -> Array:
    """(2,) N, turned by `angle` rad."""
    x, y = force
    return np.array([cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y])


def reach(scenario: Scenario) -> float:
    """m from the origin, no less than any disk can get in free flight under gravity and thrust."""
    scene, t = scenario.scene, scenario.duration
    thrust = sum(float(np.linalg.norm(one.force)) for one in scenario.thrusts) / scene.mass.min()
    start = max(
        np.abs(scene.position).max(), np.abs(scene.walls).max(initial=0.0), scene.radius.max()
    )
    return float(
        start
        + np.abs(scene.velocity).max() * t
        + (np.linalg.norm(scene.gravity) + thrust) * t * t / 2
    )


def fault_of(state: State, farthest: float) -> str:
    """What is wrong with a state that cannot be gone on from, or ""; `farthest` in m from the
    origin."""
    # Asked after every sample, so sums of squares are asked first: they are finite only if every
    # number is.
    others = state.velocity, state.angle, state.angular_velocity
    if (
        np.vdot(state.position, state.position) <= farthest * farthest
        and sum(np.vdot(a, a) for a in others) < np.inf
    ):
        return ""
    for name in ("position", "velocity", "angle", "angular_velocity"):
        values = getattr(state, name)
        if not np.isfinite(values).all():
            return f"{name} of disk {int(np.argwhere(~np.isfinite(values))[0][0])} is not finite"
    if len(state.position) and (far := np.abs(state.position).max()) > farthest:
        return f"a disk is {far:.3g} m away"
    return ""


def weight_impulse(scene: Scene, dt: float) -> float:
    """N s, the largest impulse that the weight of everything can give a contact during one step."""
    moving = scene.mass[~scene.static].sum()
    return float(2 * moving * np.linalg.norm(scene.gravity) * dt)


def first_collisions(
    collisions: Sequence[ContactImpulse], dt: float, weight: float = 0.0
) -> Collisions:
    """One collision where the impulses of a pair begin; its time is the end of the step.

    An impulse in the step after another of the same pair continues it if it is no larger than
    `weight` N s, or if the engine does not report how large it is: else it is a collision of its
    own. Impulses of less than a millionth of the pair's strongest are rounding, and left out; their
    size counts, as a faulty solver may pull where it should push.
    """
    if not collisions:
        return Collisions.of([])
    step, i, j = (np.array(column) for column in list(zip(*collisions))[:3])
    impulse = np.array([collision.impulse for collision in collisions])
    low, high = np.minimum(i, j), np.maximum(i, j)
    disk, other = np.where(low < 0, high, low), np.where(low < 0, low, high)
    order = np.lexsort((step, other, disk))
    rows = step[order], disk[order], other[order], impulse[order]
    starts = first_of_pair(rows[1], rows[2])
    size = np.abs(rows[3])
    strongest = np.maximum.reduceat(np.nan_to_num(size), np.flatnonzero(starts))[
        np.cumsum(starts) - 1
    ]
    step, disk, other, impulse = (row[~(size < 1e-6 * strongest)] for row in rows)
    begins = first_of_pair(disk, other) | (np.diff(step, prepend=step[0]) > 1)
    begins |= np.abs(impulse) > weight
    order = np.flatnonzero(begins)[np.lexsort((other[begins], disk[begins], step[begins]))]
    return Collisions(
        t=frozen((step[order] + 1) * dt),
        i=frozen(disk[order], np.int64),
        j=frozen(other[order], np.int64),
        impulse=frozen(impulse[order]),
    )


def first_of_pair(disk: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(h,) True where rows sorted by pair come to a new pair."""
    return np.append(True, (np.diff(disk) != 0) | (np.diff(other) != 0))


def gather(scenario: Scenario, states: Sequence[State], collisions: Collisions) -> Trajectory:
    """States at the first samples of a scenario as a `Trajectory`."""
    return Trajectory(
        t=frozen(scenario.times[: len(states)]),
        position=frozen([state.position for state in states]),
        velocity=frozen([state.velocity for state in states]),
        angle=frozen([state.angle for state in states]),
        angular_velocity=frozen([state.angular_velocity for state in states]),
        collisions=collisions,
    )
