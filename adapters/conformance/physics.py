"""The probes of the physics: an engine that fails one of them follows the protocol, but its physics
differs from the scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial, wraps

import numpy as np

from crosscheck2d.adapters.conformance.probe import (
    DT,
    Departure,
    Probe,
    ProbeReading,
    collided,
    head_on,
    largest,
    loaded,
    one_disk,
    scene_of,
    without_spin_and_gravity,
)
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.friction import Frictionless
from crosscheck2d.scenarios.model import Scene

SPEEDS = (0.01, 0.1, 0.5, 2.0, 10.0, 100.0)  # m/s, on both sides of Box2D's threshold of 1
FRICTION = 0.2  # that the scenes of the probes of friction state
# alpha of explicit Euler, of exact flight or velocity Verlet, of symplectic Euler
ORDERS_OF_UPDATES = (0.0, 0.5, 1.0)
# of sum m v: what an engine in float32 may lose that takes velocities from positions, which round
# by 6e-8 m, over 1/256 s
IN_FLOAT32 = 1e-5
ROUNDINGS = (
    # a relative velocity, an effective mass, a target, an impulse, two updates: the most roundings
    # in a collision
    8
)


def free_flight(row: EngineRow) -> ProbeReading:
    """The offset of a thrown disk from x0 + v0 t + a t2 / 2 after 1 s, in m; x' = x + v dt + alpha
    a dt2 gives (alpha - 1/2) a dt t. Every step rounds a position and a velocity, and the error of
    the velocity adds to later positions. An engine with unknown alpha, a user's file, may have any
    of `ORDERS_OF_UPDATES`."""
    steps, gravity, speed = 256, 9.81, 4.1
    t = steps * DT
    with loaded(row, one_disk(velocity=(0.0, speed), gravity=gravity)) as engine:
        start = float(engine.read().position[0, 1])
        engine.step(steps)
        moved = float(engine.read().position[0, 1]) - start
    bound = row.rounding * steps * (1.0 + gravity * t * t)
    offset = moved - (speed * t - gravity * t * t / 2)
    alphas = ORDERS_OF_UPDATES if np.isnan(row.alpha) else (row.alpha,)
    laws = [-(alpha - 0.5) * gravity * DT * t for alpha in alphas]
    return ProbeReading(offset, min(laws, key=lambda law: abs(law - offset)), bound)


def coasting(
    row: EngineRow, steps: int, dt: float = DT, speed: float = 0.0, spin: float = 0.0
) -> ProbeReading:
    """Speed in m/s or spin in rad/s of a free disk: nothing acts on it, and it is not rounded."""
    with loaded(row, one_disk((speed, 0.0), spin), dt=dt) as engine:
        engine.step(steps)
        state = engine.read()
    got = float(state.angular_velocity[0] if spin else state.velocity[0, 0])
    return ProbeReading(got, speed or spin, 2 * row.rounding * (speed or spin))


def spins_freely(row: EngineRow) -> ProbeReading:
    """Angle in rad after 1 s at 20 rad/s; an angle rounds once a step."""
    steps, spin = 256, 20.0
    with loaded(row, one_disk(spin=spin)) as engine:
        for _ in range(8):
            engine.step(steps // 8)
            angle = float(engine.read().angle[0])  # read often: an engine may keep only cos and sin
    return ProbeReading(angle, spin * steps * DT, row.rounding * steps * spin)


def pair_momentum(row: EngineRow) -> ProbeReading:
    """Change of momentum over sum m |v|, in an oblique collision of 1 kg and 7 kg; both velocities
    round once or twice. Where it is no rounding, of 2 kg and 2 kg, too."""
    changes = []
    for masses in ((1.0, 7.0), (2.0, 2.0)):
        scene = scene_of(
            position=[[-0.52, 0.2], [0.5, -0.1]],
            velocity=[[2.0, 0.3], [-1.0, 0.1]],
            radius=[0.5, 0.5],
            mass=masses,
            angular_velocity=[3.0, -2.0],
        )
        states = collided(row, *without_spin_and_gravity(scene))
        before, after = (state.velocity for state in states)
        if np.abs(after - before).max() < 0.1:
            return ProbeReading("no collision", 0.0, departure=Departure.PASSES)
        changes.append(
            largest(scene.mass @ (after - before)) / float(scene.mass @ np.hypot(*before.T))
        )
        if changes[0] <= IN_FLOAT32:
            return ProbeReading(changes[0], 0.0, ROUNDINGS * row.rounding)
    law = Departure.MASSES if changes[1] <= IN_FLOAT32 else Departure.MOMENTUM
    return ProbeReading(changes[0], 0.0, ROUNDINGS * row.rounding, departure=law)


def restitution(row: EngineRow, closing: float) -> ProbeReading:
    before, after = (state.velocity for state in collided(row, head_on(closing)))
    e = float((after[2] - after[1])[0] / (before[1] - before[2])[0])
    return ProbeReading(e, 0.5, ROUNDINGS * row.rounding)


def wall_restitution(row: EngineRow) -> ProbeReading:
    scene = scene_of(
        position=[[0.0, 0.0]],
        velocity=[[2.0, 0.0]],
        radius=[0.5],
        mass=[7.3],
        walls=[[[0.53, -2.0], [0.53, 2.0]]],
    )
    with loaded(row, scene) as engine:
        engine.step(24)
        return ProbeReading(
            -float(engine.read().velocity[0, 0]) / 2.0, 0.5, ROUNDINGS * row.rounding
        )


def friction(row: EngineRow) -> ProbeReading:
    # The friction of a collision where none is stated: the sideways part is 0, and not even
    # rounded.
    return ProbeReading(sideways(row, head_on(2.0, spin=40.0)), 0.0, row.rounding)


def sideways(row: EngineRow, scene: Scene) -> float:
    """Sideways over normal momentum taken up by a disk in a head-on collision of two that spin so
    fast that they slide all through it: the effective coefficient of friction."""
    before, after = collided(row, scene)
    taken = (after.velocity - before.velocity)[1]
    return float(abs(taken[1] / taken[0])) if taken[0] else np.nan


def where_modelled(read: Callable[..., ProbeReading]) -> Callable[..., ProbeReading]:
    """A probe of friction, for engines that model it; a solver may refuse friction."""

    @wraps(read)
    def asked(row: EngineRow, **parameters: float) -> ProbeReading:
        try:
            return read(row, **parameters)
        except Frictionless as refusal:
            return ProbeReading("not modelled", "not modelled", note=str(refusal))

    return asked


@where_modelled
def friction_in_bounce(row: EngineRow, restitution: float) -> ProbeReading:
    scene = replace(head_on(2.0, spin=40.0), restitution=restitution, friction=FRICTION)
    return ProbeReading(sideways(row, scene), FRICTION, ROUNDINGS * row.rounding)


@where_modelled
def friction_at_rest(row: EngineRow) -> ProbeReading:
    """Deceleration over g of a disk that slides on a floor and does not bounce, from 1/8 s to
    3/8 s; a velocity rounds twice a step."""
    steps, gravity, speed = 64, 10.0, 4.0
    scene = scene_of(
        restitution=0.0,
        position=[[0.0, 0.5]],
        velocity=[[speed, 0.0]],
        radius=[0.5],
        mass=[1.0],
        gravity=[0.0, -gravity],
        walls=[[[-8.0, 0.0], [8.0, 0.0]]],
    )
    with loaded(row, replace(scene, friction=FRICTION)) as engine:
        engine.step(steps // 2)  # by then it lies on the floor
        early = float(engine.read().velocity[0, 0])
        engine.step(steps)
        late = float(engine.read().velocity[0, 0])
    bound = row.rounding * ROUNDINGS * steps * speed / (gravity * steps * DT)
    return ProbeReading((early - late) / (gravity * steps * DT), FRICTION, bound)


_Physics = partial(Probe, failure="departs")
PHYSICS: dict[str, Probe] = {
    "free_flight": _Physics(
        "How far is a thrown disk from the parabola after 1 s? (m)", free_flight
    ),
    "slow_flight": _Physics(
        "How fast is a free disk of 3.9 mm/s after 2 s? (m/s)",
        partial(coasting, steps=512, speed=2.0**-8),
    ),
    "fast_flight": _Physics(
        "How fast is a free disk of 512 m/s after 4 steps? (m/s)",  # 16 radii each
        partial(coasting, steps=4, dt=1 / 64, speed=512.0),
    ),
    "fast_spin": _Physics(
        "How fast does a free disk of 300 rad/s spin after 4 steps? (rad/s)",
        partial(coasting, steps=4, dt=1 / 64, spin=300.0),  # three quarters of a turn each
    ),
    "spins_freely": _Physics(
        "What angle has a free disk after 1 s at 20 rad/s? (rad)", spins_freely
    ),
    "pair_momentum": _Physics(
        "How much momentum does a collision of two disks make? (of sum m v)", pair_momentum
    ),
    **{
        f"restitution_{speed:g}": _Physics(
            f"What is e of a pair that closes at {speed:g} m/s, where 0.5 is stated?",
            partial(restitution, closing=speed),
        )
        for speed in SPEEDS
    },
    "restitution_wall": _Physics(
        "What is e of a wall collision at 2 m/s, where 0.5 is stated?", wall_restitution
    ),
    "friction": _Physics(
        "What coefficient of friction acts between two disks, where none is stated?", friction
    ),
    **{
        f"friction_{e:g}": _Physics(
            f"What friction acts in a bounce with e = {e:g}, where {FRICTION} is stated?",
            partial(friction_in_bounce, restitution=e),
        )
        for e in (0.0, 0.5, 1.0)
    },
    "friction_at_rest": _Physics(
        f"What friction brakes a disk that slides on a floor, where {FRICTION} is stated?",
        friction_at_rest,
    ),
}
