"""The event-driven engine for callers in Python: disks, walls, a torus or the exercise's wrap.

It has no step size and no tolerance: contact times are roots, flights are parabolas. It raises
`NoTruth` where the motion has no single continuation.
"""

from __future__ import annotations

from collections import defaultdict
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from crosscheck2d.adapters.event_driven import loop as event_loop
from crosscheck2d.adapters.event_driven.disks import (
    ACCUMULATION,
    BASE,
    DISK,
    END_DISK,
    END_PARTNER,
    GOES_ON,
    LEFT,
    LOG_FULL,
    LOGGED,
    NOBODY,
    NONE,
    REENTRY,
    ROUND_END,
    RUN,
    SPIN,
    STOP,
    Arena,
    Grid,
    Rules,
    Scenery,
    Walls,
    empty_queue,
)
from crosscheck2d.adapters.event_driven.impacts import rotation_at
from crosscheck2d.scenarios.model import Array, Scene
from crosscheck2d.scenarios.no_truth import NoTruth

LOG_ROWS = 1 << 14
EVENTS = 1 << 14  # in one call of the loop, some ms: in between Python can handle Ctrl-C
MOST = 400_000  # events, less than a second, between two checks whether there are too many
# the events allowed in all, and for each disk, while the fastest disk moves by the smallest radius
IN_ALL, PER_DISK = 1e4, 1e2
MOST_AHEAD = 1e9  # events, about ten minutes, that may remain at the present rate
SLOWEST = 0.9999  # up to this restitution the bounces of a disk are played until they die out
# a factor above rounding: cells are wider than the largest disk, so that contacts are always in
# neighbouring cells
WIDER = 1 + 1e-9
# relative to the largest coordinate, a few units in the last place: how far rounding moves the ends
# of two walls off their line; and the largest angle, rad, between two walls of one surface
ROUNDED, STRAIGHT = 2.0**-50, 1e-12
Line = tuple[Fraction | None, Fraction]  # a key of `line_of`


class EventEngine:
    """Plays a scene exactly, except for the rounding of float64.

    torus: (2, 2) m, low and high corner of a periodic box in place of walls. cell: m, the least
    side of a grid cell; it changes the speed only. Raises `NoTruth` for an invalid
    start: disks that overlap each other or a wall, or touch and approach; a disk larger than its
    box; a torus narrower than three diameters.
    """

    def __init__(self, scene: Scene, torus: ArrayLike | None = None, cell: float = 0.0) -> None:
        box = None if torus is None else np.asarray(torus, float)
        refuse_box(scene, box)
        self.scene = scene
        (grid, low), rules = grid_of(scene, box, cell), rules_of(scene, refuse_walls(scene))
        position = scene.position
        if box is not None:
            position = low + np.mod(position - low, box[1] - low)
        self.arena = Arena(
            disks_of(scene, position, low),
            empty_queue(scene.n),
            head=np.full(np.prod(grid.shape), NONE),
            near=np.full(scene.n + 9, NONE),
            grid=grid,
            rules=rules,
            walls=walls_of(scene, grid, low),
            clock=np.zeros(2),
            log=np.zeros((LOG_ROWS, 4)),
            counters=np.zeros(4, np.int64),
            runs=np.zeros(scene.n, RUN).view(np.recarray),
            spins=spins_of(scene),
        )
        self.kept: list[Array] = []
        # events since the last call of refuse_too_many, and the simulated time of that, s
        self.spent, self.since = 0, 0.0
        self.scenery: Scenery = (
            (True,) if rules.falling or rules.wrapped or len(scene.walls) or rules.friction else ()
        )
        event_loop.begin(self.arena.disks, self.arena.head, self.arena.tree, grid)
        self.refuse_pairs()

    def advance(self, until: float) -> None:
        """Carry out all events up to `until` s; raises `NoTruth` if the answer ends before."""
        status, counters = GOES_ON, self.arena.counters
        while status in (GOES_ON, LOG_FULL):
            counters[LEFT] = EVENTS
            status = event_loop.advance(self.arena, self.scenery, until)
            self.spent += EVENTS - int(counters[LEFT])
            if counters[LOGGED]:
                self.kept.append(self.arena.log[: counters[LOGGED]].copy())
                counters[LOGGED] = 0
            if self.spent >= MOST:
                self.refuse_too_many(until)
        at, i, j = (
            float(self.arena.clock[STOP]),
            int(counters[END_DISK]),
            int(counters[END_PARTNER]),
        )
        when = f"at {at:.9g} s"
        if status == ACCUMULATION:
            on = self.partners(i, j, at)
            raise NoTruth(f"the collisions of disk {i} on {on} accumulate {when}", at)
        if status == REENTRY:
            raise NoTruth(f"disk {i} re-enters on top of disk {j} {when}", at)
        if status == ROUND_END:
            where = f"disk {i} slides round the end of wall {-1 - j} {when}"
            raise NoTruth(f"{where}: its path there is no parabola", at)

    def refuse_too_many(self, until: float) -> None:
        """Raise `NoTruth` if the latest events cover less simulated time than is plausible, or if
        too many remain up to `until` s.

        While the fastest disk moves or falls by its radius, a gas has about ten events per disk; a
        disk that bounces in a gap has more, the narrower the gap. `PER_DISK` and `IN_ALL` are far
        above both.
        """
        disks, radius = self.arena.disks, float(self.scene.radius.min())
        now = min(until, float(self.arena.clock[BASE] + self.arena.tree[1].time))
        speed = np.hypot(disks["vx"], disks["vy"]).max()
        acceleration = np.hypot(disks["free_ax"], disks["free_ay"]).max()
        took, events = now - self.since, IN_ALL + PER_DISK * self.scene.n
        rate = events * (speed / radius + np.sqrt(acceleration / radius))
        # The negation also catches nan.
        if not (self.spent <= rate * took and self.spent * (until - now) <= MOST_AHEAD * took):
            span = f"{self.spent} events from {self.since:.9g} s to {now:.9g} s"
            raise NoTruth(f"{span} are too many to follow up to {until:.9g} s", now)
        self.spent, self.since = 0, now

    def partners(self, i: int, last: int, since: float) -> str:
        """The partners of disk `i` in collisions since a time, in words; `last`: the latest one."""
        log = np.concatenate([np.empty((0, 4)), *self.kept[-2:]])
        log = log[log[:, 0] >= since * (1 - 1e-12)]
        partners = {last, *map(int, log[log[:, 1] == i, 2]), *map(int, log[log[:, 2] == i, 1])}
        disks = [f"disk {j}" for j in sorted(partners) if j >= 0]
        walls = [f"wall {-1 - j}" for j in sorted(partners, reverse=True) if j < 0]
        return " and ".join(disks + walls)

    def accelerate(self, disk: int, at: float, acceleration: Array, rate: float = 0.0) -> None:
        """Set the acceleration (2,) m/s2 of a disk that is not static, and its angular acceleration
        `rate` rad/s2, used with friction only; from `at` s on, which `advance` has reached."""
        self.arena = self.arena._replace(rules=self.arena.rules._replace(falling=True, mixed=True))
        self.scenery = (True,)
        ax, ay = acceleration
        event_loop.accelerate(self.arena, self.scenery, disk, at, ax, ay, rate)

    def motion_at(self, at: float) -> tuple[Array, Array]:
        """Position and velocity (n, 2) m, m/s at `at` s, which `advance` has reached; changes
        nothing."""
        out = np.empty((self.scene.n, 4))
        event_loop.motion_at(self.arena.disks, self.arena.clock[BASE], at, out)
        return out[:, :2], out[:, 2:]

    def rotation_at(self, at: float) -> tuple[Array, Array]:
        """Angle and angular velocity (n,) rad, rad/s at `at` s of a scene with friction, else those
        of the start."""
        out = np.empty((self.scene.n, 2))
        rotation_at(self.arena.spins, self.arena.clock[BASE], at, out)
        return out[:, 0], out[:, 1]

    @property
    def collisions(self) -> Array:
        """(h, 4): t s, disk, other disk or -1 - wall, impulse N s, of all collisions so far."""
        return np.concatenate([np.empty((0, 4)), *self.kept])

    def refuse_pairs(self) -> None:
        """Raise `NoTruth` if two disks overlap, or touch and approach; decided in rationals,
        because float64 cannot decide it."""
        disks, grid = self.arena.disks, self.arena.grid
        near = np.empty((8 * self.scene.n, 2), np.int64)
        count = event_loop.near_pairs(disks, self.arena.head, grid, WIDER - 1, near)
        for i, j in near[:count]:
            a, b = disks[i], disks[j]
            apart = [Fraction(b.x) - Fraction(a.x), Fraction(b.y) - Fraction(a.y)]
            if grid.torus:
                apart = [d - Fraction(s) * round(d / Fraction(s)) for d, s in zip(apart, grid.span)]
            speeds = [Fraction(b.vx) - Fraction(a.vx), Fraction(b.vy) - Fraction(a.vy)]
            reach = Fraction(a.radius) + Fraction(b.radius)
            gap = sum(d * d for d in apart) - reach * reach
            closing = sum(d * v for d, v in zip(apart, speeds))
            if gap < 0:
                overlap = -float(gap) / (float(reach) + np.hypot(float(apart[0]), float(apart[1])))
                by = f"{overlap:.3g} m"
                raise NoTruth(f"disks {i} and {j} overlap by {by} at the start: move one {by} away")
            if gap == 0 and closing < 0:
                fast = f"{-float(closing) / float(reach):.3g} m/s"
                both = f"disks {i} and {j} touch and approach at {fast}"
                raise NoTruth(f"{both} at the start: leave a gap")


def refuse_walls(scene: Scene) -> bool:
    """Whether a disk that is not static touches a wall; raises `NoTruth` if one overlaps a wall, or
    touches it and moves into it."""
    leaning = False
    for w, (start, end) in enumerate(scene.walls):
        along = end - start
        share = np.clip((scene.position - start) @ along / (along @ along), 0, 1)
        distance = np.hypot(*(scene.position - start - share[:, None] * along).T)
        for i in np.flatnonzero(~scene.static & (distance < scene.radius * WIDER)):
            offset, closing = exact_offset(scene.position[i], scene.velocity[i], start, end)
            gap = offset - Fraction(scene.radius[i]) ** 2
            if gap < 0:
                overlap = scene.radius[i] - float(offset) ** 0.5
                by = f"{max(overlap, -float(gap) / (2 * scene.radius[i])):.3g} m"
                raise NoTruth(f"disk {i} overlaps wall {w} by {by} at the start: move it {by} away")
            if gap == 0 and closing < 0:
                both = f"disk {i} touches wall {w} and moves into it"
                raise NoTruth(f"{both} at the start: leave a gap")
            leaning |= gap == 0
    return leaning


def exact_offset(
    position: Array, velocity: Array, start: Array, end: Array
) -> tuple[Fraction, Fraction]:
    """Squared distance of a point from a segment, and half its rate of change, in rationals."""
    p, v, a, b = ([Fraction(x) for x in point] for point in (position, velocity, start, end))
    u, d = [b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]
    share = (d[0] * u[0] + d[1] * u[1]) / (u[0] ** 2 + u[1] ** 2)
    share = min(max(share, Fraction(0)), Fraction(1))
    away = [d[0] - share * u[0], d[1] - share * u[1]]
    return away[0] ** 2 + away[1] ** 2, away[0] * v[0] + away[1] * v[1]


def refuse_box(scene: Scene, torus: Array | None) -> None:
    """Raise `NoTruth` if the box is too narrow for its largest disk, `ValueError` if the torus is
    no box or the scene has walls."""
    widest = 2 * float(scene.radius.max())
    if torus is not None:
        if scene.wrap is not None or len(scene.walls):
            raise ValueError("a torus has neither walls nor the exercise's wrap")
        if torus.shape != (2, 2) or not (torus[0] < torus[1]).all():
            raise ValueError("torus must be [low, high], low below high")
        if (narrow := float((torus[1] - torus[0]).min())) < 3 * widest * WIDER:
            three = f"three diameters of its largest disk are {3 * widest:g} m"
            raise NoTruth(f"the torus is {narrow:g} m wide: {three}")
    if scene.wrap is not None and (narrow := float((scene.wrap[1] - scene.wrap[0]).min())) < widest:
        disk = f"its largest disk has a diameter of {widest:g} m"
        raise NoTruth(f"the box is {narrow:g} m wide: {disk}")


def rules_of(scene: Scene, leaning: bool) -> Rules:
    falling, walled = bool(scene.gravity.any()), len(scene.walls) > 0
    # A disk that rests on a wall does not fall with the others; at e = 1 only a disk that touches a
    # wall at the start can rest.
    rests = walled and (leaning or scene.restitution < 1)
    # A bounce shorter than 1 / (1 - e) units in the last place of the time gains as much by
    # rounding as it loses by restitution.
    lost = 1 - min(scene.restitution, SLOWEST) if scene.restitution < 1 else 1
    return Rules(
        restitution=float(scene.restitution),
        falling=falling,
        mixed=falling and (rests or bool(scene.static.any())),
        wrapped=scene.wrap is not None,
        lasting=scene.restitution > SLOWEST,
        accumulation_ulps=1e3 / lost,
        friction=float(scene.friction),
    )


def walls_of(scene: Scene, grid: Grid, low: Array) -> Walls:
    side = np.array(grid.side)
    cells = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), -1).reshape(-1, 2)
    centre = low + side * (cells + 0.5)
    # of a disk anywhere in the cell of a centre
    reach = (np.hypot(*side) / 2 + scene.radius.max()) * WIDER
    near = np.zeros((len(centre), len(scene.walls)), bool)
    for w, (start, end) in enumerate(scene.walls):
        along = end - start
        share = np.clip((centre - start) @ along / (along @ along), 0, 1)
        near[:, w] = np.hypot(*(centre - start - share[:, None] * along).T) <= reach
    along = scene.walls[:, 1] - scene.walls[:, 0]
    length = np.hypot(*along.T) if len(along) else np.zeros(0)
    return Walls(
        wrap=np.zeros((2, 2)) if scene.wrap is None else np.array(scene.wrap),
        segment=np.column_stack([scene.walls[:, 0], along / length[:, None], length]),
        surface=surfaces(scene.walls),
        first=np.append(0, near.sum(axis=1).cumsum()).astype(np.int64),
        of=np.nonzero(near)[1].astype(np.int64),
    )


def surfaces(walls: Array) -> NDArray[np.int64]:
    """(w,) the surface that each wall belongs to, as in `Walls`, named after one of its walls.

    In line is exact, in rationals; of walls that share an end, also if only rounding keeps them
    from it: else a resting disk would turn about the joint, or fall through it.
    """
    lines = defaultdict[Line, list[tuple[float, float, int]]](list)
    for w, wall in enumerate(walls.tolist()):
        line, axis = line_of(wall)
        low, high = sorted(end[axis] for end in wall)
        lines[line].append((low, high, w))
    number = np.arange(len(walls))
    for along in lines.values():
        reach, first = -np.inf, -1
        for low, high, w in sorted(along):
            first = w if low > reach else first
            number[w], reach = first, max(reach, high)
    ending = defaultdict[tuple[float, ...], list[int]](list)
    for w, wall in enumerate(walls.tolist()):
        for end in wall:
            ending[tuple(end)].append(w)
    span = walls[:, 1] - walls[:, 0]
    heading = np.arctan2(span[:, 1], span[:, 0]) % np.pi
    for there in ending.values():
        around = sorted(there, key=lambda w: heading[w])  # of many, neighbours alone are in line
        for a, b in zip(around, [*around[1:], around[0]]):
            if number[a] != number[b] and nearly_in_line(walls[a], walls[b]):
                number[number == number[b]] = number[a]
    return number


def nearly_in_line(one: Array, other: Array) -> bool:
    """Whether two walls (2, 2) that share an end are in line but for the rounding of their ends, at
    an angle that a disk cannot tell."""
    (ax, ay), (bx, by) = (wall[1] - wall[0] for wall in (one, other))
    across, lengths = abs(ax * by - ay * bx), (np.hypot(ax, ay), np.hypot(bx, by))
    if across > STRAIGHT * lengths[0] * lengths[1]:
        return False
    return bool(across <= ROUNDED * np.abs([one, other]).max() * sum(lengths))


def line_of(wall: list[list[float]]) -> tuple[Line, int]:
    """A key for the line of a wall, the same for all walls on it: slope and intercept in rationals,
    of x over y if it is upright; and the axis along which it extends."""
    (px, py), (qx, qy) = [[Fraction(x) for x in end] for end in wall]
    if px == qx:
        return (None, px), 1
    slope = (qy - py) / (qx - px)
    return (slope, py - slope * px), 0


def grid_of(scene: Scene, torus: Array | None, cell: float) -> tuple[Grid, Array]:
    least = max(2 * scene.radius.max() * WIDER, cell)
    corners = np.empty((0, 2)) if scene.wrap is None else scene.wrap
    points = np.concatenate([scene.position, scene.walls.reshape(-1, 2), corners])
    low, high = (points.min(axis=0), points.max(axis=0)) if torus is None else torus
    extent = high - low
    # At most about four cells per disk, also in a sparse scene.
    most = 4 * scene.n
    side = np.full(2, max(least, np.sqrt(extent.prod() / most), extent.max() / most))
    if torus is None:
        low, shape = low - side, np.ceil(extent / side).astype(np.int64) + 3
        span, shift = side * shape, np.zeros(2)
    else:
        shape = np.maximum(np.floor(extent / side), 3).astype(np.int64)
        side, span, shift = extent / shape, extent, extent
    return Grid(pair(side), pair(shape), pair(span), pair(shift), torus is not None), low


def pair(array: NDArray[Any]) -> Any:
    return tuple(array.tolist())


def disks_of(scene: Scene, position: Array, low: Array) -> NDArray[np.void]:
    n, size = scene.n, DISK.itemsize
    room = np.zeros(size * n + 64, np.uint8)
    skip = -room.ctypes.data % 64  # so that each begins a cache line
    disks = room[skip : skip + size * n].view(DISK)
    disks["x"], disks["y"] = position.T
    disks["vx"], disks["vy"] = scene.velocity.T
    disks["ox"], disks["oy"] = low
    acceleration = np.where(scene.static[:, None], 0.0, scene.gravity)
    disks["ax"], disks["ay"] = disks["free_ax"], disks["free_ay"] = acceleration.T
    disks["radius"], disks["weight"] = scene.radius, 1 / scene.mass
    disks["pair_time"] = disks["own_time"] = np.inf
    disks["last"], disks["wall"], disks["corner"] = NOBODY, -1, -1
    return disks.view(np.recarray)


def spins_of(scene: Scene) -> NDArray[np.void]:
    spins = np.zeros(scene.n, SPIN)
    spins["angle"], spins["spin"] = scene.angle, scene.angular_velocity
    spins["inverse_inertia"] = np.where(scene.static, 0.0, 1 / scene.inertia)
    return spins.view(np.recarray)
