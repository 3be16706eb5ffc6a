"""One flight of the exercise's game: what the keys do, and the same thrusts through several
engines, frame by frame; no server in here."""

from __future__ import annotations

import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from math import cos, inf, sin
from typing import Any

import numpy as np

from crosscheck2d.adapters.advance import advance
from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.host.engine import GuestEngine
from crosscheck2d.adapters.run import fault_of, reach, weight_impulse
from crosscheck2d.reports.compare.laws import nearer_way
from crosscheck2d.reports.game.divergence import (
    NEVER,
    WAIT,
    Divergence,
    FlightEvent,
    Touches,
    cause_of,
    differing_since,
)
from crosscheck2d.scenarios.families.exercise import HIGH, LOW, SOURCE, asteroid_field
from crosscheck2d.scenarios.model import Array, Scenario, Scene, State, Thrust
from crosscheck2d.scenarios.no_truth import NoTruth

# s; a power of two, so that every instant of a saved flight is a whole number of steps without
# rounding
FRAME = 1 / 64
SUBSTEPS = (2, 4, 8, 16, 32)  # steps in a frame; 16 is the nearest to the exercise's 0.001 s
LONGEST = 600.0  # s, of a flight
EARTH, EARTH_SIZE = (3.5, 1.5), 0.5
# squared speed and angular velocity below which the exercise says "You won"
SLOW, SLOW_SPIN = 0.1, 0.1
# m: distance of the places to which a ship may be set back, and the room that it must have there
GRID, CLEARANCE = 0.125, 0.01
SHIP = 0  # the disk that is steered
THRUST, TURN = 0.25, 1.0  # m/s2 and rad/s2, of the exercise: force mass 0.25, torque MoI 1.0
FORWARD = {"w": 1.0, "s": -1.0}
LEFT = {"a": 1.0, "d": -1.0}
KEYS = (*FORWARD, *LEFT)


def field_scenario(
    seed: int = 0, asteroids: int = 20, restitution: float = 0.9, substeps: int = 16
) -> Scenario:
    """A field before the first flight, as a scenario of the longest flight, its step in the middle
    of the ladder."""
    return Scenario(
        name=f"flight-{seed}",
        asks=f"Do the engines carry a ship through {asteroids} asteroids as its pilot flew it?",
        source=f"{SOURCE}: a flight of `crosscheck play`, seed {seed}",
        scene=asteroid_field(seed, asteroids, restitution),
        duration=LONGEST,
        sample_interval=FRAME,
        substeps=(substeps // 2, substeps, 2 * substeps),
        seed=seed,
    )


@dataclass
class Pilot:
    """Keys in, one force and one torque at a time out, kept as thrusts. `interval`: s, of a frame;
    keys act at the start of one.

    W and S accelerate along the ship's heading as it is when the key event comes (a repeated event
    aims anew), A and D turn; releasing either key of a pair ends its thrust, as in the exercise.

    Attributes:
        held: the force and the torque that are on, without an end.
        past: those that have ended.
    """

    scene: Scene
    interval: float
    held: dict[str, Thrust] = field(default_factory=dict)
    past: list[Thrust] = field(default_factory=list)

    def key(self, key: str, down: bool, frame: int, angle: float) -> None:
        kind, now, force, torque = "torque", frame * self.interval, np.zeros(2), 0.0
        if key in FORWARD:
            kind, size = "force", down * FORWARD[key] * THRUST * float(self.scene.mass[SHIP])
            force = size * np.array([cos(angle), sin(angle)])
        else:
            torque = down * LEFT[key] * TURN * float(self.scene.inertia[SHIP])
        before = self.held.get(kind)
        if before and np.array_equal(before.force, force) and before.torque == torque:
            return  # a repeated key that aims as before
        if before and before.start < now:
            self.past.append(replace(before, stop=now))
        self.held.pop(kind, None)
        if force.any() or torque:
            self.held[kind] = Thrust(SHIP, now, inf, force, torque)

    def thrusts(self, frames: int) -> list[Thrust]:
        """All thrusts of the first `frames` frames, in order of time; they end there at the
        latest."""
        end = frames * self.interval
        begun = [thrust for thrust in (*self.past, *self.held.values()) if thrust.start < end]
        cut = [replace(thrust, stop=min(thrust.stop, end)) for thrust in begun]
        return sorted(cut, key=lambda thrust: thrust.start)


@dataclass
class Flyer:
    """The ship and the field as one engine has them.

    Attributes:
        name: `engine:profile`.
        state: at the end of the last frame.
        touches: the latest collisions, and how many there were.
        differs: (n,) frame since which each disk has had another velocity than in the solid one.
        left: why it flies no more, or "".
        left_at: s on the flight's clock, the end of the frame in which it left.
        edges: where and when its ship left the field and was set back, each time.
        beside: whether the start was taken when its ship was set back last.
        seen: how many of its collisions since then are in `touches`.
        divergence: where it diverged from the solid one.
    """

    name: str
    engine: Engine
    state: State
    touches: Touches
    differs: Array
    left: str = ""
    left_at: float = 0.0
    edges: list[FlightEvent] = field(default_factory=list)
    beside: bool = False
    seen: int = 0
    divergence: Divergence | None = None

    def leave(self, reason: Exception | str, at: float) -> None:
        if isinstance(reason, Exception):
            reason = on_the_clock(reason, self.touches.since)
        self.left, self.left_at = reason, at


def free_place(scene: Scene, position: Array) -> Array:
    """(2,) m, the place nearest to the ship's start where it is `CLEARANCE` away from every other
    disk; the start, if there is none."""
    start, radius = scene.position[SHIP], scene.radius[SHIP]
    low, high = np.array([LOW, HIGH]) + radius * np.array([[1], [-1]])
    grid = np.stack(np.meshgrid(*(np.arange(*ends, GRID) for ends in zip(low, high))), -1)
    places = np.concatenate([[start], grid.reshape(-1, 2)])
    places = places[np.argsort(np.hypot(*(places - start).T), kind="stable")]
    others = np.delete(position, SHIP, axis=0), np.delete(scene.radius, SHIP)
    gaps = np.hypot(*(places[:, None] - others[0]).T).T - others[1] - radius
    free: Array = places[np.append((gaps >= CLEARANCE).all(axis=1).nonzero()[0], 0)[0]]
    return free


SECONDS = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?(?:e[+-]?\d+)?) s\b")


def on_the_clock(error: Exception, since: float) -> str:
    """What an engine says when it fails. An event engine says when: its clock runs from `since` s
    of the flight on, and its times are given as the flight's."""
    text = str(error) or type(error).__name__
    if not isinstance(error.__cause__, NoTruth):
        return text
    return SECONDS.sub(lambda time: f"{since + float(time[1]):.4g} s", text)


class Flight:
    """A scenario flown by the engines `names`, of which the first is the solid one; keys steer
    unless it is a replay.

    The ship that leaves the exercise's field is set back to its start, at rest, at the end of that
    step, as in the exercise, and in each engine by itself: the engine is loaded anew with all else
    as it is. Where the start is taken, the ship goes to the nearest free place, because an event
    engine cannot begin with an overlap. In any other scene with a wrap disk 0 wraps like the rest,
    as it does in `play`.
    """

    def __init__(self, scenario: Scenario, names: Sequence[str], replayed: bool = False) -> None:
        self.scenario, self.replayed = scenario, replayed
        self.substeps = scenario.middle_substeps
        self.dt = scenario.dt(self.substeps)
        scene = scenario.scene
        self.is_game = scene.wrap is not None and np.array_equal(scene.wrap, [LOW, HIGH])
        self.farthest = reach(scenario)
        self.pilot = Pilot(scene, scenario.sample_interval)
        self.steered = scenario  # with the thrusts of the keys that are down
        self.frame, self.left_at = 0, -1
        self.threads = ThreadPoolExecutor(len(names))
        self.flyers: list[Flyer] = []
        for name in names:
            touches = Touches(scene, self.dt, weight_impulse(scene, self.dt))
            agreed = np.full(scene.n, NEVER)
            flyer = Flyer(name, None, scene.state, touches, agreed)  # type: ignore[arg-type]
            self.flyers.append(flyer)
            try:
                flyer.engine = ENGINES[name].make()
                flyer.engine.load(scene, self.dt)
                flyer.state = flyer.engine.read()
            except Exception as error:  # a missing library, a refusal, or whatever an engine raises
                flyer.leave(error, 0.0)

    @property
    def solid(self) -> Flyer:
        """The first that still flies; the first of all if none does."""
        return next((flyer for flyer in self.flyers if not flyer.left), self.flyers[0])

    @property
    def solid_since(self) -> float:
        """s on the flight's clock when the solid one took over from the last that left; 0.0: it has
        been solid from the start."""
        left = [flyer.left_at for flyer in self.flyers[: self.flyers.index(self.solid)]]
        return max(left, default=0.0)

    @property
    def over(self) -> bool:
        return self.frame >= self.scenario.intervals or all(flyer.left for flyer in self.flyers)

    @property
    def won(self) -> bool:
        """The exercise's rule as written: a squared distance below a size, no absolute value of the
        spin."""
        ship = self.solid.state
        way, speed = ship.position[SHIP] - np.array(EARTH), ship.velocity[SHIP]
        near = float(way @ way) < EARTH_SIZE and float(speed @ speed) < SLOW
        return self.is_game and near and float(ship.angular_velocity[SHIP]) < SLOW_SPIN

    def key(self, key: str, down: bool) -> None:
        if not self.replayed:
            self.pilot.key(key, down, self.frame, float(self.solid.state.angle[SHIP]))
            self.steered = replace(self.scenario, thrusts=list(self.pilot.held.values()))

    def advance(self, count: int = 1) -> None:
        """Fly so many frames, or what is left of them. Engines in processes of their own fly side
        by side, and beside the others."""
        for _ in range(count):
            if self.over:
                return
            flyers = [flyer for flyer in self.flyers if not flyer.left]
            guests = [flyer for flyer in flyers if isinstance(flyer.engine, GuestEngine)]
            waiting = [self.threads.submit(self.fly, flyer) for flyer in guests]
            for flyer in flyers:
                if not isinstance(flyer.engine, GuestEngine):
                    self.fly(flyer)
            for future in waiting:
                future.result()
            solid = self.solid
            if self.left_at < 0 and solid.edges and solid.edges[-1].frame == self.frame:
                self.left_at = self.frame
            self.frame += 1
            for ghost in self.flyers:
                if not (ghost is solid or ghost.left or ghost.divergence):
                    ghost.divergence = self.divergence_of(ghost)

    def fly(self, flyer: Flyer) -> None:
        """One frame of one engine, by the same steps as `play` makes them, looked at once or, near
        an edge, at each."""
        stride = 1 if self.may_leave(flyer.state) else self.substeps
        first = self.frame * self.substeps
        for step in range(first, first + self.substeps, stride):
            if not flyer.left:
                self.fly_on(flyer, step, stride)

    def may_leave(self, state: State) -> bool:
        """Whether the ship is so near an edge that a frame may carry it beyond: by its own
        velocity, or by that of whatever strikes it.

        One that is displaced further, as out of a deep overlap, is set back at the end of the frame
        instead of the step.
        """
        fastest = np.abs(state.velocity).max(axis=0)
        room = 2 * (np.abs(state.velocity[SHIP]) + fastest) * self.scenario.sample_interval
        ship, low, high = state.position[SHIP], np.add(LOW, room), np.subtract(HIGH, room)
        return self.is_game and bool(((ship < low) | (ship > high)).any())

    def fly_on(self, flyer: Flyer, step: int, count: int) -> None:
        """`count` steps of one engine from step number `step` on; what it raises or does wrong
        makes it leave."""
        before, ends = flyer.state, (self.frame + 1) * self.scenario.sample_interval
        try:
            advance(flyer.engine, self.steered, step, count, self.dt)
            flyer.state = flyer.engine.read()
            collisions = flyer.engine.collisions()
        except Exception as error:  # a refusal, or whatever an engine raises
            flyer.leave(error, ends)
            return
        if fault := fault_of(flyer.state, self.farthest):
            flyer.state = before
            flyer.leave(fault, ends)
            return
        if len(collisions) > flyer.seen:
            flyer.touches.note(collisions[flyer.seen :], self.frame, before, step * self.dt)
            flyer.seen = len(collisions)
        jump = np.abs(flyer.state.position[SHIP] - before.position[SHIP])
        if self.is_game and (jump > np.subtract(HIGH, LOW) / 2).any():  # onto the opposite edge
            self.set_back(flyer, before, (step + count) * self.dt)

    def set_back(self, flyer: Flyer, before: State, now: float) -> None:
        scene = self.scenario.scene
        arrays: dict[str, Any] = {
            name: np.array(array) for name, array in vars(flyer.state).items()
        }
        for name, array in arrays.items():
            array[SHIP] = getattr(scene, name)[SHIP]
        arrays["position"][SHIP] = free_place(scene, arrays["position"])
        flyer.beside = bool((arrays["position"][SHIP] != scene.position[SHIP]).any())
        flyer.edges.append(FlightEvent(self.frame, *before.position[SHIP].tolist()))
        flyer.touches.begin_again(SHIP, now)
        flyer.seen = 0
        try:
            flyer.engine.load(replace(scene, **arrays), self.dt)
            flyer.state = flyer.engine.read()
        except Exception as error:  # a refusal, or whatever an engine raises
            flyer.leave(f"the ship cannot be set back: {on_the_clock(error, now)}", now)

    def divergence_of(self, ghost: Flyer) -> Divergence | None:
        """Where a ghost has diverged from the solid one by the end of the last frame.

        Ships are set back one by one, so that a ship is not compared while it was set back in one
        of the two only; one that stays the only one has diverged at the edge.
        """
        solid, frame = self.solid, self.frame - 1
        velocity, other = solid.state.velocity.copy(), ghost.state.velocity
        back = len(solid.edges), len(ghost.edges)
        if back[0] != back[1]:
            velocity[SHIP] = other[SHIP]
        ghost.differs = differing_since(ghost.differs, velocity, other, frame)
        if cause := cause_of(ghost.differs, solid.touches, ghost.touches, ghost.state, frame):
            at, in_solid, in_ghost = cause
            only = "" if in_solid and in_ghost else solid.name if in_solid else ghost.name
            return Divergence(at, solid.name, only)
        more = solid if back[0] > back[1] else ghost
        if back[0] != back[1] and frame - more.edges[min(back)].frame + 1 >= WAIT:
            return Divergence(more.edges[min(back)], solid.name, more.name)
        return None

    def measures(self, flyer: Flyer) -> dict[str, Any]:
        """Momentum kg m/s, energy with spin J, how far ship and farthest disk are from the solid
        one's m, collisions."""
        scene, state = self.scenario.scene, flyer.state
        gap = nearer_way(self.solid.state.position - state.position, scene)
        deviation = np.hypot(*gap.T)
        moving = ~scene.static
        mass, inertia = scene.mass[moving], scene.inertia[moving]
        speed2 = (state.velocity[moving] ** 2).sum(axis=1)
        return {
            "momentum": (mass @ state.velocity[moving]).tolist(),
            "energy": float(mass @ speed2 + inertia @ state.angular_velocity[moving] ** 2) / 2,
            "ship_deviation": float(deviation[SHIP]),
            "deviation": float(deviation.max()),
            "collisions": flyer.touches.count,
        }

    def saved(self) -> Scenario:
        """The flight so far as a scenario, up to the frame before the ship first left: a scene has
        no way back.

        Raises:
            ValueError: if there is no frame to save.
        """
        if self.replayed:
            return self.scenario
        frames = self.frame if self.left_at < 0 else self.left_at
        if not frames:
            raise ValueError("nothing has been flown yet: fly first")
        duration = frames * self.scenario.sample_interval
        return replace(self.scenario, duration=duration, thrusts=self.pilot.thrusts(frames))

    def close(self) -> None:
        self.threads.shutdown(wait=False)
        for flyer in self.flyers:
            if flyer.engine is not None:
                flyer.engine.close()
