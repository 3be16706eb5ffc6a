"""The exercise in Python; the MoI is that of its spheres, pi / 2 size4, computed where it is needed."""

import random
from math import hypot, pi

NUM_ASTEROIDS = 20
LOW_X, HIGH_X, LOW_Y, HIGH_Y = -5.0, 5.0, -3.0, 3.0
RESTITUTION = 0.9


class Vector:
    def __init__(self, x, y):
        self.x, self.y = x, y


class Sphere:
    def __init__(self, x, y, size, density):
        self.position, self.velocity, self.force = Vector(x, y), Vector(0.0, 0.0), Vector(0.0, 0.0)
        self.alpha = self.angularVelocity = self.torque = 0.0
        self.size, self.mass, self.MoI = size, pi * size**2 * density, pi / 2 * size**4


def initUfo():
    global ufo
    ufo = Sphere(-3.5, 0.0, 0.3, 5.0)


def initScene():
    global asteroids
    initUfo()
    asteroids = []
    for _ in range(NUM_ASTEROIDS):
        one = Sphere(random.uniform(LOW_X, HIGH_X), random.uniform(LOW_Y, HIGH_Y), random.uniform(0.08, 0.3), 30.0)
        one.velocity = Vector(random.choice((-0.3, 0.3)), random.choice((-0.4, 0.4)))
        asteroids.append(one)


def integrate(sphere, dt):
    sphere.velocity.x += sphere.force.x / sphere.mass * dt
    sphere.velocity.y += sphere.force.y / sphere.mass * dt
    sphere.position.x += sphere.velocity.x * dt
    sphere.position.y += sphere.velocity.y * dt
    sphere.angularVelocity += sphere.torque / (pi / 2 * sphere.size**4) * dt
    sphere.alpha += sphere.angularVelocity * dt


def sphereSphereCollisionHandling(sphereA, sphereB):
    nx = sphereA.position.x - sphereB.position.x
    ny = sphereA.position.y - sphereB.position.y
    distance = hypot(nx, ny)
    if distance >= sphereA.size + sphereB.size or distance == 0.0:
        return
    nx, ny = nx / distance, ny / distance

    overlap = sphereA.size + sphereB.size - distance
    share = sphereB.mass / (sphereA.mass + sphereB.mass)
    sphereA.position.x += nx * overlap * share
    sphereA.position.y += ny * overlap * share
    sphereB.position.x -= nx * overlap * (1 - share)
    sphereB.position.y -= ny * overlap * (1 - share)

    vn = (sphereA.velocity.x - sphereB.velocity.x) * nx + (sphereA.velocity.y - sphereB.velocity.y) * ny
    if vn >= 0.0:
        return
    J = -(1 + RESTITUTION) * vn / (1 / sphereA.mass + 1 / sphereB.mass)
    sphereA.velocity.x += J / sphereA.mass * nx
    sphereA.velocity.y += J / sphereA.mass * ny
    sphereB.velocity.x -= J / sphereB.mass * nx
    sphereB.velocity.y -= J / sphereB.mass * ny


def projectObjects():
    for asteroid in asteroids:
        p = asteroid.position
        p.x = HIGH_X if p.x < LOW_X else LOW_X if p.x > HIGH_X else p.x
        p.y = HIGH_Y if p.y < LOW_Y else LOW_Y if p.y > HIGH_Y else p.y
    if not (LOW_X <= ufo.position.x <= HIGH_X and LOW_Y <= ufo.position.y <= HIGH_Y):
        initUfo()


def performSimStep(dt):
    for sphere in [ufo, *asteroids]:
        integrate(sphere, dt)
    for asteroid in asteroids:
        sphereSphereCollisionHandling(asteroid, ufo)
    for i, asteroid in enumerate(asteroids):
        sphereSphereCollisionHandling(asteroid, ufo)
        for other in asteroids[i + 1 :]:
            sphereSphereCollisionHandling(asteroid, other)
    projectObjects()
