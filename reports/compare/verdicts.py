"""Verdicts: what needs no exact answer, judged over the whole run, past the horizon too.

`verdicts` reads numbers off the samples; the run fails where one is above its bound. Not seen:

- A collision between two samples. A path from sample to sample is taken as straight; a disk that
  had the time to go round the end of a wall, or round the other disk, did not pass through it.
  What others near them may have added to the speed of two disks counts, unless both flew freely.
- Energy or overlap of one or two samples only: inside a collision an engine may overlap, and read
  velocity and position of different instants.
- On a torus, two disks that pass through each other in an interval in which one is set onto the
  opposite edge, an overlap that begins so, and a wall before a disk that moves half of the box.
- The part of a scene without exact answer in which disks come to rest: there only what jitters in
  place is seen, and what sinks into something.

k samples, n disks; R is the radius of the smaller disk of a pair.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from crosscheck2d.adapters.engine_row import FLOAT64
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.against import ITSELF
from crosscheck2d.reports.compare.restitution import TINY
from crosscheck2d.reports.compare.view import rounding_of
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

MOST_OVERLAP = 0.1  # radii, beyond what disks approach in two steps
STAYS = 0.9  # an overlap is not resolved while it is at least this part of that two samples before
MOST_RISE = 0.05  # of the energy at hand
MOST_BOUNCE = 0.01  # of the energy at hand, a bounce, beyond what a step explains
MOST_MOMENTUM = 1e-5  # of all momenta: a hundred roundings of float32
MOST_LOST = 0.5  # of the acceleration of gravity, or of a distance in free flight
MOST_SINKING = 0.1  # radii
MOST_JITTER, MOST_RESIDUAL = 0.02, 0.05  # sqrt(g R): mean and largest speed of what is at rest
SETTLED = 0.1  # of a run: rest that is early by more stops what should still move
LASTS = 3  # samples in a row


class Kind(NamedTuple):
    unit: str
    means: str  # what the value is
    said: str  # of a run that fails; {0} is the value, {1} the value in percent


VERDICTS = {
    "tunnelled": Kind("disks", "disks that passed through a wall or another disk", "tunnels"),
    "overlap": Kind("radii", "overlap of two disks, or of a disk and a wall", "overlaps by {0} R"),
    "energy_gained": Kind("1", "energy above that of the start, of that at hand", "gains {1}"),
    "energy_lost": Kind("1", "energy lost at e = 1, of that at hand", "loses {1}"),
    "bounce_gained": Kind("1", "energy gained a bounce, of that at hand", "gains {1} a bounce"),
    "momentum": Kind("1", "momentum not explained by outer forces", "momentum off by {1}"),
    "gravity": Kind("g", "acceleration of free disks, distance from g", "falls {1} off g"),
    "sinks": Kind("radii", "how far a disk at rest moves down", "sinks by {0} R"),
    "hops": Kind("radii", "how far a disk at rest moves up", "hops by {0} R"),
    "creeps": Kind("radii", "how far a disk at rest moves sideways", "creeps by {0} R"),
    "jitters": Kind("sqrt(g R)", "mean speed of disks that stay in place", "jitters"),
    "not_at_rest": Kind("sqrt(g R)", "largest speed where all is at rest", "does not rest"),
    "time_of_rest": Kind("of the run", "time of rest, distance from the exact", "rests at {1} off"),
}


@dataclass(frozen=True)
class Verdict:
    """A number of a whole run; it fails above `bound`, or if it is not a number."""

    id: str  # a key of `VERDICTS`, which has the unit of value and bound
    value: float
    bound: float
    at: float = np.nan  # s, the first sample that fails, else that of the value; nan: the whole run
    disks: tuple[int, ...] = ()  # those concerned, a wall w as -1 - w; (): all
    event: str = ""  # what happens, where that is more than the words of `VERDICTS`

    @property
    def failed(self) -> bool:
        return not self.value <= self.bound

    @property
    def unit(self) -> str:
        return VERDICTS[self.id].unit

    @property
    def text(self) -> str:
        return self.event or in_words(self.id, self.value)


def verdicts(
    scenario: Scenario,
    played: Trajectory,
    dt: float,
    rounding: float = FLOAT64,
    truth: Trajectory | None = None,
) -> list[Verdict]:
    """Every verdict that applies to a run with steps of `dt` s, in the order of `VERDICTS`;
    `rounding`: relative, of the engine's numbers; `truth`: the exact answer up to its horizon."""
    if len(played) < LASTS:
        return []
    # a disk thrown far out gives inf or nan
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        judge = Judge(scenario, played, dt, rounding, truth)
        return [*judge.contacts(), *judge.energy(), *judge.flight(), *judge.rest()]


def verdicts_on(run: Run, scenario: Scenario, truth: Trajectory | None) -> list[Verdict]:
    assert run.trajectory is not None
    return verdicts(scenario, run.trajectory, run.dt, rounding_of(run.name), truth)


def first_failed(run: Run, scenario: Scenario, truth: Trajectory | None) -> Verdict | None:
    judged = verdicts_on(run, scenario, truth)
    return next((verdict for verdict in judged if verdict.failed), None)


def fails(table: pd.DataFrame) -> pd.DataFrame:
    return table[
        (table.versus == ITSELF) & table.metric.isin(list(VERDICTS)) & ~(table.value <= table.bound)
    ]


def in_words(kind: str, value: float) -> str:
    """A failed verdict in a few words: "sinks by 0.3 R"."""
    number, percent = (f"{x:.0f}" if x > 9.9 else f"{x:.2g}" for x in (value, 100 * value))
    return VERDICTS[kind].said.format(number, f"{percent} %")


class Pair(NamedTuple):
    disk: int
    others: NDArray[np.int64]  # (m,), or one wall w, -1 - w
    overlap: Array  # (k, m) m
    way: Array  # (k, m, 2) m, between their centres
    smaller: Array  # (m,) m, the radius of the smaller disk


class Judge:
    def __init__(
        self,
        scenario: Scenario,
        played: Trajectory,
        dt: float,
        rounding: float,
        truth: Trajectory | None,
    ) -> None:
        self.scenario, self.played, self.dt = scenario, played, dt
        self.rounding, self.truth = rounding, truth
        self.interval = float(played.t[1] - played.t[0])  # s between two samples
        self.g = float(np.hypot(*scenario.scene.gravity))  # m/s2
        way, wrap = np.diff(played.position, axis=0), scenario.scene.wrap
        # (k,) m/s, the largest of any disk at the sample before, at and after
        speed: Array = laws.lengths(played.velocity).max(axis=1)
        speed = np.maximum.reduce([speed, np.append(speed[1:], 0.0), np.append(0.0, speed[:-1])])
        self.speed = speed
        # (k,) m: gaps above it cannot have closed between the samples beside
        moved = np.maximum(laws.lengths(way).max(axis=1), speed[1:] * self.interval)
        self.reach = 2 * np.maximum(np.append(moved, moved[-1]), np.append(moved[0], moved))
        # (k - 1, n), where a disk is set onto the opposite edge
        half = np.array([np.inf, np.inf]) if wrap is None else (wrap[1] - wrap[0]) / 2
        self.jumps = np.asarray((np.abs(way) > half).any(axis=2))

    @cached_property
    def pairs(self) -> list[Pair]:
        """Every disk beside those after it, and every moving disk beside a wall."""
        scene, x, pairs = self.scenario.scene, self.played.position, []
        r, static = scene.radius, scene.static
        for i in range(scene.n - 1):
            others = np.flatnonzero(~(static & static[i]))
            if not len(others := others[others > i]):
                continue
            way = x[:, others] - x[:, i, None]
            overlap = r[i] + r[others] - laws.lengths(way)
            pairs.append(Pair(i, others, overlap, way, np.minimum(r[i], r[others])))
        for w, (start, end) in enumerate(scene.walls):
            for disk in np.flatnonzero(~static).tolist():
                to_wall = laws.nearest_on_segment(x[:, disk], start, end) - x[:, disk]
                depth, wall = r[disk] - laws.lengths(to_wall), np.array([-1 - w])
                pairs.append(Pair(disk, wall, depth[:, None], to_wall[:, None], r[[disk]]))
        return pairs

    # Contacts: through something, or in it.

    def contacts(self) -> Iterator[Verdict]:
        if not self.pairs:
            return
        crossings = laws.wall_crossings(self.played, self.scenario.scene)
        passed = sorted([*crossings, *self.through_disks()])
        disks = len({disk for _, disk, _ in passed})
        at, *both = passed[0] if passed else (np.nan,)
        yield Verdict("tunnelled", disks, 0.0, at, tuple(map(int, both)))
        yield max(map(self.overlap, self.pairs), key=lambda verdict: verdict.value - verdict.bound)

    def through_disks(self) -> Iterator[tuple[float, int, int]]:
        """(s, disk, disk): between two samples two disks change sides, and the centre of one passes
        through the other."""
        scene, t, v = self.scenario.scene, self.played.t, self.played.velocity
        for disk, others, _, way, _ in self.pairs:
            turned = np.argwhere((way[:-1] * way[1:]).sum(axis=2) < 0) if others[0] >= 0 else ()
            for k, m in turned:
                other = int(others[m])
                if self.jumps[k, [disk, other]].any():
                    continue
                start, end = way[k, m], way[k + 1, m]
                reach = float(scene.radius[disk] + scene.radius[other])
                nearest = laws.nearest_on_segment(np.zeros((1, 2)), start, end)[0]
                distance = float(laws.lengths(nearest))
                if distance >= max(scene.radius[disk], scene.radius[other]):
                    continue
                relative = laws.lengths(v[k : k + 2, other] - v[k : k + 2, disk]).max()
                flew = self.flies(k, disk) and self.flies(k, other)
                if not flew and self.disturbed(k, disk, other):
                    relative = 2 * (self.speed[k] + self.g * self.interval)
                relative += self.g * self.interval * bool(scene.static[[disk, other]].any())
                # exactly through the centre is no way round
                beside = nearest / distance * reach if distance > 1e-6 * reach else None
                if beside is None or laws.detour(start, end, beside) > relative * self.interval:
                    yield float(t[k + 1]), disk, other

    def flies(self, k: int, disk: int) -> bool:
        """Whether the velocity at sample k or k + 1 carries a disk from one to the other, within
        0.1 R: what it meets, it meets at an end, and its path between them is straight."""
        scene, x, v = self.scenario.scene, self.played.position, self.played.velocity
        moved, gained = x[k + 1, disk] - x[k, disk], scene.gravity * self.interval
        for velocity in (v[k, disk], v[k + 1, disk] - gained):
            # symplectic Euler falls by g dt2 in a step, explicit Euler by none
            ends = velocity * self.interval, (velocity + gained) * self.interval
            nearest = laws.nearest_on_segment(moved[None], *ends)[0]
            if laws.lengths(nearest - moved) <= MOST_OVERLAP * scene.radius[disk]:
                return True
        return False

    def disturbed(self, k: int, disk: int, other: int) -> bool:
        """Whether one of two disks may meet a third, or a wall, after sample k: until k + 1 they
        may then be faster than at both."""
        scene, x = self.scenario.scene, self.played.position[k]
        reach = self.speed[k] * self.interval
        for i, partner in ((disk, other), (other, disk)):
            gaps = laws.lengths(laws.nearer_way(x - x[i], scene)) - scene.radius - scene.radius[i]
            if (np.delete(gaps, [i, partner]) < 2 * reach).any():
                return True
            walls = [laws.nearest_on_segment(x[i, None], *wall)[0] - x[i] for wall in scene.walls]
            if any(laws.lengths(way) - scene.radius[i] < reach for way in walls):
                return True
        return False

    def overlap(self, pair: Pair) -> Verdict:
        """The overlap of a disk with the others that is farthest above its bound: 0.1 R and what
        the fastest disk moves in two steps; or, if it stays for three samples, what these two do at
        the slowest of them.

        A right engine that detects collisions at the end of a step overlaps by the approach in it:
        a fast disk in a narrow gap at every sample.
        """
        touching = np.flatnonzero((pair.overlap > 0).any(axis=0))
        if not len(touching):
            return Verdict("overlap", 0.0, MOST_OVERLAP)
        others, smaller, way = pair.others[touching], pair.smaller[touching], pair.way[:, touching]
        depth = pair.overlap[:, touching] / smaller
        allowed = MOST_OVERLAP + 2 * self.dt * self.speed[:, None] / smaller
        v = self.played.velocity
        v = (v[:, others] if others[0] >= 0 else 0.0) - v[:, [pair.disk]]
        speed = np.abs((v * way).sum(axis=2)) / np.maximum(laws.lengths(way), TINY)
        slowest, least = least_of_three(speed) / smaller, least_of_three(depth)
        moves = slowest * self.interval > least  # else they lie in each other, whatever the speed
        bound = MOST_OVERLAP + np.where(moves, 2 * self.dt * slowest, 0.0)
        stays = (depth[2:] >= STAYS * depth[:-2]) & (least > bound)
        allowed[2:] = np.where(stays, bound, allowed[2:])
        depth[2:] = np.where(stays, least, depth[2:])
        if self.jumps.any():
            # not one that they are set into: they were apart after the last jump of either
            ends = np.where(others >= 0, others, pair.disk)
            jumped = np.vstack([depth[:1] < 0, self.jumps[:, [pair.disk]] | self.jumps[:, ends]])
            number = np.arange(len(depth))[:, None]
            apart, jump = (
                np.maximum.accumulate(np.where(event, number, -1)) for event in (depth <= 0, jumped)
            )
            depth = np.where(apart >= jump, depth, 0.0)
        k, m = np.unravel_index(int(np.argmax(depth - allowed)), depth.shape)
        value, most, above = depth[k, m], allowed[k, m], ~(depth[:, m] <= allowed[:, m])
        at = self.played.t[np.argmax(above) if above.any() else k]
        disks = pair.disk, int(others[m])
        return Verdict("overlap", max(float(value), 0.0), float(most), float(at), disks)

    # Energy and momentum.

    def energy(self) -> Iterator[Verdict]:
        scenario, t = self.scenario, self.played.t
        if scenario.thrusts or scales.lifts(scenario):
            return
        scale = scales.energy(scenario) or 1.0
        energy = laws.energy(self.played, scenario.scene)
        known = laws.half_step(self.played, scenario.scene, self.dt) / scale
        gained = (energy - energy[0]) / scale
        yield worst_of("energy_gained", t[2:], least_of_three(gained - known), MOST_RISE)
        if scales.keeps_energy(scenario):
            # what never comes back: a soft contact holds energy while it lasts
            best = np.maximum.accumulate((gained + known)[::-1])[::-1][: len(t) - len(t) // 10]
            yield worst_of("energy_lost", t, -best, MOST_RISE)
        yield from self.bounces(scale)

    def bounces(self, scale: float) -> Iterator[Verdict]:
        """`bounce_gained`, where one disk moves: from its first flight to its last, over the
        bounces between. A step in which the disk is moved out of a wall lifts it by v dt at most.
        """
        scene, moving = self.scenario.scene, np.flatnonzero(~self.scenario.scene.static)
        if not self.g or len(moving) != 1:
            return
        off = np.diff(self.played.velocity[:, moving[0]], axis=0) - self.interval * scene.gravity
        # of what gravity changes, and of the rounding of the speed
        small = 1e-3 * self.g * self.interval + 100 * self.rounding * self.speed[1:]
        free = laws.lengths(off) <= small
        starts = np.flatnonzero(free & ~np.append(False, free[:-1]))
        if len(starts) > 1:
            energy = laws.energy(self.played, scene)[starts] / scale
            gain = (energy[-1] - energy[0]) / (len(starts) - 1)
            lifted = self.g * self.dt * self.speed[starts[1:]].mean() * scene.mass[moving[0]]
            bound, at = MOST_BOUNCE + lifted / scale, self.played.t[starts[-1]]
            yield Verdict("bounce_gained", float(gain), float(bound), float(at), (int(moving[0]),))

    # Free flight.

    def flight(self) -> Iterator[Verdict]:
        """`momentum` where the outer forces are known, and `gravity` where disks touch nothing."""
        scenario, t = self.scenario, self.played.t
        off = scales.unexplained_momentum(scenario, self.played)
        if off is not None:
            # each step rounds each velocity once; free fall adds to the momentum at hand
            momenta = laws.lengths(laws.momenta(self.played, scenario.scene)).sum(axis=1).max()
            share = max(1.0, float(momenta) / (scales.momentum(scenario) or 1.0))
            bound = max(MOST_MOMENTUM, self.rounding * share * float(t[-1]) / self.dt)
            yield worst_of("momentum", t, off, bound)
        if not self.g or scenario.thrusts:
            return
        scene, x = scenario.scene, self.played.position
        free = (self.room > self.reach[:, None] + MOST_OVERLAP * scene.radius)[1:-1]
        free &= ~(scene.static | self.jumps[1:] | self.jumps[:-1])
        fall = np.diff(x, n=2, axis=0) @ scene.gravity / (self.g * self.interval) ** 2
        rounding = 4 * self.rounding * np.abs(x).max() / (self.g * self.interval**2)
        if free.any() and rounding < MOST_LOST / 10:
            missing = float(np.median(np.abs(fall[free] - 1)))
            at = float(t[1 + np.argmax(free.any(axis=1))])
            yield Verdict("gravity", missing, MOST_LOST, at)

    @cached_property
    def room(self) -> Array:
        """(k, n) m, from each disk to the nearest other, or wall."""
        room = np.full(self.played.position.shape[:2], np.inf)
        for disk, others, overlap, *_ in self.pairs:
            room[:, disk] = np.minimum(room[:, disk], -overlap.max(axis=1, initial=-np.inf))
            if others[0] >= 0:
                room[:, others] = np.minimum(room[:, others], -overlap)
        return room

    # Rest.

    def rest(self) -> Iterator[Verdict]:
        """Where the scene can come to rest: `jitters`, and beside an exact answer that is at rest
        at its end the others, from half of that rest on: until then an engine may bounce where
        e = 0, and correct what it takes for an overlap.

        A step changes a speed by g dt, a bounce takes the part 1 - e of it: below g dt / (1 - e) a
        ball hops on in a right stepping engine, too, or stops up to 2 dt / (1 - e)^2 early.
        """
        scenario, scene, played = self.scenario, self.scenario.scene, self.played
        held, falls = len(scene.walls) or scene.static.any(), self.g and not scene.static.all()
        settles = held and falls and scene.restitution < 1 and not scenario.thrusts
        if not settles or scene.wrap is not None:
            return
        unit, intervals = own_speed(scenario), len(played) - 1
        step = self.g * self.dt / (1 - scene.restitution) / unit
        speed = laws.lengths(played.velocity)[:, ~scene.static] / unit
        yield from self.jitter(speed, MOST_JITTER + step)
        if self.truth is None:
            return
        exact, bound = laws.lengths(self.truth.velocity).max(axis=1) / unit, MOST_RESIDUAL + step
        rest = settled_from(exact, 1e-6)  # nothing that is judged here
        if rest > len(exact) - LASTS:  # a disk that turns round is at rest at one sample
            return
        first = settled_from(speed.max(axis=1), bound)
        late = (first - settled_from(exact, bound)) / intervals
        start = min((rest + intervals) // 2, len(played) - LASTS)
        yield from self.moved(start, step)
        after = np.sqrt((speed[start:] ** 2).mean(axis=1))
        yield worst_of("not_at_rest", played.t[start:], after, bound)
        allowed = 2 * self.dt / (1 - scene.restitution) ** 2 / float(played.t[-1])
        allowed += SETTLED if late < 0 else (start - rest) / intervals
        yield Verdict("time_of_rest", abs(late), allowed, float(played.t[min(first, intervals)]))

    def jitter(self, speed: Array, bound: float) -> Iterator[Verdict]:
        """`jitters`: the root mean square speed, in the last quarter, of a disk that stays within
        0.1 R during the last half, and is no slower than in the quarter before.

        At e below 1 a disk that hops in place is slower by e after each hop. A hop of 0.1 R takes
        0.9 sqrt(R / g): in a quarter there must be time for enough of them.
        """
        scene, k = self.scenario.scene, len(self.played)
        hops = 1 + (np.log(STAYS) / np.log(scene.restitution) if scene.restitution else 0)
        if k // 4 * self.interval < 0.9 * hops * own_speed(self.scenario) / self.g:
            return
        moving, x = np.flatnonzero(~scene.static), self.played.position[k // 2 :]
        stays = laws.lengths(np.ptp(x[:, moving], axis=0)) <= MOST_SINKING * scene.radius[moving]
        parts = speed[k // 2 : k - k // 4], speed[k - k // 4 :]
        before, last = (np.sqrt((part**2).mean(axis=0)) for part in parts)
        value = np.where(stays & (last >= STAYS * before), last, 0.0)
        worst, at = int(np.argmax(value)), float(self.played.t[k // 2])
        yield Verdict("jitters", float(value[worst]), bound, at, (int(moving[worst]),))

    def moved(self, first: int, step: float) -> Iterator[Verdict]:
        """`sinks`, `hops` and `creeps`: how far a disk moves after sample `first`, beside the hop
        of a speed `step` in sqrt(g R)."""
        scene, t = self.scenario.scene, self.played.t[first:]
        way = self.played.position[first:] - self.played.position[first]
        down, across = scene.gravity / self.g, scene.gravity[::-1] * (1, -1) / self.g
        bound = MOST_SINKING + step**2 / 2
        ways = {"sinks": way @ down, "hops": -way @ down, "creeps": np.abs(way @ across)}
        for kind, distance in ways.items():
            series = distance / scene.radius
            yield worst_of(kind, t, series.max(axis=1), bound, series)


def own_speed(scenario: Scenario) -> float:
    """sqrt(g R) m/s, the speed after a fall of half a radius."""
    return float(np.sqrt(np.linalg.norm(scenario.scene.gravity) * scenario.scene.radius.min()))


def settled_from(speed: Array, bound: float) -> int:
    """The sample from which a speed (k,) is within the bound up to the end; k: never."""
    above = np.flatnonzero(~(speed <= bound))
    return int(above[-1]) + 1 if len(above) else 0


def least_of_three(series: Array) -> Array:
    """(k - 2, ...) the least of three samples in a row, at the last of them."""
    least: Array = np.minimum.reduce([series[:-2], series[1:-1], series[2:]])
    return least


def worst_of(
    kind: str, t: Array, series: Array, bound: float, of_disks: Array | None = None
) -> Verdict:
    """The largest of a series (k,), at the first sample above its bound; `of_disks` (k, n) says of
    which disk."""
    series = np.where(np.isnan(series), np.inf, series)
    k, above = int(np.argmax(series)), ~(series <= bound)
    disks = () if of_disks is None else (int(np.argmax(of_disks[k])),)
    at = float(t[np.argmax(above) if above.any() else k])
    return Verdict(kind, float(series[k]), bound, at, disks)
