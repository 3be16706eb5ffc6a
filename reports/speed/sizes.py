"""The cost of a step of a gas against the number of disks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter

import numpy as np

from crosscheck2d.adapters.engine import Engine, Unsupported
from crosscheck2d.reports.compare.accuracy import line_interval
from crosscheck2d.reports.run.stepping import Spent
from crosscheck2d.reports.run.timing import Sample, Timed, interleaved
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.model import Array, Scene

Make = Callable[[], Engine]
DT, RADIUS, COVERED = 1 / 240, 0.5, 0.3
# a sample has as many steps as fill 2 ms, less than a time slice of the system
WARM_STEPS, MOST_STEPS, SAMPLE = 5, 400, 2e-3
# steps after which a gas starts again: where collisions lose energy, disks fall asleep and cost
# nothing
RESTART_AFTER = 400
PILE, SETTLED = 100, 480  # disks; steps after which they lie still, and sleep if they may
REPLAYS = 3  # of the same steps; what is dear in one alone is due to the machine
FIT_FROM = 100  # disks; with fewer the fixed cost of a step hides the growth
STOPPED = "stopped: a step would take longer than {:g} s"


def gas(n: int, seed: int) -> Scene:
    """`n` equal disks that cover `COVERED` of a square box, on a lattice, with normal velocities; e
    = 1."""
    across = int(np.ceil(np.sqrt(n)))
    # also an incomplete lattice covers `COVERED`
    pitch = RADIUS * np.sqrt(np.pi / COVERED) * np.sqrt(n) / across
    place = (np.stack(np.divmod(np.arange(n), across), axis=-1) + 0.5) * pitch
    side = across * pitch
    return lay_out(
        position=place,
        velocity=np.random.default_rng(seed).normal(size=(n, 2)),
        radius=np.full(n, RADIUS),
        walls=box([0.0, 0.0], [side, side]),
    )


def pile(n: int) -> Scene:
    """`n` equal disks that rest on each other in columns, in a box as wide as they are; e = 0."""
    across = int(np.ceil(np.sqrt(n)))
    side = 2 * RADIUS * across
    return lay_out(
        position=(np.stack(np.divmod(np.arange(n), across), axis=-1) + 0.5) * 2 * RADIUS,
        radius=np.full(n, RADIUS),
        gravity=[0.0, -10.0],
        walls=box([0.0, 0.0], [side, 2 * side]),
        restitution=0.0,
    )


def pile_costs(
    engines: Mapping[tuple[str, str], Make], rounds: int, budget: float, seed: int
) -> list[Sample]:
    piles = {key: RunningGas(make(), pile(PILE), SETTLED) for key, make in engines.items()}
    timed = [Timed(key, running, running.steps) for key, running in piles.items()]
    samples = interleaved(timed, rounds, budget, seed)
    for running in piles.values():
        running.engine.close()
    return samples


def costs(
    engines: Mapping[str, Make],
    sizes: Sequence[int],
    rounds: int,
    budget: float,
    patience: float,
    seed: int,
) -> tuple[list[Sample], list[Sample], dict[tuple[str, int], str]]:
    """Samples in s a step, by (name, n), from few disks to many; one sample of the worst step of
    each; and which engines were not measured at which sizes, and why.

    An engine stops before a size at which a step would take longer than `patience` s,
    extrapolated from its last two sizes.
    """
    samples, worst = list[Sample](), list[Sample]()
    left_out: dict[tuple[str, int], str] = {}
    course: dict[str, list[tuple[int, float]]] = {name: [] for name in engines}
    for n in sizes:
        gases: dict[str, RunningGas] = {}
        for name, make in engines.items():
            if extrapolated_cost(course[name], n) > patience:
                left_out[name, n] = STOPPED.format(patience)
                continue
            try:
                gases[name] = RunningGas(make(), gas(n, seed))
            except Unsupported as refusal:
                left_out[name, n] = f"refused: {refusal}"
        timed = [Timed((name, n), running, running.steps) for name, running in gases.items()]
        here = interleaved(timed, rounds, budget, seed)
        for name, running in gases.items():
            least = min(sample.cost for sample in here if sample.key == (name, n))
            course[name].append((n, least))
            worst.append(Sample((name, n), 0, 0, running.worst_step(least, budget), 0.0, 1))
            running.engine.close()
        samples += here
    return samples, worst, left_out


class RunningGas:
    """A gas in motion: every sample continues where the last one ended, or starts again, `first`
    steps after the beginning."""

    def __init__(self, engine: Engine, scene: Scene, first: int = 1) -> None:
        self.engine, self.scene, self.first = engine, scene, first
        engine.listening = False
        self.begin()
        self.steps = 1
        each = min(self().seconds for _ in range(WARM_STEPS))
        self.steps = int(np.clip(SAMPLE / each, 1, MOST_STEPS))

    def begin(self) -> None:
        self.engine.load(self.scene, DT)
        self.engine.step(self.first)
        self.taken = 1

    def __call__(self) -> Spent:
        if self.taken + self.steps > RESTART_AFTER + WARM_STEPS:
            self.begin()
        started = perf_counter()
        self.engine.step(self.steps)
        seconds = perf_counter() - started
        self.taken += self.steps
        return Spent(seconds)

    def worst_step(self, mean: float, budget: float) -> float:
        """s, of the dearest of up to `RESTART_AFTER` steps: each is taken in `REPLAYS` runs from
        the same start, and the least of its times counts."""
        count = int(np.clip(budget / mean, WARM_STEPS, RESTART_AFTER))
        times = np.empty((REPLAYS, count))
        for row in times:
            self.begin()
            for k in range(count):
                started = perf_counter()
                self.engine.step(1)
                row[k] = perf_counter() - started
        return float(times.min(axis=0).max())


def extrapolated_cost(course: Sequence[tuple[int, float]], n: int) -> float:
    if len(course) < 2:
        return 0.0
    (n1, cost1), (n2, cost2) = course[-2:]
    return float(cost2 * (n / n2) ** (np.log(cost2 / cost1) / np.log(n2 / n1)))


def exponent(n: Array, cost: Array) -> tuple[float, float, float]:
    """p of cost ~ n^p from `FIT_FROM` disks on, low and high end of its 95 % interval; nan from
    fewer than 3 sizes."""
    many = n >= FIT_FROM
    if many.sum() < 3:
        return np.nan, np.nan, np.nan
    return line_interval(np.log(n[many]), np.log(cost[many]))
