"""Gives every limit its reason: the matching row of the table of reasons, or what was found by
playing the failing run again.

A reason is tested by the limit that it predicts, by the limit of a variant, by an intervention
or by an ablation; a reason without a test is called likely.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from crosscheck2d.reports.stability.ablations import (
    END_OF_STEP,
    reason_by_ablation,
    sufficient_mechanisms,
)
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.interventions import (
    FIRST,
    SAYS_SO,
    intervention_of,
    reason_by_intervention,
    with_settings,
)
from crosscheck2d.reports.stability.limits import NEVER_FAILS, Limit
from crosscheck2d.reports.stability.reasons import Reason, reason_of
from crosscheck2d.reports.stability.search import LimitSearch

# the factor by which a prediction may be off: the width of the quick form's bracket; and collisions
# are not all lost at one value
NEAR = 1.05


def with_replays(search: LimitSearch, limit: Limit) -> Limit:
    """The limit with what was found by playing its failing run again: the settings that remove it,
    the mechanisms that are enough to produce it, or another intervention that removes it.

    A reason from the table whose predicted limit fits needs no more; otherwise only an ablation can
    confirm it. In a scene of somebody's own, and as shipped in a case of one thing, the settings
    come first: they say what to do.
    """
    reason = reason_of(limit)
    if reason is not None and reason.predicts is not None and brackets(limit, reason.predicts):
        return limit
    alone = limit.engine.endswith(":shipped") and not limit.case.startswith("dt_")
    if own := reason is None and (alone or limit.case not in CASES):
        limit = replace(limit, intervention=intervention_of(search, limit, FIRST))
        limit = limit if limit.intervention else with_settings(search, limit)
        if limit.intervention or limit.settings_help:
            return limit
    limit = replace(limit, mechanisms=sufficient_mechanisms(search, limit))
    if limit.mechanisms or reason:
        return limit
    limit = limit if own else with_settings(search, limit)
    if limit.settings_help:
        return limit
    return replace(limit, intervention=intervention_of(search, limit))


def explained(limits: Sequence[Limit]) -> list[Limit]:
    """The limits with their reasons, each tested where that is possible: by the limit itself, or
    by the limit of its variant."""
    by_name = {(limit.case, limit.engine): limit for limit in limits}
    return [with_reason(limit, by_name) for limit in limits]


def with_reason(limit: Limit, by_name: Mapping[tuple[str, str], Limit]) -> Limit:
    """The limit with its reason and with how that reason was tested ("" if it was not, or if the
    test failed).

    A reason from the table that no other test confirms is replaced if an ablation shows another
    cause.
    """
    if limit.status != "ok":
        return limit
    text, source, tested = explanation(limit, by_name)
    return replace(limit, reason=text, source=source, tested=tested)


def explanation(limit: Limit, by_name: Mapping[tuple[str, str], Limit]) -> tuple[str, str, str]:
    """The reason, its source, and how it was tested, or ""."""
    reason = reason_of(limit)
    if reason is None:
        varies = CASES[limit.case].varies if limit.case in CASES else limit.case.rpartition(":")[2]
        return reason_by_intervention(limit, varies)
    text, source, tests = reason.text, reason.source, tests_of(limit, reason, by_name)
    if limit.mechanisms:
        cause, its_source, shown = reason_by_ablation(limit)
        if reason.mechanism in limit.mechanisms.split(", "):
            tests.append(shown)
        elif reason.mechanism == END_OF_STEP:  # which every ablation has
            text, source = f"{text}; {cause}", f"{source}; {its_source}"
            tests.append(shown)
        elif not tests:
            return cause, its_source, shown
    return text, source, "; ".join(tests)


def tests_of(limit: Limit, reason: Reason, by_name: Mapping[tuple[str, str], Limit]) -> list[str]:
    """The tests that confirm the reason, apart from an ablation."""
    tests = []
    if reason.predicts is not None and brackets(limit, reason.predicts):
        tests.append(f"predicts {reason.predicts:.4g}")
    variant = reason.variant_of(limit.engine)
    other = by_name.get((limit.case, variant))
    if other and farther(other, limit):
        tests.append(f"{variant} gets farther")
    if limit.refused:
        tests.append(SAYS_SO)
    return tests


def brackets(limit: Limit, value: float) -> bool:
    """Whether the value lies in the bracket, or outside by no more than the factor `NEAR`."""
    low, high = min(limit.works_at, limit.fails_at), max(limit.works_at, limit.fails_at)
    return low / NEAR <= value <= high * NEAR


def farther(one: Limit, other: Limit) -> bool:
    """Whether `one` fails at a harsher value than the other, or not at all."""
    if one.verdict == NEVER_FAILS:
        return other.verdict != NEVER_FAILS
    harsher = CASES[one.case].harsher
    return harsher * one.fails_at > harsher * other.fails_at
