"""The finding in three sentences, computed from the table: nothing here is written by hand but the
grammar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

import numpy as np
import pandas as pd

from adapters.engines import OWN
from reports.compare.comparison import Comparison
from reports.page.overview import MAPPED, values
from reports.terminal.counts import counted

FAR_OFF = 1.0  # radii: beyond it a disk is not where it should be, to the eye


def findings(comparisons: Sequence[Comparison], untrusted: Set[str]) -> list[str]:
    """Three sentences: who is closest, what settings are worth, where each fails; of none who is
    `untrusted`. A solver's own file that refuses scenes has a sentence of its own."""
    off = position_errors(comparisons).drop(columns=list(untrusted), errors="ignore")
    refusals = own_refusals(comparisons)
    ranked = off.drop(columns=list(refusals), errors="ignore")
    if ranked.columns.empty:
        ranked = off
    statuses = [
        run.status
        for comparison in comparisons
        for run in comparison.runs
        if comparison.scenario.name not in refusals.get(run.name, {})
    ]
    own = [asked_in_part(off[name], refusals[name]) for name in refusals if name in off]
    return [closest(ranked), worth_of_settings(ranked), where_it_fails(ranked, statuses), *own]


def own_refusals(comparisons: Sequence[Comparison]) -> dict[str, dict[str, str]]:
    """A solver's own file -> the scenes that it refuses, and why: what the exercise does not ask
    for is not missing in it."""
    found: dict[str, dict[str, str]] = {}
    for comparison in comparisons:
        for run in comparison.runs:
            if run.name.endswith(OWN) and run.status == "unsupported":
                found.setdefault(run.name, {})[comparison.scenario.name] = run.reason
    return found


def asked_in_part(off: pd.Series, refused: Mapping[str, str]) -> str:
    """How far a solver's own file is off where it is asked, and why it is not asked elsewhere."""
    asked = off.drop(index=list(refused), errors="ignore")
    why = "; ".join(dict.fromkeys(refused.values()))
    number = f"{asked.median():.2g} radii off, {over_scenes(len(asked))}; " if len(asked) else ""
    return f"{off.name}: {number}not asked in {counted(len(refused), 'scene')} ({why})."


def not_counted(broken: Mapping[str, str]) -> list[str]:
    """A sentence for each engine that broke the protocol: name -> the probe that it missed, and
    how."""
    return [
        f"Not counted: {name} breaks the protocol of the harness. {how}"
        for name, how in sorted(broken.items())
    ]


def position_errors(comparisons: Sequence[Comparison]) -> pd.DataFrame:
    """Largest deviation from the truth in radii at the middle dt: a row a scenario, a column an
    `engine:profile`.

    `inf` for who was asked and has no result, so that to refuse a hard scene does not help.
    """
    # A truth that is lost before its second sample has only the start, which is given to all.
    scored = [
        comparison
        for comparison in comparisons
        if comparison.truth is not None and len(comparison.truth) > 1
    ]
    rows = []
    for comparison in scored:
        found = {
            name: one.value
            for (name, metric), one in values(comparison).items()
            if metric == MAPPED
        }
        rows.append({run.name: found.get(run.name, np.inf) for run in comparison.middle_runs})
    return pd.DataFrame(rows, index=[comparison.scenario.name for comparison in scored])


def closest(off: pd.DataFrame) -> str:
    """Who comes closest to the exact answers."""
    if off.columns.empty and len(off):
        return (
            "No engine that counts was played to its end in a scene with an exact answer, so none"
            " is scored."
        )
    if off.empty:
        return (
            "No scene here has an exact answer, so no engine is scored. The page shows violations"
            " of the laws of physics and differences between engines."
        )
    medians = off.median().sort_values()
    if np.isinf(medians.iloc[0]):
        return (
            "No engine was played to its end in half of the scenes with an exact answer, so engines"
            " are not ranked."
        )
    best, *others = (f"{name} ({value:.2g})" for name, value in medians.items())
    # within 1 % counts as equal
    wins = int((off[medians.index[0]] <= off.min(axis=1) * 1.01).sum())
    ranking = (
        f", then {', '.join(others[:2])}" + (f", last {others[-1]}" if len(others) > 2 else "")
        if others
        else ""
    )
    return (
        f"Closest to the exact answers, by the largest deviation in radii,"
        f" {over_scenes(len(off))}: {best}, unbeaten in {wins}{ranking}."
    )


def over_scenes(count: int) -> str:
    """What a number is of: a median, where there is more than one scene."""
    return f"median of {counted(count, 'scene')}" if count != 1 else "in 1 scene"


def worth_of_settings(off: pd.DataFrame) -> str:
    """How much of an engine's deviation is its settings."""
    if off.empty:
        return "What settings are worth cannot be said without an exact answer."
    parts = []
    for engine in dict.fromkeys(name.split(":")[0] for name in off.columns):
        shipped, matched = f"{engine}:shipped", f"{engine}:matched"
        if shipped in off and matched in off:
            closer = int((off[matched] < 0.99 * off[shipped]).sum())
            farther = int((off[matched] > 1.01 * off[shipped]).sum())
            parts.append(f"{engine} closer in {closer} (farther in {farther})")
    if not parts:
        return (
            "No engine was played in both profiles, so the worth of settings is not known from this"
            " run."
        )
    scenes = counted(len(off), "scene")
    return f"Matching an engine to the scene brings {', '.join(parts)} of {scenes}."


def where_it_fails(off: pd.DataFrame, statuses: Sequence[str]) -> str:
    """Scenes in which an engine ends up more than a radius away, and cells without a result."""
    cells = played_to_the_end(statuses)
    lost = off > FAR_OFF
    if off.empty or not lost.any(axis=None):
        return (
            f"No engine that is scored is off by more than a radius; {cells}"
            if not off.empty
            else cells[0].upper() + cells[1:]
        )
    counts = lost.sum().sort_values(ascending=False, kind="stable")
    who = ", ".join(f"{name} in {count}" for name, count in counts.items() if count)
    defeated = lost.sum(axis=1)
    return (
        f"More than a whole radius off, or without a result: {who} of"
        f" {counted(len(off), 'scene')}; the hardest is {defeated.idxmax()}, too much for"
        f" {defeated.max()} of {lost.shape[1]}; {cells}"
    )


def played_to_the_end(statuses: Sequence[str]) -> str:
    """How many cells were not, as the end of a sentence."""
    failed = sum(status != "ok" for status in statuses)
    if not failed:
        return "every cell was played to its end."
    cells = counted(len(statuses), "cell")
    return f"{failed} of {cells} {'was' if failed == 1 else 'were'} not played to the end."
