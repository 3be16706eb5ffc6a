"""The findings: sentences computed from the scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from types import MappingProxyType

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.engines import OWN as OWN_PROFILE
from crosscheck2d.adapters.friction import REFUSAL
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.verdicts import failures_at
from crosscheck2d.reports.page import pooled
from crosscheck2d.reports.page.situations import EXACT, FAR_OFF, RIGHT, YOURS, by_friction, grouped
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.terminal.counts import counted, listed
from crosscheck2d.scenarios.catalogue import SCENARIOS

PROJECT = {name for name, row in ENGINES.items() if not row.outside}
FEW = 1  # scenes that are named of each engine that fails


def findings(comparisons: Sequence[Comparison], untrusted: Set[str]) -> list[str]:
    """The closest engines, the effect of settings, the failures. Before them come the reader's own
    solvers, after them the solvers with time-of-impact ordering, the ends of the exact answers, the
    refusals, and last the closest engines in scenes with friction, if there are others. Engines in
    `untrusted` are left out."""
    smooth, rough = by_friction(comparisons)
    sentences = [
        *findings_alike(smooth, untrusted),
        *early_ends(comparisons),
        *refusals(comparisons),
    ]
    if not rough:
        return sentences
    scores = pooled.scores(rough)
    scores = scores[scores.middle & ~scores.name.isin(untrusted)]
    groups = grouped(dict.fromkeys(scores.name))
    off = ranked(position_errors(scores, rough), groups)
    played = [name for name in off.columns if np.isfinite(off[name]).any()]
    said = closest(off[played or list(off.columns)])  # one that refuses friction is not the last
    broken = " ".join(failing(broken_laws(rough, untrusted), len(rough)))
    return [
        *sentences,
        f"Scenes with friction, which are not counted above. {said} {broken}".strip(),
    ]


def findings_alike(comparisons: Sequence[Comparison], untrusted: Set[str]) -> list[str]:
    """The findings of scenes that all have friction or all have none."""
    scores = pooled.scores(comparisons)
    scores = scores[scores.middle & ~scores.name.isin(untrusted)]
    groups = grouped(dict.fromkeys(scores.name))
    refused = not_asked(comparisons)
    off = position_errors(scores, comparisons)
    for name in refused.keys() & off.columns:
        off.loc[off.index.isin(refused[name]), name] = np.nan
    engines = ranked(off, groups)
    statuses = [
        run.status
        for comparison in comparisons
        for run in comparison.runs
        if comparison.scenario.name not in refused.get(run.name, ())
    ]
    everyone, engines = engines is off, engines.dropna(axis="columns", how="all")
    broken = broken_laws(comparisons, untrusted)
    sentences = [
        closest(engines),
        *failing({k: v for k, v in broken.items() if everyone or k in engines}, len(comparisons)),
        *worth_of_settings(engines),
        where_it_fails(engines, statuses),
    ]
    own = [
        unranked_sentence(name, off, FAR_OFF, len(refused.get(name, ())), broken.get(name, {}))
        for name in groups.get(YOURS, [])
    ]
    exact = [unranked_sentence(k, off, RIGHT, 0, broken.get(k, {})) for k in groups.get(EXACT, [])]
    return sentences if everyone else [*own, *sentences, *exact]


def broken_laws(
    comparisons: Sequence[Comparison], untrusted: Set[str]
) -> dict[str, dict[str, str]]:
    """Engine -> scene -> the verdict that it fails at the middle step size, in words; this
    project's solvers first, then those that fail most."""
    scenes: dict[str, dict[str, str]] = {}
    for comparison in comparisons:
        for name, words in failures_at(comparison.table, comparison.middle_dt).items():
            if name not in untrusted:
                scenes.setdefault(name, {})[comparison.scenario.name] = words
    order = sorted(scenes, key=lambda name: (name not in PROJECT, -len(scenes[name])))
    return {name: scenes[name] for name in order}


def where_broken(broken: Mapping[str, str], scenes: int) -> str:
    """ "fails in 3 of 50 scenes (tunnels in falling_box, ...)", of one scene "tunnels"; "" if it
    does not."""
    if scenes == 1 or not broken:
        return "".join(broken.values())
    named = [f"{words} in {scene}" for scene, words in broken.items()]
    more = ", ..." if len(named) > FEW else ""
    return f"fails in {len(named)} of {counted(scenes, 'scene')} ({', '.join(named[:FEW])}{more})"


def failing(broken: Mapping[str, Mapping[str, str]], scenes: int) -> list[str]:
    """A sentence on the engines that break a law, whatever their distance from the exact answer."""
    said = "; ".join(f"{name} {where_broken(each, scenes)}" for name, each in broken.items())
    return [f"Laws broken anywhere in a scene: {said}."] if said else []


def early_ends(comparisons: Sequence[Comparison]) -> list[str]:
    """A sentence for each scene of the reader's own whose exact answer ends before the scene."""
    return [
        f"The exact answer of {scenario.name} ends at {number(truth.horizon)} s of"
        f" {number(scenario.duration)} s, and no error after that counts"
        f"{f': {truth.reason}' if truth.reason else ''}."
        for scenario, truth in ((each.scenario, each.truth) for each in comparisons)
        if scenario.name not in SCENARIOS and truth and truth.horizon < scenario.duration
    ]


def refusals(comparisons: Sequence[Comparison]) -> list[str]:
    """A sentence for each reason for which cells were refused. That an engine does not model
    friction stands in the summary of the scenes with friction."""
    whose: dict[str, list[str]] = {}
    for comparison in comparisons:
        for run in comparison.runs:
            if run.status == "unsupported" and REFUSAL not in run.reason:
                whose.setdefault(run.reason, []).append(run.name.removesuffix(OWN_PROFILE))
    return [
        f"{listed(list(dict.fromkeys(names)))} refused {counted(len(names), 'cell')}: {reason}."
        for reason, names in whose.items()
    ]


def ranked(off: pd.DataFrame, groups: Mapping[str, Sequence[str]]) -> pd.DataFrame:
    """The columns of `position_errors` of the ranked engines: all but the reader's own solver and
    solvers with time-of-impact ordering. If nothing else was played, these."""
    unranked = [name for group in (YOURS, EXACT) for name in groups.get(group, [])]
    return off if len(unranked) == off.shape[1] else off.drop(columns=unranked)


def not_asked(comparisons: Sequence[Comparison]) -> dict[str, set[str]]:
    """Engine -> the scenes whose refusal is no failure: those that a solver's own file refuses, as
    the exercise does not ask for them, and those with friction, which an engine need not model."""
    found: dict[str, set[str]] = {}
    for comparison in comparisons:
        for run in comparison.runs:
            if run.status == "unsupported" and (
                run.name.endswith(OWN_PROFILE) or REFUSAL in run.reason
            ):
                found.setdefault(run.name, set()).add(comparison.scenario.name)
    return found


def not_counted(broken: Mapping[str, str]) -> list[str]:
    """A sentence for each engine that broke the protocol; `broken`: name -> the probe that failed,
    and how."""
    return [
        f"Not counted: {name.removesuffix(OWN_PROFILE)} breaks the protocol of the harness. {how}"
        for name, how in sorted(broken.items())
    ]


def position_errors(scores: pd.DataFrame, comparisons: Sequence[Comparison]) -> pd.DataFrame:
    """Largest deviation from the truth in radii at the middle dt: a row for each scenario with
    `scores`, a column for each `engine:profile`.

    `inf` for an engine without a result, so that refusing a hard scene is no advantage.
    """
    scored = [
        each.scenario.name
        for each in comparisons
        if pooled.scored(each) or each.scenario.name in set(scores.scenario)
    ]
    names = list(dict.fromkeys(scores.name))
    table = scores.pivot(index="scenario", columns="name", values="error")
    return table.reindex(index=scored, columns=names)


def unranked_sentence(
    name: str,
    off: pd.DataFrame,
    within: float,
    refused: int,
    broken: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """A sentence on an engine that is not ranked: where it breaks a law (`broken`: scene -> how);
    the number of scenes with an error of at most `within` radii; those with an error above a
    radius, the worst first; those without a result; and the number `refused` of those not played by
    design."""
    errors = off[name].dropna()
    far = errors[(errors > FAR_OFF) & np.isfinite(errors)].sort_values(ascending=False)
    lost = [scene for scene in errors.index[np.isinf(errors)] if scene not in broken]
    bound = f"{number(within)} {'radius' if within == 1 else 'radii'} of the exact answer"
    inside = int((errors <= within).sum())
    if len(errors) == 1:
        said = f"is {'' if inside else 'not '}within {bound}"
    else:
        said = f"is within {bound} in {inside} of {len(errors)} scenes"
    fails = where_broken(broken, max(len(errors), len(broken)))
    parts = [f"{name.removesuffix(OWN_PROFILE)} {', '.join(filter(None, (fails, said)))}"]
    if len(far):
        parts.append(f"off by {number(far.iloc[0], 2)} radii in {far.index[0]}")
        if len(far) > 1:
            parts.append(f"by more than a radius in {len(far) - 1} more")
    if lost:
        more = f" and {len(lost) - 3} more" if len(lost) > 3 else ""
        parts.append(f"without a result in {', '.join(lost[:3])}{more}")
    if refused:
        parts.append(f"not asked in {counted(refused, 'scene')}")
    return f"{', '.join(parts)}. It is not ranked among the engines."


def closest(off: pd.DataFrame) -> str:
    """The engines closest to the exact answers."""
    if off.columns.empty and len(off):
        return (
            "No engine is ranked: none keeps the laws and plays a scene with an exact answer to its"
            " end."
        )
    if off.empty:
        return (
            "No scene here has an exact answer for a tenth of its samples, so no engine is scored."
            " The page shows violations of the laws of physics and differences between engines."
        )
    medians = off.median().sort_values()
    if np.isinf(medians.iloc[0]):
        return (
            "No engine was played to its end, without breaking a law, in half of the scenes with an"
            " exact answer, so engines are not ranked."
        )
    # within 1 % counts as equal
    near = (off.le(1.01 * off.min(axis=1), axis="index") & np.isfinite(off)).sum()
    best, *others = (
        f"{name} ({number(value, 2)}{f', unbeaten in {near[name]}' if len(off) > 1 else ''})"
        for name, value in medians[np.isfinite(medians)].items()
    )
    ranking = (
        f", then {', '.join(others[:2])}" + (f", last {others[-1]}" if len(others) > 2 else "")
        if others
        else ""
    )
    if len(off) == 1:
        return (
            f"Closest of the ranked engines to the exact answer of {off.index[0]}, by the largest"
            " deviation in radii:"
            f" {best}{ranking}."
        )
    return (
        "Closest to the exact answers, by the largest deviation in radii as a median over"
        f" {len(off)} scenes: {best}{ranking}."
    )


def worth_of_settings(off: pd.DataFrame) -> list[str]:
    """A sentence on how much matched settings reduce the deviation, if both profiles are ranked."""
    moved = {}  # engine -> the number of scenes in which it gets closer, and farther
    for engine in dict.fromkeys(name.split(":")[0] for name in off.columns):
        shipped, matched = f"{engine}:shipped", f"{engine}:matched"
        if shipped in off and matched in off:
            closer = int((off[matched] < 0.99 * off[shipped]).sum())
            farther = int((off[matched] > 1.01 * off[shipped]).sum())
            moved[engine] = closer, farther
    if not moved:
        return []
    if len(off) == 1:
        return [worth_in_one_scene(str(off.index[0]), moved)]
    parts = [f"{engine} in {near} (farther in {far})" for engine, (near, far) in moved.items()]
    return [
        "The matched settings bring an engine closer to the exact answer than the shipped ones:"
        f" {', '.join(parts)} of {len(off)} scenes."
    ]


def worth_in_one_scene(scene: str, moved: Mapping[str, tuple[int, int]]) -> str:
    """`worth_of_settings` where there is one scene; `moved`: engine -> (1, 0) if its matched
    settings bring it closer, (0, 1) if farther, (0, 0) if neither by more than 1 %."""
    says = {
        (1, 0): "bring {} closer to the exact answer",
        (0, 1): "take {} farther from it",
        (0, 0): "make no difference of more than 1 % to {}",
    }
    parts = [
        said.format(listed([engine for engine, way in moved.items() if way == asked]))
        for asked, said in says.items()
        if asked in moved.values()
    ]
    if (1, 0) not in moved.values():
        parts[0] = parts[0].replace("from it", "from the exact answer")
    return f"In {scene} the matched settings {listed(parts)}."


def where_it_fails(off: pd.DataFrame, statuses: Sequence[str]) -> str:
    """Scenes in which an engine ends up more than a radius away, and cells without a result."""
    cells = played_to_the_end(statuses)
    lost = off > FAR_OFF  # scenes that were not requested are nan
    if off.empty or not lost.any(axis=None):
        return (
            f"No engine that is ranked is off by more than a radius; {cells}"
            if not off.empty
            else cells[0].upper() + cells[1:]
        )
    counts = lost.sum().sort_values(ascending=False, kind="stable")
    if len(off) == 1:
        who = ", ".join(str(name) for name, count in counts.items() if count)
        return f"More than one radius off, or failed: {who}; {cells}"
    who = ", ".join(f"{name} in {count}" for name, count in counts.items() if count)
    defeated = lost.sum(axis=1)
    least = off.min(axis=1).where(defeated == defeated.max())  # of the best engine there
    hardest = least.replace(np.inf, np.finfo(float).max).idxmax()
    return (
        f"More than one radius off, or failed: {who} of {len(off)} scenes. In the hardest"
        f" scene, {hardest}, {defeated.max()} of {counted(lost.shape[1], 'engine')} fail;"
        f" {cells}"
    )


def played_to_the_end(statuses: Sequence[str]) -> str:
    """The number of cells not played to the end, as the end of a sentence."""
    if not statuses:
        return "every cell was refused."
    failed = sum(status != "ok" for status in statuses)
    if not failed:
        return "every cell was played to its end."
    cells = counted(len(statuses), "cell")
    return f"{failed} of {cells} {'was' if failed == 1 else 'were'} not played to the end."
