"""Vectors as complex numbers; typed; an equal split; another restitution."""

from __future__ import annotations

from typing import Any

E: float = 0.8


def vector(v: Any) -> complex:
    return complex(v.x, v.y)


def put(v: Any, z: complex) -> None:
    v.x, v.y = z.real, z.imag


def integrate(sphere: Any, dt: float) -> None:
    put(sphere.velocity, vector(sphere.velocity) + vector(sphere.force) / sphere.mass * dt)
    put(sphere.position, vector(sphere.position) + vector(sphere.velocity) * dt)
    sphere.angularVelocity += sphere.torque / sphere.MoI * dt
    sphere.alpha += sphere.angularVelocity * dt


def sphereSphereCollisionHandling(a: Any, b: Any) -> None:
    r = vector(a.position) - vector(b.position)
    reach = a.size + b.size
    if (r == 0) or abs(r) >= reach:
        return
    n = r / abs(r)
    put(a.position, vector(a.position) + (reach - abs(r)) / 2 * n)
    put(b.position, vector(b.position) - (reach - abs(r)) / 2 * n)
    vn = ((vector(a.velocity) - vector(b.velocity)) * n.conjugate()).real
    if vn < 0:
        J = -(1 + E) * vn / (1 / a.mass + 1 / b.mass)
        put(a.velocity, vector(a.velocity) + J / a.mass * n)
        put(b.velocity, vector(b.velocity) - J / b.mass * n)
