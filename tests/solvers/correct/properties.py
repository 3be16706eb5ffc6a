"""Properties on a wrapper; vectors as tuples that are reassigned."""


class Body:
    def __init__(self, s):
        self._s = s

    @property
    def x(self):
        return (self._s.position.x, self._s.position.y)

    @x.setter
    def x(self, value):
        self._s.position.x, self._s.position.y = value

    @property
    def v(self):
        return (self._s.velocity.x, self._s.velocity.y)

    @v.setter
    def v(self, value):
        self._s.velocity.x, self._s.velocity.y = value

    def __getattr__(self, name):
        return getattr(self._s, name)


def add(a, b, k=1.0):
    return tuple(p + k * q for p, q in zip(a, b))


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def integrate(sphere, dt):
    b = Body(sphere)
    b.v = add(b.v, (sphere.force.x, sphere.force.y), dt / sphere.mass)
    b.x = add(b.x, b.v, dt)
    sphere.angularVelocity += dt * sphere.torque / sphere.MoI
    sphere.alpha += dt * sphere.angularVelocity


def sphereSphereCollisionHandling(sphereA, sphereB):
    a, b = Body(sphereA), Body(sphereB)
    d = add(a.x, b.x, -1)
    dist = dot(d, d) ** 0.5
    if not dist < a.size + b.size:
        return
    n = tuple(c / dist for c in d)
    half = (a.size + b.size - dist) / 2
    a.x, b.x = add(a.x, n, half), add(b.x, n, -half)
    j = -1.9 * dot(add(a.v, b.v, -1), n) / (1 / a.mass + 1 / b.mass)
    a.v, b.v = add(a.v, n, j / a.mass), add(b.v, n, -j / b.mass)
