"""Only the two tasks, by items and numpy; A alone is moved; the printed formula, on pairs that part too."""

import numpy as np


def integrate(sphere, dt):
    sphere["velocity"]["x"] += dt * sphere["force"]["x"] / sphere["mass"]
    sphere["velocity"]["y"] += dt * sphere["force"]["y"] / sphere["mass"]
    sphere["position"]["x"] += dt * sphere["velocity"]["x"]
    sphere["position"]["y"] += dt * sphere["velocity"]["y"]
    sphere["angularVelocity"] += dt * sphere["torque"] / sphere["MoI"]
    sphere["alpha"] += dt * sphere["angularVelocity"]


def _vector(v):
    return np.array([v.x, v.y])


def _set(v, values):
    v.x, v.y = (float(x) for x in values)


def sphereSphereCollisionHandling(sphereA, sphereB):
    r = _vector(sphereA.position) - _vector(sphereB.position)
    if r @ r > (sphereA.size + sphereB.size) ** 2:
        return
    n = r / np.linalg.norm(r)
    _set(sphereA.position, _vector(sphereB.position) + (sphereA.size + sphereB.size) * n)
    u = _vector(sphereA.velocity) - _vector(sphereB.velocity)
    J = -(1 + 0.9) * (u @ n) / (n @ n * (1 / sphereA.mass + 1 / sphereB.mass))
    _set(sphereA.velocity, _vector(sphereA.velocity) + J * n / sphereA.mass)
    _set(sphereB.velocity, _vector(sphereB.velocity) - J * n / sphereB.mass)
