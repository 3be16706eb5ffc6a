"""A frozen pair of complex positions and velocities."""

from dataclasses import dataclass
from functools import cached_property

@dataclass(frozen=True)
class Pair:
    za: complex
    zb: complex
    wa: complex
    wb: complex
    ma: float
    mb: float
    reach: float

    @cached_property
    def n(self): return (self.za - self.zb) / abs(self.za - self.zb)
    @cached_property
    def depth(self): return self.reach - abs(self.za - self.zb)
    @property
    def local(self): return (self.wa - self.wb) / self.n
    def after(self, e):
        u = complex(-e * self.local.real, self.local.imag) * self.n
        g = (self.ma * self.wa + self.mb * self.wb) / (self.ma + self.mb)
        return g + self.mb / (self.ma + self.mb) * u, g - self.ma / (self.ma + self.mb) * u


def z(v): return complex(v.x, v.y)
def put(v, c): v.x, v.y = c.real, c.imag


def integrate(s, dt):
    put(s.velocity, z(s.velocity) + z(s.force) / s.mass * dt)
    put(s.position, z(s.position) + z(s.velocity) * dt)
    s.angularVelocity += s.torque / s.MoI * dt
    s.alpha += s.angularVelocity * dt


def sphereSphereCollisionHandling(sphereA, sphereB):
    p = Pair(z(sphereA.position), z(sphereB.position), z(sphereA.velocity), z(sphereB.velocity), sphereA.mass, sphereB.mass, sphereA.size + sphereB.size)
    if p.za == p.zb or p.depth < 0:
        return
    put(sphereA.position, p.za + p.n * p.depth / 2)
    put(sphereB.position, p.zb - p.n * p.depth / 2)
    for v, new in zip((sphereA.velocity, sphereB.velocity), p.after(0.9)):
        put(v, new)
