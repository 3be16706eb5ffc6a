"""How fast the event engine is: `python -m tests.bench.events` prints its figures and the floors
they must reach."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from time import perf_counter

import numpy as np

from crosscheck2d.adapters.event_driven.events import EventEngine
from tests.adapters.event_driven.gases import gas

SLICES = 50  # short ones, so that on a busy machine some are undisturbed
ROWS = (
    (1000, 0.3, 1_000_000),
    (100, 0.3, 1_000_000),
    (10_000, 0.3, 1_000_000),
    (1000, 0.5, 1_000_000),
)


def rate(n: int, packing: float, collisions: int) -> tuple[float, float]:
    """Collisions of two disks a second on a torus, e = 1, after 50 collisions a disk: the best and
    the median of many slices."""
    scene, torus = gas(n, packing)
    engine = EventEngine(scene, torus)
    at = 0.0
    while len(engine.collisions) < 25 * n:
        at += 1.0
        engine.advance(at)
    span = at * collisions / len(engine.collisions) / SLICES
    rates = []
    for _ in range(SLICES):
        engine.kept.clear()
        started = perf_counter()
        at += span
        engine.advance(at)
        seconds = perf_counter() - started
        rates.append(len(engine.collisions) / seconds)
    return max(rates), float(np.median(rates))


def alone(code: str, **environment: str) -> float:
    env = os.environ | environment
    return float(subprocess.check_output([sys.executable, "-c", code], env=env, text=True))


def memory() -> float:
    return alone(
        "from tests.bench.events import peak; from tests.adapters.event_driven.gases import gas; "
        "from crosscheck2d.adapters.event_driven.events import EventEngine; "
        "engine = EventEngine(*gas(100_000, 0.3)); engine.advance(1.0); print(peak())"
    )


def peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def compile_time() -> float:
    with tempfile.TemporaryDirectory() as empty:
        return alone(
            "from tests.adapters.event_driven.gases import gas; from time import process_time;"
            " from crosscheck2d.adapters.event_driven.events import EventEngine;"
            " start = process_time(); engine = EventEngine(*gas(100, 0.3)); engine.advance(1.0);"
            " engine.motion_at(1.0); engine.accelerate(0, 1.0, (0.0, 0.0)); engine.advance(2.0);"
            " print(process_time() - start)",
            NUMBA_CACHE_DIR=empty,
        )


def main() -> None:
    print(f"{'what':58}{'measured':>14}  floor")
    for n, packing, collisions in ROWS:
        best, median = rate(n, packing, collisions)
        floor = "1.8" if (n, packing) == (1000, 0.3) else ""
        print(
            f"{f'torus, N = {n}, packing {packing}: M collisions/s, best':58}{best / 1e6:14.2f} "
            f" {floor}"
        )
        print(f"{'    median of ' + str(SLICES) + ' slices':58}{median / 1e6:14.2f}")
    print(f"{'compile all kernels, empty cache: s':58}{compile_time():14.1f}  10 at most")
    print(f"{'N = 100 000: MB':58}{memory():14.0f}  300 at most")


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.parse_args()
    main()
