"""The first table of the report: what each library does well, at what cost, and what goes wrong;
and the sentences above it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
from markupsafe import Markup, escape

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.verdicts import VERDICTS, in_words
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.kit import Section, Table, TableCell
from crosscheck2d.reports.page.scenes import (
    ANGLE,
    ERROR,
    EXACT,
    FRICTION,
    LIBRARIES,
    LOST,
    OURS,
    RIGHT,
    SITUATIONS,
    SPIN,
    TIE,
    WITH_FRICTION,
    SceneScores,
    is_library,
    label,
    scenes_of,
    smooth,
)
from crosscheck2d.reports.run.timing import Noise
from crosscheck2d.reports.run.timing_pass import BUSY
from crosscheck2d.reports.terminal.counts import counted, listed

WITHOUT = "All"
MEANING = {
    "Flight": "no collisions",
    "Single collisions": "two disks at a time",
    "Rows": "collisions on a line",
    "Stacks and rest": "contacts that last",
    "Crowds": "many disks meet",
    SPIN: "angle error, rad",
    FRICTION: "scenes with friction",
    WITHOUT: "without friction",
}
MANY = 10  # scenes, so that most of them say something about an engine
MOST_WORDS = 2  # in a cell


class RunTimes(NamedTuple):
    """timings.csv of a run, and why no time of it is shown, as a sentence; "" if times are."""

    table: pd.DataFrame
    fault: str


NO_CLOCK = RunTimes(pd.DataFrame(), "No times were taken.")


def run_times(table: pd.DataFrame, noise: Noise, limit: float, again: str = "") -> RunTimes:
    """The times of a run, with the ratios of two timings of one engine, the limit of the timing
    pass in s, and the command that takes them again."""
    if table.empty and not limit:
        fault = "No times were taken."
    elif table.empty or not noise.pairs:
        fault = f"The engines could not be timed within {limit:g} s."
    elif noise.floor > BUSY:
        fault = (
            "The machine was busy: an engine timed twice differs from itself by"
            f" {style.number(100 * noise.floor, 2)} %, so no times are shown."
        )
    else:
        return RunTimes(table, "")
    return RunTimes(table, f"{fault} To take them: {again}" if again else fault)


class Choice(NamedTuple):
    """The profile of a library in all situations, as a program runs with one; and in how many
    scenes it is nearer and farther than the other by more than a factor `TIE`."""

    name: str
    nearer: int
    farther: int


@dataclass(frozen=True, eq=False)
class Summary:
    """The scenes of a run, and what the first table says of them. Engines are named
    `engine:profile`, situations as in `MEANING`."""

    scenes: Sequence[SceneScores]
    names: Sequence[str]  # every engine that was played
    # those that broke the protocol, and the reader's own that break a law: they are not ranked
    untrusted: frozenset[str] = frozenset()
    clock: RunTimes = NO_CLOCK

    @cached_property
    def profiles(self) -> dict[str, list[str]]:
        profiles: dict[str, list[str]] = {}
        for name in self.names:
            if is_library(name) and not name.endswith(OWN) and name not in self.untrusted:
                profiles.setdefault(name.partition(":")[0], []).append(name)
        return profiles

    @cached_property
    def chosen(self) -> dict[str, Choice]:
        """Library -> the profile that is nearer in more scenes, the last if in as many."""
        scored, chosen = [scene for scene in self.scenes if scene.counts], {}
        for library, names in self.profiles.items():
            errors = [[max(s.error(name), EXACT) for name in names[:2]] for s in scored]
            pairs = np.reshape(errors, (-1, len(names[:2])))
            pairs = pairs[np.isfinite(pairs).any(axis=1)]
            with np.errstate(invalid="ignore"):
                ratio = pairs[:, -1] / pairs[:, 0]
            nearer, farther = int((ratio < 1 / TIE).sum()), int((ratio > TIE).sum())
            chosen[library] = Choice(names[:2][-1], nearer, farther)
            if nearer < farther:
                chosen[library] = Choice(names[0], farther, nearer)
        return chosen

    @cached_property
    def versions(self) -> dict[str, Mapping[str, str]]:
        runs = [run for scene in self.scenes for run in scene.comparison.runs if run.versions]
        return {run.engine: run.versions for run in runs}

    @cached_property
    def libraries(self) -> list[str]:
        return [choice.name for choice in self.chosen.values()]

    @cached_property
    def columns(self) -> list[str]:
        own = [name for name in self.names if name.endswith(OWN)]
        names = [*self.libraries, *own, *(name for name in OURS if name in self.names)]
        return names if self.libraries or own else names or list(self.names)[:8]

    @cached_property
    def situations(self) -> dict[str, list[SceneScores]]:
        """Situation -> its scenes that are scored; the last without friction, if there are more."""
        scored = [scene for scene in self.scenes if scene.counts]
        scenes = {kind: [s for s in scored if kind in s.situations] for kind in SITUATIONS}
        scenes = {kind: members for kind, members in scenes.items() if members}
        if len(scenes.keys() - {SPIN, FRICTION}) > 1:
            scenes[WITHOUT] = smooth(self.scenes)
        return scenes

    @cached_property
    def hopeless(self) -> set[str]:
        """Those that fail, or are a radius off, in most of several scenes without friction."""
        scenes = smooth(self.scenes)
        lost = {name: sum(scene.is_lost(name) for scene in scenes) for name in self.names}
        return {n for n, count in lost.items() if len(scenes) >= MANY and count > len(scenes) / 2}

    def error(self, name: str, kind: str) -> float:
        # the median; inf where an engine fails in half of the scenes
        metric = ANGLE if kind == SPIN else ERROR
        return median([s.error(run, metric=metric) for s, run in self.runs(name, kind)])

    def runs(self, name: str, kind: str) -> list[tuple[SceneScores, str]]:
        """Each scene of a situation, with the engine that counts there."""
        return [(scene, stand_in(name, scene)) for scene in self.situations[kind]]

    @cached_property
    def times(self) -> dict[tuple[str, str, float], float]:
        """(scene, engine, dt in s, `rounded`) -> µs of engine time for a second of simulation,
        where that was timed."""
        if self.clock.fault:
            return {}
        table = self.clock.table
        steps = map(rounded, table.dt_s.astype(float))
        keys = zip(table.scenario, table.engine + ":" + table.profile, steps)
        return dict(zip(keys, table.cost_us_per_s.astype(float)))

    @cached_property
    def costs(self) -> dict[tuple[str, str], float]:
        """(scene, engine) -> µs of a step at the middle step size, where it was timed."""
        steps = {scene.name: scene.comparison.middle_dt for scene in self.scenes}
        keys = [(scene, name) for scene in steps for name in self.names]
        times = {key: self.times.get((*key, rounded(steps[key[0]]))) for key in keys}
        return {key: time * steps[key[0]] for key, time in times.items() if time is not None}

    def cost(self, name: str, kind: str) -> float:
        # µs of a step, geometric mean of the timed scenes
        costs = [self.costs.get((scene.name, run), np.nan) for scene, run in self.runs(name, kind)]
        return float(np.exp(np.nanmean(np.log(costs)))) if np.isfinite(costs).any() else np.nan

    def best(self, kind: str) -> float:
        errors = [self.error(name, kind) for name in self.libraries]
        return min((error for error in errors if not np.isnan(error)), default=np.nan)

    def is_near(self, name: str, kind: str) -> bool:
        error = self.error(name, kind)
        limit = max(TIE * self.best(kind), RIGHT)
        return name in self.libraries and error <= limit and error < LOST

    def nearest(self, kind: str) -> list[str]:
        """The labels of the libraries that are nearest, the nearest first."""
        names = [name for name in self.libraries if self.is_near(name, kind)]
        return [label(name) for name in sorted(names, key=lambda name: self.error(name, kind))]

    def words(self, name: str, kind: str) -> list[TableCell]:
        """What goes wrong in a situation, the gravest first; each opens its worst scene."""
        if kind == SPIN:
            return []
        runs = dict(self.runs(name, kind))
        of = f"of {counted(len(runs), 'scene')}"
        words = []
        for verdict in VERDICTS:
            failed = [(dict(s.verdicts(run)).get(verdict), s.name) for s, run in runs.items()]
            values = [(value, scene) for value, scene in failed if value is not None]
            if values:
                value, worst = max((-1.0, ""), *values)
                title = f"in {len(values)} {of}, worst in {worst}"
                words.append(TableCell(in_words(verdict, value), title, f"#{worst}", "bad"))
        refused = [scene for scene, run in runs.items() if scene.refuses(run)]
        if refused and not name.endswith(OWN):
            reason = refused[0].refused[runs[refused[0]]]
            text = f"refuses {len(refused)} of {len(runs)}"
            words.append(TableCell(text, reason, f"#{refused[0].name}", "bad"))
        if lost := [scene for scene, run in runs.items() if scene.is_lost(run)]:
            far = max(lost, key=lambda scene: np.nan_to_num(scene.raw_error(runs[scene])))
            text = f"lost in {len(lost)} of {len(runs)}"
            if len(lost) == len(runs) and all(scene.hopeless for scene in runs):
                ends = {scene: answer.t[-1] for scene in lost if (answer := scene.comparison.truth)}
                parts = [min(scene.follows[runs[scene]] / end, 1) for scene, end in ends.items()]
                text = f"lost after {100 * float(np.median(parts)):.0f} %"
            title = f"fails, or is more than a radius off; farthest in {far.name}"
            words.append(TableCell(text, title, f"#{far.name}", "bad"))
        return words if len(words) <= MOST_WORDS else [words[0], words[-1]]

    def cell(self, name: str, kind: str) -> TableCell:
        error, cost = self.error(name, kind), self.cost(name, kind)
        if np.isnan(error):
            return TableCell("–", "not played")
        notes = self.words(name, kind) if kind != WITHOUT else self.words(name, kind)[-1:]
        others = [other for other in self.profiles.get(name.partition(":")[0], []) if other != name]
        better = [other for other in others if self.error(other, kind) < error / TIE]
        if better and error > 10 * RIGHT:
            text = f"{better[0].partition(':')[2]} {error_text(self.error(better[0], kind))}"
            notes.append(TableCell(text, "the other settings are nearer here", css="soft"))
        css = "best" if self.is_near(name, kind) else ""
        side = " " if np.isnan(cost) else f"{style.number(cost, 2)} µs"
        return TableCell(error_text(error), css=css, side=side, notes=tuple(notes))

    def heading(self, name: str) -> TableCell:
        engine, _, profile = name.rpartition(":")
        about = LIBRARIES.get(engine, ("", "yours" if name.endswith(OWN) else ""))[1]
        if name in OURS:
            about = "our exercise, float64" if name == OURS[0] else "ours, ordered by time"
        if name in self.libraries and profile != "matched":
            about += f", {profile}"
        title = label(name)
        if is_library(name) and engine in self.versions and not title[-1:].isdigit():
            title += " " + ".".join(next(iter(self.versions[engine].values())).split(".")[:2])
        link = f"#settings_{engine}" if name in self.libraries else ""
        return TableCell(title, name, link, notes=(TableCell(about, css="soft"),))

    def section(self) -> Section:
        kinds = [kind for kind in MEANING if kind in self.situations]
        rows = [[self.cell(name, kind) for name in self.columns] for kind in kinds]
        about = {kind: (TableCell(MEANING[kind], css="soft"),) for kind in kinds}
        last = {WITHOUT: "last"}
        index = [TableCell(kind, css=last.get(kind, ""), notes=about[kind]) for kind in kinds]
        frame = pd.DataFrame(rows, index, dtype=object)
        frame = frame.set_axis([self.heading(name) for name in self.columns], axis="columns")
        steps = Counter(step_text(scene.comparison.middle_dt) for scene in self.scenes)
        step = steps.most_common(1)[0][0] + (" in most scenes" if len(steps) > 1 else "")
        cost = "Small: the time of a step. " if self.costs else ""
        fault = "" if self.costs else self.clock.fault or "No scene was timed."
        matched = all(name.endswith(":matched") for name in self.libraries)
        settings = " Libraries have <a href='#settings'>matched settings</a>: click a name."
        says = Markup(
            "Large: how far a disk is from its exact place at worst, in radii of the disk, at the"
            " usual step ({}); median of the scenes. {}<span class='best'>Green</span>: nearest;"
            " within a factor of {:.0f} is a tie, as half the step changes as much. <span"
            " class='bad'>Red</span>: what goes wrong, a click shows the worst scene; lost: a disk"
            " is more than a radius off, or the run fails (sinks, tunnels, gains energy, ...),"
            " which counts as infinitely far off.{} {}"
        ).format(step, cost, TIE, Markup(settings * (matched and bool(self.libraries))), fault)
        return Section("", says, [Table(frame, css="main stack")])

    def sentences(self) -> list[Markup]:
        if len(self.libraries) < 2 or WITHOUT not in self.situations:
            return []
        near = self.nearest(WITHOUT)
        rough = self.nearest(FRICTION) if FRICTION in self.situations else None
        first = tied(near) + (
            ", with friction and without" if near == rough else " without friction"
        )
        costs = {name: self.cost(name, WITHOUT) for name in self.libraries}
        costs = {name: cost for name, cost in costs.items() if not np.isnan(cost)}
        if costs:
            cheapest = label(min(costs, key=costs.__getitem__))
            first += Markup("; <b>{}</b> costs least").format(cheapest)
        first += "."
        if rough not in (None, near):
            first += Markup(" With friction {}.").format(tied(rough))
        second = Markup("")
        if lost := [
            kind for kind in self.situations if kind != SPIN and not self.best(kind) < LOST
        ]:
            kinds = listed([kind.lower() for kind in lost])
            second += f"In {kinds} no library stays within a radius. "
        scenes = smooth(self.scenes)
        ranges = [
            sorted(
                sum(scene.is_lost(name) for scene in scenes)
                for names in self.profiles.values()
                for name in names
                if name.endswith(f":{profile}")
            )
            for profile in ("shipped", "matched")
        ]
        if all(ranges):
            shipped, matched = (" to ".join(map(str, sorted({r[0], r[-1]}))) for r in ranges)
            second += Markup(
                "<a href='#settings'>Settings</a> decide more than the library: as shipped the"
                " libraries fail, or are a radius off, in {} of {} scenes, matched in {}."
            ).format(shipped, len(scenes), matched)
        third = Markup("")
        if OURS[1] in self.names:
            exact = sum(scene.error(OURS[1]) < EXACT for scene in scenes)
            cost = self.cost(OURS[1], WITHOUT)
            third = Markup(
                "A solver that takes collisions in order of time (ordered) is exact in {} of {}{}."
            ).format(
                exact,
                len(scenes),
                "" if np.isnan(cost) else f" and costs {style.number(cost, 2)} µs a step",
            )
        return [sentence for sentence in (first, second, third) if sentence]


def summarize(
    comparisons: Sequence[Comparison], untrusted: Iterable[str] = (), clock: RunTimes = NO_CLOCK
) -> Summary:
    names = list(dict.fromkeys(run.name for each in comparisons for run in each.runs))
    return Summary(scenes_of(comparisons), names, frozenset(untrusted), clock)


def median(errors: Sequence[float]) -> float:
    """Of those that are known; nan of none, inf where half of them are."""
    known = [error for error in errors if not np.isnan(error)]
    return float(np.median(known)) if known else np.nan


def stand_in(name: str, scene: SceneScores) -> str:
    """The engine that stands for another in a scene."""
    return WITH_FRICTION.get(name, name) if FRICTION in scene.situations else name


def tied(near: Sequence[str]) -> Markup:
    """ "pymunk is nearest", "a and b are nearest, a tie"."""
    if not near:
        return Markup("no library stays within a radius")
    names = Markup(listed([f"<b>{escape(name)}</b>" for name in near]))
    return names + (" is nearest" if len(near) == 1 else " are nearest, a tie")


def rounded(dt: float) -> float:
    return float(f"{dt:.5g}")  # timings.csv has six digits


def step_text(dt: float) -> str:
    """ "1/240 s"."""
    whole = dt < 0.2 and abs(1 / dt - round(1 / dt)) < 1e-6 / dt
    return f"1/{1 / dt:.0f} s" if whole else f"{style.number(dt)} s"


def error_text(error: float) -> str:
    """An error in radii or rad, as the table has it."""
    if not np.isfinite(error):
        return "fails" if error > 0 else "–"
    return "exact" if error < EXACT else "< 0.001" if error < RIGHT else style.number(error, 2)
