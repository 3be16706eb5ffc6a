"""How long a float64 solver can follow an exact motion: the growth of a rounding error of the
initial state, to first order.

Motions whose initial states differ by a rounding error diverge exponentially. Once they have
diverged, a distance to the exact answer tells nothing about a solver: that time is the horizon. It
is computed along the path of the oracle. Each number of the initial state has an independent error
of 2^-52 of the largest one, and its effect is propagated by the derivative of the flights and of
every collision (Dellago, Posch & Hoover, Phys. Rev. E 53, 1485, 1996; here also for parabolas and
for motion along a wall). The derivative is needed to a few per cent only, so it is computed in
float64. A near miss by less than a rounding error has no derivative and is not detected; collisions
whose order the rounding decides are found in `order.py`.

The limit applies to the standard deviation over independent errors of all numbers. The deviation of
one rounded state is normally distributed: it is below the standard deviation in two of three
samples. The horizon of falling_box is 0.409 s; single samples pass the limit at 0.395 to 0.47 s,
most of them at 0.43 to 0.45 s.

The rounding error is relative to the largest coordinate in the scene, even if that belongs to a
disk that the others never meet. At ten times the distance the horizon of the other disks is shorter
by ln 10 growth times: for a gas of eight disks, 2.67 s become 2.39 s when a row of disks at rest,
which none of them meets, is moved from 3 m to 30 m. There the horizon is too short rather than too
long. An error relative to each number itself would be too small: an engine also rounds the
coordinates of the partners and walls of a disk.
"""

from __future__ import annotations

from itertools import takewhile
from typing import NamedTuple

import numpy as np

from crosscheck2d.scenarios.model import Array, Scenario, Scene
from crosscheck2d.scenarios.truth.oracle.bodies import Hop, Leg
from crosscheck2d.scenarios.truth.oracle.path import Event, Path

EPS = float(np.finfo(float).eps)
DIVERGED = 1e-9
"""In radii of a disk: if the standard deviation of its position is larger, it has diverged."""
# this many bounces of a series that dies out are computed; float64 cannot resolve later ones
BOUNCES = 64


def roundings(scene: Scene) -> tuple[Array, Array, Array]:
    """Initial deviations of position and velocity (n, d, 2) and of spin (n, d), one for each of d
    numbers of the initial state: 2^-52 of the largest coordinate, speed or spin.

    Where all centres lie on a line along an axis and no disk moves off it, the other coordinate has
    no rounding error; with friction a disk may move off. Without friction spins have no effect.
    """
    lined = (
        (scene.position == scene.position[0]).all(axis=0)
        & ~scene.velocity.any(axis=0)
        & (scene.gravity == 0)
        & (scene.friction == 0)
    )
    free = np.argwhere(~scene.static[:, None] & ~lined)
    turns = np.flatnonzero(~scene.static) if scene.friction else np.zeros(0, int)
    dx, dv = np.zeros((2, scene.n, 2 * len(free) + len(turns), 2))
    dw = np.zeros((scene.n, 2 * len(free) + len(turns)))
    for k, (i, axis) in enumerate(free):
        dx[i, k, axis] = EPS * np.abs(scene.position).max()
        dv[i, len(free) + k, axis] = EPS * np.abs(scene.velocity).max()
    # The speed of a rim comes from the spin of its disk, or from a speed by friction.
    rim = max(np.abs(scene.velocity).max(), np.abs(scene.radius * scene.angular_velocity).max())
    for k, i in enumerate(turns):
        dw[i, 2 * len(free) + k] = EPS * rim / scene.radius[i]
    return dx, dv, dw


class Body(NamedTuple):
    """One side of a collision: its motion along the path, the deviations, its acceleration before
    and after, 1/mass; and for friction its rotation likewise, its radius and 1/inertia.

    Shapes (2,), m, m/s, m/s2; `dx` and `dv` (d, 2); `dw` (d,).
    """

    x: Array
    v: Array
    dx: Array
    dv: Array
    before: Array
    after: Array
    weight: float
    spin: float = 0.0
    dw: Array | float = 0.0
    rates: tuple[float, float] = (0.0, 0.0)  # before and after
    radius: float = 0.0
    inverse_inertia: float = 0.0


class TangentVectors:
    """Deviations of a motion, to first order, carried along a path: one for a rounding error of
    each of the d numbers of the initial state."""

    def __init__(self, scenario: Scenario, path: Path) -> None:
        scene = scenario.scene
        self.scene, self.path, self.moving = scene, path, np.flatnonzero(~scene.static).tolist()
        # (n,) s, up to when each disk has been carried; its leg then; and its deviations then:
        # (n, d, 2) m and m/s, (n, d) rad/s
        self.t, self.leg = np.zeros(scene.n), [0] * scene.n
        self.dx, self.dv, self.dw = roundings(scene)
        # (n,) s, (n, 2) m/s, (n,) rad/s: the last collision of each disk, its velocity after that
        self.collided_at, self.v = np.full(scene.n, -1.0), np.zeros((scene.n, 2))
        self.spin = np.zeros(scene.n)
        turns = ~scene.static & np.isfinite(scene.inertia)
        self.inverse_inertia = np.where(turns, 1 / scene.inertia, 0.0)
        # s, the latest collision; (d,) s, its delay for each deviation
        self.instant, self.late = 0.0, np.zeros(self.dx.shape[1])
        self.starts_and_stops = {
            edge for thrust in scenario.thrusts for edge in (thrust.start, thrust.stop)
        }
        self.diverged = np.inf  # s, when the first disk diverges

    def carry(self, i: int, until: float) -> None:
        legs = self.path.legs[i]
        while self.leg[i] + 1 < len(legs) and (t := float(legs[self.leg[i] + 1].t)) < until:
            self.fly(i, t)
            self.change_leg(i, t)
        self.fly(i, until)

    def fly(self, i: int, until: float) -> None:
        hop = self.path.legs[i][self.leg[i]].hop
        if hop is not None:
            self.bounce(i, hop)
        here, drift = self.dx[i], self.dv[i]
        since, limit = until - self.t[i], DIVERGED * self.scene.radius[i]
        # |dx + dv s|^2 = limit^2, summed over the deviations: they are independent, so that their
        # variances add.
        room, slope, growth = limit**2 - (here**2).sum(), (here * drift).sum(), (drift**2).sum()
        if not room > 0:  # or nan, after a graze that no float64 can follow
            self.diverged = min(self.diverged, self.t[i])
        elif room < since * (speed := slope + np.sqrt(slope**2 + growth * room)):
            self.diverged = min(self.diverged, self.t[i] + room / speed)
        self.dx[i], self.t[i] = here + drift * since, until

    def bounce(self, i: int, hop: Hop) -> None:
        """Note when disk i diverges along the normal of a wall on which its bounces die out; then
        keep only the deviation along the wall.

        Bounce k begins at u s_k, s_k = (2 / g) (1 - e^k) / (1 - e), with the speed u e^k
        (`record.along`). If the first one begins dt late and at a speed larger by du, bounce k
        begins dt + du s_k late and lasts 2 du e^k / g longer.
        """
        normal, u, g = np.array([float(hop.nx), float(hop.ny)]), float(hop.speed), float(hop.fall)
        e, k = self.scene.restitution, np.arange(BOUNCES)[:, None]
        begins = 2 / g * (1 - e**k) / (1 - e)
        # at e = 1e-308 a bounce has no speed that float64 could divide by
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            dt = -self.dx[i] @ normal / u
            du = self.dv[i] @ normal - g * dt
            off = u * e**k * np.abs(dt + begins * du) + 2 * u / g * e ** (2 * k) * np.abs(du)
        if (far := (off**2).sum(axis=1) > (DIVERGED * self.scene.radius[i]) ** 2).any():
            self.diverged = min(self.diverged, self.t[i] + u * float(begins[int(far.argmax()), 0]))
        for part in (self.dx, self.dv):
            part[i] -= np.outer(part[i] @ normal, normal)

    def change_leg(self, i: int, t: float) -> None:
        before, leg = self.path.legs[i][self.leg[i] : self.leg[i] + 2]
        self.leg[i] += 1
        # `collide` has done this for a collision, and a thrust starts and stops at given times.
        if t != self.collided_at[i] and t not in self.starts_and_stops:
            late = self.release_delay(i, before, t)
            self.dv[i] += np.outer(late, acceleration(before) - acceleration(leg))
            self.dw[i] += late * (rate(before) - rate(leg))
        for contact in leg.held:
            self.hold(i, contact.j if contact.kind == "wall" and len(leg.held) == 1 else None)

    def release_delay(self, i: int, leg: Leg, t: float) -> Array:
        """(d,) s: at the end of its wall, at the stroke of another disk, or where its slip ends."""
        late: Array
        if leg.turn is not None and leg.held and leg.held == self.path.legs[i][self.leg[i]].held:
            contact, arm = leg.held[0], float(self.scene.radius[i])
            start, end = self.scene.walls[contact.j]
            way, arm = (end - start) / np.hypot(*(end - start)), arm * contact.side
            slower = float(acceleration(leg) @ way + arm * rate(leg))
            if not slower:  # no slip ends: a group of disks begins or ends
                return np.zeros_like(self.late)
            late = -(self.dv[i] @ way + arm * self.dw[i]) / slower
            return late
        walls = [self.scene.walls[c.j] for c in leg.held if c.kind == "wall"]
        spans = [end - start for start, end in walls]
        if len(spans) == 1 and (speed := float(spans[0] @ along(leg, t)[1])):
            late = -self.dx[i] @ spans[0] / speed
            return late
        return self.late if t == self.instant else np.zeros_like(self.late)

    def hold(self, i: int, wall: int | None) -> None:
        way = np.zeros(2)
        if wall is not None:
            start, end = self.scene.walls[wall]
            way = (end - start) / np.hypot(*(end - start))
        for part in (self.dx, self.dv):
            part[i] = np.outer(part[i] @ way, way)

    def collide(self, event: Event) -> None:
        """Carry both sides through a collision; a contact that was closed before collides at the
        same time as the new contact of that instant.

        To first order: the gap closes `late` s later, with a tilted normal and another closing
        speed, hence another impulse. For these `late` s a body flies on with its old velocity.
        """
        t, e, impulse = float(event.t), self.scene.restitution, float(event.impulse)
        if t > self.instant:
            self.instant, self.late = t, np.zeros_like(self.late)
        one = self.body(event.i, t)
        two, reach = self.other(event, one)
        way, dv, share = two.x - one.x, two.v - one.v, one.weight + two.weight
        normal = way / np.hypot(*way)
        if event.new and t > 0:
            self.late = self.delay(event, one, two)
        late = self.late[:, None]
        shift = two.dx - one.dx + dv * late
        tilt = (shift - np.outer(shift @ normal, normal)) / reach
        faster = tilt @ dv + (two.dv - one.dv + (two.before - one.before) * late) @ normal
        more = -(1 + e) / share * faster
        kick, change = impulse * normal, impulse * tilt + np.outer(more, normal)
        friction, d_friction = 0.0, np.zeros_like(more)
        if self.scene.friction:
            friction, d_friction = self.friction_impulse(one, two, normal, tilt, impulse, more)
            tangent, turned = perpendicular(normal), perpendicular(tilt)
            kick = kick + friction * tangent
            change = change + friction * turned + np.outer(d_friction, tangent)
        for disk, body, side in ((event.i, one, -one.weight), (event.j, two, two.weight)):
            if side:
                self.dx[disk] -= side * kick * late
                self.dv[disk] += side * change + (body.before - body.after) * late
                self.v[disk], self.collided_at[disk] = body.v + side * kick, t
                arm = body.radius * body.inverse_inertia
                self.dw[disk] += (body.rates[0] - body.rates[1]) * self.late - arm * d_friction
                self.spin[disk] = body.spin - arm * friction

    def delay(self, event: Event, one: Body, two: Body) -> Array:
        way = two.x - one.x
        # normal.dv itself would lose its digits in a grazing collision
        closing = -float(event.impulse) * (one.weight + two.weight) / (1 + self.scene.restitution)
        late: Array = -(two.dx - one.dx) @ (way / np.hypot(*way)) / closing
        return late

    def friction_impulse(
        self, one: Body, two: Body, normal: Array, tilt: Array, impulse: float, more: Array
    ) -> tuple[float, Array]:
        """N s, the impulse of friction on `two` along the tangent, and its deviations (d,); see
        `oracle/ties.py`.

        tilt, more: (d, 2) and (d,) N s, the deviations of the normal and of the impulse.
        """
        tangent, dv, late = perpendicular(normal), two.v - one.v, self.late[:, None]
        inverse_mass = one.weight + two.weight
        slip = float(tangent @ dv)
        slips = (two.dv - one.dv + (two.before - one.before) * late) @ tangent
        slips += perpendicular(tilt) @ dv
        for body in (one, two):
            inverse_mass += body.radius**2 * body.inverse_inertia
            slip -= body.radius * body.spin
            slips -= body.radius * (body.dw + body.rates[0] * self.late)
        most = self.scene.friction * impulse
        if abs(slip) <= most * inverse_mass:
            return -slip / inverse_mass, -slips / inverse_mass
        way = -1.0 if slip > 0 else 1.0
        return way * most, way * self.scene.friction * more

    def body(self, i: int, t: float) -> Body:
        if not self.scene.static[i]:
            self.carry(i, t)
        legs, k = self.path.legs[i], self.leg[i]
        x, v = along(legs[k], t)
        # The last one from this instant on: a disk that lands may roll at once.
        following = [legs[k], *takewhile(lambda leg: float(leg.t) == t, legs[k + 1 :])][-1]
        after = acceleration(following)
        collided = self.collided_at[i] == t
        before, v = (after, self.v[i]) if collided else (acceleration(legs[k]), v)
        weight = 0.0 if self.scene.static[i] else 1 / float(self.scene.mass[i])
        body = Body(x, v, self.dx[i], self.dv[i], before, after, weight)
        turn = legs[k].turn
        if turn is None:
            return body
        rates = rate(legs[k]), rate(following)
        return body._replace(
            spin=self.spin[i] if collided else float(turn.spin) + rates[0] * (t - float(legs[k].t)),
            dw=self.dw[i],
            rates=(rates[1], rates[1]) if collided else rates,
            radius=float(self.scene.radius[i]),
            inverse_inertia=float(self.inverse_inertia[i]),
        )

    def other(self, event: Event, one: Body) -> tuple[Body, float]:
        """The other side, and the distance, m, over which a shift tilts the normal: inf at a wall's
        face."""
        if event.j >= 0:
            two = self.body(event.j, float(event.t))
            return two, float(np.hypot(*(two.x - one.x)))
        start, end = self.scene.walls[-1 - event.j]
        share = (one.x - start) @ (end - start) / ((end - start) @ (end - start))
        foot, still = start + np.clip(share, 0, 1) * (end - start), np.zeros(2)
        nothing = np.zeros_like(one.dx)
        reach = np.inf if 0 <= share <= 1 else float(np.hypot(*(foot - one.x)))
        return Body(foot, still, nothing, nothing, still, still, 0.0), reach


def along(leg: Leg, t: float) -> tuple[Array, Array]:
    """Without the bounces along the normal."""
    since, x, y, vx, vy, ax, ay = t - float(leg.t), *map(float, leg[1:7])
    v, a = np.array([vx, vy]), np.array([ax, ay])
    return np.array([x, y]) + (v + a * since / 2) * since, v + a * since


def rate(leg: Leg) -> float:
    return 0.0 if leg.turn is None else float(leg.turn.rate)


def perpendicular(vector: Array) -> Array:
    turned: Array = vector[..., ::-1] * [-1.0, 1.0]
    return turned


def acceleration(leg: Leg) -> Array:
    a = np.array([float(leg.ax), float(leg.ay)])
    if leg.hop is None:
        return a
    return a - float(leg.hop.fall) * np.array([float(leg.hop.nx), float(leg.hop.ny)])
