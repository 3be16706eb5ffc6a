"""The largest usable dt of every scenario of the suite."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from reports.stability.limits import Case
from reports.stability.predicates_usable import USABLE
from scenarios.catalogue import DRAWN, SCENARIOS, scenario
from scenarios.model import Scenario

FAMILY = "The largest dt of the suite's scenes"
SEEN = 300  # samples at most


def in_steps(whole: Scenario, dt: float) -> Scenario:
    """The scenario in steps as near to `dt` s as its duration allows, seen at `SEEN` instants at most."""
    steps = max(1, round(whole.duration / dt))
    every = -(-steps // SEEN)
    samples = -(-steps // every)
    return replace(whole, sample_interval=whole.duration / samples, substeps=(every,))


def at_dt(name: str, x: float, run: int, _of: int) -> Scenario:
    """x = dt in s; the number of the run is the seed."""
    return in_steps(scenario(name, run), x)


def ladder(one: Scenario) -> tuple[float, ...]:
    """s, from an eighth of the sample interval to a tenth of the duration."""
    steps = [one.sample_interval * 2.0**k for k in range(-3, 20)]
    return tuple(dt for dt in steps if dt <= one.duration / 10)


SUITE = tuple(
    Case(
        f"dt_{name}", FAMILY, build().asks, "dt", "s", ladder(build()), partial(at_dt, name), USABLE,
        drawn=name in DRAWN, ratio=1.2, quick_values=ladder(build())[1::2], quick_runs=1,
    )
    for name, build in SCENARIOS.items()
)  # fmt: skip
