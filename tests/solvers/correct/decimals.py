"""Thirty decimal digits, rounded to floats only where a number is written."""

from decimal import Decimal, getcontext

getcontext().prec = 30
D = Decimal
E = D("0.9")


def read(v):
    return [D(v.x), D(v.y)]


def write(v, values):
    v.x, v.y = map(float, values)


def integrate(sphere, dt):
    h = D(dt)
    v = [a + f / D(sphere.mass) * h for a, f in zip(read(sphere.velocity), read(sphere.force))]
    write(sphere.position, [x + a * h for x, a in zip(read(sphere.position), v)])
    write(sphere.velocity, v)
    w = D(sphere.angularVelocity) + D(sphere.torque) / D(sphere.MoI) * h
    sphere.angularVelocity, sphere.alpha = float(w), float(D(sphere.alpha) + w * h)


def sphereSphereCollisionHandling(sphereA, sphereB):
    r = [p - q for p, q in zip(read(sphereA.position), read(sphereB.position))]
    d, reach = sum(x * x for x in r).sqrt(), D(sphereA.size) + D(sphereB.size)
    if d >= reach or not d:
        return
    n = [x / d for x in r]
    write(sphereA.position, [x + (reach - d) / 2 * k for x, k in zip(read(sphereA.position), n)])
    write(sphereB.position, [x - (reach - d) / 2 * k for x, k in zip(read(sphereB.position), n)])
    vn = sum((a - b) * k for a, b, k in zip(read(sphereA.velocity), read(sphereB.velocity), n))
    if vn < 0:
        J = -(1 + E) * vn / (1 / D(sphereA.mass) + 1 / D(sphereB.mass))
        write(sphereA.velocity, [a + J / D(sphereA.mass) * k for a, k in zip(read(sphereA.velocity), n)])
        write(sphereB.velocity, [b - J / D(sphereB.mass) * k for b, k in zip(read(sphereB.velocity), n)])
