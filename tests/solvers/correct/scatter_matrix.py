"""The speeds before, times a matrix, are those after."""

def integrate(s, dt):
    s.velocity.x += s.force.x / s.mass * dt
    s.velocity.y += s.force.y / s.mass * dt
    s.position.x += s.velocity.x * dt
    s.position.y += s.velocity.y * dt
    s.angularVelocity += s.torque / s.MoI * dt
    s.alpha += s.angularVelocity * dt



from fractions import Fraction as F
import numpy as np


def sphereSphereCollisionHandling(sphereA, sphereB):
    R = np.array([[sphereA.position.x, sphereA.position.y], [sphereB.position.x, sphereB.position.y]])
    V = np.array([[sphereA.velocity.x, sphereA.velocity.y], [sphereB.velocity.x, sphereB.velocity.y]])
    d = R[0] - R[1]
    dist = np.hypot(*d)
    if dist >= sphereA.size + sphereB.size:
        return
    angle = np.arctan2(d[1], d[0])
    Q = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    local = V @ Q.T
    m = np.array([sphereA.mass, sphereB.mass])
    e = 9 / 10
    S = np.array([[m[0] - e * m[1], (1 + e) * m[1]], [(1 + e) * m[0], m[1] - e * m[0]]]) / m.sum()
    local[:, 0] = S @ local[:, 0]
    V = local @ Q
    R += np.outer([1, -1], Q[0]) * (sphereA.size + sphereB.size - dist) / 2
    for s, x, v in zip((sphereA, sphereB), R, V):
        s.position.x, s.position.y = map(float, x)
        s.velocity.x, s.velocity.y = map(float, v)
