"""The impulse from the energy that the centre-of-mass frame keeps, e2 of it along the normal: a quadratic equation."""

from math import dist, sqrt

e2 = 0.81


def integrate(sphere, dt):
    s, v, f = sphere.position, sphere.velocity, sphere.force
    v.x, v.y = v.x + f.x / sphere.mass * dt, v.y + f.y / sphere.mass * dt
    s.x, s.y = s.x + v.x * dt, s.y + v.y * dt
    sphere.angularVelocity, sphere.alpha = (
        (w := sphere.angularVelocity + sphere.torque / sphere.MoI * dt),
        sphere.alpha + w * dt,
    )


def sphereSphereCollisionHandling(sphereA, sphereB):
    d = dist((sphereA.position.x, sphereA.position.y), (sphereB.position.x, sphereB.position.y))
    if d >= sphereA.size + sphereB.size or d == 0:
        return
    nx, ny = (sphereA.position.x - sphereB.position.x) / d, (sphereA.position.y - sphereB.position.y) / d
    move = sphereA.size + sphereB.size - d
    sphereB.position.x -= nx * move
    sphereB.position.y -= ny * move
    vn = (sphereA.velocity.x - sphereB.velocity.x) * nx + (sphereA.velocity.y - sphereB.velocity.y) * ny
    if vn >= 0:
        return
    # (vn + J w)^2 = e2 vn^2 with w = 1/mA + 1/mB, the root with a positive separation
    w = 1 / sphereA.mass + 1 / sphereB.mass
    a, b, c = w * w, 2 * vn * w, (1 - e2) * vn * vn
    J = (-b + sqrt(b * b - 4 * a * c)) / (2 * a)
    sphereA.velocity.x += J * nx / sphereA.mass
    sphereA.velocity.y += J * ny / sphereA.mass
    sphereB.velocity.x -= J * nx / sphereB.mass
    sphereB.velocity.y -= J * ny / sphereB.mass
