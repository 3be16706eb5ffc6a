"""The kept tables of speed and the README's picture: uv run python .ci/benchmarks.py, alone on the
machine.

It takes about a quarter of an hour on two cores, says so, and goes on where it was interrupted.
With --check it measures a few ratios anew, in a few seconds, and says, by its exit status too,
whether they are still what is kept.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.speed import figures, sizes
from crosscheck2d.reports.speed.page import write_picture
from crosscheck2d.reports.speed.tables import summed_up

OUT = Path("reports/out/speed")
# the fastest of many short samples: CI machines are seldom alone
ROUNDS, BUDGET, PATIENCE = 25, 1.0, 10.0
ORDERED, GROWTH = "reference:ordered", 3.0


def make() -> None:
    """Measure all, keep the figures, draw the picture."""
    crosscheck = Path(sys.executable).parent / "crosscheck"
    subprocess.run([crosscheck, "speed", "--full", "--out", OUT], check=True)
    figures.keep(OUT)
    write_picture(figures.PICTURE, figures.read())
    paths = (figures.KEPT, figures.ORDERS, figures.EXPLAINED, figures.PICTURE)
    print(
        f"kept: {', '.join(map(str, paths))}; what README.md says: python -m"
        " tests.reports.speed.statements"
    )


def check() -> list[str]:
    """What has drifted since the figures were kept; every ratio is printed."""
    print(
        f"the cost of a step against reference:exercise, the fastest of {ROUNDS} rounds", flush=True
    )
    engines = {name: row.make for name, row in ENGINES.items() if not row.adds_friction}
    samples, _, _ = sizes.costs(engines, figures.GATED, ROUNDS, BUDGET, PATIENCE, seed=0)
    rows = [
        dict(
            zip(("engine", "profile"), sample.key[0].split(":")),
            at=sample.key[1],
            **sample._asdict(),
        )
        for sample in samples
    ]
    fresh = summed_up(pd.DataFrame(rows), ["engine", "profile", "at"]).assign(
        figure="cost of a step"
    )
    kept, now = figures.ratios(figures.read()), figures.ratios(fresh)
    for (name, n), ratio in now.items():
        print(f"{name:22} {n:5} disks  {ratio:8.3g}  kept {kept.get((name, n), float('nan')):8.3g}")
    return figures.drifted(kept, now) + growth()


def growth() -> list[str]:
    """Whether a step of many disks has become dear a disk: if each collision asks all pairs again,
    it costs 26 times as much; the medians, as few steps have many collisions."""
    counts = 100, 10_000
    gases = [sizes.RunningGas(ENGINES[ORDERED].make(), sizes.gas(n, 0)) for n in counts]
    rounds = [[gas().seconds / gas.steps / n for n, gas in zip(counts, gases)] for _ in range(40)]
    few, many = np.median(rounds, axis=0)
    said = f"{ORDERED}: a disk among {counts[1]} costs {many / few:.3g} of one among {counts[0]}"
    print(said)
    return [f"{said}; allowed is {GROWTH:g}"] if many > GROWTH * few else []


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        drift = check()
        print("\n".join(drift) or "every ratio is within its gate")
        sys.exit(bool(drift))
    make()
