"""A run in sentences, for the terminal and on top of the page: the nearest engines, what fails or
is refused, and the laws that an engine of the reader's own breaks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.conformance.laws import ALLOWED
from crosscheck2d.adapters.conformance.probe import Departure
from crosscheck2d.adapters.engines import ENGINES, OWN
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.verdicts import in_words
from crosscheck2d.reports.page.scenes import LOST, is_library
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.page.summary import Summary, median
from crosscheck2d.reports.terminal.counts import counted, listed
from crosscheck2d.scenarios.catalogue import SCENARIOS

Finding = Mapping[str, Any]  # a row of the probes

STATED = "{got} where {expected} is stated"
# In the order in which they are named.
WORDS = {
    Departure.START: "before the first step, read differs from the scene: {got}",
    Departure.MEMORY: "state of the scene before is kept",
    Departure.DT_IGNORED: "dt is ignored",
    Departure.PATH: "a disk of {expected} m/s moves by {got} m in a second",
    Departure.SPEED: "a free disk of {expected} m/s does not keep its speed and ends at {got} m/s",
    Departure.GRAVITY_UNSTATED: "gravity acts where none is stated",
    Departure.GRAVITY_ABSENT: "gravity does not act",
    Departure.GRAVITY_AT_REST: "gravity does not act on a disk at rest",
    Departure.GRAVITY_UPWARD: "gravity acts upward",
    Departure.GRAVITY: f"gravity is {STATED} (m/s2)",
    Departure.MASSES: "momentum is not kept where masses differ",
    Departure.MOMENTUM: "momentum is not kept",
    Departure.STATIC: "a static disk moves",
    Departure.PASSES: "disks pass through each other",
    Departure.STICKS: "disks stick where e = {expected} is stated",
    Departure.RESTITUTION: f"bounces with e = {STATED}",
    Departure.BY_MASS: f"disks of different mass bounce with e = {STATED}",
    Departure.TANGENTIAL: "an off-centre collision changes the tangential velocity",
    Departure.WALL_PASSES: "disks pass through walls",
    Departure.WALL_STICKS: "disks stick to walls where e = {expected} is stated",
    Departure.WALL_RESTITUTION: f"bounces off walls with e = {STATED}",
    Departure.WALL_TANGENTIAL: "a collision with a wall changes the tangential velocity",
}
# What these change, all later readings show, so that no other cause is named beside them; and a
# wrong momentum is also that of what cannot move.
ALONE = (
    Departure.START,
    Departure.DT_IGNORED,
    Departure.PATH,
    Departure.SPEED,
    Departure.GRAVITY_UNSTATED,
)
UNMOVED = (Departure.STATIC, Departure.WALL_PASSES)
# Of an engine that breaks no law, such as one with a threshold.
PROPERTIES = {
    "slow_flight": "a free disk of {expected} m/s ends at {got} m/s",
    "fast_flight": "a free disk of {expected} m/s ends at {got} m/s",
    "fast_spin": "a spin of {expected} rad/s ends at {got} rad/s",
    "spins_freely": "a disk turns by {got} rad where its spin gives {expected}",
    "force_lasts_one_step": "a force lasts for more than one step",
    "mass_by_force": f"a force acts as on a mass of {STATED} (kg)",
    "inertia_by_torque": f"a torque acts as on an inertia of {STATED} (kg m2)",
    "friction": "friction of {got} acts where none is stated",
    "friction_at_rest": f"the friction of a sliding disk is {STATED}",
    "restitution_wall": f"off a wall that is not one of a box e is {STATED}",
    **{f"restitution_{v}": f"at {v} m/s e is {STATED}" for v in ("0.01", "0.1", "0.5", "2", "100")},
}
SCENES = {
    "gravity_is_stated": "gravity",
    "pair_keeps_e": "collisions of disks",
    "wall_keeps_e": "walls",
    "static_stays": "static disks",
}


def findings(summary: Summary) -> list[str]:
    comparisons = [scene.comparison for scene in summary.scenes]
    own = [name for name in summary.names if name.endswith(OWN) and name not in summary.untrusted]
    broken = laws_broken(summary)
    return [
        *(own_sentence(name, summary) for name in own),
        *([str(text.striptags()) for text in summary.sentences()] or [nearest(summary)]),
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
    medians = {
        name: median([s.error(name) for s in scenes if name not in s.frictionless])
        for name in ranked(summary)
    }
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


def own_sentence(name: str, summary: Summary) -> str:
    errors = pd.Series({s.name: s.error(name) for s in summary.scenes if s.counts}, dtype=float)
    errors = errors.dropna()
    lost = [*errors[errors > LOST].sort_values(ascending=False, kind="stable").index]
    refused = sum(name in scene.refused for scene in summary.scenes)
    file = name.removesuffix(OWN)
    if errors.empty:  # the reason that nothing was played is printed beside it
        return f"{file} is not ranked among the engines: it played no scene."
    near = f"{len(errors) - len(lost)} of {counted(len(errors), 'scene')}"
    sentence = f"{file} is within a radius of the exact answer in {near}"
    if lost:
        more = f" and {len(lost) - 3} more" * (len(lost) > 3)
        sentence += f", not in {', '.join(lost[:3])}{more}"
    if refused:
        sentence += f", not counting {refused} that it refuses"
    return f"{sentence}. It is not ranked among the engines."


def laws_broken(summary: Summary) -> list[str]:
    """ "pymunk:shipped fails in 3 of 50 scenes (tunnels in falling_box, ...)", of one scene
    "tunnels"; those that fail most first."""
    failed: dict[str, list[tuple[str, str]]] = {}
    for scene in summary.scenes:
        for name in summary.names:
            if (verdicts := scene.verdicts(name)) and name not in summary.untrusted:
                failed.setdefault(name, []).append((in_words(*verdicts[0]), scene.name))
    if len(summary.scenes) == 1:
        return [f"{name} {words}" for name, [(words, _)] in failed.items()]
    of = counted(len(summary.scenes), "scene")
    return [
        f"{name} fails in {len(runs)} of {of} ({' in '.join(runs[0])}{', ...' * (len(runs) > 1)})"
        for name, runs in sorted(failed.items(), key=lambda item: -len(item[1]))
    ]


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
    by_reason: dict[str, list[str]] = {}
    for comparison in comparisons:
        for run in comparison.runs:
            # missing friction stands in the summary of the scenes with friction
            if run.status == "unsupported" and not run.frictionless:
                by_reason.setdefault(run.reason, []).append(run.name.removesuffix(OWN))
    return [
        f"{listed(list(dict.fromkeys(names)))} refused {counted(len(names), 'cell')}: {reason}."
        for reason, names in by_reason.items()
    ]


def not_counted(broken: Mapping[str, Finding]) -> list[str]:
    sentences = []
    for name, row in sorted(broken.items()):
        if row["got"] == "raised":
            how = f"It raised {row['note']}. The probe was: {row['asked']}"
        else:
            note = f" ({row['note']})" if row["note"] else ""
            got = str(row["got"]).capitalize()
            how = f"{row['asked']} {got}{note}; expected: {row['expected']}."
        file = name.removesuffix(OWN)
        sentences.append(f"Not counted: {file} breaks the protocol of the harness. {how}")
    return sentences


def is_lawless(findings: Sequence[Finding]) -> bool:
    """Whether these are of a reader's own engine that breaks a law, so that it is not ranked."""
    return any(row.get("departure") and f":{row['profile']}" == OWN for row in findings)


def own_engine_sentences(findings: Sequence[Finding]) -> list[str]:
    if not findings or f":{findings[0]['profile']}" != OWN:
        return []
    missed = {row["probe"]: row for row in findings if row["verdict"] in ("departs", "breaks")}
    broken = {row["departure"]: row for row in missed.values() if row.get("departure")}
    laws = [law for law in WORDS if law in broken]
    if set(laws) & set(ALONE):
        laws = [law for law in laws if law in (*ALONE, Departure.MEMORY)]
    if {Departure.MASSES, Departure.MOMENTUM} & set(laws):
        laws = [law for law in laws if law not in UNMOVED]
    words = [fill_in(WORDS[law], broken[law]) for law in laws]
    if not laws:
        if any(row["verdict"] == "breaks" for row in missed.values()):
            return []  # it is not counted, and a sentence says why
        probes = [probe for probe in PROPERTIES if probe in missed and is_visible(missed[probe])]
        words = [fill_in(PROPERTIES[probe], missed[probe]) for probe in probes]
    refused = {row["probe"] for row in findings if row["verdict"] == "not asked"}
    scenes = [scene for probe, scene in SCENES.items() if probe in refused]
    if not words and not scenes:
        return []
    name = findings[0]["engine"]
    text = f"{name}: {'; '.join(words)}." if words else f"{name} keeps the laws that were asked."
    if laws:
        text += f" It breaks {'a law' if len(laws) == 1 else 'laws'}, so it is not ranked."
    return [f"{text} Not asked, because it refuses them: {listed(scenes)}." if scenes else text]


def is_visible(row: Finding) -> bool:
    """Whether a reading is a number, and off by more than a law allows."""
    got, expected = row["got"], row["expected"]
    if isinstance(got, str) or isinstance(expected, str):
        return False
    return not abs(got - expected) <= ALLOWED * (abs(expected) or 1.0)


def fill_in(text: str, row: Finding) -> str:
    got = row["got"] if isinstance(row["got"], str) else round(row["got"], 9)  # 0 for 4e-15
    return text.format(got=number(got, 2), expected=number(row["expected"], 2))
