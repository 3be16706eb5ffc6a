"""Times the things to compare in interleaved, shuffled rounds, and keeps every sample."""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from math import inf
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.host.process import processes_reused
from crosscheck2d.reports.run.stepping import Spent
from crosscheck2d.scenarios.model import Array

# s, least duration of a sample: some 10 000 ticks of the clock, so that reading it costs nothing
LEAST = 1e-3
MOST_RUNS = 20  # runs in one sample, because setting up takes time, too
FEWEST_ROUNDS = 3  # rounds of a run so long that its time is used up earlier
WARM_UP = -1  # the warm-up round, which is stored but not counted


class Timed(NamedTuple):
    """One thing to be timed: `run` sets up, runs once, and returns the time spent; one run is worth
    `amount`.

    The cost is per unit of `amount`: a simulated second, or a step.
    """

    key: Any
    run: Callable[[], Spent]
    amount: float


class Sample(NamedTuple):
    """One measurement: its key, its round and place in the round, s per unit of amount, and number
    of runs."""

    key: Any
    round: int
    place: int
    cost: float
    wrapping: float
    runs: int


class Noise(NamedTuple):
    """The ratios of an engine's time to a second timing of it, of `pairs` pairs: median, quartiles,
    least and largest."""

    pairs: int
    low: float
    median: float
    high: float
    least: float
    most: float

    @property
    def floor(self) -> float:
        """The largest distance from 1 of the middle half of the ratios; inf if nothing was timed
        twice."""
        return max(abs(self.low - 1), abs(self.high - 1)) if self.pairs else inf


def noise_of(ratios: Sequence[float] | Array) -> Noise:
    if not len(ratios):
        return Noise(0, *[np.nan] * 5)
    low, median, high, least, most = np.percentile(ratios, [25, 50, 75, 0, 100]).tolist()
    return Noise(len(ratios), low, median, high, least, most)


def interleaved(
    what: Sequence[Timed],
    rounds: int,
    budget: float,
    seed: int,
    limit: float = inf,
    fewest: int = FEWEST_ROUNDS,
) -> list[Sample]:
    """Samples of all of `what`, the warm-up round first; each round visits everything in a new
    random order.

    A thing that has used `budget` s skips the remaining rounds, but never the first `fewest` after
    the warm-up. Slow changes of the machine (heat, clock, other processes) thus affect all alike.
    The garbage collector is off meanwhile, as in `timeit`. The process of a solver's file is
    reused, because starting one takes longer than most samples. It ends after `limit` s, and an
    incomplete last round is left out.
    """
    rng = np.random.default_rng(seed)
    spent = {one.key: 0.0 for one in what}
    samples: list[Sample] = []
    end = perf_counter() + limit
    collecting = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        with processes_reused():
            for k in range(WARM_UP, rounds):
                whole = len(samples)
                for place, index in enumerate(rng.permutation(len(what))):
                    one = what[index]
                    if perf_counter() > end:
                        return samples[:whole]
                    if k < fewest or spent[one.key] < budget:
                        sample = sampled(one, k, place)
                        spent[one.key] += (sample.cost + sample.wrapping) * one.amount * sample.runs
                        samples.append(sample)
    finally:
        if collecting:
            gc.enable()
    return samples


def sampled(one: Timed, k: int, place: int) -> Sample:
    seconds, wrapping, runs = 0.0, 0.0, 0
    while runs == 0 or (seconds < LEAST and runs < MOST_RUNS):
        spent = one.run()
        seconds, wrapping, runs = seconds + spent.seconds, wrapping + spent.wrapping, runs + 1
    per = runs * one.amount
    return Sample(one.key, k, place, (seconds - wrapping) / per, wrapping / per, runs)
