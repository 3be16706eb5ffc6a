"""Closed formulas, collected: ((mA - e mB) vA + (1 + e) mB vB) / (mA + mB), by unit vectors of numpy."""
import numpy as np

e = 0.9


def vec(v):
    return np.array((v.x, v.y), dtype=np.float64)


def integrate(s, dt):
    s.velocity.x, s.velocity.y = vec(s.velocity) + vec(s.force) * (dt / s.mass)
    s.position.x, s.position.y = vec(s.position) + vec(s.velocity) * dt
    s.angularVelocity += s.torque * dt / s.MoI
    s.alpha += s.angularVelocity * dt


def sphereSphereCollisionHandling(sphereA, sphereB):
    n = vec(sphereB.position) - vec(sphereA.position)
    d = np.sqrt(np.sum(n**2))
    if d == 0 or d > sphereA.size + sphereB.size:
        return
    n /= d
    for s, k in ((sphereA, -0.5), (sphereB, 0.5)):
        s.position.x, s.position.y = vec(s.position) + k * (sphereA.size + sphereB.size - d) * n
    a, b, M = sphereA.mass, sphereB.mass, sphereA.mass + sphereB.mass
    va, vb = vec(sphereA.velocity), vec(sphereB.velocity)
    pa, pb = va @ n, vb @ n
    qa = ((a - e * b) * pa + (1 + e) * b * pb) / M
    qb = ((b - e * a) * pb + (1 + e) * a * pa) / M
    sphereA.velocity.x, sphereA.velocity.y = va + (qa - pa) * n
    sphereB.velocity.x, sphereB.velocity.y = vb + (qb - pb) * n
