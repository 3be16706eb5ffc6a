"""Two worlds of 60 disks in Box2D 2.3, and a hash of all that they do: `python box2d_worlds.py`
prints it, with whatever distribution Python finds."""

from __future__ import annotations

import hashlib
import struct

import Box2D

WALLS = [((-4, 0), (4, 0)), ((-4, 0), (-4, 30)), ((4, 0), (4, 30)), ((-4, 30), (4, 30))]


def play(gravity: float, restitution: float, friction: float) -> str:
    world = Box2D.b2World(gravity=(0, gravity))
    for ends in WALLS:
        world.CreateStaticBody().CreateEdgeFixture(
            vertices=ends, restitution=restitution, friction=friction
        )
    bodies = []
    for k in range(60):
        body = world.CreateDynamicBody(
            position=(-3 + k % 6 * 1.1 + 0.01 * (k % 7), 1 + k // 6 * 1.2),
            linearVelocity=((k * 7 % 11 - 5) / 2, (k * 5 % 13 - 6) / 2),
        )
        body.CreateCircleFixture(
            radius=0.3 + k % 4 / 20, density=1 + k % 3, restitution=restitution, friction=friction
        )
        bodies.append(body)
    states = hashlib.sha256()
    for _ in range(600):
        world.Step(1 / 60, 8, 3)
        for body in bodies:
            x, v = body.position, body.linearVelocity
            motion = (x.x, x.y, v.x, v.y, body.angle, body.angularVelocity)
            states.update(struct.pack("<6f", *motion))
    return states.hexdigest()


if __name__ == "__main__":
    print(play(-10.0, 0.3, 0.4), play(0.0, 1.0, 0.0))
