"""How far and how fast the oracle answers: `python -m tests.bench.oracle` prints its figures and
writes them down.

They go to tests/data/oracle_figures.csv, which `uv run pytest -m slow
tests/bench/test_oracle_figures.py` computes again.
"""

from __future__ import annotations

import csv
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Iterator
from dataclasses import replace
from math import log
from pathlib import Path
from time import process_time

import numpy as np

from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.exact import accuracy_of, computed, difference
from crosscheck2d.scenarios.truth.oracle.events import trace
from crosscheck2d.scenarios.truth.oracle.numbers import mpfr
from crosscheck2d.scenarios.truth.record import TruthRecord
from tests.scenarios.exercise_box import boxed, lasting

FIGURES = Path(__file__).parents[2] / "tests" / "data" / "oracle_figures.csv"
REPEATS = 3
FLOORS = {60.0: 0.2, 600.0: 3.0}  # s, for a certified answer of the box at e = 1
FALLS = {0.5: range(4), 0.8: range(4), 0.9: range(2)}  # restitution and seeds
FALL = 10.0  # s, of the falling boxes
COLUMNS = (
    "scene",
    "duration_s",
    "method",
    "bits",
    "collisions",
    "rests",
    "first_rest_s",
    "horizon_s",
    "ends_because",
    "seconds",
)
Row = dict[str, str | float | int]


def lasting_box(seed: int, duration: float) -> Scenario:
    return lasting(boxed(seed), duration)


def wrapped(duration: float) -> Scenario:
    one = scenario("asteroids")
    return replace(
        one,
        scene=replace(one.scene, restitution=1.0),
        duration=duration,
        sample_interval=duration / 100,
    )


def falling(restitution: float, seed: int) -> Scenario:
    return lasting(boxed(seed, restitution, 10.0), FALL)


def figures(name: str, one: Scenario, repeats: int) -> Row:
    best = np.inf
    for _ in range(repeats):
        started = process_time()
        record = computed(one)
        best = min(best, process_time() - started)
    return {
        "scene": name,
        "duration_s": one.duration,
        **said(one, record),
        "seconds": round(best, 3),
    }


def said(one: Scenario, record: TruthRecord) -> Row:
    rests = record.events[record.events[:, 3] == 0, 0]
    return {
        "method": record.method,
        "bits": record.bits,
        "collisions": len(record.events) - len(rests),
        "rests": len(rests),
        "first_rest_s": round(float(rests[0]), 6) if len(rests) else "",
        "horizon_s": round(min(record.horizon, one.duration), 6),
        "ends_because": record.reason,
    }


def growth(one: Scenario, bits: int = 128) -> float:
    """1/s, of the distance of runs with so many and twice as many bits, from 2^-bits to what they
    may be off."""
    coarse, fine = (trace(one.scene, [], one.duration, mpfr(each)) for each in (bits, 2 * bits))
    diverged, _ = difference(coarse, fine, one.duration, mpfr(2 * bits), accuracy_of(one))
    return (bits * log(2) + log(accuracy_of(one))) / diverged


def main() -> None:
    computed(lasting_box(0, 1.0))  # compiles what is not yet in numba's cache
    print(
        f"growth of a distance, box 0: {growth(lasting_box(0, 600.0)):.2f} 1/s; floors {FLOORS} s"
    )
    with FIGURES.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        for name, repeats, one in questions():
            row = figures(name, one, repeats)
            table.writerow(row)
            print("  ".join(f"{value}" for value in row.values()), flush=True)


def questions() -> Iterator[tuple[str, int, Scenario]]:
    for until in FLOORS:
        yield from ((f"box_{seed}", REPEATS, lasting_box(seed, until)) for seed in range(2))
        yield "wrap_0", REPEATS, wrapped(until)
    for restitution, seeds in FALLS.items():
        yield from ((f"fall_{restitution}_{seed}", 1, falling(restitution, seed)) for seed in seeds)


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.parse_args()
    main()
