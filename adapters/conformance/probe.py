"""The type of a conformance probe: a tiny scene played by a fresh engine, and a reading with its
bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from crosscheck2d.adapters.engine import SILENT, Engine, Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.run import first_collisions
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scene, State

EXERCISE = 0.9  # the restitution that the exercise states
DT = 1 / 256  # s; a power of two, so that multiples of it are exact
# the most roundings in a collision: a relative velocity, an effective mass, a target, an impulse,
# two updates; there are fewer between a force and a velocity
ROUNDINGS = 8

# The laws that an engine breaks, where a probe tells which.
Departure = StrEnum(
    "Departure",
    "START MEMORY DT_IGNORED PATH SPEED GRAVITY_UNSTATED GRAVITY_ABSENT GRAVITY_AT_REST"
    " GRAVITY_UPWARD GRAVITY STATIC MASSES MOMENTUM PASSES STICKS RESTITUTION BY_MASS TANGENTIAL"
    " WALL_PASSES WALL_STICKS WALL_RESTITUTION WALL_TANGENTIAL",
)


class ProbeReading(NamedTuple):
    """The reading of a probe: a number that must be within `bound` of `expected`, or words that
    must equal it; and if it is not, the law that is broken."""

    got: float | str
    expected: float | str
    bound: float = 0.0
    note: str = ""
    departure: Departure | None = None

    @property
    def kept(self) -> bool:
        # Whether it is as expected; NaN never is.
        if isinstance(self.got, str) or isinstance(self.expected, str):
            return self.got == self.expected
        return abs(self.got - self.expected) <= self.bound


@dataclass(frozen=True)
class Probe:
    """One question to every engine."""

    asked: str  # the question, one plain sentence
    # makes fresh engines from a row of `ENGINES` and closes them again
    read: Callable[[EngineRow], ProbeReading]
    # "breaks" if a miss means that the adapter breaks the protocol, so that no number of the engine
    # may be trusted; "departs" if it means other physics than the scene states
    failure: Literal["breaks", "departs"]
    # it reads values that an adapter passes to its library (mass, forces, dt) or from it
    # (collisions, numbers that are none). A solver's own file gets these from the harness, so a
    # failure is due to its physics, and departs.
    handed_on: bool = False


Questions = Mapping[Callable[[EngineRow], ProbeReading], str]  # what reads a probe -> its question


def probes(
    questions: Questions, failure: Literal["breaks", "departs"], handed_on: bool = False
) -> dict[str, Probe]:
    """The probes by the names of their functions."""
    return {
        read.__name__: Probe(asked, read, failure, handed_on) for read, asked in questions.items()
    }


@contextmanager
def loaded(row: EngineRow, *scenes: Scene, dt: float = DT) -> Iterator[Engine]:
    """Context with a fresh engine that has loaded the first of `scenes` that it does not refuse; it
    is always closed."""
    with closing(row.make()) as engine:
        load_first(engine, scenes, dt)
        yield engine


def before_and_after(
    row: EngineRow, *scenes: Scene, steps: int = 24, dt: float = DT
) -> tuple[State, State]:
    """The states of the first of `scenes` that a fresh engine does not refuse."""
    with loaded(row, *scenes, dt=dt) as engine:
        before = engine.read()
        engine.step(steps)
        return before, engine.read()


def load_first(engine: Engine, scenes: Sequence[Scene], dt: float) -> Scene:
    """Load and return the first scene that the engine does not refuse; raises `Unsupported` if it
    refuses all."""
    *fuller, last = scenes
    for scene in fuller:
        with suppress(Unsupported):
            engine.load(scene, dt)
            return scene
    engine.load(last, dt)
    return last


def simplified(scene: Scene) -> tuple[Scene, ...]:
    """`scene`, then simpler versions for a solver of the exercise, which has no walls, no static
    disks and a fixed restitution: without the first two, with the exercise's e, one disk alone.
    Each also without spin, gravity, or both, for an engine's file that does not model these."""
    moving = np.where(scene.static, 1.0, scene.mass)
    bare = replace(scene, walls=np.zeros((0, 2, 2)), mass=moving, inertia=moving)
    alone = {
        name: value[:1]
        for name, value in vars(bare).items()
        if name not in ("walls", "gravity", "restitution", "friction", "wrap")
    }
    fuller = (scene, bare, replace(bare, restitution=EXERCISE), replace(bare, **alone))
    return tuple(poorer for each in fuller for poorer in without_spin_and_gravity(each))


def without_spin_and_gravity(scene: Scene) -> tuple[Scene, ...]:
    still: dict[str, Any] = {"angular_velocity": np.zeros(scene.n)}
    light: dict[str, Any] = {"gravity": np.zeros(2)}
    return scene, replace(scene, **still), replace(scene, **light), replace(scene, **still, **light)


scene_of = partial(lay_out, radius=0.5, restitution=0.5)


def one_disk(
    velocity: tuple[float, float] = (0.0, 0.0), spin: float = 0.0, gravity: float = 0.0
) -> Scene:
    rotation: dict[str, Any] = {"inertia": [0.9], "angular_velocity": [spin]}
    return scene_of([[0.25, -0.5]], velocity, mass=7.3, gravity=[0.0, -gravity], **rotation)


def head_on(closing: float, spin: float = 0.0, lead: float = 4.5) -> Scene:
    """A disk far off, and two equal ones that meet along x at `closing` m/s after `lead` steps; e =
    0.5."""
    gap = closing * DT * lead
    return scene_of(
        [[0.0, 9.0], [-0.5 - gap / 2, 0.0], [0.5 + gap / 2, 0.0]],
        [[0.0, 0.0], [closing / 2, 0.0], [-closing / 2, 0.0]],
        angular_velocity=[0.0, spin, spin],
    )


def plain() -> Scene:
    """Two disks that collide obliquely after 2 steps, fall, spin, and bounce off a floor."""
    return scene_of(
        [[-0.42, 0.1], [0.0, 0.4]],
        [[2.0, 0.0], [-1.0, 0.5]],
        radius=0.25,
        mass=[1.0, 3.0],
        angle=[0.1, -0.2],
        angular_velocity=[1.0, -2.0],
        gravity=[0.0, -9.8],
        walls=[[[-4.0, -0.2], [4.0, -0.2]]],
    )


def reported(engine: Engine) -> str:
    """The collisions an engine reports, as "disk 0 and disk 1, disk 0 and wall 2"; raises
    `Unsupported` for one that says it reports none."""
    must_report(engine)
    collisions = first_collisions(engine.collisions(), DT)
    names = [
        (f"disk {i}", f"disk {j}" if j >= 0 else f"wall {-1 - j}")
        for i, j in zip(collisions.i, collisions.j)
    ]
    return ", ".join(" and ".join(pair) for pair in names) or "none"


def must_report(engine: Engine) -> None:
    if is_silent(engine):
        raise Unsupported("it reports no collisions")


def is_silent(engine: Engine) -> bool:
    return bool(engine.settings().get("collisions", (None, None))[1] == SILENT)


def act_on(engine: Engine, disk: int, force: tuple[float, float], torque: float) -> bool:
    """Apply a force and a torque, or the force alone, or nothing, whichever the engine accepts
    first; returns whether the torque was applied."""
    for turning in (torque, 0.0):
        with suppress(Unsupported):
            engine.apply_force(disk, np.array(force), turning)
            return turning != 0.0
    return False


def history(engine: Engine, steps: int = 60) -> list[tuple[str, bytes]]:
    """The next `steps` steps of an engine, with a force in the first: (array and time, its bytes)
    for every array at every 10th step, then the collisions."""
    seen: list[tuple[str, bytes]] = []
    act_on(engine, 0, (3.0, 1.0), 0.5)
    for k in range(0, steps + 1, 10):
        if k:
            engine.step(10)
        seen += [
            (f"{name} after {k} steps", array.tobytes())
            for name, array in vars(engine.read()).items()
        ]
    return [
        *seen,
        ("collisions", repr([collision[:3] for collision in engine.collisions()]).encode()),
    ]


def first_difference(seen: list[tuple[str, bytes]], wanted: list[tuple[str, bytes]]) -> str:
    return next((what for (what, a), (_, b) in zip(seen, wanted) if a != b), "nowhere")


def largest(array: Array) -> float:
    return float(np.abs(array).max())
