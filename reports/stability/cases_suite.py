"""The largest usable dt of every scenario of the suite."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from crosscheck2d.reports.stability.limits import Case
from crosscheck2d.reports.stability.predicates_usable import USABLE
from crosscheck2d.scenarios.catalogue import RANDOM, SCENARIOS, scenario
from crosscheck2d.scenarios.model import Scenario

MOST_SAMPLES = 300  # samples at most


def in_steps(whole: Scenario, dt: float) -> Scenario:
    """The scenario with a step as near to `dt` s as its duration allows, sampled at most
    `MOST_SAMPLES` times."""
    steps = max(1, round(whole.duration / dt))
    every = -(-steps // MOST_SAMPLES)
    samples = -(-steps // every)
    return replace(whole, sample_interval=whole.duration / samples, substeps=(every,))


def at_dt(name: str, x: float, run: int) -> Scenario:
    """x = dt in s; the seed is the number of the run."""
    return in_steps(scenario(name, run), x)


def ladder(one: Scenario, an_octave: int = 1) -> tuple[float, ...]:
    """Step sizes in s, a fixed number for each factor of two, from an eighth of the sample
    interval to a tenth of the duration."""
    steps = [one.sample_interval * 2.0 ** (k / an_octave - 3) for k in range(23 * an_octave)]
    return tuple(dt for dt in steps if dt <= one.duration / 10)


def dense_ladder(one: Scenario) -> tuple[float, ...]:
    """Step sizes in s, as `ladder`, and from the sample interval on four for each factor of two
    (two where a run is long).

    In a scene without random numbers each dt puts the collisions at other places within their
    steps: failures appear at scattered step sizes, and only a dense scan finds the first. Finer
    steps seldom fail and cost most. Both forms scan the same step sizes.
    """
    steps = one.duration / one.sample_interval * 8
    close = ladder(one, 2 if one.scene.n * steps > LONG else 4)
    return tuple(sorted({*ladder(one), *(dt for dt in close if dt > one.sample_interval)}))


LONG = 2e4  # steps of a disk
SEEDS = 4  # runs at a value of a random scene

SUITE = tuple(
    Case(
        f"dt_{name}",
        partial(at_dt, name),
        "dt",
        dense_ladder(build()),
        USABLE,
        build().asks,
        unit="s",
        runs=SEEDS if name in RANDOM else 1,
        ratio=1.2,
        refines=False,
        report=name,
    )
    for name, build in SCENARIOS.items()
    if not build().scene.friction  # the kept limits are of the scenes without
)
