"""The figures in the repository and the README's picture: uv run python .ci/benchmarks.py, alone on the machine.

With --check it measures a few ratios anew and says, by its exit status too, whether they are still what is kept.
"""

import subprocess
import sys
from pathlib import Path

import pandas as pd

from adapters.engines import ENGINES
from reports.speed import figures, sizes
from reports.speed.timing import summed_up

OUT = Path("reports/out/speed")
ROUNDS, BUDGET, PATIENCE = 25, 1.0, 10.0  # the fastest of many short samples: CI machines are seldom alone


def make() -> None:
    """Measure all, keep the figures, take the picture."""
    subprocess.run([Path(sys.executable).parent / "crosscheck", "speed", "--full", "--out", OUT], check=True)
    figures.KEPT.write_bytes((OUT / "speed_figures.csv").read_bytes())
    subprocess.run([sys.executable, Path(__file__).parent / "picture.py", OUT / "speed.html"], check=True)


def check() -> list[str]:
    """What has drifted since the figures were kept."""
    players = {name: row.make for name, row in ENGINES.items()}
    samples, _ = sizes.costs(players, figures.GATED, ROUNDS, BUDGET, PATIENCE, seed=0)
    rows = [
        dict(zip(("engine", "profile"), sample.key[0].split(":")), at=sample.key[1], **sample._asdict())
        for sample in samples
    ]
    fresh = summed_up(pd.DataFrame(rows), ["engine", "profile", "at"]).assign(figure="cost of a step")
    return figures.drifted(figures.ratios(figures.read()), figures.ratios(fresh))


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        drift = check()
        print("\n".join(drift) or "every ratio is within its gate")
        sys.exit(bool(drift))
    make()
