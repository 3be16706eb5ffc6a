"""Polar coordinates by cmath: velocities are turned so that the line of centres is the real axis."""

import cmath


def z(v):
    return complex(v.x, v.y)


def integrate(sphere, dt):
    v = z(sphere.velocity) + z(sphere.force) * dt / sphere.mass
    x = z(sphere.position) + v * dt
    sphere.velocity.x, sphere.velocity.y = v.real, v.imag
    sphere.position.x, sphere.position.y = x.real, x.imag
    sphere.angularVelocity += sphere.torque * dt / sphere.MoI
    sphere.alpha += sphere.angularVelocity * dt


def sphereSphereCollisionHandling(sphereA, sphereB):
    distance, phase = cmath.polar(z(sphereA.position) - z(sphereB.position))
    reach = sphereA.size + sphereB.size
    if distance > reach:
        return
    half = cmath.rect((reach - distance) / 2, phase)
    for sphere, shift in ((sphereA, half), (sphereB, -half)):
        sphere.position.x += shift.real
        sphere.position.y += shift.imag
    back = cmath.rect(1, -phase)
    a, b = z(sphereA.velocity) * back, z(sphereB.velocity) * back
    if a.real > b.real:
        return
    m, n = sphereA.mass, sphereB.mass
    J = 1.9 * (b.real - a.real) * m * n / (m + n)
    for sphere, v in ((sphereA, (a + J / m) / back), (sphereB, (b - J / n) / back)):
        sphere.velocity.x, sphere.velocity.y = v.real, v.imag
