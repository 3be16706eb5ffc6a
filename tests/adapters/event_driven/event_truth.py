"""The float64 event engine beside the oracle: its answer up to where its own rounding would begin
to show."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory, frozen
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.closed_forms import Motion, answer, world_thrusts

ERROR_BOUND = 1e-9  # m
# a perturbed run may stray so many times less than the bound, since the run itself is as far off
SAFETY = 10.0
PERTURBATIONS = 3
EPS = float(np.finfo(float).eps)


class EventTruth:
    """Times (k,) s -> the `Trajectory` of a scenario by the event engine, cut at `horizon` s.

    It is valid up to the last sample at which all runs from starts a unit in the last place away
    agree with it, and to where the motion has no single continuation; `reason` says which, or is ""
    if it holds for the duration.

    Raises:
        NoTruth: the scene has no answer at all, or thrusts that turn with their disk.
    """

    def __init__(self, scenario: Scenario) -> None:
        if any(thrust.frame == "body" and thrust.force.any() for thrust in scenario.thrusts):
            raise NoTruth("a thrust that turns with its disk makes no parabolas")
        self.scenario = scenario
        EventEngine(scenario.scene).advance(0.0)  # refuses a start that is none

    def __call__(self, t: Array) -> Trajectory:
        """The answer at the times t (k,) s, increasing."""
        scene, thrusts = self.scenario.scene, self.scenario.thrusts
        within = np.asarray(t)[np.asarray(t) <= self.horizon]
        motion, collisions, turning, _, _ = self.play(scene, within)
        reached = np.asarray(t)[: len(motion[0])]
        rows = [(float(at), int(i), int(j), float(impulse)) for at, i, j, impulse in collisions]
        if not scene.friction:
            turned = world_thrusts(scene, thrusts, reached)
            turning = (turned.angle, turned.angular_velocity)
        return answer(scene, reached, motion, rows, turning, self.horizon, ERROR_BOUND)

    @property
    def horizon(self) -> float:
        """s, the horizon."""
        return self.ended[0]

    @property
    def reason(self) -> str:
        """Why the answer ends there, or ""."""
        return self.ended[1]

    @cached_property
    def ended(self) -> tuple[float, str]:
        """Until when the runs from nearby starts agree, s, and why no longer."""
        scene, times = self.scenario.scene, self.scenario.times
        (position, _), _, _, end, reason = self.play(scene, times)
        agree = len(position)
        for seed in range(PERTURBATIONS):
            try:
                (other, _), _, _, _, _ = self.play(perturbed(scene, seed), times[:agree])
            except (
                NoTruth
            ):  # disks that touch may overlap when they are moved by a unit in the last place
                return 0.0, "the start itself is decided by rounding: disks or walls touch"
            agree = min(agree, len(other))
            diverged = (
                np.abs(other[:agree] - position[:agree]).max(axis=(1, 2)) > ERROR_BOUND / SAFETY
            )
            agree = int(diverged.argmax()) if diverged.any() else agree
        if agree == len(times):
            return float(times[-1]), ""
        if agree == len(position):
            return float(min(end, times[agree])), reason
        return (
            float(times[agree - 1]),
            "float64 cannot decide: a start one unit in the last place away leads elsewhere",
        )

    def play(self, scene: Scene, t: Array) -> tuple[Motion, Array, Motion, float, str]:
        """Position and velocity (k, n, 2) at as many of the times as are reached, collisions (h,
        4); angles and spins (k, n) as friction has them; when and why it ends."""
        engine = EventEngine(scene)
        edges = {edge for thrust in self.scenario.thrusts for edge in (thrust.start, thrust.stop)}
        seen: list[tuple[Array, Array]] = []
        turned: list[tuple[Array, Array]] = []
        end, reason = np.inf, ""
        try:
            for at in sorted(
                {*t.tolist(), *(edge for edge in edges if edge <= t[-1])} if len(t) else ()
            ):
                engine.advance(at)
                if at in edges:
                    self.set_accelerations(engine, scene, at)
                seen += [engine.motion_at(at)] * int((t == at).sum())
                turned += [engine.rotation_at(at)] * int((t == at).sum())
        except NoTruth as refusal:
            end, reason = refusal.at, str(refusal)
        shape = (len(seen), scene.n, 2)
        position, velocity = (
            np.array([look[part] for look in seen]).reshape(shape) for part in range(2)
        )
        turning = tuple(np.array([each[k] for each in turned]).reshape(shape[:2]) for k in (0, 1))
        return (position, velocity), engine.collisions, (turning[0], turning[1]), end, reason

    def set_accelerations(self, engine: EventEngine, scene: Scene, at: float) -> None:
        """Give every disk under a thrust the acceleration it has from `at` s on."""
        for disk in sorted({thrust.disk for thrust in self.scenario.thrusts}):
            on = [
                p.force for p in self.scenario.thrusts if p.disk == disk and p.start <= at < p.stop
            ]
            if not scene.static[disk]:
                engine.accelerate(disk, at, scene.gravity + sum(on, np.zeros(2)) / scene.mass[disk])


def float64_truth(scenario: Scenario) -> EventTruth:
    """The scenario's answer by float64 events; raises `NoTruth` if its start or its thrusts allow
    none."""
    return EventTruth(scenario)


def perturbed(scene: Scene, seed: int) -> Scene:
    """The scene with every moving disk off by a unit in the last place of the largest coordinate
    and speed.

    Where all centres lie on one line along an axis and nothing moves across it, nothing is rounded
    across it either.
    """
    draw = np.random.default_rng(seed)
    position, velocity = scene.position, scene.velocity
    lined = (position == position[0]).all(axis=0) & ~velocity.any(axis=0) & (scene.gravity == 0)
    moves = ~scene.static[:, None] & ~lined
    x = position + moves * EPS * np.abs(position).max() * draw.choice([-1.0, 1.0], position.shape)
    v = velocity + moves * EPS * np.abs(velocity).max() * draw.choice([-1.0, 1.0], velocity.shape)
    if scene.wrap is not None:
        x = np.clip(x, *scene.wrap)
    return replace(scene, position=frozen(x), velocity=frozen(v))
