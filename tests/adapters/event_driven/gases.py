"""Gases of equal disks on a torus, what the literature says of them, and how tests ask the event
engine."""

from __future__ import annotations

import numpy as np

from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.families.exercise import HIGH, LOW, SHIP, SHIP_MASS, SHIP_RADIUS
from crosscheck2d.scenarios.families.placing import box, lay_out, scatter
from crosscheck2d.scenarios.model import Scene


def gas(n: int, packing: float, seed: int = 0) -> tuple[Scene, np.ndarray]:
    """Disks of diameter and mass 1, kT = 1 and no momentum, on a triangular lattice; and their
    torus (2, 2)."""
    side = np.sqrt(n * np.pi / 4 / packing)
    columns = int(np.ceil(np.sqrt(n * np.sqrt(3) / 2)))
    rows = -(-n // columns)
    rows += rows % 2
    k = np.arange(n)
    x = (k % columns + 0.5 * (k // columns % 2) + 0.25) * side / columns
    y = (k // columns + 0.5) * side / rows
    velocity = np.random.default_rng(seed).normal(size=(n, 2))
    velocity -= velocity.mean(axis=0)
    velocity *= np.sqrt(2 * (n - 1) / (velocity**2).sum())
    scene = lay_out(np.stack([x, y], -1), velocity, radius=0.5)
    return scene, np.array([[0.0, 0.0], [side, side]])


def boxed_gas(n: int, packing: float, seed: int = 0) -> Scene:
    """The gas of `gas` between four walls instead, which the disks cover by `packing`, in an order
    sampled by `seed`."""
    free, torus = gas(n, packing, seed)
    side = torus[1, 0]
    spread = free.position - free.position.min(axis=0)
    # From wall to wall, but for a gap of a thousandth of a diameter.
    position = 0.501 + spread / spread.max(axis=0) * (side - 1.002)
    order = np.random.default_rng(seed).permutation(n)
    return Scene(
        position=position[order],
        velocity=free.velocity[order],
        radius=free.radius,
        mass=free.mass,
        restitution=1.0,
        walls=box([0.0, 0.0], [side, side]),
    )


def boxed_asteroids(seed: int, restitution: float = 1.0, gravity: float = 0.0) -> Scene:
    """The exercise's ship and twenty asteroids between walls at the edges of its world, sampled as
    there."""
    rng = np.random.default_rng(seed)
    radius = np.append(SHIP_RADIUS, rng.uniform(0.08, 0.3, 20))
    position = scatter(rng, np.array(LOW) + 0.3, np.array(HIGH) - 0.3, radius, first=SHIP)
    velocity = rng.uniform(0.25, 0.5, (21, 2)) * rng.choice([-1.0, 1.0], (21, 2))
    velocity[0] = 0.0
    return Scene(
        position=position,
        velocity=velocity,
        radius=radius,
        mass=np.append(SHIP_MASS, 30 * np.pi * radius[1:] ** 2),
        restitution=restitution,
        gravity=np.array([0.0, gravity]),
        walls=box(LOW, HIGH),
    )


def collisions_of(engine):
    """(t, i, j) of all collisions, the lower disk first."""
    return [
        (t, *((i, j) if j < 0 or i < j else (j, i)))
        for t, i, j in engine.collisions[:, :3].tolist()
    ]


def state_after(scene, until, torus=None, cell=0.0):
    engine = EventEngine(scene, torus, cell)
    engine.advance(until)
    return engine, *engine.motion_at(until)


def after(scene, until):
    return state_after(scene, until)[1:]
