"""Gives every limit its cause: the matching row of the table of reasons, or what playing the
failing run again shows.

A reason is shown by the limit that it predicts, by the limit of a variant, by an intervention (the
failing run with one thing changed works), or by an ablation: the reference with only these
mechanisms of the engine (`adapters/mechanisms/table.py`) works and fails at the same values. A
reason that nothing shows is called likely.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatch
from functools import partial
from math import isnan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.mechanisms.settings import find_remedy, settings_of, without_finer
from crosscheck2d.adapters.mechanisms.table import (
    MECHANISMS,
    Mechanism,
    mechanisms_of,
    with_mechanisms,
)
from crosscheck2d.reports.compare.causes import (
    ACTS_AT_END,
    LATE,
    Cause,
    CauseKind,
    by_mechanisms,
    unknown,
)
from crosscheck2d.reports.compare.collisions import ALONG, first_on_line
from crosscheck2d.reports.compare.verdicts import Verdict
from crosscheck2d.reports.stability.cases import CASES, GHOST, similar
from crosscheck2d.reports.stability.limits import (
    NEVER_FAILS,
    DrivenEngine,
    Limit,
    LimitSearch,
    play_as,
    step_size,
)
from crosscheck2d.reports.stability.predicates import REFUSED, judge
from crosscheck2d.scenarios.model import Array, Scenario, Scene
from crosscheck2d.scenarios.truth.exact import with_oracle

# the factor by which a prediction may be off: the width of the quick form's bracket; and collisions
# are not all lost at one value
NEAR = 1.05
MOST = 300  # disks: the ablated reference tests all pairs
# where an engine works nowhere, the reading of its ablation must be the same within this factor
ALIKE = 2.0
FINER = 8
SAYS_SO = "the engine's message says so"


class Law(NamedTuple):
    text: str  # what happens
    source: str
    mechanism: str = ""


class Reason(NamedTuple):
    """A row of reasons.toml, which has the meaning of its fields."""

    cases: str
    engines: str
    law: str
    predicts: float | None = None
    variant: str = ""

    def fits(self, limit: Limit) -> bool:
        pairs = (limit.case, self.cases), (limit.engine, self.engines)
        return all(any(fnmatch(name, p) for p in patterns.split()) for name, patterns in pairs)


TEXT = tomllib.loads(Path(__file__).with_name("reasons.toml").read_text(encoding="utf-8"))
LAWS = {name: Law(*row) for name, row in TEXT["laws"].items()}
REASONS = [Reason(**row) for row in TEXT["reasons"]]


def reason_of(limit: Limit) -> Reason | None:
    """The first row that fits; None if nothing failed. For a user's own scene only rows that
    hold in every scene."""
    if limit.verdict == NEVER_FAILS:
        return None
    rows = (row for row in REASONS if limit.case in CASES or row.cases == "*")
    return next((row for row in rows if row.fits(limit)), None)


def explained(limits: Sequence[Limit]) -> list[Limit]:
    """The limits with their final causes, some shown by the limit of a variant. A search that was
    lost has none."""
    by_name = {(limit.case, limit.engine): limit for limit in limits}
    return [replace(limit, cause=final_cause(limit, by_name)) for limit in limits]


def final_cause(limit: Limit, by_name: Mapping[tuple[str, str], Limit]) -> Cause | None:
    # An ablation that shows another cause replaces a reason from the table that nothing else shows.
    ablation = by_mechanisms(limit.mechanisms, limit.engine) if limit.mechanisms else None
    reason = reason_of(limit)
    if reason is None or limit.status != "ok":
        return ablation or limit.cause
    law, shown = LAWS[reason.law], list[str]()
    text, source = law.text, law.source
    if predicted(limit, reason):
        shown.append(f"predicts {reason.predicts:.4g}")
    variant = reason.variant
    variant = limit.engine + variant if variant.startswith("+") else variant
    varied = by_name.get((limit.case, variant))
    if varied and farther(varied, limit):
        shown.append(f"{variant} gets farther")
    if limit.refused:
        shown.append(SAYS_SO)
    if ablation:
        if law.mechanism in limit.mechanisms:
            shown.append(ablation.shown)
        elif law.mechanism == LATE:  # which every ablation has
            text, source = f"{text}; {ablation.text}", f"{source}; {ablation.source}"
            shown.append(ablation.shown)
        elif not shown:
            return ablation
    return Cause(CauseKind.LAW, text, source, "; ".join(shown))


def predicted(limit: Limit, reason: Reason) -> bool:
    if reason.predicts is None:
        return False
    low, high = min(limit.works_at, limit.fails_at), max(limit.works_at, limit.fails_at)
    return low / NEAR <= reason.predicts <= high * NEAR


def farther(varied: Limit, limit: Limit) -> bool:
    if varied.verdict == NEVER_FAILS:
        return limit.verdict != NEVER_FAILS
    harsher = CASES[varied.case].harsher
    return harsher * varied.fails_at > harsher * limit.fails_at


def with_replays(search: LimitSearch, limit: Limit) -> Limit:
    """The limit with what playing its failing run again shows: the settings that remove it, the
    mechanisms that are enough to produce it, or another intervention that removes it.

    A reason from the table whose predicted limit fits needs no more; otherwise only an ablation can
    confirm it. In a scene of somebody's own, and as shipped in a case of one thing, the settings
    come first: they say what to do.
    """
    reason, failing = reason_of(limit), limit.failing
    if failing is None or (reason is not None and predicted(limit, reason)):
        return limit
    alone = limit.engine.endswith(":shipped") and not limit.case.startswith("dt_")
    settings = None
    if reason is None and (alone or limit.case not in CASES):
        if cause := cause_by_intervention(search, limit, INTERVENTIONS[:1]):
            return replace(limit, cause=cause)
        settings = cause_by_settings(search, limit)
        if settings.kind is CauseKind.SETTING:
            return replace(limit, cause=settings)
    mechanisms = sufficient_mechanisms(search, limit)
    if mechanisms or reason is not None:
        return replace(limit, mechanisms=mechanisms)
    settings = settings or cause_by_settings(search, limit)
    if settings.kind is CauseKind.SETTING:
        return replace(limit, cause=settings)
    cause = cause_by_intervention(search, limit, INTERVENTIONS)
    if cause is None and failing.broken == REFUSED:
        cause = Cause(CauseKind.REFUSAL, "the engine refuses it", shown=SAYS_SO)
    if cause is None:
        rows = (row for row in INTERVENTIONS[1:] if row.fits(search.engine, search.case.varies))
        tried = ", ".join(dict.fromkeys(row.how for row in rows))
        cause = unknown("", f"it also fails {tried}" if tried else "", settings.text)
    return replace(limit, cause=cause)


def sufficient_mechanisms(search: LimitSearch, limit: Limit) -> tuple[str, ...]:
    """The names of the smallest set of mechanisms with which the reference has the limit; `LATE`
    if it needs none, () if no set has the limit or no ablation can be played.

    Tried in this order: end-of-step detection alone; each mechanism alone (with those it acts
    on); all mechanisms, from which those that are not needed are then removed.
    """
    known, has_limit = ablations(search, limit)
    if has_limit is None:
        return ()
    for alone in ([], *([*(x for x in known if x.name in top.on_top), top] for top in known)):
        if has_limit(alone):
            return tuple(mechanism.name for mechanism in alone) or (LATE,)
    if not known or not has_limit(known):
        return ()
    needed = known
    for mechanism in known:
        fewer = [x for x in needed if x is not mechanism and mechanism.name not in x.on_top]
        needed = fewer if has_limit(fewer) else needed
    return tuple(mechanism.name for mechanism in needed)


def ablations(
    search: LimitSearch, limit: Limit
) -> tuple[list[Mechanism], Callable[[Sequence[Mechanism]], bool] | None]:
    """The mechanisms of the engine, and whether the reference with some of them has its limit: it
    fails as the engine does in the first run that failed, and works at the nearest value where the
    engine works; where that works nowhere, it reads as much as the engine. None if nothing failed,
    nothing was played, or the engine has no known mechanisms.
    """
    failure, failing, case = search.seen.get(limit.fails_at), limit.failing, search.case
    name, _, variant = search.engine.partition("+")
    if failure is None or failing is None or name not in MECHANISMS:
        return [], None
    judged, run = failure
    bad = case.scene(limit.fails_at, failing.first)
    if run.trajectory is None or bad.scene.n > MOST:
        return [], None
    works = not isnan(limit.works_at)
    good = [case.scene(limit.works_at, run) for run in range(failing.runs if works else 0)]
    known = [] if variant else mechanisms_of(name, run.settings, bad.scene, step_size(bad))
    of_engine = judge(case.predicate, judged, run)

    def verdict_on(scenario: Scenario, mechanisms: Sequence[Mechanism]) -> Verdict:
        ablation = DrivenEngine("reference:ablation", partial(with_mechanisms, mechanisms))
        return judge(case.predicate, *case.play(ablation, scenario))

    def has_limit(mechanisms: Sequence[Mechanism]) -> bool:
        verdict = verdict_on(bad, mechanisms)
        if not verdict.failed or verdict.id != of_engine.id:
            return False
        if good:
            failed = sum(verdict_on(scenario, mechanisms).failed for scenario in good)
            return failed <= case.by_chance * len(good)
        return 1 / ALIKE <= verdict.value / of_engine.value <= ALIKE

    return [mechanism for mechanism in known if mechanism.parameters], has_limit


def finer(scenario: Scenario, times: int = FINER) -> Scenario:
    return replace(scenario, substeps=(scenario.substeps[0] * times,))


def at_home(scenario: Scenario) -> Scenario:
    return similar(scenario, shift=-float(np.mean(scenario.scene.position[:, 0])))


def joined(scenario: Scenario) -> Scenario:
    walls, scene = list[Array](), scenario.scene
    lines = np.array([first_on_line(scene.walls, w) for w in range(len(scene.walls))])
    for line in np.unique(lines):
        start, end = scene.walls[line]
        way = end - start
        spans = np.sort((scene.walls[lines == line] - start) @ way / (way @ way), axis=1)
        spans = spans[spans[:, 0].argsort()]
        reach = np.maximum.accumulate(spans[:, 1])
        first = np.flatnonzero(np.append(True, spans[1:, 0] > reach[:-1] + ALONG))
        last = np.append(first[1:], len(spans)) - 1
        walls += [start + np.outer(pair, way) for pair in zip(spans[first, 0], reach[last])]
    whole: Scene = replace(scene, walls=np.array(walls).reshape(-1, 2, 2))
    return with_oracle(replace(scenario, scene=whole))


class Intervention(NamedTuple):
    """One change to a failing run."""

    engines: str  # patterns of engines and of what is varied, for which it is tried
    varied: str
    reason: str | None  # why it failed, if it works with the change; None: that is not known
    how: str  # the change in words
    change: Callable[[Scenario], Scenario] | None = None  # of the scene, if anything
    engine: str | None = None  # that plays it instead, if another does

    def fits(self, engine: str, varied: str) -> bool:
        return fnmatch(engine, self.engines) and fnmatch(varied, self.varied)


PIECES = "the walls of one floor act as several; join them into one wall"
FLOAT32 = "positions are float32, too coarse so far from the origin"
TOO_LARGE = f"{ACTS_AT_END}, and the step is too large for that"
UNSWEPT, EIGHTHS = "disks are not swept against each other", "in steps of an eighth"
ORDERED, BULLETS = "reference:ordered", "box2d_v3:matched+bullets"
# In the order in which they are tried: changes of one thing only come first, a finer step comes
# later. The settings of the engine come after the first row. Where the step itself is varied, a
# finer one is not tried.
INTERVENTIONS = (
    Intervention("*", "*", PIECES, "on a floor of one wall", joined),
    Intervention("box2d*", "offset", FLOAT32, "at the origin", at_home),
    Intervention("reference:[el]*", "*", ACTS_AT_END, f"as {ORDERED}", engine=ORDERED),
    # For matter a smaller step is ambiguous: its friction, its friction of the air and its resting
    # threshold depend on the step, too.
    Intervention("matter:*", "[!d]*", None, EIGHTHS, finer),
    Intervention("*", "[!d]*", TOO_LARGE, EIGHTHS, finer),
    Intervention("box2d_v3:matched", "*", UNSWEPT, f"as {BULLETS}", engine=BULLETS),
)


def cause_by_intervention(
    search: LimitSearch, limit: Limit, interventions: Sequence[Intervention]
) -> Cause | None:
    """From the first change with which the run that failed at the limit works."""
    scenario, failed = search.seen[limit.fails_at]
    if failed.status == "unsupported":  # a refusal needs no other explanation
        return None
    predicate = search.case.predicate
    for row in interventions:
        if not row.fits(search.engine, search.case.varies):
            continue
        changed = row.change(scenario) if row.change else scenario
        if judge(predicate, changed, play_as(row.engine or search.engine, changed)).failed:
            continue
        ghost = f"a {GHOST}: " * (limit.failing is not None and limit.failing.broken == GHOST)
        shown = f"works {row.how}"
        if row.reason is not None:
            return Cause(CauseKind.INTERVENTION, ghost + row.reason, shown=shown)
        cause = unknown(shown, "the step is too large for something in it")
        return cause._replace(text=ghost + cause.text)
    return None


def cause_by_settings(search: LimitSearch, limit: Limit) -> Cause:
    """From the settings of the engine with which the run that failed at the limit works; else of
    kind unknown, with those that do not help."""
    (scenario, failed), predicate = search.seen[limit.fails_at], search.case.predicate
    if failed.status == "unsupported" or "+" in search.engine:
        return Cause(CauseKind.UNKNOWN, "")

    def error(parameters: Mapping[str, Any]) -> float:
        chosen, steps = without_finer(parameters)
        driven = DrivenEngine(search.engine, partial(row_of(search.engine).make, **chosen))
        verdict = judge(predicate, *search.case.play(driven, finer(scenario, steps)))
        share = abs(verdict.value) / (predicate.bound or 1.0)
        if verdict.failed:
            return share if share > 1.0 else np.inf
        return float(np.fmin(share, 1.0))  # nan: there is nothing to judge

    settings = settings_of(search.engine, scenario.scene, step_size(scenario))
    remedy = find_remedy(settings, error, bound=1.0)
    if remedy.settings and remedy.after <= 1.0:
        return Cause(CauseKind.SETTING, remedy.sentence(search.engine), shown="works with it")
    return Cause(CauseKind.UNKNOWN, remedy._replace(settings=()).sentence(""))
