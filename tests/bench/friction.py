"""What the code of friction costs where a scene has none: `python -m tests.bench.friction BEFORE`.

BEFORE is another checkout of this repository, of a commit without friction (`git worktree add`).
A gas of 1000 disks without friction is played by the engines of both, each checkout in a process of
its own that plays a round when it is told to, so that rounds alternate; this checkout plays twice,
and what it measures against itself is the noise. Printed are microseconds a step, the least of all
rounds, and their ratios. Within this checkout `reference:coulomb` is set against
`reference:exercise`, whose bits it gives here.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).parents[2]
DISKS, ROUNDS = 1000, 40
ENGINES = (
    "reference:exercise",
    "reference:coulomb",
    "reference:neighbours",
    "reference:ordered",
    "event_driven:float64",
)
# What plays: a line of the times in microseconds for each line that it reads.
PLAYER = f"""
import sys
from time import thread_time
from crosscheck2d.adapters.engines import ENGINES
from tests.adapters.event_driven.gases import boxed_gas

scene, dt, engines, counts = boxed_gas({DISKS}, 0.3), 1 / 240, {{}}, {{}}
for name in {ENGINES}:
    if name in ENGINES:
        engines[name] = ENGINES[name].make()
        engines[name].load(scene, dt)
        engines[name].step(20)
        started = thread_time()
        engines[name].step(10)
        counts[name] = max(5, int(0.03 * 10 / (thread_time() - started)))
print(*engines, flush=True)
for _ in sys.stdin:
    times = []
    for name, engine in engines.items():
        started = thread_time()
        engine.step(counts[name])
        times.append(1e6 * (thread_time() - started) / counts[name])
    print(*times, flush=True)
"""


class Checkout:
    """A process that plays with the source of a checkout; its kernels are compiled elsewhere."""

    def __init__(self, source: Path, kernels: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-B", "-c", PLAYER],
            cwd=source,
            env=os.environ
            | {"PYTHONPATH": str(source / ".ci" / "types"), "NUMBA_CACHE_DIR": str(kernels)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.engines = self.line()
        self.least = dict.fromkeys(self.engines, float("inf"))

    def line(self) -> list[str]:
        assert self.process.stdout is not None
        return self.process.stdout.readline().split()

    def round(self) -> None:
        assert self.process.stdin is not None
        print(file=self.process.stdin, flush=True)
        for name, time in zip(self.engines, map(float, self.line()), strict=True):
            self.least[name] = min(self.least[name], time)


def measured(sources: Sequence[Path], rounds: int = ROUNDS) -> list[dict[str, float]]:
    with tempfile.TemporaryDirectory() as kernels:
        folders = [Path(kernels) / str(sources.index(source)) for source in sources]
        checkouts = [Checkout(source, folder) for source, folder in zip(sources, folders)]
        for k in range(rounds):
            # first one way round, then the other
            for one in checkouts[:: 1 if k % 2 else -1]:
                one.round()
        for one in checkouts:
            one.process.communicate()
    return [one.least for one in checkouts]


def main(before: Path) -> None:
    now, again, then = measured([HERE, HERE, before.resolve()])
    print(f"{'microseconds a step':24}{'before':>10}{'now':>10}{'ratio':>8}{'noise':>8}")
    for name, time in now.items():
        old = then.get(name, now["reference:exercise"])
        best = min(time, again[name])
        print(f"{name:24}{old:10.2f}{best:10.2f}{best / old:8.3f}{time / again[name]:8.3f}")


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path, metavar="BEFORE")
    main(parser.parse_args().before)
