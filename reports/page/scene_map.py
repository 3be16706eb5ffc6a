"""All scenes against all engines, a mark each; a scene opens on its replays and its numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from markupsafe import Markup

from crosscheck2d.adapters.advance import off_grid_note
from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.compare.fast_disks import fast_note
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.verdicts import VERDICTS
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.kit import Part, Playback, Section, Table, TableCell, Text
from crosscheck2d.reports.page.replay import pack_layers, ratio_of, view_of
from crosscheck2d.reports.page.replay import played as drawn
from crosscheck2d.reports.page.scenes import (
    EXACT,
    LOST,
    OURS,
    SEEN,
    SceneScores,
    is_library,
    label,
    long_label,
    values,
)
from crosscheck2d.reports.page.situations import FRICTION, SPIN
from crosscheck2d.reports.page.summary import MEANING, Summary, error_text, played, step_text

GRADES = (
    (EXACT, "exact", "="),
    (0.01, "below 0.01 radii", "·"),
    (SEEN, "below 0.1", "•"),
    (LOST, "below 1", "●"),
    (np.inf, "a radius or more, or it fails", "✕"),
)
NOT_PLAYED = len(GRADES)
PIXELS, VISIBLE = (370, 290), 3  # the picture of a replay; what the eye sees in it
SPECIAL = ("reference:exercise", "reference:lesson", "reference:ordered", "event_driven:float64")


def map_section(summary: Summary) -> Section:
    """A row for each scene, in groups by situation."""
    groups = columns(summary)
    names = [name for _, of in groups for name in of]
    order = [kind for kind in MEANING if kind not in (SPIN, FRICTION)] + [FRICTION]
    scenes = sorted(summary.scenes, key=lambda scene: order.index(scene.situations[0]))
    starts = {of[0] for _, of in groups}
    rows = [
        [TableCell(scene.comparison.scenario.asks, css="ask")]
        + [mark(scene, name, name in starts) for name in names]
        for scene in scenes
    ]
    heads = [TableCell("", css="ask")] + [
        TableCell(
            short_name(name), name.replace(":", " "), css="mark" + " first" * (name in starts)
        )
        for name in names
    ]
    frame = pd.DataFrame(rows, [title_of(scene) for scene in scenes], dtype=object)
    table = Table(
        frame.set_axis(heads, axis="columns"),
        groups=[group(scene) for scene in scenes],
        spans=[("", 1), *((TableCell(over(title), css="first"), len(of)) for title, of in groups)],
        opens={title_of(scene): opening(scene, summary) for scene in scenes},
        css="map",
    )
    key = Markup("").join(
        Markup('<span class="g{}">{}</span>{}').format(k, sign, words)
        for k, (_, words, sign) in enumerate(GRADES)
    )
    says = Markup(
        'A click on a scene replays it. <span class="key">Largest error:{}<span>–</span>not'
        " played.</span> Columns: s as shipped, m matched; ours: exercise, lesson, ordered,"
        " event-driven."
    ).format(key)
    return Section("All scenes", says, [table], id="scenes")


def columns(summary: Summary) -> list[tuple[str, list[str]]]:
    """(title, names) of the groups of columns."""
    groups = [(label(of[0]), of) for of in summary.profiles.values()]
    own = [name for name in summary.names if name.endswith(OWN)]
    ours = [name for name in SPECIAL if name in summary.names]
    rest = [
        name
        for name in summary.names
        if name not in [*own, *ours, "reference:coulomb"]
        and not any(name in of for _, of in groups)
    ]
    return [each for each in [*groups, ("others", rest), ("yours", own), ("ours", ours)] if each[1]]


def over(title: str) -> Markup:
    """The heading of a group of columns, in as many lines as it has words."""
    return Markup("<br>").join(title.split())


def short_name(name: str) -> str:
    """A column in a letter or two."""
    profile = name.rpartition(":")[2]
    return "ev" if name.startswith("event") else profile[:1] if is_library(name) else profile[:2]


def title_of(scene: SceneScores) -> str:
    """The name of a scene as its heading."""
    return scene.name.replace("_", " ")


def group(scene: SceneScores) -> TableCell:
    """The heading of a group of scenes."""
    kind = scene.situations[0]
    return TableCell(Markup("{} <small>{}</small>").format(kind, MEANING[kind]))


def mark(scene: SceneScores, name: str, starts: bool) -> TableCell:
    """A cell of the map: a sign by the size of the error, which words explain."""
    name = played(name, scene)
    error = scene.error(name)
    runs = {run.name for run in scene.comparison.runs}
    if name in scene.refused or name not in runs or np.isnan(error):
        grade, sign = NOT_PLAYED, "–"
        why = scene.refused.get(name, "not played" if name not in runs else "no exact answer")
    else:
        grade = next(k for k, (top, _, _) in enumerate(GRADES) if error < top or np.isinf(top))
        sign = GRADES[grade][2]
        words = scene.words(name)
        why = "; ".join([error_text(scene.raw_error(name)) + " radii", *words])
    title = f"{name.replace(':', ' ')}: {why}".replace("exact radii", "exact")
    return TableCell(sign, title, css=f"mark g{grade}" + " first" * starts)


def opening(scene: SceneScores, summary: Summary) -> list[Part]:
    """What a row opens: replays side by side, what is to be said, and the numbers."""
    return [*replay(scene, summary), *remarks(scene), *numbers(scene)]


def replay(scene: SceneScores, summary: Summary) -> list[Part]:
    """The replays, three engines ticked."""
    layers = drawn(scene.comparison)
    names = [run.name for run, _ in layers if run is not None]
    if not names:
        return []
    ticked, notes = to_tick(scene, summary, names)
    facts = {
        "key": scene.name,
        "panels": True,
        "asks": scene.comparison.scenario.asks,
        "ticked": ticked,
        "notes": notes,
        "labels": {name: long_label(name) for name in names},
        "words": {name: "; ".join(words) for name in names if (words := scene.words(name))},
        "errors": {name: error_text(scene.raw_error(name)) for name in names if scene.counts},
    }
    pack = pack_layers(scene.comparison.scenario, layers, more=facts)
    ratio = ratio_of(scene.comparison.scenario, layers)
    return [Playback(pack, ratio, f"Replays of {title_of(scene)}")]


def to_tick(
    scene: SceneScores, summary: Summary, names: Sequence[str]
) -> tuple[list[str], dict[str, str]]:
    """Three engines, and what is said of two: the reader's own or the reference, the nearest
    library and the farthest. If the farthest cannot be told from the exact answer by eye, one that
    can, but none that is lost in most scenes."""
    own = [name for name in names if name.endswith(OWN)]
    first = own or [name for name in (played(OURS[0], scene), *names) if name in names]
    libraries = [name for name in summary.libraries if name in names and scene.counts]
    if not libraries:
        return list(names[:3]), {}
    lost_first = scene.hopeless

    def order(name: str) -> tuple[float, float]:
        held = -scene.follows.get(name, np.inf) if lost_first else 0.0
        return (held, scene.raw_error(name) if np.isfinite(scene.raw_error(name)) else np.inf)

    ranked = sorted(libraries, key=order)
    farthest = ranked[-1]
    layers = [trajectory for _, trajectory in drawn(scene.comparison)]
    left, bottom, right, top = view_of(scene.comparison.scenario, layers)
    size = min(PIXELS[0] / (right - left), PIXELS[1] / (top - bottom))
    radius = scene.comparison.scenario.scene.radius.max() * size
    if scene.raw_error(farthest) * radius < VISIBLE:
        others = [name for of in summary.profiles.values() for name in of if name in names]
        usable = [name for name in others if name not in summary.hopeless] or libraries
        farthest = max(usable, key=lambda name: np.nan_to_num(scene.raw_error(name)))
    words = ("follows longest", "lost first") if lost_first else ("nearest library", "farthest")
    ticked = list(dict.fromkeys([first[0], ranked[0], farthest]))
    return ticked, {farthest: words[1], ranked[0]: words[0]}


def remarks(scene: SceneScores) -> list[Part]:
    """Where the scene comes from, why it has no exact answer, who refused it, and what a step of
    it may miss."""
    comparison = scene.comparison
    scenario, truth = comparison.scenario, comparison.truth
    told = [f"Source: {scenario.source}."] if scenario.source and truth is not None else []
    if truth is None:
        told.append(f"No exact answer: {scenario.without_truth}.")
    elif truth.reason:
        told.append(f"The exact answer ends at {style.number(truth.horizon)} s: {truth.reason}.")
    if note := off_grid_note(scenario):
        told.append(f"{note[0].upper()}{note[1:].removesuffix('.')}.")
    if note := fast_note(comparison):
        told.append(note)
    by_reason: dict[str, list[str]] = {}
    for name, why in scene.refused.items():
        by_reason.setdefault(why, []).append(long_label(name))
    told += [f"Not played by {', '.join(names)}: {why}." for why, names in by_reason.items()]
    return [Text([" ".join(told)], css="soft")] if told else []


def numbers(scene: SceneScores) -> list[Section]:
    """Every number of every engine at the middle step size, folded; failed verdicts first."""
    comparison = scene.comparison
    found = values(comparison)
    names = [run.name for run in comparison.middle_runs if run.status == "ok"]
    if not found:
        return []
    failed = {verdict for name in names for verdict, _ in scene.verdicts(name)}
    ids = [
        *[v for v in VERDICTS if v in failed],
        *METRICS,
        *[v for v in VERDICTS if v not in failed],
    ]
    ids = [each for each in ids if any((name, each) in found for name in names)]
    rows = []
    for each in ids:
        bad = {name for name in names if each in dict(scene.verdicts(name))}
        row = [found.get((name, each)) for name in names]
        rows.append(
            [
                TableCell(value.text, value.remark, css="bad" * (name in bad)) if value else ""
                for name, value in zip(names, row)
            ]
        )
    index = [heading(each) for each in ids]
    heads = [TableCell(label(name), name, notes=(TableCell(profile(name)),)) for name in names]
    frame = pd.DataFrame(rows, index, dtype=object)
    decide = "; ".join(VERDICTS[each].means for each in VERDICTS if each in failed)
    says = f"at a step of {step_text(comparison.middle_dt)}; what fails: {decide or 'nothing'}"
    table = Table(frame.set_axis(heads, axis="columns"), css="plain number")
    return [Section("Numbers of all engines", says, [table], folded=True)]


def profile(name: str) -> str:
    """The profile of a library, or nothing."""
    return name.rpartition(":")[2] if is_library(name) else ""


def heading(each: str) -> TableCell:
    """A metric or a verdict as the heading of a row."""
    if each in VERDICTS:
        kind = VERDICTS[each]
        return TableCell(kind.means[0].upper() + kind.means[1:], f"verdict {each}, {kind.unit}")
    metric = METRICS[each]
    unit = "" if metric.unit == "1" else f", {metric.unit}"
    return TableCell((metric.title or each) + unit, metric.summary)
