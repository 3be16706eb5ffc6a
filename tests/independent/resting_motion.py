"""What comes to rest, by plain rules that share nothing with the project: a ball on a slope with
friction, and a column of balls above a floor.

In 400 bits, bounce by bounce, until what is left is below 1e-30; then the ball slides and rolls by
the formulas of any textbook, and the column lies.
"""

from __future__ import annotations

from typing import NamedTuple

import gmpy2
import numpy as np
from gmpy2 import mpfr

from crosscheck2d.scenarios.model import Array, Scene

BITS = 400
LEFT = mpfr(10) ** -30  # m/s, and m: slower and nearer is at rest
MOST_EVENTS = 100_000  # of a column, some 20 s


class Ball(NamedTuple):
    """A ball above a wall from `t` s on: the way along the wall, the gap, their speeds, the spin,
    and the accelerations of the way, the gap and the spin."""

    t: mpfr
    way: mpfr
    gap: mpfr
    v: mpfr
    u: mpfr
    spin: mpfr
    a: mpfr
    fall: mpfr
    rate: mpfr

    def at(self, t: mpfr) -> Ball:
        s = t - self.t
        return self._replace(
            t=t,
            way=self.way + self.v * s + self.a * s * s / 2,
            gap=self.gap + self.u * s - self.fall * s * s / 2,
            v=self.v + self.a * s,
            u=self.u - self.fall * s,
            spin=self.spin + self.rate * s,
        )


def clamp(x: mpfr, most: mpfr) -> mpfr:
    return max(-most, min(most, x))


def ball_on_slope(scene: Scene, times: Array) -> tuple[Array, Array]:
    """(k, 3) m, m/s, rad/s: way along the wall from its middle, its speed, and the spin of disk 0
    above wall 0 (on its left); and (k,) the gap."""
    with gmpy2.context(precision=BITS):
        (px, py), (qx, qy) = [[mpfr(float(c)) for c in end] for end in scene.walls[0]]
        length = gmpy2.sqrt((qx - px) ** 2 + (qy - py) ** 2)
        tx, ty = (qx - px) / length, (qy - py) / length
        x, y, vx, vy = (mpfr(float(c)) for c in (*scene.position[0], *scene.velocity[0]))
        gx, gy = (mpfr(float(c)) for c in scene.gravity)
        r, mu, e = (mpfr(float(c)) for c in (scene.radius[0], scene.friction, scene.restitution))
        ratio = mpfr(float(scene.mass[0])) * r * r / mpfr(float(scene.inertia[0]))
        pull, fall, zero = gx * tx + gy * ty, gx * ty - gy * tx, mpfr(0)
        ball = Ball(
            zero,
            (x - px) * tx + (y - py) * ty - length / 2,
            (y - py) * tx - (x - px) * ty - r,
            vx * tx + vy * ty,
            vy * tx - vx * ty,
            mpfr(float(scene.angular_velocity[0])),
            pull,
            fall,
            zero,
        )
        legs = [ball]
        while True:  # each bounce
            s = (ball.u + gmpy2.sqrt(ball.u**2 + 2 * fall * ball.gap)) / fall
            ball = ball.at(ball.t + s)
            kick = clamp(-(ball.v + r * ball.spin) / (1 + ratio), -mu * (1 + e) * ball.u)
            ball = ball._replace(
                gap=zero, u=-e * ball.u, v=ball.v + kick, spin=ball.spin + ratio * kick / r
            )
            legs.append(ball)
            if ball.u < LEFT:
                break
        legs += lying(ball._replace(u=zero, fall=zero), pull, mu * fall, ratio, r)
        rows = []
        for t in times:
            leg = [leg for leg in legs if leg.t <= t][-1].at(mpfr(float(t)))
            rows.append([float(c) for c in (leg.way, leg.v, leg.spin, leg.gap)])
        return np.array(rows)[:, :3], np.array(rows)[:, 3]


def lying(ball: Ball, pull: mpfr, most: mpfr, ratio: mpfr, r: mpfr) -> list[Ball]:
    """The ball on the wall: it slides until its slip ends, then it rolls or slides down."""
    legs, slip = [], ball.v + r * ball.spin
    if abs(slip) > 1000 * LEFT:
        force = -most if slip > 0 else most
        ball = ball._replace(a=pull + force, rate=ratio * force / r)
        legs, change = [ball], pull + (1 + ratio) * force
        if change * slip >= 0:
            return legs
        ball = ball.at(ball.t - slip / change)
    held = -pull / (1 + ratio)
    force = clamp(held, most)
    return [*legs, ball._replace(a=pull + force, rate=ratio * force / r)]


Leg = tuple[mpfr, list[mpfr], list[mpfr], list[bool]]
"""Of a column: from when on, s, its heights m and speeds m/s, and which disks lie."""


def column(scene: Scene, times: Array, order: np.random.Generator) -> Array:
    """(k, n) m, the heights of disks above each other and above the floor y = 0, in order from
    below; only up to where `MOST_EVENTS` lead.

    Contact 0 is that of disk 0 with the floor, contact i that of the disks i - 1 and i. Of contacts
    that touch and approach at once, any may be next.
    """
    with gmpy2.context(precision=BITS):
        n, g, e = scene.n, mpfr(-float(scene.gravity[1])), mpfr(float(scene.restitution))
        y = [mpfr(float(c)) for c in scene.position[:, 1]]
        v = [mpfr(float(c)) for c in scene.velocity[:, 1]]
        m, r = ([mpfr(float(c)) for c in part] for part in (scene.mass, scene.radius))
        rests, now, legs = (
            [False] * n,
            mpfr(0),
            list[Leg](),
        )

        def gap(i: int) -> mpfr:
            return y[i] - r[i] - (y[i - 1] + r[i - 1] if i else 0)

        def opens(i: int) -> mpfr:
            return v[i] - (v[i - 1] if i else 0)

        def wait(i: int) -> mpfr | None:
            if rests[i]:
                return None
            b, c = opens(i), gap(i)
            if c < LEFT**2 and b < 0:
                return mpfr(0)
            if i and not rests[i - 1]:
                return c / -b if b < 0 else None
            return (b + gmpy2.sqrt(b * b + 2 * g * max(c, 0))) / g

        legs.append((now, [*y], [*v], [*rests]))
        for _ in range(MOST_EVENTS):
            if all(rests) or now >= times[-1]:
                break
            waits = [(s, i) for i in range(n) if (s := wait(i)) is not None]
            soonest = min(waits)[0]
            i = int(order.choice([i for s, i in waits if s == soonest]))
            now += soonest
            for k in range(n):
                if not rests[k]:
                    y[k], v[k] = y[k] + v[k] * soonest - g * soonest**2 / 2, v[k] - g * soonest
            below = m[i - 1] if i else None
            change = -(1 + e) * opens(i)
            share = 1 if below is None else below / (m[i] + below)
            v[i] += share * change
            if below is not None:
                v[i - 1] -= (1 - share) * change
                rests[i - 1] = False
            for k in range(n):  # what lies on what lies, and hardly moves, lies
                lies = (k == 0 or rests[k - 1]) and abs(v[k]) < LEFT and gap(k) < LEFT
                rests[k], v[k] = lies, mpfr(0) if lies else v[k]
            legs.append((now, [*y], [*v], [*rests]))
        known = times if all(rests) else times[times <= float(now)]
        return np.array([heights(legs, mpfr(float(t)), g) for t in known])


def heights(legs: list[Leg], t: mpfr, g: mpfr) -> list[float]:
    at, y, v, lies = [leg for leg in legs if leg[0] <= t][-1]
    s = t - at
    return [float(a if rests else a + b * s - g * s * s / 2) for a, b, rests in zip(y, v, lies)]
