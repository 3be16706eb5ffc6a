"""Normal velocities from the two equations of momentum and restitution, as a lesson would; integration by axis."""

from math import sqrt

e = 0.9


def integrate(sphere, dt):
    for axis in "xy":
        faster = getattr(sphere.velocity, axis) + getattr(sphere.force, axis) * dt / sphere.mass
        setattr(sphere.velocity, axis, faster)
        setattr(sphere.position, axis, getattr(sphere.position, axis) + faster * dt)
    sphere.angularVelocity, before = sphere.angularVelocity + sphere.torque * dt / sphere.MoI, sphere.alpha
    sphere.alpha = before + sphere.angularVelocity * dt


def sphereSphereCollisionHandling(one, two):
    dx, dy = two.position.x - one.position.x, two.position.y - one.position.y
    squared = dx * dx + dy * dy
    if not 0 < squared <= (one.size + two.size) ** 2:
        return None
    d = sqrt(squared)
    n = dx / d, dy / d
    delta, w1, w2 = one.size + two.size - d, 1 / one.mass, 1 / two.mass
    one.position.x, one.position.y = (p - w1 / (w1 + w2) * delta * c for p, c in zip((one.position.x, one.position.y), n))
    two.position.x, two.position.y = (p + w2 / (w1 + w2) * delta * c for p, c in zip((two.position.x, two.position.y), n))
    v1, v2 = one.velocity.x * n[0] + one.velocity.y * n[1], two.velocity.x * n[0] + two.velocity.y * n[1]
    if v1 <= v2:
        return None
    m1, m2 = one.mass, two.mass
    V1 = (m1 * v1 + m2 * v2 - m2 * (v1 - v2) * e) / (m1 + m2)
    V2 = (m1 * v1 + m2 * v2 - m1 * (v2 - v1) * e) / (m1 + m2)
    one.velocity.x, one.velocity.y = one.velocity.x + (V1 - v1) * n[0], one.velocity.y + (V1 - v1) * n[1]
    two.velocity.x, two.velocity.y = two.velocity.x + (V2 - v2) * n[0], two.velocity.y + (V2 - v2) * n[1]
    return None
