"""Solves the exercise's equations for both new velocities and J at once, by numpy."""

import numpy as np

E = 0.9


def integrate(sphere, dt):
    state = np.array([sphere.position.x, sphere.position.y, sphere.velocity.x, sphere.velocity.y, 1.0])
    ax, ay = sphere.force.x / sphere.mass, sphere.force.y / sphere.mass
    step = np.array(
        [
            [1, 0, dt, 0, ax * dt * dt],
            [0, 1, 0, dt, ay * dt * dt],
            [0, 0, 1, 0, ax * dt],
            [0, 0, 0, 1, ay * dt],
            [0, 0, 0, 0, 1],
        ]
    )
    sphere.position.x, sphere.position.y, sphere.velocity.x, sphere.velocity.y, _ = map(float, step @ state)
    sphere.angularVelocity += sphere.torque / sphere.MoI * dt
    sphere.alpha += sphere.angularVelocity * dt


def sphereSphereCollisionHandling(sphereA, sphereB):
    a, b = sphereA, sphereB
    r = np.array([a.position.x - b.position.x, a.position.y - b.position.y])
    d = float(np.linalg.norm(r))
    if d == 0.0 or d > a.size + b.size:
        return
    nx, ny = r / d
    deep = (a.size + b.size - d) / 2
    a.position.x, a.position.y = float(a.position.x + deep * nx), float(a.position.y + deep * ny)
    b.position.x, b.position.y = float(b.position.x - deep * nx), float(b.position.y - deep * ny)
    va, vb = [a.velocity.x, a.velocity.y], [b.velocity.x, b.velocity.y]
    vn = (va[0] - vb[0]) * nx + (va[1] - vb[1]) * ny
    if vn >= 0.0:
        return
    unknowns = np.array(
        [
            [a.mass, 0, 0, 0, -nx],
            [0, a.mass, 0, 0, -ny],
            [0, 0, b.mass, 0, nx],
            [0, 0, 0, b.mass, ny],
            [nx, ny, -nx, -ny, 0],
        ]
    )
    known = [a.mass * va[0], a.mass * va[1], b.mass * vb[0], b.mass * vb[1], -E * vn]
    a.velocity.x, a.velocity.y, b.velocity.x, b.velocity.y, _ = map(float, np.linalg.solve(unknowns, known))
