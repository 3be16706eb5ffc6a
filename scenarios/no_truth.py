"""The exception for scenes without an exact answer, and the function that asks for an answer."""

from __future__ import annotations

from dataclasses import replace

from crosscheck2d.scenarios.model import Scenario, Trajectory


class NoTruth(ValueError):
    """A scene has no exact answer from `at` s on; str() says why, in one sentence."""

    def __init__(self, reason: str, at: float = 0.0) -> None:
        super().__init__(reason)
        self.at = at


def answered(scenario: Scenario) -> tuple[Scenario, Trajectory | None]:
    """The scenario and its truth at its samples; if there is none, the scenario has the reason."""
    if scenario.truth is None:
        return scenario, None
    try:
        return scenario, scenario.truth(scenario.times)
    except NoTruth as refusal:
        return replace(scenario, truth=None, without_truth=str(refusal)), None
