"""New vectors for every change; only the lighter sphere is moved."""

import math
from types import SimpleNamespace as NS


def integrate(sphere, dt):
    sphere.velocity = NS(x=sphere.velocity.x + sphere.force.x * dt / sphere.mass, y=sphere.velocity.y + sphere.force.y * dt / sphere.mass)
    sphere.position = NS(x=sphere.position.x + sphere.velocity.x * dt, y=sphere.position.y + sphere.velocity.y * dt)
    sphere.angularVelocity = math.fsum((sphere.angularVelocity, sphere.torque / sphere.MoI * dt))
    sphere.alpha = math.fsum((sphere.alpha, sphere.angularVelocity * dt))


def sphereSphereCollisionHandling(sphereA, sphereB):
    delta = math.dist((sphereA.position.x, sphereA.position.y), (sphereB.position.x, sphereB.position.y))
    gap = delta - sphereA.size - sphereB.size
    if gap > 0 or delta < 1e-12:
        return None
    nx = (sphereB.position.x - sphereA.position.x) / delta
    ny = (sphereB.position.y - sphereA.position.y) / delta
    heavy, light, s = (sphereA, sphereB, -1) if sphereA.mass >= sphereB.mass else (sphereB, sphereA, 1)
    light.position = NS(x=light.position.x + s * gap * nx, y=light.position.y + s * gap * ny)
    k = (1 + 0.9) * ((sphereB.velocity.x - sphereA.velocity.x) * nx + (sphereB.velocity.y - sphereA.velocity.y) * ny)
    k *= sphereA.mass * sphereB.mass / (sphereA.mass + sphereB.mass)
    sphereA.velocity = NS(x=sphereA.velocity.x + k * nx / sphereA.mass, y=sphereA.velocity.y + k * ny / sphereA.mass)
    sphereB.velocity = NS(x=sphereB.velocity.x - k * nx / sphereB.mass, y=sphereB.velocity.y - k * ny / sphereB.mass)
    return None
