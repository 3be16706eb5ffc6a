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
from crosscheck2d.reports.page import replay, style
from crosscheck2d.reports.page.kit import Part, Playback, Section, Table, TableCell, Text
from crosscheck2d.reports.page.scenes import (
    EXACT,
    FRICTION,
    LOST,
    OURS,
    SEEN,
    SPIN,
    SceneScores,
    is_library,
    label,
    long_label,
    values,
)
from crosscheck2d.reports.page.summary import MEANING, Summary, error_text, stand_in, step_text

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
    groups = [(label(names[0]), names) for names in summary.profiles.values()]
    own = [name for name in summary.names if name.endswith(OWN)]
    ours = [name for name in SPECIAL if name in summary.names]
    placed = {*own, *ours, "reference:coulomb", *(name for _, names in groups for name in names)}
    rest = [name for name in summary.names if name not in placed]
    groups += [("others", rest), ("yours", own), ("ours", ours)]
    groups = [(title, names) for title, names in groups if names]
    order = [kind for kind in MEANING if kind not in (SPIN, FRICTION)] + [FRICTION]
    scenes = sorted(summary.scenes, key=lambda scene: order.index(scene.situations[0]))
    columns = [[TableCell(scene.comparison.scenario.asks, css="ask") for scene in scenes]]
    heads, spans = [TableCell("", css="ask")], list[tuple[str | TableCell, int]]([("", 1)])
    for title, names in groups:
        # in as many lines as it has words
        spans.append((TableCell(Markup("<br>").join(title.split()), css="first"), len(names)))
        for name in names:
            first, profile = " first" * (name == names[0]), name.rpartition(":")[2]
            short = "ev" if name.startswith("event") else profile[: 1 if is_library(name) else 2]
            heads.append(TableCell(short, name.replace(":", " "), css=f"mark{first}"))
            columns.append([mark(scene, name, first) for scene in scenes])
    titles = [title_of(scene) for scene in scenes]
    frame = pd.DataFrame(dict(enumerate(columns)), titles, dtype=object)
    frame = frame.set_axis(heads, axis="columns")
    kinds = [scene.situations[0] for scene in scenes]
    small = Markup("{} <small>{}</small>")
    opens = [[*replays(scene, summary), *remarks(scene), *numbers(scene)] for scene in scenes]
    table = Table(
        frame,
        groups=[TableCell(small.format(kind, MEANING[kind])) for kind in kinds],
        spans=spans,
        opens=dict(zip(titles, opens)),
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


def title_of(scene: SceneScores) -> str:
    return scene.name.replace("_", " ")


def mark(scene: SceneScores, name: str, first: str) -> TableCell:
    name = stand_in(name, scene)
    error = scene.error(name)
    if name in scene.refused or np.isnan(error):
        grade, sign = NOT_PLAYED, "–"
        played = any(run.name == name for run in scene.comparison.runs)
        reason = scene.refused.get(name, "no exact answer" if played else "not played")
    else:
        grade = next(k for k, (top, _, _) in enumerate(GRADES) if error < top or np.isinf(top))
        sign = GRADES[grade][2]
        reason = "; ".join([error_text(scene.raw_error(name)) + " radii", *scene.words(name)])
    title = f"{name.replace(':', ' ')}: {reason}".replace("exact radii", "exact")
    return TableCell(sign, title, css=f"mark g{grade}{first}")


def replays(scene: SceneScores, summary: Summary) -> list[Part]:
    scenario = scene.comparison.scenario
    layers = replay.played(scene.comparison)
    names = [run.name for run, _ in layers if run is not None]
    if not names:
        return []
    ticked, notes = to_tick(scene, summary, names)
    facts = {
        "key": scene.name,
        "panels": True,
        "asks": scenario.asks,
        "ticked": ticked,
        "notes": notes,
        "labels": {name: long_label(name) for name in names},
        "words": {name: "; ".join(words) for name in names if (words := scene.words(name))},
        "errors": {name: error_text(scene.raw_error(name)) for name in names if scene.counts},
    }
    pack = replay.pack_layers(scenario, layers, more=facts)
    return [Playback(pack, replay.ratio_of(scenario, layers), f"Replays of {title_of(scene)}")]


def to_tick(
    scene: SceneScores, summary: Summary, names: Sequence[str]
) -> tuple[list[str], dict[str, str]]:
    """Three engines, and what is said of two: the reader's own or the reference, the nearest
    library and the farthest. If the farthest cannot be told from the exact answer by eye, one that
    can, but none that is lost in most scenes."""
    own = [name for name in names if name.endswith(OWN)]
    first = own or [name for name in (stand_in(OURS[0], scene), *names) if name in names]
    libraries = [name for name in summary.libraries if name in names and scene.counts]
    if not libraries:
        return list(names[:3]), {}

    def order(name: str) -> tuple[float, float]:
        held = -scene.follows.get(name, np.inf) if scene.hopeless else 0.0
        return (held, scene.raw_error(name) if np.isfinite(scene.raw_error(name)) else np.inf)

    ranked = sorted(libraries, key=order)
    nearest, farthest = ranked[0], ranked[-1]
    scenario = scene.comparison.scenario
    layers = [trajectory for _, trajectory in replay.played(scene.comparison)]
    left, bottom, right, top = replay.view_of(scenario, layers)
    size = min(PIXELS[0] / (right - left), PIXELS[1] / (top - bottom))
    if scene.raw_error(farthest) * scenario.scene.radius.max() * size < VISIBLE:
        others = [name for of in summary.profiles.values() for name in of if name in names]
        usable = [name for name in others if name not in summary.hopeless] or libraries
        farthest = max(usable, key=lambda name: np.nan_to_num(scene.raw_error(name)))
    words = ("follows longest", "lost first") if scene.hopeless else ("nearest library", "farthest")
    ticked = list(dict.fromkeys([first[0], nearest, farthest]))
    return ticked, {farthest: words[1], nearest: words[0]}


def remarks(scene: SceneScores) -> list[Part]:
    scenario, truth = scene.comparison.scenario, scene.comparison.truth
    sentences = [f"Source: {scenario.source}."] if scenario.source and truth is not None else []
    if truth is None:
        sentences.append(f"No exact answer: {scenario.without_truth}.")
    elif truth.reason:
        end = style.number(truth.horizon)
        sentences.append(f"The exact answer ends at {end} s: {truth.reason}.")
    if note := off_grid_note(scenario):
        sentences.append(f"{note[0].upper()}{note[1:].removesuffix('.')}.")
    if note := fast_note(scene.comparison):
        sentences.append(note)
    by_reason: dict[str, list[str]] = {}
    for name, reason in scene.refused.items():
        by_reason.setdefault(reason, []).append(long_label(name))
    sentences += [f"Not played by {', '.join(of)}: {reason}." for reason, of in by_reason.items()]
    return [Text([" ".join(sentences)], css="soft")] if sentences else []


def numbers(scene: SceneScores) -> list[Section]:
    """Every number of every engine at the middle step size, folded; failed verdicts first."""
    comparison = scene.comparison
    cells = values(comparison)
    if not cells:
        return []
    names = [run.name for run in comparison.middle_runs if run.status == "ok"]
    fails = {(name, verdict) for name in names for verdict, _ in scene.verdicts(name)}
    failed = [verdict for verdict in VERDICTS if any((name, verdict) in fails for name in names)]
    index, rows = [], []
    for row in dict.fromkeys([*failed, *METRICS, *VERDICTS]):
        if not any((name, row) in cells for name in names):
            continue
        if row in VERDICTS:
            means, unit = VERDICTS[row].means, VERDICTS[row].unit
            index.append(TableCell(means[0].upper() + means[1:], f"verdict {row}, {unit}"))
        else:
            metric = METRICS[row]
            unit = "" if metric.unit == "1" else f", {metric.unit}"
            index.append(TableCell((metric.title or row) + unit, metric.summary))
        rows.append(
            [
                TableCell(cell.text, cell.remark, css="bad" * ((name, row) in fails))
                if (cell := cells.get((name, row)))
                else ""
                for name in names
            ]
        )
    profiles = [name.rpartition(":")[2] if is_library(name) else "" for name in names]
    heads = [
        TableCell(label(name), name, notes=(TableCell(profile),))
        for name, profile in zip(names, profiles)
    ]
    frame = pd.DataFrame(rows, index, dtype=object)
    decide = "; ".join(VERDICTS[verdict].means for verdict in failed)
    says = f"at a step of {step_text(comparison.middle_dt)}; what fails: {decide or 'nothing'}"
    table = Table(frame.set_axis(heads, axis="columns"), css="plain number")
    return [Section("Numbers of all engines", says, [table], folded=True)]
