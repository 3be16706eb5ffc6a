"""Gives every limit its cause: the matching row of the table of reasons, or what was found by
playing the failing run again.

A reason is shown by the limit that it predicts, by the limit of a variant, by an intervention
or by an ablation; a reason that nothing shows is called likely.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from crosscheck2d.reports.compare.causes import LATE, Cause, CauseKind, by_mechanisms
from crosscheck2d.reports.stability.ablations import sufficient_mechanisms
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.interventions import (
    FIRST,
    SAYS_SO,
    cause_by_replays,
    intervention_of,
    with_settings,
)
from crosscheck2d.reports.stability.limits import NEVER_FAILS, Limit
from crosscheck2d.reports.stability.reasons import LAWS, Reason, reason_of
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
    if reason is not None and predicted(limit, reason):
        return limit
    alone = limit.engine.endswith(":shipped") and not limit.case.startswith("dt_")
    settings_first = reason is None and (alone or limit.case not in CASES)
    if settings_first:
        limit = replace(limit, intervention=intervention_of(search, limit, FIRST))
        limit = limit if limit.intervention else with_settings(search, limit)
        if limit.intervention or limit.settings_help:
            return limit
    limit = replace(limit, mechanisms=sufficient_mechanisms(search, limit))
    if limit.mechanisms or reason:
        return limit
    limit = limit if settings_first else with_settings(search, limit)
    if limit.settings_help:
        return limit
    return replace(limit, intervention=intervention_of(search, limit))


def explained(limits: Sequence[Limit]) -> list[Limit]:
    """The limits with their causes, each shown where that is possible: by the limit itself, or by
    the limit of its variant. A search that was lost has none."""
    by_name = {(limit.case, limit.engine): limit for limit in limits}
    return [
        replace(limit, cause=cause_of(limit, by_name)) if limit.status == "ok" else limit
        for limit in limits
    ]


def cause_of(limit: Limit, by_name: Mapping[tuple[str, str], Limit]) -> Cause | None:
    """Why it fails. A reason from the table that nothing else shows is replaced if an ablation
    shows another cause."""
    reason = reason_of(limit)
    if reason is None:
        varies = CASES[limit.case].varies if limit.case in CASES else limit.case.rpartition(":")[2]
        return cause_by_replays(limit, varies)
    law, shown = LAWS[reason.law], ways_shown(limit, reason, by_name)
    text, source = law.text, law.source
    if limit.mechanisms:
        ablation = by_mechanisms(limit.mechanisms, limit.engine)
        if law.mechanism in limit.mechanisms:
            shown.append(ablation.shown)
        elif law.mechanism == LATE:  # which every ablation has
            text, source = f"{text}; {ablation.text}", f"{source}; {ablation.source}"
            shown.append(ablation.shown)
        elif not shown:
            return ablation
    return Cause(CauseKind.LAW, text, source, "; ".join(shown))


def ways_shown(limit: Limit, reason: Reason, by_name: Mapping[tuple[str, str], Limit]) -> list[str]:
    """What confirms the reason, apart from an ablation."""
    shown = []
    if predicted(limit, reason):
        shown.append(f"predicts {reason.predicts:.4g}")
    variant = reason.variant_of(limit.engine)
    varied = by_name.get((limit.case, variant))
    if varied and farther(varied, limit):
        shown.append(f"{variant} gets farther")
    return [*shown, SAYS_SO] if limit.refused else shown


def predicted(limit: Limit, reason: Reason) -> bool:
    """Whether the limit that follows from the reason lies in the bracket, or outside by no more
    than the factor `NEAR`."""
    if reason.predicts is None:
        return False
    low, high = min(limit.works_at, limit.fails_at), max(limit.works_at, limit.fails_at)
    return low / NEAR <= reason.predicts <= high * NEAR


def farther(varied: Limit, limit: Limit) -> bool:
    """Whether `varied` fails at a harsher value than the other, or not at all."""
    if varied.verdict == NEVER_FAILS:
        return limit.verdict != NEVER_FAILS
    harsher = CASES[varied.case].harsher
    return harsher * varied.fails_at > harsher * limit.fails_at
