"""The exception for scenes without an exact answer, and the functions that request an answer."""

from __future__ import annotations

from dataclasses import replace

from scenarios.model import Array, Scenario, Trajectory


class NoTruth(ValueError):
    """A scene has no exact answer from `at` s on; str() says why, in one sentence."""

    def __init__(self, reason: str, at: float = 0.0) -> None:
        super().__init__(reason)
        self.at = at


def truth_at(scenario: Scenario, t: Array) -> Trajectory:
    """The exact `Trajectory` at all the times t (k,) s, increasing; `scenario.truth(t)` stops at
    the horizon.

    Raises:
        NoTruth: there is none, or a time is beyond its horizon; gives the horizon and the reason.
    """
    if scenario.truth is None:
        raise NoTruth(scenario.without_truth)
    truth = scenario.truth(t)
    if len(truth) < len(t):
        late, until = t[len(truth)], truth.horizon
        why = f": {truth.reason}" if truth.reason else ""
        raise NoTruth(
            f"t = {late:.9g} s: the truth of {scenario.name} ends at its horizon at {until:.9g}"
            f" s{why}",
            until,
        )
    return truth


def answered(scenario: Scenario) -> tuple[Scenario, Trajectory | None]:
    """The scenario and its truth at its samples; if there is none, the scenario has the reason."""
    if scenario.truth is None:
        return scenario, None
    try:
        return scenario, scenario.truth(scenario.times)
    except NoTruth as refusal:
        return replace(scenario, truth=None, without_truth=str(refusal)), None
