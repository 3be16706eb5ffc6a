"""The first table of the report: what each library does well, at what cost, and what goes wrong;
and the sentences above it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd
from markupsafe import Markup, escape

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.verdicts import VERDICTS, in_words
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.cost_points import NO_CLOCK, RunTimes
from crosscheck2d.reports.page.kit import Section, Table, TableCell
from crosscheck2d.reports.page.scenes import (
    ANGLE,
    ERROR,
    EXACT,
    LIBRARIES,
    LOST,
    OURS,
    RIGHT,
    TIE,
    WITH_FRICTION,
    SceneScores,
    is_library,
    label,
    nearer_profile,
    scenes_of,
    smooth,
)
from crosscheck2d.reports.page.situations import FRICTION, SITUATIONS, SPIN
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


@dataclass(frozen=True, eq=False)
class Summary:
    """The scenes of a run, and what the first table says of them.

    Attributes:
        scenes: all of them.
        names: every `engine:profile` that was played.
        untrusted: those that broke the protocol, and the reader's own that break a law: their rows
            stay in the tables, but they are not ranked.
        clock: the times of the run.
    """

    scenes: Sequence[SceneScores]
    names: Sequence[str]
    untrusted: frozenset[str] = frozenset()
    clock: RunTimes = field(default=NO_CLOCK)

    @cached_property
    def profiles(self) -> dict[str, list[str]]:
        """Engine -> its `engine:profile`, of the libraries that are ranked."""
        found: dict[str, list[str]] = {}
        for name in self.names:
            if is_library(name) and not name.endswith(OWN) and name not in self.untrusted:
                found.setdefault(name.partition(":")[0], []).append(name)
        return found

    @cached_property
    def chosen(self) -> dict[str, tuple[str, int, int]]:
        """Engine -> `nearer_profile` in all scenes: one for all situations, as a program runs with
        one."""
        scored = [scene for scene in self.scenes if scene.counts]
        return {engine: nearer_profile(scored, of) for engine, of in self.profiles.items()}

    @cached_property
    def libraries(self) -> list[str]:
        """The `engine:profile` of each library that is ranked."""
        return [name for name, _, _ in self.chosen.values()]

    @cached_property
    def columns(self) -> list[str]:
        """What stands across: libraries, the reader's own, ours."""
        own = [name for name in self.names if name.endswith(OWN)]
        ours = [name for name in OURS if name in self.names]
        found = [*self.libraries, *own, *ours]
        return found if self.libraries or own else found or list(self.names)[:8]

    @cached_property
    def situations(self) -> dict[str, list[SceneScores]]:
        """Situation -> its scenes that are scored; the last without friction, if there are more."""
        scored = [scene for scene in self.scenes if scene.counts]
        found = {kind: [s for s in scored if kind in s.situations] for kind in SITUATIONS}
        found = {kind: scenes for kind, scenes in found.items() if scenes}
        if len([kind for kind in found if kind not in (SPIN, FRICTION)]) > 1:
            found[WITHOUT] = smooth(self.scenes)
        return found

    @cached_property
    def hopeless(self) -> set[str]:
        """Those that fail, or are a radius off, in most of several scenes without friction."""
        scenes = smooth(self.scenes)
        if len(scenes) < MANY:
            return set()
        lost = {name: sum(scene.is_lost(name) for scene in scenes) for name in self.names}
        return {name for name, count in lost.items() if count > len(scenes) / 2}

    def error(self, name: str, kind: str) -> float:
        """The median error in a situation; inf where an engine fails in half of the scenes."""
        metric = ANGLE if kind == SPIN else ERROR
        errors = [s.error(played(name, s), metric=metric) for s in self.situations[kind]]
        known = [error for error in errors if not np.isnan(error)]
        return float(np.median(known)) if known else np.nan

    @cached_property
    def times(self) -> dict[tuple[str, str, float], float]:
        """(scene, `engine:profile`, dt in s, `rounded`) -> µs of engine time for a second of
        simulation, where that was timed."""
        if self.clock.fault:
            return {}
        table = self.clock.table
        names = zip(table.scenario, table.engine + ":" + table.profile, table.dt_s.astype(float))
        costs = table.cost_us_per_s.astype(float)
        return {(s, n, rounded(dt)): float(cost) for (s, n, dt), cost in zip(names, costs)}

    @cached_property
    def costs(self) -> dict[tuple[str, str], float]:
        """(scene, `engine:profile`) -> µs of a step at the middle step size, where it was timed."""
        found = {}
        for scene in self.scenes:
            dt = scene.comparison.middle_dt
            for name in self.names:
                if (time := self.times.get((scene.name, name, rounded(dt)))) is not None:
                    found[scene.name, name] = time * dt
        return found

    def cost(self, name: str, kind: str) -> float:
        """µs of a step: geometric mean of the timed scenes of a situation."""
        keys = [(scene.name, played(name, scene)) for scene in self.situations[kind]]
        costs = [self.costs[key] for key in keys if key in self.costs]
        return float(np.exp(np.mean(np.log(costs)))) if costs else np.nan

    def best(self, kind: str) -> float:
        """The smallest error of a library."""
        errors = [self.error(name, kind) for name in self.libraries]
        return min((error for error in errors if not np.isnan(error)), default=np.nan)

    def is_near(self, name: str, kind: str) -> bool:
        """Whether a library is nearest, or in a tie with the nearest."""
        error = self.error(name, kind)
        return (
            name in self.libraries and error <= max(TIE * self.best(kind), RIGHT) and error < LOST
        )

    def words(self, name: str, kind: str) -> list[TableCell]:
        """What goes wrong in a situation, the gravest first; each opens its worst scene."""
        if kind == SPIN:
            return []
        scenes = self.situations[kind]
        worst: dict[str, tuple[float, str]] = {}
        count: Counter[str] = Counter()
        for scene in scenes:
            for verdict, value in scene.verdicts(played(name, scene)):
                count[verdict] += 1
                worst[verdict] = max(worst.get(verdict, (-1.0, "")), (value, scene.name))
        lost = [s for s in scenes if s.is_lost(played(name, s))]
        refused = [s for s in scenes if s.refuses(played(name, s))]
        told = []
        for verdict in [verdict for verdict in VERDICTS if verdict in worst]:
            value, where = worst[verdict]
            title = f"in {count[verdict]} of {counted(len(scenes), 'scene')}, worst in {where}"
            told.append(TableCell(in_words(verdict, value), title, f"#{where}", "bad"))
        if refused and not name.endswith(OWN):
            why = refused[0].refused[played(name, refused[0])]
            words = f"refuses {len(refused)} of {len(scenes)}"
            told.append(TableCell(words, why, f"#{refused[0].name}", "bad"))
        if lost:
            far = max(lost, key=lambda s: np.nan_to_num(s.raw_error(played(name, s))))
            words = f"lost in {len(lost)} of {len(scenes)}"
            if len(lost) == len(scenes) and all(scene.hopeless for scene in scenes):
                part = [min(s.follows[played(name, s)] / s.known_until, 1) for s in lost]
                words = f"lost after {100 * float(np.median(part)):.0f} %"
            title = f"fails, or is more than a radius off; farthest in {far.name}"
            told.append(TableCell(words, title, f"#{far.name}", "bad"))
        return told if len(told) <= MOST_WORDS else [told[0], told[-1]]

    def cell(self, name: str, kind: str) -> TableCell:
        """A cell of the table."""
        error, cost = self.error(name, kind), self.cost(name, kind)
        if np.isnan(error):
            return TableCell("–", "not played")
        notes = self.words(name, kind) if kind != WITHOUT else self.words(name, kind)[-1:]
        other = [each for each in self.profiles.get(name.partition(":")[0], []) if each != name]
        better = [each for each in other if self.error(each, kind) < error / TIE]
        if better and error > 10 * RIGHT:
            text = f"{better[0].partition(':')[2]} {error_text(self.error(better[0], kind))}"
            notes.append(TableCell(text, "the other settings are nearer here", css="soft"))
        css = "best" if self.is_near(name, kind) else ""
        side = "" if np.isnan(cost) else f"{style.number(cost, 2)} µs"
        return TableCell(error_text(error), css=css, side=side or " ", notes=tuple(notes))

    def table(self) -> Table:
        """Situations down, engines across."""
        kinds = [kind for kind in MEANING if kind in self.situations]
        columns = {self.heading(name): [self.cell(name, k) for k in kinds] for name in self.columns}
        notes = {kind: (TableCell(MEANING[kind], css="soft"),) for kind in kinds}
        index = [
            TableCell(kind, css="last" * (kind == WITHOUT), notes=notes[kind]) for kind in kinds
        ]
        frame = pd.DataFrame(dict(enumerate(columns.values())), index, dtype=object)
        return Table(frame.set_axis(list(columns), axis="columns"), css="main stack")

    def heading(self, name: str) -> TableCell:
        """The heading of a column: the engine, and what it is."""
        engine, _, profile = name.rpartition(":")
        about = LIBRARIES.get(engine, ("", "yours" if name.endswith(OWN) else ""))[1]
        if name in OURS:
            about = "our exercise, float64" if name == OURS[0] else "ours, ordered by time"
        if name in self.libraries and profile != "matched":
            about += f", {profile}"
        version = self.versions.get(engine, "")
        title = label(name) + (f" {version}" if is_library(name) and version else "")
        link = f"#settings_{engine}" if name in self.libraries else ""
        return TableCell(title, name, link, notes=(TableCell(about, css="soft"),))

    @cached_property
    def versions(self) -> dict[str, str]:
        """Engine -> version of its library, where `label` has none."""
        found: dict[str, str] = {}
        for scene in self.scenes[:1]:
            for run in scene.comparison.runs:
                if run.versions and not label(run.name)[-1:].isdigit():
                    first = next(iter(run.versions.values()))
                    found[run.engine] = ".".join(first.split(".")[:2])
        return found

    def sentences(self) -> list[Markup]:
        """What the table says, in three sentences."""
        if len(self.libraries) < 2 or WITHOUT not in self.situations:
            return []
        told = []
        near = self.nearest(WITHOUT)
        rough = self.nearest(FRICTION) if FRICTION in self.situations else None
        where = ", with friction and without" if near == rough else " without friction"
        first = tied(near) + where
        costs = {name: self.cost(name, WITHOUT) for name in self.libraries}
        costs = {name: cost for name, cost in costs.items() if not np.isnan(cost)}
        if costs:
            first += Markup("; <b>{}</b> costs least").format(
                label(min(costs, key=costs.__getitem__))
            )
        first += "."
        if rough not in (None, near):
            first += Markup(" With friction {}.").format(tied(rough))
        told.append(first)
        lost = [kind for kind in self.situations if kind != SPIN and not self.best(kind) < LOST]
        second = Markup("")
        if lost:
            second += (
                f"In {listed([kind.lower() for kind in lost])} no library stays within a radius. "
            )
        scenes = smooth(self.scenes)
        ranges = {
            profile: sorted(
                sum(scene.is_lost(f"{engine}:{profile}") for scene in scenes)
                for engine, of in self.profiles.items()
                if f"{engine}:{profile}" in of
            )
            for profile in ("shipped", "matched")
        }
        if all(ranges.values()):
            shipped, matched = ((span(counts)) for counts in ranges.values())
            second += Markup(
                "<a href='#settings'>Settings</a> decide more than the library: as shipped the"
                " libraries fail, or are a radius off, in {} of {} scenes, matched in {}."
            ).format(shipped, len(scenes), matched)
        told.append(second)
        if OURS[1] in self.names:
            exact = sum(scene.error(OURS[1]) < EXACT for scene in scenes)
            cost = self.cost(OURS[1], WITHOUT)
            of = f"{exact} of {len(scenes)}"
            costs_text = "" if np.isnan(cost) else f" and costs {style.number(cost, 2)} µs a step"
            third = f"A solver that takes collisions in order of time (ordered) is exact in {of}"
            told.append(Markup(f"{third}{costs_text}."))
        return [each for each in told if each]

    def nearest(self, kind: str) -> list[str]:
        """The libraries that are nearest, the nearest first."""
        names = [name for name in self.libraries if self.is_near(name, kind)]
        return [label(name) for name in sorted(names, key=lambda name: self.error(name, kind))]

    def section(self) -> Section:
        """The first section of the report."""
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
        return Section("", says, [self.table()])


def summarize(
    comparisons: Sequence[Comparison],
    untrusted: Iterable[str] = (),
    clock: RunTimes = NO_CLOCK,
) -> Summary:
    """The summary of these scenes."""
    names = list(dict.fromkeys(run.name for each in comparisons for run in each.runs))
    return Summary(scenes_of(comparisons), names, frozenset(untrusted), clock)


def played(name: str, scene: SceneScores) -> str:
    """Who stands for an engine in a scene."""
    return WITH_FRICTION.get(name, name) if FRICTION in scene.situations else name


def tied(near: Sequence[str]) -> Markup:
    """ "pymunk is nearest", "a and b are nearest, a tie"."""
    if not near:
        return Markup("no library stays within a radius")
    names = Markup(listed([f"<b>{escape(name)}</b>" for name in near]))
    return names + (" is nearest" if len(near) == 1 else " are nearest, a tie")


def span(counts: Sequence[int]) -> str:
    """ "6 to 10"."""
    return f"{counts[0]} to {counts[-1]}" if counts[0] < counts[-1] else str(counts[0])


def rounded(dt: float) -> float:
    """A step size to the digits that timings.csv may have."""
    return float(f"{dt:.5g}")


def step_text(dt: float) -> str:
    """ "1/240 s"."""
    return (
        f"1/{1 / dt:.0f} s"
        if dt < 0.2 and abs(1 / dt - round(1 / dt)) < 1e-6 / dt
        else f"{style.number(dt)} s"
    )


def error_text(error: float) -> str:
    """An error in radii or rad, as the table has it."""
    if not np.isfinite(error):
        return "fails" if error > 0 else "–"
    return "exact" if error < EXACT else "< 0.001" if error < RIGHT else style.number(error, 2)
