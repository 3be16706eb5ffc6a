"""How fast the reference is beside the engines: `python -m tests.bench_reference [CSV]`, alone on the machine.

A gas of equal disks between walls (area fraction 0.3, e = 1, dt 1/240 s, kT = m = diameter = 1), played by every engine
in turn, round by round in shuffled order: nothing is read and no hit is told while the clock runs, and Python calls the
engine once a step where it cannot take many. Each engine's own state goes on from round to round. The clock is that of
the thread, which does not run while others have the processor; they still take its caches.
"""

from __future__ import annotations

import csv
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from time import thread_time

import numpy as np
from numba import njit

from adapters.box2d import POSITION_ITERATIONS, VELOCITY_ITERATIONS, Box2DEngine
from adapters.box2d_v3 import SUBSTEPS, Box2DV3
from adapters.pymunk import Pymunk
from adapters.reference import Reference
from reference_impl import crowd, ordered
from scenarios.model import Scene
from tests.gases import boxed_asteroids, boxed_gas

Step = Callable[[int], object]  # advances so many steps
DT, ROUNDS, LONG = 1 / 240, 15, 0.02  # s, rounds, s that a round of one engine takes at least
FLOORS = {"pymunk:matched": 8, "pymunk:shipped": 8, "box2d:matched": 25, "box2d:shipped": 25, "box2d_v3:matched": 12,
          "box2d_v3:shipped": 12}  # fmt: skip
COLUMNS = ("scene", "engine", "N", "dt_s", "us_per_step", "iqr", "ratio", "machine", "versions")


def reference(variant, scene: Scene, dt: float) -> Step:
    """The compiled solver, whose hits are counted but not handed to Python."""
    engine = Reference(variant)
    engine.load(scene, dt)
    advance = variant.advance
    silent = njit(lambda disks, world, count: len(advance(disks, world, dt, count)))
    return lambda count: silent(engine.disks, engine.world, count)


def pymunk(profile: str, scene: Scene, dt: float) -> Step:
    """The space without its collision callback."""
    engine = Pymunk(profile)
    engine._record = None  # type: ignore[assignment, method-assign]
    engine.load(scene, dt)
    return lambda count: [engine.space.step(dt) for _ in range(count)]


def box2d(profile: str, scene: Scene, dt: float) -> Step:
    """The world without its contact listener."""
    engine = Box2DEngine(profile)
    engine.load(scene, dt)
    engine.world.contactListener = None
    unit, iterations = dt / engine.time, engine.position_iterations
    assert iterations in (0, POSITION_ITERATIONS)
    return lambda count: [engine.world.Step(unit, VELOCITY_ITERATIONS, iterations) for _ in range(count)]


def box2d_v3(profile: str, scene: Scene, dt: float) -> Step:
    """The world, whose hit events nobody collects; its unit of length is global, so it is set before each round."""
    import pyb2d3

    engine = Box2DV3(profile)
    engine.load(scene, dt)

    def step(count: int) -> None:
        pyb2d3.set_length_units_per_meter(engine.unit)
        for _ in range(count):
            engine.world.step(dt, SUBSTEPS)

    step.engine = engine  # type: ignore[attr-defined] # the world dies with its engine
    return step


def engines(scene: Scene, dt: float) -> dict[str, Step]:
    """Everyone who steps, and the reference a second time: what it measures against itself is the noise."""
    steps = {
        "reference:exercise": reference(crowd, scene, dt),
        "reference:exercise again": reference(crowd, scene, dt),
    }
    for profile in ("matched", "shipped"):
        steps[f"pymunk:{profile}"] = pymunk(profile, scene, dt)
        steps[f"box2d:{profile}"] = box2d(profile, scene, dt)
        steps[f"box2d_v3:{profile}"] = box2d_v3(profile, scene, dt)
    return steps


def times(steps: dict[str, Step], warm: int) -> dict[str, np.ndarray]:
    """(ROUNDS,) microseconds a step of each, interleaved in an order shuffled anew each round, after warming up."""
    rng = np.random.default_rng(0)
    counts = {}
    for name, step in steps.items():
        step(warm)
        started = thread_time()
        step(10)
        counts[name] = max(10, int(10 * LONG / (thread_time() - started)))
    samples: dict[str, list[float]] = {name: [] for name in steps}
    for _ in range(ROUNDS):
        for name in rng.permutation(list(steps)):
            started = thread_time()
            steps[name](counts[name])
            samples[name].append((thread_time() - started) / counts[name] * 1e6)
    return {name: np.array(values) for name, values in samples.items()}


def rows(scene: str, n: int, dt: float, measured: dict[str, np.ndarray], base: str) -> list[dict[str, object]]:
    """The table's rows: median and quartiles, and the ratio to `base` within each round, whose noise is shared."""
    machine = f"{processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    versions = "; ".join(f"{name} {version(name)}" for name in ("pymunk", "box2d-py", "pyb2d3", "numba", "numpy"))
    found = []
    for name, samples in measured.items():
        low, middle, high = np.quantile(samples, [0.25, 0.5, 0.75])
        ratio = np.median(samples / measured[base])
        values = (scene, name, n, f"{dt:.6g}", f"{middle:.4g}", f"{high - low:.2g}", f"{ratio:.3g}", machine, versions)
        found.append(dict(zip(COLUMNS, values)))
    return found


def processor() -> str:
    """The model of the processor."""
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.processor() or platform.machine()


def added(n: int) -> float:
    """Bytes a disk that playing n disks adds at most to what the process holds; scene and compiled code not counted."""
    warm = Reference(crowd)
    warm.load(boxed_gas(1000, 0.3), DT)
    scene = boxed_gas(n, 0.3)
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far (Linux, proc(5))
    before = status("VmRSS")
    engine = Reference(crowd)
    engine.load(scene, DT)
    for _ in range(5):
        crowd.advance(engine.disks, engine.world, DT, 20)
    return (status("VmHWM") - before) / n


def status(key: str) -> float:
    """Bytes, of a line in /proc/self/status."""
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key))
    return 1024.0 * float(line.split()[1])


def memory(n: int) -> float:
    """`added` in a process of its own."""
    code = f"from tests.bench_reference import added; print(added({n}))"
    return float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)


def compared(scene: str, n: int, dt: float, steps: dict[str, Step], warm: int = 200) -> list[dict[str, object]]:
    """Measure, print and return the rows of one scene."""
    print(f"\n{scene}, N = {n}, dt = 1/{round(1 / dt)} s")
    found = rows(scene, n, dt, times(steps, warm), next(iter(steps)))
    for row in found:
        floor = FLOORS.get(str(row["engine"]), "") if (n, scene) == (1000, "gas") else ""
        print(f"  {row['engine']:26}{row['us_per_step']:>10} us  iqr {row['iqr']:>7}  x {row['ratio']:>6}  {floor}")
    return found


def main() -> None:
    """Print the tables, and write them where the first argument says."""
    table = []
    for n in (20, 100, 1000):
        scene = boxed_gas(n, 0.3)
        table += compared("gas", n, DT, engines(scene, DT))
    sizes = (100, 1000, 10_000, 100_000)
    sized = {f"N = {n}": reference(crowd, boxed_gas(n, 0.3), DT) for n in sizes}
    print("\nreference:exercise, ns a disk and step; at N = 100 000 at most twice that at N = 100")
    measured = {n: samples * 1e3 / n for n, samples in zip(sizes, times(sized, 50).values())}
    for n, samples in measured.items():
        ratio = np.median(samples / measured[100])
        print(f"  N = {n:7}{np.median(samples):10.1f} ns  x {ratio:.2f}")
    print(f"\nN = 100 000: {memory(100_000):.0f} bytes a disk, 300 at most")
    asteroids = boxed_asteroids(0)
    steps = {
        "reference:exercise": reference(crowd, asteroids, 1 / 60),
        "reference:ordered": reference(ordered, asteroids, 1 / 60),
        "pymunk:matched": pymunk("matched", asteroids, 1 / 60),
        "pymunk:shipped": pymunk("shipped", asteroids, 1 / 60),
    }
    table += compared("asteroids in a box", 21, 1 / 60, steps)
    if len(sys.argv) > 1:
        with open(sys.argv[1], "w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(table)


if __name__ == "__main__":
    main()
