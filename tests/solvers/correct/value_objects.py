"""Frozen vectors with operators, a match statement, and a scene of its own."""

from __future__ import annotations

import itertools
import math
import random
from dataclasses import dataclass, field


@dataclass(frozen=True)
class V:
    x: float
    y: float

    def __add__(self, o: V) -> V:
        return V(self.x + o.x, self.y + o.y)

    def __sub__(self, o: V) -> V:
        return V(self.x - o.x, self.y - o.y)

    def __rmul__(self, k: float) -> V:
        return V(k * self.x, k * self.y)

    def __matmul__(self, o: V) -> float:
        return self.x * o.x + self.y * o.y

    def __abs__(self) -> float:
        return math.hypot(self.x, self.y)


class Mutable:
    def __init__(self, x=0.0, y=0.0):
        self.x, self.y = x, y


@dataclass
class Sphere:
    position: Mutable
    size: float
    density: float
    velocity: Mutable = field(default_factory=Mutable)
    force: Mutable = field(default_factory=Mutable)
    alpha: float = 0.0
    angularVelocity: float = 0.0
    torque: float = 0.0

    def __post_init__(self):
        self.mass, self.MoI = math.pi * self.size**2 * self.density, math.pi / 2 * self.size**4


def get(v) -> V:
    return V(v.x, v.y)


def put(target, v: V) -> None:
    target.x, target.y = v.x, v.y


def initScene():
    global ufo, asteroids
    ufo = Sphere(Mutable(-3.5, 0.0), 0.3, 5.0)
    asteroids = [Sphere(Mutable(random.uniform(-5, 5), random.uniform(-3, 3)), random.uniform(0.08, 0.3), 30.0) for _ in range(20)]


def integrate(sphere, dt):
    put(sphere.velocity, get(sphere.velocity) + dt / sphere.mass * get(sphere.force))
    put(sphere.position, get(sphere.position) + dt * get(sphere.velocity))
    sphere.angularVelocity += dt * sphere.torque / sphere.MoI
    sphere.alpha += dt * sphere.angularVelocity


def sphereSphereCollisionHandling(a, b):
    r = get(a.position) - get(b.position)
    match a.size + b.size - abs(r):
        case depth if depth <= 0 or abs(r) == 0:
            return
        case depth:
            n = 1 / abs(r) * r
    put(a.position, get(a.position) + depth / 2 * n)
    put(b.position, get(b.position) - depth / 2 * n)
    match (get(a.velocity) - get(b.velocity)) @ n:
        case vn if vn < 0:
            J = -1.9 * vn / (1 / a.mass + 1 / b.mass)
            put(a.velocity, get(a.velocity) + J / a.mass * n)
            put(b.velocity, get(b.velocity) - J / b.mass * n)


def projectObjects():
    for p in (one.position for one in asteroids):
        p.x = -p.x / abs(p.x) * 5.0 if abs(p.x) > 5.0 else p.x
        p.y = math.copysign(3.0, -p.y) if abs(p.y) > 3.0 else p.y
    if abs(ufo.position.x) > 5.0 or abs(ufo.position.y) > 3.0:
        ufo.position.x, ufo.position.y = -3.5, 0.0


def performSimStep(dt):
    everybody = [ufo, *asteroids]
    for one in everybody:
        integrate(one, dt)
    for a, b in itertools.combinations(everybody, 2):
        sphereSphereCollisionHandling(a, b)
    projectObjects()
