"""How fast the reference is beside the engines: `python -m tests.bench.reference` prints and writes
its figures.

A gas of equal disks between walls (area fraction 0.3, e = 1, dt 1/240 s, kT = m = diameter = 1),
played by every engine in turn, round by round in shuffled order: nothing is read and no collision
is reported while the clock runs, and Python calls the engine once a step where it cannot take many.
Each engine's own state goes on from round to round. The clock is that of the thread, which does not
run while others have the processor; they still take its
caches: leave the machine alone.

The figures go to tests/data/reference_figures.csv, each with the least or the most that is demanded
of it; `uv run pytest tests/bench/test_reference_figures.py` holds them to it, and with `-m slow`
measures some ratios anew.
"""

from __future__ import annotations

import csv
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import thread_time
from typing import NamedTuple

import numpy as np
from numba import njit

from crosscheck2d.adapters.box2d import Box2DEngine
from crosscheck2d.adapters.box2d_v3 import Box2DV3
from crosscheck2d.adapters.pymunk import Pymunk
from crosscheck2d.adapters.reference import Reference
from crosscheck2d.reference_impl import exercise, neighbours, ordered
from crosscheck2d.reports.run.cells import about, busy_cores
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scene
from tests.adapters.event_driven.gases import boxed_asteroids, boxed_gas
from tests.bench.events import alone
from tests.reference_impl.test_ordered import CASES, off

Step = Callable[[int], object]  # advances so many steps
DT, ROUNDS, LONG = 1 / 240, 15, 0.02  # s, rounds, s that a round of one engine takes at least
SIZES = (100, 1000, 10_000, 100_000)
HUGE, CALL = 1_000_000, 50  # disks that run at all; steps in a call at least: a list serves 16
FEWEST, GASES = (2, 5, 10, 21), (50, 100, 300, 1000)  # of the asteroids; disks of a gas
MOST = {1 / 60: 0.35, 1e-3: 0.2}  # dt in s -> neighbours over all pairs in the box of the asteroids
# steps of the reference in one of theirs, of 1000 disks
LEAST = {"pymunk": 10.0, "box2d": 40.0, "box2d_v3": 12.0}
FIGURES = Path(__file__).parents[2] / "tests" / "data" / "reference_figures.csv"


class Figure(NamedTuple):
    scene: str
    disks: int
    what: str
    value: float
    iqr: float | None = None
    unit: str = "1"
    at_least: float | None = None
    at_most: float | None = None


def reference(variant, scene: Scene, dt: float) -> Step:
    engine = Reference(variant)
    engine.load(scene, dt)
    return lambda count: silent(variant)(engine.disks, engine.world, dt, count)


@cache
def silent(variant):
    """The variant's `advance`, which returns how many collisions there were."""
    advance = variant.advance
    return njit(lambda disks, world, dt, count: len(advance(disks, world, dt, count)))


def pymunk(profile: str, scene: Scene, dt: float) -> Step:
    engine = Pymunk(profile)
    engine._record = None  # type: ignore[assignment, method-assign]
    engine.load(scene, dt)
    return lambda count: [engine.space.step(dt) for _ in range(count)]


def box2d(profile: str, scene: Scene, dt: float) -> Step:
    engine = Box2DEngine(profile)
    engine.load(scene, dt)
    engine.world.contactListener = None
    unit, velocity, position = (
        dt / engine.time,
        engine.velocity_iterations,
        engine.position_iterations,
    )
    return lambda count: [engine.world.Step(unit, velocity, position) for _ in range(count)]


def box2d_v3(profile: str, scene: Scene, dt: float) -> Step:
    """The world, whose collision events nobody collects; its unit of length is global, so it is set
    before each round."""
    import pyb2d3

    engine = Box2DV3(profile)
    engine.load(scene, dt)

    def step(count: int) -> None:
        pyb2d3.set_length_units_per_meter(engine.unit)
        for _ in range(count):
            engine.world.step(dt, engine.substeps)

    step.engine = engine  # type: ignore[attr-defined] # the world dies with its engine
    return step


def engines(scene: Scene, dt: float) -> dict[str, Step]:
    steps = {
        "reference:neighbours": reference(neighbours, scene, dt),
        "reference:neighbours again": reference(neighbours, scene, dt),
        "reference:exercise": reference(exercise, scene, dt),
    }
    for profile in ("matched", "shipped"):
        steps[f"pymunk:{profile}"] = pymunk(profile, scene, dt)
        steps[f"box2d:{profile}"] = box2d(profile, scene, dt)
        steps[f"box2d_v3:{profile}"] = box2d_v3(profile, scene, dt)
    return steps


def times(steps: dict[str, Step], warm: int, fewest: int = 10) -> dict[str, np.ndarray]:
    """(ROUNDS,) microseconds a step of each, interleaved in an order shuffled anew each round,
    after warming up; `fewest` steps in a call."""
    rng = np.random.default_rng(0)
    counts = {}
    for name, step in steps.items():
        step(warm)
        started = thread_time()
        step(10)
        counts[name] = max(fewest, int(10 * LONG / (thread_time() - started)))
    samples: dict[str, list[float]] = {name: [] for name in steps}
    for _ in range(ROUNDS):
        for name in rng.permutation(list(steps)):
            started = thread_time()
            steps[name](counts[name])
            samples[name].append((thread_time() - started) / counts[name] * 1e6)
    return {name: np.array(values) for name, values in samples.items()}


def compared(
    scene: str, n: int, steps: dict[str, Step], least: dict[str, float]
) -> Iterator[Figure]:
    """What a step of each costs, and how many of the first go into it, within a round, whose noise
    is shared."""
    measured = times(steps, 200)
    base = next(iter(measured))
    for name, samples in measured.items():
        low, middle, high = np.quantile(samples, [0.25, 0.5, 0.75])
        yield Figure(scene, n, f"{name}, step", middle, high - low, "us")
        if name != base:
            ratio = float(np.median(samples / measured[base]))
            demanded = least.get(name, least.get(name.split(":")[0]))
            yield Figure(scene, n, f"{name} over {base}", ratio, at_least=demanded)


def added(n: int) -> float:
    """Bytes a disk that playing n disks adds at most to what the process holds; scene and compiled
    code not counted."""
    warm = Reference(neighbours)
    warm.load(boxed_gas(1000, 0.3), DT)
    warm.step(20)
    scene = boxed_gas(n, 0.3)
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far (Linux, proc(5))
    before = status("VmRSS")
    engine = Reference(neighbours)
    engine.load(scene, DT)
    engine.listening = False
    for _ in range(5):
        engine.step(20)
    return (status("VmHWM") - before) / n


def status(key: str) -> float:
    (line,) = (
        line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key)
    )
    return 1024.0 * float(line.split()[1])


def gases() -> Iterator[Figure]:
    for n in (20, 100, 1000):
        yield from compared("gas", n, engines(boxed_gas(n, 0.3), DT), LEAST if n == 1000 else {})


def sizes() -> Iterator[Figure]:
    sized = {str(n): reference(neighbours, boxed_gas(n, 0.3), DT) for n in SIZES}
    measured = {n: samples * 1e3 / n for n, samples in zip(SIZES, times(sized, 50, CALL).values())}
    for n, samples in measured.items():
        low, middle, high = np.quantile(samples, [0.25, 0.5, 0.75])
        yield Figure("gas", n, "reference:neighbours, disk and step", middle, high - low, "ns")
    ratio = float(np.median(measured[SIZES[-1]] / measured[SIZES[0]]))
    # 1.1 to 1.3 in five runs, 1.7 on a machine with smaller caches: the fastest of so many disks is
    # faster, so that a disk has 1.4 near pairs instead of 0.4, and a new list no longer fits
    yield Figure("gas", SIZES[-1], f"disk and step over one of {SIZES[0]}", ratio, at_most=1.6)
    code = "from tests.bench.reference import added; print(added({}))"
    for n in (SIZES[-1], HUGE):
        yield Figure("gas", n, "memory a disk", alone(code.format(n)), unit="B", at_most=300.0)


def first_of(scene: Scene, n: int) -> Scene:
    arrays = ("position", "velocity", "angle", "angular_velocity", "radius", "mass", "inertia")
    return replace(scene, **{name: getattr(scene, name)[:n] for name in arrays})


def small() -> Iterator[Figure]:
    variants = {"neighbours": neighbours, "ordered": ordered, "exercise": exercise}
    asteroids = boxed_asteroids(0)
    scenes: list[tuple[Scene, float, float | None]] = []
    scenes += [(asteroids, dt, most) for dt, most in MOST.items()]
    scenes += [(first_of(asteroids, n), DT, None) for n in FEWEST]
    scenes += [(boxed_gas(n, 0.3), DT, None) for n in GASES]
    for scene, dt, most in scenes:
        steps = {name: reference(variant, scene, dt) for name, variant in variants.items()}
        samples = times(steps, 600, 600 if scene.n < 100 else CALL)
        where = f"{'asteroids in a box' if scene.n <= FEWEST[-1] else 'gas'}, {1 / dt:.0f} Hz"
        for name, at_most in (("neighbours", most), ("ordered", 1.0)):
            ratio = float(np.min(samples[name]) / np.min(samples["exercise"]))
            yield Figure(where, scene.n, f"{name} over exercise", ratio, at_most=at_most)
    engine = Reference(neighbours)
    engine.load(asteroids, 1 / 60)

    def one_by_one(count: int) -> None:
        for _ in range(count):
            engine.step()

    one = times({"call": one_by_one}, 600)["call"]
    yield Figure("asteroids in a box", 21, "a call of one step", float(one.min()), unit="us")


def in_order() -> Iterator[Figure]:
    """`reference:ordered` in the box of the asteroids: its cost, and how far off it is in 20 of
    them."""
    asteroids, dt = boxed_asteroids(0), 1 / 60
    steps = {
        "reference:ordered": reference(ordered, asteroids, dt),
        "reference:neighbours": reference(neighbours, asteroids, dt),
        "reference:exercise": reference(exercise, asteroids, dt),
        "pymunk:matched": pymunk("matched", asteroids, dt),
        "pymunk:shipped": pymunk("shipped", asteroids, dt),
    }
    least = {"reference:exercise": 1.0, "pymunk": 1.0}
    yield from compared("asteroids in a box", 21, steps, least)
    for e, gravity, t, rate in CASES:
        errors = [off(boxed_asteroids(seed, e, gravity), t, rate) for seed in range(20)]
        scene = f"asteroids in a box, e = {e}, g = {gravity}, {t:g} s at {rate} Hz"
        most = 1e-9 if gravity == 0.0 else None
        yield Figure(scene, 21, "median error", float(np.median(errors)), unit="m", at_most=most)
        yield Figure(scene, 21, "largest error", max(errors), unit="m", at_most=1e-6)


def without_edges() -> Iterator[Figure]:
    """The 21 disks of the exercise without the edges of their torus, which no library has."""
    scene, dt = replace(scenario("asteroids").scene, wrap=None), 1 / 60
    for variant, least in ((neighbours, 14.0), (exercise, 3.0)):
        steps = {
            f"reference:{variant.__name__.rpartition('.')[2]}": reference(variant, scene, dt),
            "pymunk:matched": pymunk("matched", scene, dt),
        }
        yield from compared("asteroids without edges", 21, steps, {"pymunk": least})


def main() -> None:
    header = about("python -m tests.bench.reference", 0)
    lines = {"started": header["started"], **header["machine"], **header["versions"]}
    lines["busy cores"] = f"{busy_cores():.2f}"
    with FIGURES.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {key}: {value}\n" for key, value in lines.items())
        table = csv.writer(file, lineterminator="\n")
        table.writerow(Figure._fields)
        for part in (gases, small, sizes, in_order, without_edges):
            for figure in part():
                row = [
                    "" if cell is None else f"{cell:.4g}" if isinstance(cell, float) else cell
                    for cell in figure
                ]
                table.writerow(row)
                print("  ".join(map(str, row)), flush=True)


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.parse_args()
    main()
