"""Scenes for choosing settings, sampled from a seed. None is in the catalogue, on which the
settings are judged.

Sizes and speeds differ from scene to scene, so that no setting is tuned to one length or one speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import answer, at_rest, drop, flight, stacked
from crosscheck2d.scenarios.truth.exact import with_oracle

SAMPLE_INTERVAL = 1 / 60  # s
LADDER = (1, 2, 4)  # steps in it
# m; radii a second, so .03 to .3 radii in the coarsest step
RADII, SPEEDS = (0.1, 3.0), (2.0, 20.0)
ELASTIC, INELASTIC = 1.0, (0.3, 0.9)
# of the touching distance: at smaller gaps two disks practically touch
LEAST_GAP, MOST_GAP = 0.005, 0.05
# number of grazing or missing pairs in a scene; they are faster than others: up to a radius a step
PASSING, FASTER = 8, 3.0
LANE = 6.0  # touching distances between lanes
FAR = 100.0  # radii, half the length of a floor

Sampled = Callable[[np.random.Generator, float, float], Scenario]


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A random number with a uniform logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def posed(asks: str, duration: float, **disks: Any) -> Scenario:
    """The scenario with the oracle as its truth, cut to whole samples; `one_of` sets its name."""
    duration = max(round(duration / SAMPLE_INTERVAL), 4) * SAMPLE_INTERVAL
    source, scene = "sampled for crosscheck tune", lay_out(**disks)
    return with_oracle(Scenario("unnamed", asks, source, scene, duration, substeps=LADDER))


def sample_restitution(rng: np.random.Generator) -> float:
    return ELASTIC if rng.random() < 0.5 else float(rng.uniform(*INELASTIC))


def flight_alone(rng: np.random.Generator, r: float, v: float) -> Scenario:
    return posed(
        "How far from its parabola is a thrown disk?",
        1.0,
        position=[[0.0, 0.0]],
        velocity=[v * r * rng.normal(size=2)],
        radius=r,
        gravity=[0, -v * r],
    )


def pairs(
    asks: str, rng: np.random.Generator, radius: Array, speed: float, offset: Array, duration: float
) -> Scenario:
    """Pairs of disks with these two radii in adjacent lanes; pair k passes at offset[k] touching
    distances.

    They close at `speed` m/s and collide or pass after .3 to .4 s, each pair at another phase of
    the step.
    """
    turn, n, touch = rng.uniform(0, 2 * np.pi), len(offset), radius.sum()
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    ahead = touch * np.sqrt(np.maximum(1 - offset**2, 0)) + rng.uniform(0.3, 0.4, n) * speed
    apart = np.outer(ahead, along) + np.outer(touch * offset, across)
    lane = np.outer(LANE * touch * (np.arange(n) - n // 2), across)
    drift = np.outer(0.1 * speed * rng.normal(size=n), along)
    return posed(
        asks,
        duration,
        position=np.stack([lane - apart / 2, lane + apart / 2], axis=1).reshape(-1, 2),
        velocity=np.stack([drift + speed / 2 * along, drift - speed / 2 * along], axis=1).reshape(
            -1, 2
        ),
        radius=np.tile(radius, n),
        mass=10 ** rng.uniform(-1, 1, 2 * n),
        restitution=sample_restitution(rng),
    )


def oblique(rng: np.random.Generator, r: float, v: float) -> Scenario:
    offset = rng.uniform(0.2, 0.9, 1)
    asks = "How far off are two disks after an oblique collision?"
    return pairs(asks, rng, unlike(rng, r), v * r, offset, 1.0)


def passing(asks: str, rng: np.random.Generator, r: float, v: float, side: float) -> Scenario:
    """Pairs that miss (side 1) or collide (-1) by `LEAST_GAP` to `MOST_GAP` touching distances."""
    gap = np.array([log_uniform(rng, LEAST_GAP, MOST_GAP) for _ in range(PASSING)])
    return pairs(asks, rng, np.full(2, r), FASTER * v * r, 1 + side * gap, 0.5)


def unlike(rng: np.random.Generator, r: float) -> Array:
    """(2,) m: two radii of about r."""
    return r * rng.uniform(0.7, 1.5, 2)


def onto_wall(rng: np.random.Generator, r: float, v: float) -> Scenario:
    x = -rng.uniform(0.35, 0.4) * v * r - r
    return posed(
        "How far off is a disk after a wall?",
        1.0,
        position=[[x, 0.0]],
        velocity=[[v * r, v * r * rng.normal()]],
        radius=r,
        walls=[[[0, -FAR * r], [0, FAR * r]]],
        restitution=sample_restitution(rng),
    )


def thin_wall(rng: np.random.Generator, r: float, _v: float) -> Scenario:
    """Disks that move one to three radii in the coarsest step onto a wall, judged by verdicts only:
    one that tunnels is so far off that it would outweigh all other errors."""
    speed = rng.uniform(1, 3, PASSING) * r / SAMPLE_INTERVAL
    asked = posed(
        "Does a fast disk pass through a thin wall?",
        0.5,
        position=np.column_stack(
            [-r - rng.uniform(0.2, 0.3, PASSING) * speed, LANE * r * np.arange(PASSING)]
        ),
        velocity=np.column_stack([speed, 0 * speed]),
        radius=r,
        walls=[[[0, -FAR * r], [0, FAR * r]]],
        restitution=sample_restitution(rng),
    )
    return replace(asked, truth=None, without_truth="asked is only whether it passes")


def onto_static(rng: np.random.Generator, r: float, v: float) -> Scenario:
    y = rng.uniform(0, 2)
    x = -(rng.uniform(0.35, 0.4) * v + np.sqrt(9 - y * y))
    return posed(
        "How far off is a disk after a static one?",
        1.0,
        position=[[x * r, y * r], [0, 0]],
        velocity=[[v * r, 0], [0, 0]],
        radius=[r, 2 * r],
        mass=[1.0, np.inf],
        restitution=sample_restitution(rng),
    )


def wall_to_wall(rng: np.random.Generator, r: float, v: float) -> Scenario:
    reach = r + 0.2 * v * r
    return posed(
        "How far off is a disk between two walls?",
        2.0,
        position=[[rng.uniform(-0.1, 0.1) * v * r, 0]],
        velocity=[[v * r, 0]],
        radius=r,
        walls=[[[-reach, -2 * r], [-reach, 2 * r]], [[reach, -2 * r], [reach, 2 * r]]],
        restitution=sample_restitution(rng),
    )


def dropped(
    rng: np.random.Generator, r: float, v: float, restitution: float, falls: float
) -> Scenario:
    """A ball that reaches its floor at the speed v; the duration is `falls` falls of .3 to .5 s."""
    t = rng.uniform(0.3, 0.5)
    return posed(
        "How far off is a ball that bounces?",
        falls * t,
        position=[[0, r + v * r * t / 2]],
        radius=r,
        gravity=[0, -v * r / t],
        walls=[[[-FAR * r, 0], [FAR * r, 0]]],
        restitution=restitution,
    )


def long_bounce(rng: np.random.Generator, r: float, v: float) -> Scenario:
    """The same for forty bounces, judged by conservation of energy only."""
    ball = dropped(rng, r, v, ELASTIC, 80.0)
    asks = "Does a ball keep its energy over many bounces?"
    return replace(
        ball,
        asks=asks,
        truth=None,
        without_truth="after so many bounces the detection delay is all there is",
    )


def coming_to_rest(rng: np.random.Generator, r: float, v: float) -> Scenario:
    restitution = rng.uniform(0.4, 0.8)
    asked = dropped(rng, r, v, restitution, 2 + 2 * (1 + restitution) / (1 - restitution))
    return replace(asked, truth=partial(drop, asked.scene, float(asked.scene.position[0, 1]) - r))


def row(rng: np.random.Generator, r: float, v: float) -> Scenario:
    x = np.cumsum(
        np.append(0.0, 2 * r + r * np.append(rng.uniform(0.25, 0.3) * v, rng.uniform(0.02, 0.3, 3)))
    )
    return posed(
        "How far off is a row of disks after a collision went through it?",
        1.0,
        position=np.stack([x, 0 * x], axis=-1),
        velocity=[[v * r, 0], *[[0, 0]] * 4],
        radius=r,
        restitution=sample_restitution(rng),
    )


def light_between(rng: np.random.Generator, r: float, v: float) -> Scenario:
    return posed(
        "How far off are a light and a heavy disk after some collisions?",
        2.0,
        position=[[rng.uniform(1.5, 3) * r, 0], [rng.uniform(5, 6) * r + 0.2 * v * r, 0]],
        velocity=[[0, 0], [-v * r / 2, 0]],
        radius=r,
        mass=[1.0, log_uniform(rng, 3, 30)],
        walls=[[[0, -2 * r], [0, 2 * r]]],
    )


def small_gas(rng: np.random.Generator, r: float, v: float) -> Scenario:
    """Nine disks that cover a sixth to a half of a box, for some collisions each."""
    n, pitch = 9, float(np.sqrt(np.pi / rng.uniform(0.15, 0.5))) * r
    places = pitch * (np.stack(np.meshgrid(np.arange(3), np.arange(3)), axis=-1).reshape(-1, 2) - 1)
    room, half = pitch / 2 - r, 1.5 * pitch
    return posed(
        "How far off is a small gas before chaos has its way?",
        6.0 / v,
        position=places + rng.uniform(-0.9 * room, 0.9 * room, (n, 2)),
        velocity=v * r * rng.normal(size=(n, 2)),
        radius=r,
        walls=box([-half] * 2, [half] * 2),
        restitution=sample_restitution(rng),
    )


def long_gas(rng: np.random.Generator, r: float, v: float) -> Scenario:
    """The same at e = 1 for some ten times as long, judged by conservation of energy only."""
    gas = small_gas(rng, r, v)
    scene = replace(gas.scene, restitution=ELASTIC)
    why = "after so many collisions chaos has its way"
    longer = replace(gas, scene=scene, duration=10 * gas.duration, truth=None, without_truth=why)
    return replace(longer, asks="Does a small gas keep its energy?")


def column(rng: np.random.Generator, r: float, v: float) -> Scenario:
    """Three to eight disks that rest on each other; gravity is v / .4 s."""
    n = int(rng.integers(3, 9))
    r = 2.0 ** round(np.log2(r))  # so that they touch exactly
    y = r + 2 * r * np.arange(n)
    asked = posed(
        "Does a column of disks stay as it is?",
        2.0,
        position=np.stack([0 * y, y], axis=-1),
        radius=r,
        gravity=[0, -v * r / 0.4],
        walls=[[[-FAR * r, 0], [FAR * r, 0]]],
        restitution=0.0,
    )
    return replace(asked, truth=partial(at_rest, asked.scene, collisions=stacked(asked.scene)))


def sliding(_rng: np.random.Generator, r: float, v: float) -> Scenario:
    r, g = 2.0 ** round(np.log2(r)) * 0.625, v * r
    down = np.array([4.0, -3.0]) / 5
    asked = posed(
        "Does a disk slide down a smooth incline as it should?",
        1.0,
        position=[np.array([0.6, 0.8]) * r],
        radius=r,
        gravity=[0, -g],
        walls=[np.array([-8 * r * down, FAR * r * down])],
        restitution=0.0,
    )

    def truth(t: Array) -> Trajectory:
        scene = asked.scene
        motion = flight(t[:, None, None], scene.position, scene.velocity, 0.6 * g * down)
        return answer(scene, t, motion, stacked(scene))

    return replace(asked, truth=truth)


FAMILIES: dict[str, Sampled] = {
    "flight_alone": flight_alone,
    "head_on": lambda rng, r, v: pairs(
        "How far off are two disks after they collided head-on?",
        rng,
        unlike(rng, r),
        v * r,
        np.zeros(1),
        1.0,
    ),
    "oblique": oblique,
    # pairs that just collide, by as much as those of `near_miss` miss
    "grazing": lambda rng, r, v: passing("Is a grazing collision seen?", rng, r, v, -1.0),
    "near_miss": lambda rng, r, v: passing(
        "Is there a spurious collision of two disks that miss?", rng, r, v, 1.0
    ),
    "onto_wall": onto_wall,
    "thin_wall": thin_wall,
    "onto_static": onto_static,
    "wall_to_wall": wall_to_wall,
    "bouncing_elastic": lambda rng, r, v: dropped(rng, r, v, ELASTIC, 8.0),
    # a ball that loses height, until before it rests
    "bouncing_lossy": lambda rng, r, v: dropped(rng, r, v, rng.uniform(0.6, 0.9), 4.0),
    "long_bounce": long_bounce,
    "coming_to_rest": coming_to_rest,
    "landing": lambda rng, r, v: dropped(rng, r, v, 0.0, 3.0),
    "row": row,
    "light_between": light_between,
    "small_gas": small_gas,
    "long_gas": long_gas,
    "column": column,
    "sliding": sliding,
}


def one_of(family: str, seed: int) -> Scenario:
    rng = np.random.default_rng([seed, *family.encode()])
    made = FAMILIES[family](rng, log_uniform(rng, *RADII), log_uniform(rng, *SPEEDS))
    return replace(made, name=f"{family}-{seed}", seed=seed)
