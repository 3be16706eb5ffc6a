"""The nouns of a lesson: its sliders, and what it shows for a setting of them: curves, a replay,
numbers, and claims about the curves."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engine import Engine
from crosscheck2d.adapters.engines import row_of
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.laws import deviation
from crosscheck2d.reports.page.replay import name_of, pack_layers, played, ratio_of
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Trajectory
from crosscheck2d.scenarios.no_truth import answered

POINTS = 400  # of a curve, at most: more than a chart has pixels for
# A space between a number and its unit.
BEFORE_A_UNIT = re.compile(
    r"(?<=[\d∞⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=(?:[mµnk]?[ms]|kg|rad|Hz|kHz|J|N|%)(?:[/²³·]\S*)?(?:\W|$))"
)
Read = Callable[[Trajectory], Array]  # what a curve shows of a motion
Makes = Mapping[str, Callable[[], Engine]]  # name -> how that engine is made


@dataclass(frozen=True)
class Slider:
    """One thing that can be changed: a slider, or a list to choose from where its values are names.

    values: what it goes through; start: the index it begins with; read_as: how the values are read
    where that is not the value and its unit.
    """

    key: str
    label: str
    values: Sequence[Any]
    start: int = 0
    unit: str = ""
    read_as: Sequence[str] = ()

    @property
    def of_names(self) -> bool:
        """Whether its values are names, which lie on no scale."""
        return all(isinstance(value, str) for value in self.values)

    @property
    def shown(self) -> list[str]:
        """The values as they are read."""
        return list(map(unbroken, self.read_as)) or [
            value if isinstance(value, str) else unbroken(f"{number(value)} {self.unit}".strip())
            for value in self.values
        ]


def time_step(interval: float, substeps: Sequence[int], start: int) -> Slider:
    """The slider `k`, by how many steps a sample interval (s) is divided, read as dt in ms."""
    read_as = [f"{number(1e3 * interval / k)} ms" for k in substeps]
    return Slider("k", "Time step dt", substeps, start, read_as=read_as)


@dataclass(frozen=True)
class Curve:
    """name: whose (an engine, `truth`, or `reference:ablated` for the reference with a mechanism
    on); x, y: (k,).

    dots: whether its points are marked; faint: whether it stands back behind the others.
    """

    name: str
    x: Array
    y: Array
    dots: bool = False
    faint: bool = False

    def to_json(self) -> dict[str, Any]:
        """For JSON: thinned out and rounded to what can be seen; what is not finite is left out."""
        kept = np.linspace(0, len(self.x) - 1, min(POINTS, len(self.x))).round().astype(int)
        kept = kept[np.isfinite(self.x[kept]) & np.isfinite(self.y[kept])]
        return {
            "name": self.name,
            "x": rounded(self.x[kept]),
            "y": rounded(self.y[kept]),
            "dots": self.dots,
            "faint": self.faint,
        }


@dataclass(frozen=True)
class LessonChart:
    """Curves over one pair of axes.

    Attributes:
        title, x, y: what it shows, and the axes with their units.
        log: which of the axes, of "xy", are logarithmic.
        guides: lines across: (axis, value, text).
        reverse: whether x runs to the left.
    """

    title: str
    x: str
    y: str
    curves: Sequence[Curve]
    log: str = ""
    guides: Sequence[tuple[str, float, str]] = ()
    reverse: bool = False

    def curve(self, name: str) -> Curve:
        """The curve of that name.

        Raises:
            KeyError: if there is none.
        """
        for curve in self.curves:
            if curve.name == name:
                return curve
        raise KeyError(f"{name}: not in the chart {self.title}")

    def gap(self, name: str, other: str = TRUTH) -> float:
        """The largest distance of two curves over the points that both have."""
        pair = self.curve(name).y, self.curve(other).y
        k = min(map(len, pair))
        return float(np.nanmax(np.abs(pair[0][:k] - pair[1][:k])))

    def to_json(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "title": self.title,
            "x": self.x,
            "y": self.y,
            "log": self.log,
            "guides": list(self.guides),
            "reverse": self.reverse,
            "curves": [curve.to_json() for curve in self.curves],
        }


@dataclass(frozen=True)
class Claim:
    """A sentence about the curves of a page, and what must be true of the curves for it to hold.

    A sentence that is true of some settings only is claimed at these settings only. The page marks
    a sentence that its own curves contradict; `tests/reports/lessons/test_claims.py` allows none.
    """

    text: str
    holds: Callable[[Shown], bool | np.bool_]


@dataclass(frozen=True)
class Shown:
    """What a lesson shows for one setting of its sliders.

    Attributes:
        charts: at least one.
        film: what is replayed, or None.
        facts: (what, number and unit) of this run.
        claims: every number and every trend that the page states in words about its curves.
        steps: title -> a paragraph with the numbers of this run filled in.
        opening: how the film opens, as `more` of `pack_layers`.
        said: slider -> what it means here, where that depends on the others.
    """

    charts: Sequence[LessonChart]
    film: Comparison | None = None
    facts: Sequence[tuple[str, str]] = ()
    claims: Sequence[Claim] = ()
    steps: Mapping[str, str] = field(default_factory=dict)
    opening: Mapping[str, Any] = field(default_factory=dict)
    said: Mapping[str, str] = field(default_factory=dict)

    def curve(self, name: str, chart: int = 0) -> Curve:
        """The curve of that name in a chart; raises `KeyError` if the chart has none."""
        return self.charts[chart].curve(name)

    def x(self, name: str, chart: int = 0) -> Array:
        """(k,) the abscissas of the curve, in the unit of the chart."""
        return self.curve(name, chart).x

    def y(self, name: str, chart: int = 0) -> Array:
        """(k,) the ordinates of the curve, in the unit of the chart."""
        return self.curve(name, chart).y

    def gap(self, name: str, other: str = TRUTH, chart: int = 0) -> float:
        """The largest distance of two curves over the points that both have."""
        return self.charts[chart].gap(name, other)

    def follows(self, name: str, law: Array | float, bound: float, chart: int = 0) -> bool:
        """Whether a curve is `law`, a number or (k,) ordinates, within `bound`."""
        return bool(np.abs(self.y(name, chart) - law).max() <= bound)

    def drawn(self) -> list[str]:
        """The names with a curve in a chart, or with disks in the replay."""
        names = {curve.name for chart in self.charts for curve in chart.curves}
        if self.film is not None:
            names |= {name_of(run) for run, _ in played(self.film)}
        return sorted(names)

    def refusals(self) -> list[tuple[str, str]]:
        """The engines that were not played to the end, and why."""
        runs = [] if self.film is None else self.film.runs
        return [(run.name, f"{run.status}: {run.reason}") for run in runs if run.status != "ok"]

    def to_json(self) -> dict[str, Any]:
        """For JSON."""
        film = None
        if self.film is not None:
            layers = played(self.film)
            pack = pack_layers(self.film.scenario, layers, more=self.opening)
            film = {
                "pack": pack,
                "ratio": ratio_of(self.film.scenario, layers),
                "names": [name_of(run) for run, _ in layers],
            }
        return {
            "charts": [chart.to_json() for chart in self.charts],
            "film": film,
            "drawn": self.drawn(),
            "facts": [(what, unbroken(text)) for what, text in (*self.facts, *self.refusals())],
            "claims": [[unbroken(claim.text), bool(claim.holds(self))] for claim in self.claims],
            "steps": [(title, unbroken(text)) for title, text in self.steps.items()],
            "said": {key: unbroken(text) for key, text in self.said.items()},
        }


@dataclass(frozen=True)
class Lesson:
    """One page.

    Attributes:
        name: for address and file.
        number: "1", "6.3".
        title, asks: the heading, and the question it answers.
        text: paragraphs with an empty line between them, HTML written here and nowhere else;
            `[order]` becomes a link to the lesson of that name. What is stated in numbers or as a
            trend is a claim of `show`, not text.
        sliders: what can be changed.
        names: who may be drawn, in the order of the legend.
        show: what is shown where the sliders have these values; its arguments are their keys.
        recorded: whose numbers are not of a run of now, and when and with what they were made; a
            sentence, or "".
    """

    name: str
    number: str
    title: str
    asks: str
    text: str
    sliders: Sequence[Slider]
    names: Sequence[str]
    show: Callable[..., Shown]
    recorded: str = ""

    @property
    def paragraphs(self) -> list[str]:
        """Those of the text, each in one line."""
        return [" ".join(paragraph.split()) for paragraph in self.text.split("\n\n")]

    def at(self, places: Sequence[int]) -> Shown:
        """What is shown with the sliders at these indices.

        Raises:
            ValueError: if there are not as many as sliders, or one is beyond its values.
        """
        if len(places) != len(self.sliders):
            raise ValueError(f"{len(places)} places for {len(self.sliders)} sliders")
        for slider, place in zip(self.sliders, places):
            if not 0 <= place < len(slider.values):
                raise ValueError(
                    f"{slider.key} = {place}: must be from 0 to {len(slider.values) - 1}"
                )
        return self.show(
            **{slider.key: slider.values[place] for slider, place in zip(self.sliders, places)}
        )

    @property
    def start(self) -> tuple[int, ...]:
        """Where the sliders begin."""
        return tuple(slider.start for slider in self.sliders)

    @property
    def grid(self) -> list[tuple[int, ...]]:
        """Every setting of the sliders."""
        return list(product(*(range(len(slider.values)) for slider in self.sliders)))


@dataclass(frozen=True, eq=False)
class Simulation:
    """A scenario played by some engines in one step size."""

    scenario: Scenario  # its step sizes are this one only
    runs: Sequence[Run]

    @staticmethod
    def by(
        scenario: Scenario, names: Sequence[str], substeps: int, makes: Makes | None = None
    ) -> Simulation:
        """Play it; `makes`: how those of `names` are made that are not made as their row says."""
        runs = [run_of(name, scenario, substeps, (makes or {}).get(name)) for name in names]
        return Simulation(replace(scenario, substeps=(substeps,)), runs)

    @cached_property
    def answered(self) -> tuple[Scenario, Trajectory | None]:
        """The scenario and its exact answer; if it has none, the scenario says why."""
        return answered(self.scenario)

    @property
    def truth(self) -> Trajectory:
        """The exact answer of a scenario that has one."""
        _, truth = self.answered
        assert truth is not None
        return truth

    @cached_property
    def film(self) -> Comparison:
        """What the player of the page shows."""
        return Comparison(*self.answered, self.runs, pd.DataFrame())

    @cached_property
    def motions(self) -> dict[str, Trajectory]:
        """The trajectory of every engine that played, and the exact answer if there is one: it
        comes last, so that its curve lies on top."""
        _, truth = self.answered
        played = {run.name: run.trajectory for run in self.runs if run.trajectory is not None}
        return played | ({TRUTH: truth} if truth is not None else {})

    @property
    def first_collision(self) -> float:
        """s, up to when nothing collides, in the exact answer and in any engine."""
        starts = [float(each.collisions.t[0]) for each in self.motions.values()]
        return min(starts) - self.runs[0].dt

    def curves(self, read: Read, x: Array | None = None) -> list[Curve]:
        """`read` of every motion: over time, or against `x`, where the points of the engines are
        marked."""
        return [
            Curve(name, each.t if x is None else x, read(each), x is not None and name != TRUTH)
            for name, each in self.motions.items()
        ]

    def over_time(
        self,
        title: str,
        y: str,
        read: Read,
        log: str = "",
        guides: Sequence[tuple[str, float, str]] = (),
    ) -> LessonChart:
        """`read` of every motion over time."""
        return LessonChart(title, "time in s", y, self.curves(read), log, guides)

    def error(self, name: str, motion: Trajectory) -> Curve:
        """m, the distance of the farthest disk from the exact answer over time, while there is
        one."""
        distances = farthest(motion, self.truth, self.scenario.scene)
        return Curve(name, motion.t[: len(distances)], distances)

    def errors(self) -> list[Curve]:
        """m, the error of every engine."""
        return [self.error(*each) for each in self.motions.items() if each[0] != TRUTH]

    def errors_over_time(
        self, *others: Curve, guides: Sequence[tuple[str, float, str]] = ()
    ) -> LessonChart:
        """The error of every engine, and other errors."""
        curves = [*self.errors(), *others]
        title = "Farthest disk from the exact answer"
        return LessonChart(title, "time in s", "m", curves, "y", guides)


def run_of(
    name: str, scenario: Scenario, substeps: int, make: Callable[[], Engine] | None = None
) -> Run:
    """One run of one engine: of the row of that name, or made by `make`."""
    return play_once(make or row_of(name).make, name, scenario, scenario.dt(substeps))


def farthest(one: Trajectory, other: Trajectory, scene: Scene) -> Array:
    """(k,) m, the largest distance of any disk between two motions, as long as both last."""
    distances: Array = deviation(one, other, scene).max(axis=1)
    return distances


def swept(
    x: Array, played: Sequence[Simulation], read: Callable[[Trajectory, Scene], float]
) -> list[Curve]:
    """A curve for each engine, with a point for each simulation: `read` of its motion there."""
    found: dict[str, list[float]] = {}
    for one in played:
        for run in one.runs:
            if run.trajectory is not None:
                point = read(run.trajectory, one.scenario.scene)
                found.setdefault(run.name, []).append(float(point))
    return [Curve(name, x, np.array(points), dots=True) for name, points in found.items()]


def tidy(value: float, rounding: float, digits: int = 3) -> str:
    """To so many digits; what is 0 but for `rounding` is shown as 0."""
    return number(value, digits) if abs(value) > rounding else "0"


def unbroken(text: str) -> str:
    """The text with spaces at which no line is broken between its numbers and their units."""
    return BEFORE_A_UNIT.sub("\N{NO-BREAK SPACE}", text)


def rounded(values: Array) -> list[float]:
    """To six digits, more than a chart can show."""
    return [float(f"{value:.6g}") for value in values.tolist()]
