"""Whether what `crosscheck advise` says is right, by measuring anew:
`python -m tests.bench.advice [SCENE ...]`, a quarter of an hour alone on the machine.

Every engine is played at every step size of every scene, and all that keeps the error at that and
every finer step size, from nine tenths of the instants of a step and without a failed verdict, is
timed. What was advised must be among it, and nothing may cost less by more
than one of the two engines differs from itself: the runs of a scene of one collision take
microseconds, and of nine step sizes of one engine the least is low by chance.
"""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from math import log

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.speed.advice import (
    LOUD,
    Inquiry,
    NoAdvice,
    Requirement,
    those_that_keep,
)
from crosscheck2d.reports.speed.plan import PLAIN
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS

BOUND, PURPOSE, SEED = 0.01, "trajectory", 0


def main(scenes: list[str]) -> int:
    wrong = 0
    for scene in scenes:
        with Progress() as progress:
            try:
                line, right = measured_anew(scene, progress)
            except NoAdvice as why:
                line, right = str(why), True
        print(f"{scene:28} {'' if right else 'WRONG: '}{line}", flush=True)
        wrong += not right
    print(f"{len(scenes) - wrong} of {len(scenes)} right")
    return int(bool(wrong))


def measured_anew(scene: str, progress: Progress) -> tuple[str, bool]:
    requirement = Requirement(scene, SEED, PURPOSE, BOUND)
    asked = Inquiry(requirement, os.cpu_count() or 1, progress)
    advice = asked.advise(list(ENGINES))
    keeping = []
    for name in ENGINES:
        tried = asked.attempts((name, PLAIN, k) for k in asked.ladder)
        able, _ = asked.to_the_end(those_that_keep(tried, BOUND))
        every = asked.from_every_start(able)
        keeping += [one for one in every if one.holds(BOUND)]
    advised = advice["cheapest_first"]
    if not advised or not keeping:
        return "none", not advised and not keeping
    again, apart, _ = asked.timed(keeping)
    cheapest = min(again, key=lambda one: one.cost)
    best = min(advised, key=lambda row: row["us_per_simulated_s"])
    same = [one for one in again if (one.name, one.dt) == (best["engine"], best["dt_s"])]
    ratio = same[0].cost / cheapest.cost if same else float("inf")
    name, other = best["engine"], cheapest.name
    noise = max(far for (who, _), far in apart.items() if who in (name, other))
    least = f"{cheapest.name} at {cheapest.dt:.3g} s"
    said = f"{name} at {best['dt_s']:.3g} s, {ratio:.2f} of the least ({least}; noise {noise:.0%})"
    return said, log(ratio) <= max(noise, LOUD)


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="*", default=list(SCENARIOS), metavar="SCENE")
    scenes = parser.parse_args().scene
    if unknown := set(scenes) - set(SCENARIOS):
        parser.error(f"no scene of that name: {', '.join(sorted(unknown))}")
    sys.exit(main(scenes))
