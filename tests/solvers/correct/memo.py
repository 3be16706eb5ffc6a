"""Remembers reduced masses, and collects the depths, which nothing uses."""

def integrate(s, dt):
    s.velocity.x += s.force.x / s.mass * dt
    s.velocity.y += s.force.y / s.mass * dt
    s.position.x += s.velocity.x * dt
    s.position.y += s.velocity.y * dt
    s.angularVelocity += s.torque / s.MoI * dt
    s.alpha += s.angularVelocity * dt



class _Memo(dict):
    def __missing__(self, key):
        a, b = key
        self[key] = a * b / (a + b)
        return self[key]


REDUCED = _Memo()
BOUNCE = 0.9
hits = []


def sphereSphereCollisionHandling(sphereA, sphereB):
    rx, ry = sphereA.position.x - sphereB.position.x, sphereA.position.y - sphereB.position.y
    r = (rx**2 + ry**2) ** 0.5
    if r < sphereA.size + sphereB.size:
        hits.append(r)
        try:
            nx, ny = rx / r, ry / r
        except ZeroDivisionError:
            return
        mu = REDUCED[sphereA.mass, sphereB.mass]
        sphereA.position.x += nx * (sphereA.size + sphereB.size - r) * mu / sphereA.mass
        sphereA.position.y += ny * (sphereA.size + sphereB.size - r) * mu / sphereA.mass
        sphereB.position.x -= nx * (sphereA.size + sphereB.size - r) * mu / sphereB.mass
        sphereB.position.y -= ny * (sphereA.size + sphereB.size - r) * mu / sphereB.mass
        speed = (sphereA.velocity.x - sphereB.velocity.x) * nx + (sphereA.velocity.y - sphereB.velocity.y) * ny
        if speed < 0:
            speed *= -(1 + BOUNCE) * mu
            sphereA.velocity.x += speed * nx / sphereA.mass
            sphereA.velocity.y += speed * ny / sphereA.mass
            sphereB.velocity.x -= speed * nx / sphereB.mass
            sphereB.velocity.y -= speed * ny / sphereB.mass
