"""A and B change their names; components by setattr."""

def integrate(s, dt):
    s.velocity.x += s.force.x / s.mass * dt
    s.velocity.y += s.force.y / s.mass * dt
    s.position.x += s.velocity.x * dt
    s.position.y += s.velocity.y * dt
    s.angularVelocity += s.torque / s.MoI * dt
    s.alpha += s.angularVelocity * dt



from math import sqrt

E = 0.9


def sphereSphereCollisionHandling(sphereA, sphereB, restitution=E):
    a, b = sphereB, sphereA  # the names of my notes
    (x, y) = (a.position.x - b.position.x, a.position.y - b.position.y)
    if (d := sqrt(x * x + y * y)) >= (reach := a.size + b.size):
        return
    if d == 0:
        x, y, d = 1.0, 0.0, 1.0
        reach = 1.0 + reach
    n = (x / d, y / d)
    for s, sign, w in ((a, 1, b.size / (a.size + b.size)), (b, -1, a.size / (a.size + b.size))):
        s.position.x += sign * w * (reach - d) * n[0]
        s.position.y += sign * w * (reach - d) * n[1]
    u = sum(c * (getattr(a.velocity, k) - getattr(b.velocity, k)) for c, k in zip(n, "xy"))
    if u > 0:
        return
    J = -(1 + restitution) * u / (1 / a.mass + 1 / b.mass)
    for s, sign in ((a, 1), (b, -1)):
        for c, k in zip(n, "xy"):
            setattr(s.velocity, k, getattr(s.velocity, k) + sign * J * c / s.mass)
