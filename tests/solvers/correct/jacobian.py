"""The impulse of a constraint, by its Jacobian and the matrix of the masses."""

import numpy as np

def integrate(s, dt):
    v = np.array([s.velocity.x, s.velocity.y]) + np.array([s.force.x, s.force.y]) * dt / s.mass
    x = np.array([s.position.x, s.position.y]) + v * dt
    s.velocity.x, s.velocity.y = v
    s.position.x, s.position.y = x
    s.angularVelocity += s.torque * dt / s.MoI
    s.alpha += s.angularVelocity * dt


def sphereSphereCollisionHandling(a, b):
    xa, xb = (np.array([s.position.x, s.position.y]) for s in (a, b))
    va, vb = (np.array([s.velocity.x, s.velocity.y]) for s in (a, b))
    r = xa - xb
    d = np.linalg.norm(r)
    if d > a.size + b.size:
        return
    n = r / d
    P = np.outer(n, n)
    m, I = np.diag([a.mass, a.mass, b.mass, b.mass]), np.eye(2)
    jac = np.concatenate([n, -n])
    lam = -(1 + 0.9) * (jac @ np.concatenate([va, vb])) / (jac @ np.linalg.inv(m) @ jac)
    v = np.concatenate([va, vb]) + np.linalg.inv(m) @ jac * lam
    c = (a.size + b.size - d) / (jac @ np.linalg.inv(m) @ jac)
    x = np.concatenate([xa, xb]) + np.linalg.inv(m) @ jac * c
    a.position.x, a.position.y, b.position.x, b.position.y = x.tolist()
    a.velocity.x, a.velocity.y, b.velocity.x, b.velocity.y = v.tolist()
