"""Which mechanisms of an engine are enough to produce its limit: the reference with only these
works and fails at the same values as the engine.

`adapters/mechanisms/table.py` lists what an engine does differently from exact flight with
end-of-step detection, and `adapters/mechanisms/ablated_reference.py` can enable each of these
mechanisms. An ablation is the reference with some of them enabled. An ablation that has the
engine's limit shows its cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import isnan

from crosscheck2d.adapters.mechanisms.table import (
    MECHANISMS,
    Mechanism,
    mechanisms_of,
    with_mechanisms,
)
from crosscheck2d.reports.compare.causes import LATE
from crosscheck2d.reports.compare.verdicts import Verdict
from crosscheck2d.reports.stability.limits import Case, Limit
from crosscheck2d.reports.stability.predicates import judge
from crosscheck2d.reports.stability.search import LimitSearch
from crosscheck2d.reports.stability.variants import DrivenEngine
from crosscheck2d.scenarios.model import Scenario

MOST = 300  # disks: the ablated reference tests all pairs
# where an engine works nowhere, the reading of its ablation must be the same within this factor
NEAR = 2.0


def sufficient_mechanisms(search: LimitSearch, limit: Limit) -> tuple[str, ...]:
    """The names of the smallest set of mechanisms with which the reference has the limit; `LATE`
    if it needs none, () if no set has the limit or no ablation can be played.

    Tried in this order: end-of-step detection alone; each mechanism alone (with those it acts
    on); all mechanisms, from which those that are not needed are then removed.
    """
    ablations = Ablations.of(search, limit)
    if ablations is None:
        return ()
    for mechanisms in ablations.simple():
        if ablations.alike(mechanisms):
            return tuple(mechanism.name for mechanism in mechanisms) or (LATE,)
    if not ablations.mechanisms or not ablations.alike(ablations.mechanisms):
        return ()
    return tuple(mechanism.name for mechanism in ablations.needed())


@dataclass(frozen=True)
class Ablations:
    """A case with the scenarios that fail and work next to a limit, the engine's mechanisms, and
    the verdict on its failing run.

    Attributes:
        bad: the first run that failed.
        good: all runs at the nearest value that works; empty if the engine works nowhere.
    """

    case: Case
    bad: Scenario
    good: list[Scenario]
    mechanisms: list[Mechanism]
    verdict: Verdict

    @staticmethod
    def of(search: LimitSearch, limit: Limit) -> Ablations | None:
        """None if nothing failed, nothing was played, or the engine has no known mechanisms."""
        failure, failing = search.failure(limit), limit.failing
        name, _, variant = search.engine.partition("+")
        if failure is None or failing is None or name not in MECHANISMS:
            return None
        (judged, run), scene = failure, search.case.scene
        bad = scene(limit.fails_at, failing.first)
        if run.trajectory is None or bad.scene.n > MOST:
            return None
        works = not isnan(limit.works_at)
        good = [scene(limit.works_at, run) for run in range(failing.runs if works else 0)]
        dt = bad.dt(bad.substeps[0])
        known = [] if variant else mechanisms_of(name, run.settings, bad.scene, dt)
        mechanisms = [mechanism for mechanism in known if mechanism.parameters]
        verdict = judge(search.case.predicate, judged, run)
        return Ablations(search.case, bad, good, mechanisms, verdict)

    def simple(self) -> Iterator[list[Mechanism]]:
        """No mechanism, then each one with those it acts on."""
        yield []
        for mechanism in self.mechanisms:
            below = [base for base in self.mechanisms if base.name in mechanism.on_top]
            yield [*below, mechanism]

    def needed(self) -> Sequence[Mechanism]:
        """The mechanisms that remain after removing, one after the other, each one without which
        the ablation still has the limit."""
        needed = list(self.mechanisms)
        for mechanism in self.mechanisms:
            fewer = [
                base
                for base in needed
                if base is not mechanism and mechanism.name not in base.on_top
            ]
            if self.alike(fewer):
                needed = fewer
        return needed

    def alike(self, mechanisms: Sequence[Mechanism]) -> bool:
        """Whether the ablation fails as the engine does at the limit, and works where the engine
        works."""
        verdict = self.judge(self.bad, mechanisms)
        if not verdict.failed or verdict.id != self.verdict.id:
            return False
        if self.good:
            failed = sum(self.judge(scenario, mechanisms).failed for scenario in self.good)
            return failed <= self.case.by_chance * len(self.good)
        return 1 / NEAR <= verdict.value / self.verdict.value <= NEAR

    def judge(self, scenario: Scenario, mechanisms: Sequence[Mechanism]) -> Verdict:
        """The verdict of the predicate on the ablation's run or runs."""
        ablation = DrivenEngine("reference:ablation", partial(with_mechanisms, mechanisms))
        return judge(self.case.predicate, *self.case.play(ablation, scenario))
