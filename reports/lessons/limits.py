"""Lesson 8, where methods fail: cases of the stability report, searched when they are asked for,
with the run that fails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import DISTINCT
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    LessonChart,
    Read,
    Shown,
    Simulation,
    Slider,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.explain import explained, with_replays
from crosscheck2d.reports.stability.limits import (
    DRIVEN_ENGINES,
    NEVER_FAILS,
    QUICK,
    Case,
    Limit,
    LimitSearch,
    Trial,
    engines_of,
)
from crosscheck2d.reports.stability.overview import bracket, why

HARSHNESS = tuple(range(9))  # places from the gentlest value of a case to its harshest
SECONDS = 4.0  # that a replay lasts


class Seen(NamedTuple):
    """A case of the stability report as the lesson shows it: what is drawn over time, of the first
    disk; and how harsh it gets."""

    case: str
    what: str
    unit: str
    read: Read
    harshest: float | None = None

    def value(self, place: int) -> float:
        """The parameter at this place of `HARSHNESS`, evenly spread in its logarithm."""
        first, last = CASES[self.case].values[0], self.harshest or CASES[self.case].values[-1]
        return float(f"{first * (last / first) ** (place / HARSHNESS[-1]):.3g}")


def gone(axis: int) -> Read:
    """(k,) m that the first disk has gone along an axis."""
    return lambda each: each.position[:, 0, axis] - each.position[0, 0, axis]


ALONG = "Displacement along x"
SEEN = {
    "a fast disk meets another": Seen("tunnelling_head_on", ALONG, "m", gone(0)),
    "a fast disk meets a thin wall": Seen("tunnelling_thin_wall", ALONG, "m", gone(0)),
    "a slow collision": Seen("slow_collision", "Displacement of the first disk", "m", gone(0)),
    "a near miss": Seen("near_miss", "Deflection of the first disk", "m", gone(1)),
    "a scene made smaller": Seen("scale_down", "Displacement of the first disk", "m", gone(0)),
    # A replay keeps seven digits of a place: farther out they are too few for a disk.
    "far from the origin": Seen("far_from_origin", ALONG, "m", gone(0), harshest=1e5),
    "a fast spin": Seen("spin", "Angle", "rad", lambda each: each.angle[:, 0]),
}

# What is changed in the engines of these cases whose names have a +.
CHANGES = dict.fromkeys(
    f"<code>+{name.partition('+')[2]}</code>, {DRIVEN_ENGINES[name].change}"
    for seen in SEEN.values()
    for name in CASES[seen.case].also
    if DRIVEN_ENGINES[name].change
)


@cache
def limits_of(name: str) -> list[Limit]:
    """The limits of a case on every engine, searched now, with their reasons, which engines with
    one change test."""
    case = CASES[name]
    searches = [LimitSearch(case, engine, QUICK) for engine in engines_of(case)]
    limits = explained([with_replays(search, search.limit()) for search in searches])
    if case.predicate.bound:
        return limits
    # The share of runs that fail is drawn; the search stops at the first one.
    whole = {search.engine: search for search in searches if search.engine in DISTINCT}

    def to_the_end(limit: Limit) -> Limit:
        if limit.engine not in whole:
            return limit
        trials = (whole[limit.engine].trial(t.value, to_the_end=True) for t in limit.trials)
        return replace(limit, trials=tuple(trials))

    return list(map(to_the_end, limits))


def run_at(case: Case, engine: str, value: float) -> tuple[Trial, Simulation]:
    """All runs of an engine at a value, and of them the first that fails, or the first, which has
    the worst phase."""
    search = LimitSearch(case, engine, QUICK)
    trial = search.trial(value, to_the_end=True)
    played = search.seen.get(value) or case.play(DRIVEN_ENGINES[engine], case.scene(value, 0))
    scenario, run = played
    return trial, Simulation(scenario, [run])


def show_limits(case: str, engine: str, place: int) -> Shown:
    """The run at this value beside the exact answer, and the readings of all engines up to their
    limits."""
    seen = SEEN[case]
    asked, value, limits = CASES[seen.case], seen.value(place), limits_of(seen.case)
    trial, played = run_at(asked, engine, value)
    found = next(limit for limit in limits if limit.engine == engine)
    return Shown(
        [
            played.over_time(seen.what, seen.unit, seen.read),
            readings(asked, limits, engine, value),
        ],
        played.film,
        [(limit.engine, in_words(limit, asked)) for limit in limits if limit.engine in DISTINCT],
        [limit_claim(asked, found)],
        in_numbers(asked, trial, found),
        {"pace": played.scenario.duration / SECONDS} | event_of(trial),
        {"place": with_unit(f"{asked.parameter} = {number(value)}", asked)},
    )


def limit_claim(case: Case, limit: Limit) -> Claim:
    """That the readings of an engine pass the line of failing once, and stay beyond it."""
    most = case.predicate.bound or 0.0  # without a bound the share of runs that fail is drawn

    def fails(shown: Shown) -> np.ndarray:
        return ~(shown.y(limit.engine, 1) <= most)  # what was refused has no reading

    def fails_from_the_limit_on(shown: Shown) -> bool:
        x, beyond = case.harsher * shown.x(limit.engine, 1), fails(shown)
        return bool(beyond.any() and x[beyond].min() > x[~beyond].max(initial=-np.inf))

    if limit.verdict == NEVER_FAILS:
        return Claim(
            f"{limit.engine} works at every value that was tried.",
            lambda shown: not fails(shown).any(),
        )
    return Claim(
        f"{limit.engine} works at every value tried before its limit, and fails or refuses at it.",
        fails_from_the_limit_on,
    )


def event_of(trial: Trial) -> dict[str, Any]:
    """What the replay marks: when and at which disk it fails."""
    fails = not trial.works and isfinite(trial.at)
    return {"event": {"t": trial.at, "disk": trial.disk}} if fails else {}


def readings(case: Case, limits: Sequence[Limit], engine: str, value: float) -> LessonChart:
    """What is read at every value tried, harsher to the right, the engine before all others.

    Where a run can only fail or not, the share of runs that fail.
    """
    bound = case.predicate.bound

    def read(trial: Trial) -> float:
        return abs(trial.worst) if bound else trial.failed / trial.runs

    curves = [
        Curve(
            each.engine,
            np.array([t.value for t in each.trials]),
            np.array([read(t) for t in each.trials]),
            mine,
            not mine,
        )
        for mine in (False, True)
        for each in limits
        if each.engine in DISTINCT and mine == (each.engine == engine)
    ]
    axis = case.parameter if case.unit == "1" else f"{case.parameter} in {case.unit}"
    here, harsh_left = ("x", value, "here"), case.values[0] > case.values[-1]
    if not bound:
        return LessonChart("Runs that fail", axis, "share", curves, "x", [here], harsh_left)
    title, unit = case.predicate.name.capitalize(), case.predicate.unit.removesuffix("1")
    guides = [here, ("y", bound, "fails above")]
    return LessonChart(title, axis, unit, curves, "xy", guides, harsh_left)


def with_unit(text: str, case: Case) -> str:
    """The text and the parameter's unit, if it has one."""
    return text if case.unit == "1" else f"{text} {case.unit}"


def in_words(limit: Limit, case: Case) -> str:
    """The bracket of a limit."""
    works, fails = bracket(limit)
    if limit.verdict == NEVER_FAILS:
        return f"does not fail up to {with_unit(works, case)}"
    return (
        f"works {works if works == 'nowhere' else f'at {works}'}, fails at {with_unit(fails, case)}"
    )


def in_numbers(case: Case, trial: Trial, limit: Limit) -> dict[str, str]:
    """What failing means, what these runs do, the engine's bracket and the reason, with how that
    was tested."""
    bound, read = "", trial.event
    if case.predicate.bound:
        bound = f", by more than {measured(case, case.predicate.bound)}"
        read = read or f"off by {measured(case, trial.worst)}"
    facts = {
        "Failing means": f"{case.predicate.means}{bound}.",
        "Here": f"{counted(trial)}{f': {read}' if read else ''}.",
        limit.engine: f"{in_words(limit, case)}.",
    }
    if limit.verdict != NEVER_FAILS:
        shown, its_source = (limit.cause.shown, limit.cause.source) if limit.cause else ("", "")
        tested = f" Tested: {shown}." if shown else ""
        source = f" Source: {its_source}." if its_source else ""
        facts["Why"] = f"{why(limit)}{tested}{source}"
    return facts


def counted(trial: Trial) -> str:
    """How many runs fail."""
    if trial.runs == 1:
        return "it works" if trial.works else "it fails"
    return (
        f"none of {trial.runs} runs fails"
        if not trial.failed
        else f"{trial.failed} of {trial.runs} runs fail"
    )


def measured(case: Case, value: float) -> str:
    """A reading with its unit, if it has one."""
    return f"{number(value)} {case.predicate.unit}".removesuffix(" 1")


LIMITS = Lesson(
    name="limits",
    number="8",
    title="Where methods fail",
    asks="How harsh may a scene be before a method breaks?",
    text=f"""
    Every method works in gentle scenes. If one parameter gets harsher, such as a speed, a distance
    or a size, a method may <b>fail</b> from some value on: it misses a collision, limits a spin, or
    loses a position to rounding. The search tries values from gentle to harsh, with the collision
    at several moments of its step. It stops at the first value that fails. Then it halves the gap
    to the last value that works until the two are at most {QUICK.ratio - 1:.0%} apart.

    In the names of the cases and in the reasons v is a speed, R a radius, b the distance of the
    centre lines of two disks, w a spin in rad/s (ω in lesson 9) or, of a force, its angular
    frequency, and h the duration of a substep.

    A reason counts as tested if the limit follows from it, or if an engine that differs in this one
    thing gets farther; else it is called likely. The command <code>crosscheck stability</code>
    searches all cases; these are the quick ones. [threshold] and [digits] explain two of the
    reasons.

    <b>Continuous collision detection</b> (CCD) looks for a contact along the whole path of a disk
    in a step, not only at its end: the disk is <b>swept</b>. Box2D sweeps a disk against walls and
    static disks, and against moving disks only if it is marked as a <b>bullet</b>. As matched,
    Box2D 2.3 has bullets only, and Box2D 3.1 none. A name with a + is an engine with one change:
    {"; ".join(CHANGES)}.
    """,
    sliders=(
        Slider("case", "Case", tuple(SEEN)),
        Slider("engine", "Engine", tuple(DISTINCT), list(DISTINCT).index("box2d:matched")),
        Slider("place", "Harshness", HARSHNESS, 5),
    ),
    names=(*DISTINCT, TRUTH),
    show=show_limits,
)
