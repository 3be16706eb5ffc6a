"""The float64 event engine: disks, walls, a torus or the exercise's wrap, from hit to hit without time steps.

It has no step size and no tolerance: contact times are roots, flights are parabolas. Where the motion has no single
continuation it says so (`NoTruth`) rather than go on.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenarios import event_loop
from scenarios.event_kernels import (
    ACCUMULATION,
    AX,
    HITS,
    LAST,
    LOG_FULL,
    NOBODY,
    OWN_TIME,
    OX,
    PAIR_TIME,
    RADIUS,
    REENTRY,
    WEIGHT,
    Disks,
    Grid,
    Rules,
)
from scenarios.event_queue import empty_queue
from scenarios.model import Array, Scene
from scenarios.no_truth import NoTruth

LOG_ROWS = 1 << 14
WIDER = 1 + 1e-9  # cells are wider than the largest disk by more than rounding, so that contacts are always next door


class EventEngine:
    """Plays a scene exactly, but for the rounding of float64.

    torus: (2, 2) m, low and high corner of a periodic box in place of walls. cell: m, the least side of a grid cell;
    it changes the speed only. Raises `NoTruth` where the start is no start: disks that overlap each other or a wall
    or touch and close in, a disk larger than its box, a torus narrower than three diameters.
    """

    def __init__(self, scene: Scene, torus: ArrayLike | None = None, cell: float = 0.0) -> None:
        box = None if torus is None else np.asarray(torus, float)
        refuse_box(scene, box)
        refuse_walls(scene)
        self.scene = scene
        self.rules = rules_of(scene)
        self.grid, low = grid_of(scene, box, cell)
        position = scene.position if box is None else low + np.mod(scene.position - low, box[1] - low)
        self.disks = disks_of(scene, position, low)
        self.clock, self.told = np.zeros(2), np.zeros(3, np.int64)
        self.log = np.zeros((LOG_ROWS, 4))
        self.kept: list[Array] = []
        event_loop.begin(self.disks, self.grid)
        self.refuse_pairs()

    def advance(self, until: float) -> None:
        """Let all events up to `until` s happen; `NoTruth` if the answer ends before."""
        status = LOG_FULL
        while status == LOG_FULL:
            self.drain()
            status = event_loop.advance(
                self.disks, self.grid, self.rules, self.clock, until, self.log, self.told
            )  # fmt: skip
        self.drain()
        at, i, j = self.clock[event_loop.END], self.told[event_loop.WHO], self.told[event_loop.WHOM]
        if status == ACCUMULATION:
            other = f"disk {j}" if j >= 0 else f"wall {-1 - j}"
            reason = f"{HITS} hits of disk {i}, the last with {other}, come at once at {at:.9g} s: they accumulate"
            raise NoTruth(reason, at)
        if status == REENTRY:
            raise NoTruth(f"disk {i} re-enters on top of disk {j} at {at:.9g} s", at)

    def drain(self) -> None:
        """Keep what is in the log and empty it."""
        if self.told[event_loop.LOGGED]:
            self.kept.append(self.log[: self.told[event_loop.LOGGED]].copy())
            self.told[event_loop.LOGGED] = 0

    def pull(self, disk: int, at: float, acceleration: Array) -> None:
        """From `at` s on, which `advance` has reached, let a disk that is not static accelerate so, (2,) m/s2."""
        self.rules = self.rules._replace(falling=True, mixed=True)
        event_loop.pull(self.disks, self.clock, disk, at, acceleration[0], acceleration[1])

    def look(self, at: float) -> tuple[Array, Array]:
        """Position and velocity (n, 2) m, m/s at `at` s, which `advance` has reached; nothing changes by looking."""
        out = np.empty((self.scene.n, 4))
        event_loop.look(self.disks, self.clock, at, out)
        return out[:, :2], out[:, 2:]

    @property
    def hits(self) -> Array:
        """(h, 4): t s, disk, other disk or -1 - wall, impulse N s, of all hits so far."""
        return np.concatenate([np.empty((0, 4)), *self.kept])

    def refuse_pairs(self) -> None:
        """`NoTruth` if two disks overlap, or touch and close in, judged in rationals: floats cannot tell."""
        found = np.empty((8 * self.scene.n, 2), np.int64)
        count = event_loop.near_pairs(self.disks, self.grid, WIDER - 1, found)
        for i, j in found[:count]:
            refuse_pair(self.disks.row, self.grid, int(i), int(j))


def refuse_pair(row: Array, grid: Grid, i: int, j: int) -> None:
    """`NoTruth` if disks i and j overlap, or touch and close in."""
    apart = [Fraction(row[j, axis]) - Fraction(row[i, axis]) for axis in range(2)]
    if grid.torus:
        apart = [d - Fraction(span) * round(d / Fraction(span)) for d, span in zip(apart, grid.span)]
    reach = Fraction(row[i, RADIUS]) + Fraction(row[j, RADIUS])
    gap = sum(d * d for d in apart) - reach * reach
    closing = sum(d * (Fraction(row[j, 2 + axis]) - Fraction(row[i, 2 + axis])) for axis, d in enumerate(apart))
    if gap < 0:
        overlap = -float(gap) / (float(reach) + np.hypot(float(apart[0]), float(apart[1])))
        raise NoTruth(f"disks {i} and {j} overlap by {overlap:.3g} m at the start: move one {overlap:.3g} m away")
    if gap == 0 and closing < 0:
        speed = -float(closing) / float(reach)
        raise NoTruth(f"disks {i} and {j} touch and close in at {speed:.3g} m/s at the start: leave a gap")


def refuse_walls(scene: Scene) -> None:
    """`NoTruth` if a disk that can move overlaps a wall, or touches it and closes in."""
    for w, (start, end) in enumerate(scene.walls):
        along = end - start
        share = np.clip((scene.position - start) @ along / (along @ along), 0, 1)
        distance = np.hypot(*(scene.position - start - share[:, None] * along).T)
        for i in np.flatnonzero(~scene.static & (distance < scene.radius * WIDER)):
            offset, closing = exact_offset(scene.position[i], scene.velocity[i], start, end)
            gap = offset - Fraction(scene.radius[i]) ** 2
            if gap < 0:
                overlap = scene.radius[i] - float(offset) ** 0.5
                by = max(overlap, -float(gap) / (2 * scene.radius[i]))
                raise NoTruth(f"disk {i} overlaps wall {w} by {by:.3g} m at the start: move it {by:.3g} m away")
            if gap == 0 and closing < 0:
                raise NoTruth(f"disk {i} touches wall {w} and closes in at the start: leave a gap")


def exact_offset(position: Array, velocity: Array, start: Array, end: Array) -> tuple[Fraction, Fraction]:
    """Squared distance of a point from a segment, and half the rate at which it grows, in rationals."""
    p, v, a, b = ([Fraction(x) for x in point] for point in (position, velocity, start, end))
    u, d = [b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]
    share = min(max((d[0] * u[0] + d[1] * u[1]) / (u[0] ** 2 + u[1] ** 2), Fraction(0)), Fraction(1))
    away = [d[0] - share * u[0], d[1] - share * u[1]]
    return away[0] ** 2 + away[1] ** 2, away[0] * v[0] + away[1] * v[1]


def refuse_box(scene: Scene, torus: Array | None) -> None:
    """`NoTruth` for a box too narrow for its largest disk, `ValueError` for a torus that is no box or has walls."""
    widest = 2 * float(scene.radius.max())
    if torus is not None:
        if scene.wrap is not None or len(scene.walls):
            raise ValueError("a torus has neither walls nor the exercise's wrap")
        if torus.shape != (2, 2) or not (torus[0] < torus[1]).all():
            raise ValueError("torus must be [low, high], low below high")
        if (narrow := float((torus[1] - torus[0]).min())) < 3 * widest * WIDER:
            raise NoTruth(f"the torus is {narrow:g} m wide: three diameters of its largest disk are {3 * widest:g} m")
    if scene.wrap is not None and (narrow := float((scene.wrap[1] - scene.wrap[0]).min())) < widest:
        raise NoTruth(f"the box is {narrow:g} m wide: its largest disk has a diameter of {widest:g} m")


def rules_of(scene: Scene) -> Rules:
    """The scene's physics as the kernels take it."""
    along = scene.walls[:, 1] - scene.walls[:, 0]
    length = np.hypot(*along.T) if len(along) else np.zeros(0)
    falling = bool(scene.gravity.any())
    wrap = np.zeros((2, 2)) if scene.wrap is None else np.array(scene.wrap)
    return Rules(
        restitution=float(scene.restitution), falling=falling, mixed=falling and bool(scene.static.any()),
        wrapped=scene.wrap is not None, wrap=wrap,
        walls=np.column_stack([scene.walls[:, 0], along / length[:, None], length]),
    )  # fmt: skip


def grid_of(scene: Scene, torus: Array | None, cell: float) -> tuple[Grid, Array]:
    """The cell grid and its low corner: over the torus, or over all that is there and a cell around it."""
    least = max(2 * scene.radius.max() * WIDER, cell)
    corners = np.empty((0, 2)) if scene.wrap is None else scene.wrap
    points = np.concatenate([scene.position, scene.walls.reshape(-1, 2), corners])
    low, high = (points.min(axis=0), points.max(axis=0)) if torus is None else torus
    extent = high - low
    # About four cells a disk are enough for the sparsest scene.
    side = np.full(2, max(least, np.sqrt(extent.prod() / (4 * scene.n)), extent.max() / (4 * scene.n)))
    if torus is None:
        low, shape = low - side, np.ceil(extent / side).astype(np.int64) + 3
    else:
        shape = np.maximum(np.floor(extent / side), 3).astype(np.int64)
        side = extent / shape
    first, walls = walls_by_cell(scene, low, side, shape)
    head = np.full(shape.prod(), -1, np.int64)
    span = side * shape if torus is None else extent
    grid = Grid(pair(side), pair(shape), pair(span), torus is not None, head, first, walls)
    return grid, low


def pair(array: NDArray) -> Any:
    """(2,) as the two Python numbers in it."""
    return tuple(array.tolist())


def walls_by_cell(scene: Scene, low: Array, side: Array, shape: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
    """For each cell the walls that a disk in it may touch: where its list begins, (cells + 1,), and all lists."""
    centre = low + side * (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 2) + 0.5)
    reach = (np.hypot(*side) / 2 + scene.radius.max()) * WIDER
    near = np.zeros((len(centre), len(scene.walls)), bool)
    for w, (start, end) in enumerate(scene.walls):
        along = end - start
        share = np.clip((centre - start) @ along / (along @ along), 0, 1)
        near[:, w] = np.hypot(*(centre - start - share[:, None] * along).T) <= reach
    return np.append(0, near.sum(axis=1).cumsum()).astype(np.int64), np.nonzero(near)[1].astype(np.int64)


def disks_of(scene: Scene, position: Array, low: Array) -> Disks:
    """The disks at t = 0, in no cell yet and without records."""
    n = scene.n
    room = np.zeros(16 * n + 8)
    skip = -room.ctypes.data % 64 // 8  # what a contact needs of a disk then fills one line of the cache, not two
    row, tag = room[skip : skip + 16 * n].reshape(n, 16), np.zeros((n, 9), np.int64)
    row[:, :2], row[:, 2:4] = position, scene.velocity
    row[:, RADIUS], row[:, WEIGHT] = scene.radius, 1 / scene.mass
    row[:, [PAIR_TIME, OWN_TIME]] = np.inf
    row[:, AX:OX] = np.where(scene.static[:, None], 0.0, scene.gravity)
    row[:, OX : OX + 2] = low
    tag[:, LAST] = NOBODY
    return Disks(row, tag, np.full(n, -1), *empty_queue(n))
