"""The findings of a run in sentences: for the terminal, and on top of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from crosscheck2d.adapters.engines import ENGINES, OWN
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.verdicts import in_words
from crosscheck2d.reports.page.scenes import LOST, SceneScores, is_library
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.page.summary import Summary
from crosscheck2d.reports.terminal.counts import counted, listed
from crosscheck2d.scenarios.catalogue import SCENARIOS

FEW = 1  # scenes that are named of each engine that fails


def findings(summary: Summary) -> list[str]:
    """The reader's own solvers, the nearest engines, the laws that are broken, the ends of exact
    answers, the refusals."""
    comparisons = [scene.comparison for scene in summary.scenes]
    own = [name for name in summary.names if name.endswith(OWN) and name not in summary.untrusted]
    told = [str(sentence.striptags()) for sentence in summary.sentences()] or [nearest(summary)]
    broken = laws_broken(summary)
    return [
        *(own_sentence(name, summary) for name in own),
        *told,
        *([f"Laws broken anywhere in a scene: {'; '.join(broken)}."] if broken else []),
        *early_ends(comparisons),
        *refusals(comparisons),
    ]


def ranked(summary: Summary) -> list[str]:
    """The engines that are ranked: not the reader's own solvers, and not those that take collisions
    in order of time; if nothing else was played, these."""
    names = [name for name in summary.names if name not in summary.untrusted]
    in_order = [name for name in names if name in ENGINES and ENGINES[name].orders_collisions]
    return [name for name in names if not name.endswith(OWN) and name not in in_order] or names


def nearest(summary: Summary) -> str:
    """The engines nearest to the exact answers, by the median of the scored scenes; an engine that
    models no friction has no scene with it."""
    scenes = [scene for scene in summary.scenes if scene.counts]
    if not scenes:
        return (
            "No scene here has an exact answer for a tenth of its samples, so no engine is scored."
            " The page shows what fails a verdict."
        )
    medians = {name: median_error(name, scenes) for name in ranked(summary)}
    if not medians:
        return (
            "No engine is ranked: none keeps the laws and plays a scene with an exact answer to its"
            " end."
        )
    names = [name for name in medians if np.isfinite(medians[name])]
    if not names:
        return (
            "No engine was played to its end, without breaking a law, in half of the scenes with an"
            " exact answer, so engines are not ranked."
        )
    names.sort(key=lambda name: (medians[name], not is_library(name)))
    best, *others = (f"{name} ({number(medians[name], 2)} radii)" for name in names)
    then = f", then {', '.join(others[:2])}" if others else ""
    last = f", last {others[-1]}" if len(others) > 2 else ""
    of = f"answer of {scenes[0].name}" if len(scenes) == 1 else "answers"
    return f"Nearest to the exact {of}: {best}{then}{last}."


def median_error(name: str, scenes: Sequence[SceneScores]) -> float:
    """The median error of an engine in scenes whose friction, if they have some, it models."""
    asked = [scene for scene in scenes if name not in scene.frictionless]
    errors = [error for scene in asked if not np.isnan(error := scene.error(name))]
    return float(np.median(errors)) if errors else np.nan


def own_sentence(name: str, summary: Summary) -> str:
    """How near the reader's own solver is, where it is lost, and what it was not asked."""
    errors = {s.name: s.error(name) for s in summary.scenes if s.counts}
    errors = {scene: error for scene, error in errors.items() if not np.isnan(error)}
    lost = sorted((s for s in errors if errors[s] > LOST), key=lambda s: -errors[s])
    refused = sum(name in scene.refused for scene in summary.scenes)
    if not errors:  # the reason that nothing was played is printed beside it
        return f"{name.removesuffix(OWN)} is not ranked among the engines: it played no scene."
    near = f"{len(errors) - len(lost)} of {counted(len(errors), 'scene')}"
    told = f"{name.removesuffix(OWN)} is within a radius of the exact answer in {near}"
    if lost:
        told += f", not in {', '.join(lost[:3])}{f' and {len(lost) - 3} more' * (len(lost) > 3)}"
    if refused:
        told += f", not counting {refused} that it refuses"
    return f"{told}. It is not ranked among the engines."


def laws_broken(summary: Summary) -> list[str]:
    """ "pymunk:shipped fails in 3 of 50 scenes (tunnels in falling_box, ...)", of one scene
    "tunnels"; those that fail most first."""
    found: dict[str, list[str]] = {}
    for scene in summary.scenes:
        for name in summary.names:
            if (verdicts := scene.verdicts(name)) and name not in summary.untrusted:
                found.setdefault(name, []).append(f"{in_words(*verdicts[0])} in {scene.name}")
    told = []
    for name, where in sorted(found.items(), key=lambda each: -len(each[1])):
        if len(summary.scenes) == 1:
            told.append(f"{name} {where[0].rpartition(' in ')[0]}")
            continue
        more = ", ..." * (len(where) > FEW)
        of = counted(len(summary.scenes), "scene")
        told.append(f"{name} fails in {len(where)} of {of} ({', '.join(where[:FEW])}{more})")
    return told


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
            if run.status == "unsupported" and not run.frictionless:
                whose.setdefault(run.reason, []).append(run.name.removesuffix(OWN))
    return [
        f"{listed(list(dict.fromkeys(names)))} refused {counted(len(names), 'cell')}: {reason}."
        for reason, names in whose.items()
    ]


def not_counted(broken: Mapping[str, str]) -> list[str]:
    """A sentence for each engine that broke the protocol; `broken`: name -> the probe that failed,
    and how."""
    return [
        f"Not counted: {name.removesuffix(OWN)} breaks the protocol of the harness. {how}"
        for name, how in sorted(broken.items())
    ]
