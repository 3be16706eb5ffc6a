"""Functions that make functions: partial, closures, a decorator that keeps the order of A and B."""

from functools import partial, reduce
from operator import mul


def symmetric(rule):
    def applied(a, b):
        first, second = sorted((a, b), key=lambda s: s.mass)
        return rule(first, second)

    return applied


def shifted(what, sphere, by, n):
    vector = getattr(sphere, what)
    vector.x, vector.y = (v + by * k for v, k in zip((vector.x, vector.y), n))


displace, kick = partial(shifted, "position"), partial(shifted, "velocity")


def restitution(e=0.9):
    return lambda vn, *masses: -(1 + e) * vn * reduce(mul, masses) / sum(masses)


impulse = restitution()


def integrate(sphere, dt):
    kick(sphere, dt / sphere.mass, (sphere.force.x, sphere.force.y))
    displace(sphere, dt, (sphere.velocity.x, sphere.velocity.y))
    sphere.angularVelocity += dt * sphere.torque / sphere.MoI
    sphere.alpha += dt * sphere.angularVelocity


@symmetric
def sphereSphereCollisionHandling(light, heavy):
    r = (light.position.x - heavy.position.x, light.position.y - heavy.position.y)
    d = sum(map(mul, r, r)) ** 0.5
    depth = light.size + heavy.size - d
    if depth <= 0.0 or d == 0.0:
        return
    n = tuple(x / d for x in r)
    displace(light, depth, n)
    u = (light.velocity.x - heavy.velocity.x, light.velocity.y - heavy.velocity.y)
    if (vn := sum(map(mul, u, n))) < 0.0:
        J = impulse(vn, light.mass, heavy.mass)
        kick(light, J / light.mass, n)
        kick(heavy, -J / heavy.mass, n)
