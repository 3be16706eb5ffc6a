"""The conventions of all engines as the conformance suite measures them: nothing here is typed
in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from crosscheck2d.adapters.conformance.conform import PROBES, Finding, conform
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.reports.page.style import number

ASKED = (
    "free_flight",
    "restitution_0.1",
    "restitution_2",
    "restitution_wall",
    "friction",
    "friction_0",
    "friction_1",
    "friction_at_rest",
    "slow_flight",
    "fast_flight",
    "fast_spin",
    "spins_freely",
    "pair_momentum",
)

ZERO = "0 to rounding"
# A reading adds up to 64 steps, each rounded, of numbers up to 10 (m, m/s): the largest measured is
# 126 times the rounding, the distance of reference:ordered from the parabola.
ROUNDINGS = 500


@dataclass(frozen=True)
class Convention:
    """One probe over all engines: the question, what a scene's own physics would give, and what
    each gave."""

    asked: str
    expected: str
    got: dict[str, tuple[str, str]]  # engine:profile -> reading, verdict


def table(engines: Mapping[str, EngineRow]) -> list[Convention]:
    """The physics probes put to every engine now, in the order of `ASKED`; a few seconds."""
    findings = {
        name: {each.probe: each for each in conform(name, row)} for name, row in engines.items()
    }
    rows = []
    for probe in ASKED:
        answers = {name: found[probe] for name, found in findings.items() if probe in found}
        expected = (
            "0 if exact" if probe == "free_flight" else number(stated(list(answers.values())))
        )
        got = {
            name: (reading(each, engines[name].rounding), each.verdict)
            for name, each in answers.items()
        }
        rows.append(Convention(PROBES[probe].asked, expected, got))
    return rows


def stated(answers: Sequence[Finding]) -> float | str:
    """What the scene's own physics would give: a number, unless no engine models it."""
    expected = [each.expected for each in answers]
    return next((each for each in expected if not isinstance(each, str)), expected[0])


def reading(found: Finding, rounding: float) -> str:
    """What an engine gave, with as many digits as it takes to see that it departs from what is
    expected; what is not 0 only by the relative `rounding` of the engine's numbers is called so."""
    if not isinstance(found.got, str) and 0 < abs(found.got) < ROUNDINGS * rounding:
        return ZERO
    digits = range(3, 10) if found.verdict == "departs" else [3]
    return next(
        (text for d in digits if (text := number(found.got, d)) != number(found.expected, d)),
        number(found.got),
    )
