"""The angle stays between -pi and pi; vectors are pairs, and a collision is a change of both."""

from math import hypot, pi, remainder

E = 0.9


def integrate(sphere, dt):
    for axis in ("x", "y"):
        v = getattr(sphere.velocity, axis) + getattr(sphere.force, axis) * dt / sphere.mass
        setattr(sphere.velocity, axis, v)
        setattr(sphere.position, axis, getattr(sphere.position, axis) + v * dt)
    sphere.angularVelocity += sphere.torque * dt / sphere.MoI
    sphere.alpha = remainder(sphere.alpha + sphere.angularVelocity * dt, 2 * pi)


def sphereSphereCollisionHandling(sphereA, sphereB):
    a, b = (sphereA.position, sphereA.velocity), (sphereB.position, sphereB.velocity)
    (dx, dy), (du, dv) = ((p.x - q.x, p.y - q.y) for p, q in zip(a, b))
    distance = hypot(dx, dy)
    overlap = sphereA.size + sphereB.size - distance
    if overlap <= 0 or distance == 0:
        return
    n = dx / distance, dy / distance
    inverse = 1 / sphereA.mass, -1 / sphereB.mass
    closing = min(du * n[0] + dv * n[1], 0.0)
    impulse = -(1 + E) * closing / (inverse[0] - inverse[1])
    for (position, velocity), weight, sign in zip((a, b), inverse, (1, -1)):
        position.x, position.y = position.x + sign * overlap / 2 * n[0], position.y + sign * overlap / 2 * n[1]
        velocity.x, velocity.y = velocity.x + weight * impulse * n[0], velocity.y + weight * impulse * n[1]
