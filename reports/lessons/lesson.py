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
from numpy.typing import ArrayLike

from adapters.engines import ENGINES
from adapters.play import play_once
from adapters.run import Run
from reports.compare.comparison import Comparison
from reports.compare.laws import deviation
from reports.compare.view import cut
from reports.page.replay import name_of, pack_layers, played, ratio_of
from reports.page.style import TRUTH, number
from scenarios.model import Array, Scenario, Trajectory
from scenarios.no_truth import answered

POINTS = 400  # of a curve, at most: more than a chart has pixels for
# A space between a number and its unit.
BEFORE_A_UNIT = re.compile(
    r"(?<=[\d∞⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=(?:[mµnk]?[ms]|kg|rad|Hz|kHz|J|N|%)(?:[/²³·]\S*)?(?:\W|$))"
)
Settings = Mapping[str, Any]


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
    x: ArrayLike
    y: ArrayLike
    dots: bool = False
    faint: bool = False

    def to_json(self) -> dict[str, Any]:
        """For JSON: thinned out and rounded to what can be seen; what is not finite is left out."""
        x, y = np.asarray(self.x, float), np.asarray(self.y, float)
        kept = np.linspace(0, len(x) - 1, min(POINTS, len(x))).round().astype(int)
        kept = kept[np.isfinite(x[kept]) & np.isfinite(y[kept])]
        return {
            "name": self.name,
            "x": rounded(x[kept]),
            "y": rounded(y[kept]),
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
        steps: paragraphs with the numbers of this run filled in.
        opening: how the film opens, as `more` of `pack_layers`.
        said: slider -> what it means here, where that depends on the others.
    """

    charts: Sequence[LessonChart]
    film: Comparison | None = None
    facts: Sequence[tuple[str, str]] = ()
    claims: Sequence[Claim] = ()
    steps: Sequence[tuple[str, str]] = ()
    opening: Mapping[str, Any] = field(default_factory=dict)
    said: Mapping[str, str] = field(default_factory=dict)

    def curve(self, name: str, chart: int = 0) -> Curve:
        """The curve of that name in a chart.

        Raises:
            KeyError: if the chart has none.
        """
        for curve in self.charts[chart].curves:
            if curve.name == name:
                return curve
        raise KeyError(f"{name}: not in the chart {self.charts[chart].title}")

    def x(self, name: str, chart: int = 0) -> Array:
        """(k,) the abscissas of the curve, in the unit of the chart."""
        return np.asarray(self.curve(name, chart).x, float)

    def y(self, name: str, chart: int = 0) -> Array:
        """(k,) the ordinates of the curve, in the unit of the chart."""
        return np.asarray(self.curve(name, chart).y, float)

    def gap(self, name: str, other: str = TRUTH, chart: int = 0) -> float:
        """The largest distance of two curves over the points that both have."""
        pair = self.y(name, chart), self.y(other, chart)
        k = min(map(len, pair))
        return float(np.nanmax(np.abs(pair[0][:k] - pair[1][:k])))

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
            "steps": [(title, unbroken(text)) for title, text in self.steps],
            "said": {key: unbroken(text) for key, text in self.said.items()},
        }


@dataclass(frozen=True)
class Lesson:
    """One page.

    Attributes:
        name: for address and file.
        number: "1", "6.3".
        title, asks: the heading, and the question it answers.
        text: paragraphs, HTML written here and nowhere else; `[order]` becomes a link to the lesson
            of that name. What is stated in numbers or as a trend is a claim of `show`, not text.
        sliders: what can be changed.
        names: who may be drawn, in the order of the legend.
        show: settings (key -> value) -> what is shown.
        recorded: whose numbers are not of a run of now, and when and with what they were made; a
            sentence, or "".
    """

    name: str
    number: str
    title: str
    asks: str
    text: Sequence[str]
    sliders: Sequence[Slider]
    names: Sequence[str]
    show: Callable[[Settings], Shown]
    recorded: str = ""

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
            {slider.key: slider.values[place] for slider, place in zip(self.sliders, places)}
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
    """A scenario played by some engines in one step size, and its truth where it has one."""

    scenario: Scenario
    runs: Sequence[Run]
    truth: Trajectory | None

    @staticmethod
    def by(scenario: Scenario, names: Sequence[str], substeps: int) -> Simulation:
        """Play it; the ladder of the scenario that is kept has this step only."""
        scenario, truth = answered(replace(scenario, substeps=(substeps,)))
        return Simulation(scenario, [run_of(name, scenario, substeps) for name in names], truth)

    @cached_property
    def film(self) -> Comparison:
        """What the player of the page shows."""
        return Comparison(self.scenario, self.truth, self.runs, pd.DataFrame())

    @property
    def first_collision(self) -> float:
        """s, up to when nothing collides, in the exact answer and in any engine."""
        assert self.truth is not None
        motions = [self.truth, *(run.trajectory for run in self.runs if run.trajectory)]
        return min(float(each.collisions.t[0]) for each in motions) - self.runs[0].dt

    def curves(self, read: Callable[[Trajectory], Array]) -> list[Curve]:
        """`read` of every trajectory over time; the truth last, so that it lies on top."""
        found = [
            Curve(run.name, run.trajectory.t, read(run.trajectory))
            for run in self.runs
            if run.trajectory
        ]
        return found + (
            [Curve(TRUTH, self.truth.t, read(self.truth))] if self.truth is not None else []
        )

    def errors(self) -> list[Curve]:
        """m, the largest distance of any disk from the truth over time, while there is one."""
        assert self.truth is not None
        curves = []
        for run in self.runs:
            if run.trajectory is not None:
                k = min(len(run.trajectory), len(self.truth))
                distances = deviation(
                    cut(run.trajectory, k), cut(self.truth, k), self.scenario.scene
                )
                curves.append(Curve(run.name, self.truth.t[:k], distances.max(axis=1)))
        return curves


def run_of(name: str, scenario: Scenario, substeps: int) -> Run:
    """One run of one engine, by the name of its row."""
    return play_once(ENGINES[name].make, name, scenario, scenario.dt(substeps))


def unbroken(text: str) -> str:
    """The text with spaces at which no line is broken between its numbers and their units."""
    return BEFORE_A_UNIT.sub("\N{NO-BREAK SPACE}", text)


def rounded(values: Array) -> list[float]:
    """To six digits, more than a chart can show."""
    return [float(f"{value:.6g}") for value in values.tolist()]
