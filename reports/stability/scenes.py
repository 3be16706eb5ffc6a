"""What the scenes of the cases are made of: disks that are alike, steps, and where in a step a
collision falls."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, flight, pair

RADIUS, G, DT = 0.25, 10.0, 1 / 64
LEAD, AFTER = 3, 6  # whole steps before the step of the collision, and after it
EDGE = 1e-3  # of a step: how near to a step's very beginning, or end, a phase comes
MOST = 1024  # runs, more than any case has
SEEDS = 16  # runs at a value of what is sampled


def disks(
    position: Any,
    velocity: Any = 0.0,
    *,
    radius: ArrayLike = RADIUS,
    mass: ArrayLike = 1.0,
    e: float = 1.0,
    **more: Any,
) -> Scene:
    """The scene of disks at these places (n, 2); one number stands for all of them."""
    n = len(np.asarray(position))
    return lay_out(
        position=position,
        velocity=np.broadcast_to(velocity, (n, 2)),
        radius=np.broadcast_to(radius, n),
        mass=np.broadcast_to(mass, n),
        restitution=e,
        **more,
    )


def scenario_of(
    scene: Scene,
    duration: float,
    interval: float,
    every: int = 1,
    truth: Callable[[Array], Trajectory] | None = None,
    **more: Any,
) -> Scenario:
    """A scene of a case in its only step size: `every` steps in a sample interval."""
    asks, source = "Does it work?", "reports/stability"  # a case has its own question
    return Scenario("case", asks, source, scene, duration, interval, (every,), truth=truth, **more)


def stepped(scene: Scene, dt: float, truth: Callable[[Array], Trajectory]) -> Scenario:
    """A scenario of a few steps, sampled at each of them, with its collision after `LEAD`."""
    return scenario_of(scene, (LEAD + 1 + AFTER) * dt, dt, truth=truth)


def flyby(
    speed: float,
    run: int,
    *,
    offset: float = 0.0,
    e: float = 1.0,
    mass: float = 1.0,
    radius: float = RADIUS,
    dt: float = DT,
) -> Scenario:
    """Disk 0 flies towards disk 1, which rests at the origin, and reaches it after `LEAD` steps;
    `offset` is in units of the sum of the radii."""
    reach = radius + RADIUS
    touch = -reach * np.sqrt(max(0.0, 1 - offset**2))
    start = touch - speed * dt * (LEAD + phase(run))
    scene = disks(
        [[start, offset * reach], [0, 0]],
        [[speed, 0], [0, 0]],
        radius=[RADIUS, radius],
        mass=[1.0, mass],
        e=e,
    )
    return stepped(scene, dt, partial(pair_answer, scene))


def pair_answer(scene: Scene, t: Array) -> Trajectory:
    """The exact answer of two disks that meet once at most, at the times t (k,) s: momentum, and
    Newton's restitution along the line of centres (Landau & Lifshitz, Mechanics, 17)."""
    position, velocity, radius, mass = scene.position, scene.velocity, scene.radius, scene.mass
    legs, impulse = pair(position, velocity, radius, mass, scene.restitution)
    collisions = [(float(at), 0, 1, float(kick)) for at, kick in zip(legs.start[1:], impulse)]
    return answer(scene, t, legs.at(t), collisions)


def free_answer(scene: Scene, t: Array) -> Trajectory:
    """The exact answer of a disk that meets nothing, at the times t (k,) s."""
    return answer(scene, t, flight(t[:, None, None], scene.position, scene.velocity))


@cache
def sampled(seed: int) -> tuple[float, ...]:
    """`MOST` numbers from 0 to 1, the same for a seed on every machine."""
    return tuple(float(x) for x in np.random.default_rng(seed).random(MOST))


def phase(run: int) -> float:
    """Where within its step the collision of a run happens: 0 is the beginning of the step, 1
    its end.

    Run 0 has it at the very beginning, where it is found latest. Of the other runs every second
    follows an even sequence (van der Corput: 1/2, 1/4, 3/4, 1/8 ...) and the rest are random,
    because an error that repeats with the step could escape the even ones. So the first few runs
    are a good sample.
    """
    if run == 0:
        return EDGE
    where = radical_inverse((run + 1) // 2) if run % 2 else sampled(seed=0)[run // 2]
    return EDGE + (1 - 2 * EDGE) * where


def radical_inverse(k: int) -> float:
    """The binary digits of k mirrored at the point: 1 -> 1/2, 2 -> 1/4, 3 -> 3/4 (van der Corput,
    1935)."""
    value, share = 0.0, 0.5
    while k:
        value, k, share = value + share * (k & 1), k >> 1, share / 2
    return value
