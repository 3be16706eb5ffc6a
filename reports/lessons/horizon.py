"""Lesson 7: why trajectories stop being comparable."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from math import log

import numpy as np

from crosscheck2d.reports.lessons.box import energy
from crosscheck2d.reports.lessons.lesson import (
    Claim,
    Curve,
    Lesson,
    Shown,
    Simulation,
    Slider,
    farthest,
    run_of,
    time_step,
)
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.exercise import asteroid_field
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory
from crosscheck2d.scenarios.truth.exact import with_oracle
from crosscheck2d.scenarios.truth.horizon import DIVERGED

ROUNDED = "event_driven against itself, start moved by one rounding"
EVENTS = "event_driven:float64"
STEPPED = ("reference:exercise", "pymunk:matched", "box2d:matched")
NAMES = (*STEPPED, EVENTS)


@cache
def field(seed: int, restitution: float) -> Scenario:
    """The exercise's asteroids for 20 s."""
    scene = asteroid_field(seed, 20, restitution)
    return with_oracle(Scenario("field", "How long is it comparable?", "", scene, 20.0, 1 / 32))


def show_horizon(seed: int, e: float, k: int) -> Shown:
    """The error as long as there is an exact answer, and the energy."""
    played = Simulation.by(field(seed, e), NAMES, k)
    scene = played.scenario.scene

    def energy_left(each: Trajectory) -> Array:
        return energy(scene, each) / energy(scene, scene.state)

    end = float(played.truth.t[-1])
    moved = moved_by_a_rounding(seed, e, k)
    kept = [float(energy_left(played.motions[name])[-1]) for name in STEPPED]
    return Shown(
        [
            played.errors_over_time(moved, guides=[("x", end, "horizon")]),
            played.over_time("Kinetic energy over that at the start", "ratio", energy_left),
        ],
        played.film,
        [
            ("the exact answer ends at", f"{number(end)} s"),
            *(
                (
                    f"collisions of {'the exact answer' if name == TRUTH else name} until then",
                    str(int((each.collisions.t <= end).sum())),
                )
                for name, each in played.motions.items()
            ),
        ],
        list(horizon_claims(played, e, kept, moved)),
    )


def moved_by_a_rounding(seed: int, restitution: float, k: int) -> Curve:
    """m, the farthest disk of an event-driven run from that of another whose start is moved by one
    rounding in every coordinate; as long as both play."""
    scenario = replace(field(seed, restitution), truth=None)
    scene = scenario.scene
    start = replace(scene, position=np.nextafter(scene.position, np.inf))
    one, other = (
        run_of(EVENTS, each, k).trajectory for each in (scenario, replace(scenario, scene=start))
    )
    assert one is not None
    assert other is not None
    apart = farthest(one, other, scene)
    return Curve(ROUNDED, one.t[: len(apart)], apart)


def rounding_claim(played: Simulation, factor: float, moved: Curve) -> Claim:
    """How far two right runs are apart at the horizon and in the end, and when they would be a
    radius apart."""
    end, radius = float(played.truth.t[-1]), float(played.scenario.scene.radius.min())
    t, apart = moved.x, moved.y
    here, last = float(apart[t <= end][-1]), float(apart[-1])
    more = log(1 / DIVERGED) / log(factor)
    beyond = t[apart > radius]
    later = (
        f"At {number(float(beyond[0]))} s they are a radius apart."
        if len(beyond)
        else f"At {number(float(t[-1]))} s, where the first of them ends, they are"
        f" {number(1e9 * last)} nm apart."
    )
    return Claim(
        "Two event-driven runs whose starts differ by one rounding are"
        f" {number(1e9 * here, 2)} nm apart at the horizon. {later} At this growth a billionth of a"
        f" radius needs some {number(more, 2)} more collisions to become a radius.",
        lambda shown: (
            shown.y(ROUNDED)[shown.x(ROUNDED) <= end][-1] == here < 1e-9
            and abs(shown.y(ROUNDED)[-1] - last) <= 1e-9 * last
            and (shown.y(ROUNDED).max() > radius) == bool(len(beyond))
        ),
    )


def horizon_claims(
    played: Simulation, restitution: float, kept: Sequence[float], moved: Curve
) -> Iterator[Claim]:
    """Errors grow exponentially up to the size of the box; the energy stays comparable: `kept` is
    the share that each engine with steps has left."""
    end = float(played.truth.t[-1])
    factor = growth(played)
    yield Claim(
        f"The exact answer ends at {number(end)} s. Until then the event-driven engine, whose"
        " only error is rounding, is less than 1 nm off.",
        lambda shown: shown.x(EVENTS)[-1] == end and shown.y(EVENTS).max() < 1e-9,
    )
    yield Claim(
        "Its error grows exponentially: on average a collision multiplies it by"
        f" {number(factor, 2)}.",
        lambda shown: abs(growth(played, shown.curve(EVENTS)) / factor - 1) < 1e-9 and factor > 1.2,
    )
    yield rounding_claim(played, factor, moved)
    yield Claim(
        "The engines with steps detect collisions late. Half way to the horizon they are at least a"
        " million times farther off than the event-driven engine, and later at least a decimetre.",
        lambda shown: all(
            half_way(shown, name) > 1e6 * half_way(shown, EVENTS) and shown.y(name).max() > 0.1
            for name in STEPPED
        ),
    )
    if restitution == 1.0:
        # a disk that meets two others in one step of Box2D may gain 2 % of the energy there
        yield Claim(
            "The energy stays comparable: with e = 1 the engines with steps keep it for 20 s, long"
            " past the horizon, within a millionth, and Box2D (single precision) within 3 %.",
            lambda shown: all(
                shown.x(name, 1)[-1] == 20 > 1.3 * end
                and np.abs(shown.y(name, 1) - 1).max() < (0.03 if name == "box2d:matched" else 1e-6)
                for name in STEPPED
            ),
        )
    else:
        yield Claim(
            "The energy stays comparable: after 20 s, long past the horizon, the engines with"
            f" steps have {number(min(kept), 2)} to {number(max(kept), 2)} of it left. How much"
            " depends on their collisions.",
            lambda shown: (
                1.3 * end < 20
                and all(shown.x(name, 1)[-1] == 20 for name in STEPPED)
                and [shown.y(name, 1)[-1] for name in STEPPED] == kept
                and max(kept) < 1.25 * min(kept)
            ),
        )


def half_way(shown: Shown, name: str) -> float:
    """m, the error of an engine half way to the horizon."""
    error = shown.y(name)
    return float(error[len(error) // 2])


def growth(played: Simulation, error: Curve | None = None) -> float:
    """By what factor a collision makes the error of the event-driven engine grow, fitted over all
    collisions of the exact answer; nan if there is nothing to fit."""
    error = error or played.error(EVENTS, played.motions[EVENTS])
    t, y = error.x, error.y
    used = y > 1e-15
    if used.sum() < 10:
        return float("nan")
    collisions = np.searchsorted(played.truth.collisions.t, t[used])
    return float(np.exp(np.polyfit(collisions, np.log(y[used]), 1)[0]))


HORIZON = Lesson(
    name="horizon",
    number="7",
    title="Why trajectories stop being comparable",
    asks="How long do two right solvers agree?",
    text="""
    Two disks that meet slightly further to the side separate in another direction. So a
    collision multiplies an error, also one that is as small as the rounding of a number. The
    <b>horizon</b> is the time at which a rounding of the start has grown to a billionth of a
    radius. There the exact answer ends and this harness stops judging positions: from then on a
    distance from it could come from rounding alone. How soon two right solvers disagree by a
    radius depends on the collisions that follow.

    What stays comparable for longer is what depends little on which disk is where: the energy,
    the number of collisions. A disk that leaves the field enters it again at the opposite edge,
    as in the exercise.
    """,
    sliders=(
        Slider("seed", "Random field, seed", (0, 1, 3), 0),
        Slider("e", "Restitution e", (0.9, 1.0), 0),
        time_step(1 / 32, (32, 16, 4), 1),
    ),
    names=(*NAMES, ROUNDED, TRUTH),
    show=show_horizon,
)
