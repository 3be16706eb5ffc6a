"""Structural matching, a stack of impulses, global counters."""
from collections import Counter, namedtuple
from math import copysign, hypot

Contact = namedtuple("Contact", "nx ny depth")
statistics = Counter()


def integrate(body, dt):
    statistics["steps"] += 1
    for name, rate in (("x", body.force.x), ("y", body.force.y)):
        setattr(body.velocity, name, getattr(body.velocity, name) + dt * rate / body.mass)
        setattr(body.position, name, getattr(body.position, name) + dt * getattr(body.velocity, name))
    body.angularVelocity, body.alpha = (
        (w := body.angularVelocity + body.torque / body.MoI * dt),
        body.alpha + w * dt,
    )


def contact(a, b):
    dx, dy = a.position.x - b.position.x, a.position.y - b.position.y
    gap = hypot(dx, dy) - (a.size + b.size)
    match (gap <= 0, hypot(dx, dy) > 0):
        case (True, True):
            return Contact(dx / hypot(dx, dy), dy / hypot(dx, dy), -gap)
        case (True, False):
            return Contact(copysign(1.0, dx), 0.0, -gap)
        case _:
            return None


def sphereSphereCollisionHandling(sphereA, sphereB):
    if (c := contact(sphereA, sphereB)) is None:
        return
    statistics["collisions"] += 1
    stack = [(sphereA, +1), (sphereB, -1)]
    closing = (sphereB.velocity.x - sphereA.velocity.x) * c.nx + (sphereB.velocity.y - sphereA.velocity.y) * c.ny
    impulse = 1.9 * closing * sphereA.mass * sphereB.mass / (sphereA.mass + sphereB.mass)
    while stack:
        body, sign = stack.pop()
        body.position.x += sign * c.nx * c.depth / 2
        body.position.y += sign * c.ny * c.depth / 2
        body.velocity.x += sign * impulse * c.nx / body.mass
        body.velocity.y += sign * impulse * c.ny / body.mass
