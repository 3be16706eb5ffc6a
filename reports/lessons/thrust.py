"""Lesson 2: force and thrust."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.lessons.lesson import Claim, Lesson, Shown, Simulation, Slider, time_step
from crosscheck2d.reports.page.style import TRUTH, number
from crosscheck2d.scenarios.families.exercise import ship_thrust
from crosscheck2d.scenarios.model import Scenario, Thrust, Trajectory
from crosscheck2d.scenarios.truth.closed_forms import world_thrusts

START, STOP = 0.5, 2.5  # s, of the thrust


def thrust_ship(acceleration: float) -> Scenario:
    """The exercise's ship, accelerated along x for 2 s and coasting for 2 s."""
    base = ship_thrust()
    scene = base.scene
    thrusts = [Thrust(0, START, STOP, np.array([acceleration * float(scene.mass[0]), 0.0]))]
    return replace(
        base,
        duration=4.0,
        sample_interval=1 / 16,
        thrusts=thrusts,
        truth=lambda t: world_thrusts(scene, thrusts, t),
    )


NAMES = (
    "reference:exercise",
    "reference:lesson",
    "pymunk:matched",
    "box2d:matched",
    "box2d_v3:matched",
    "event_driven:float64",
)


def show_thrust(k: int, a: float) -> Shown:
    """Which engines are ahead of the parabola and which are behind, and the formula for it."""
    scenario = thrust_ship(a)
    played = Simulation.by(scenario, NAMES, k)
    exact, dt = played.truth, scenario.dt(k)

    def ahead(each: Trajectory) -> np.ndarray:
        return 1e3 * (each.position[:, 0, 0] - exact.position[: len(each), 0, 0])

    seconds = min(exact.t[-1], STOP) - START
    laws = {
        run.name: 1e3 * (ENGINES[run.name].alpha - 0.5) * a * dt * seconds
        for run in played.runs
        if run.status == "ok"
    }
    return Shown(
        [
            played.over_time("Ahead of the exact answer", "mm", ahead),
            played.over_time("Velocity", "m/s", lambda each: each.velocity[:, 0, 0]),
        ],
        played.film,
        [
            (f"{name}, α = {number(ENGINES[name].alpha)}", f"(α − ½) a dt T = {number(law)} mm")
            for name, law in laws.items()
        ],
        list(thrust_claims(laws)),
    )


def thrust_claims(laws: Mapping[str, float]) -> Iterator[Claim]:
    """The effect of the order of a step on the position, and none on the velocity; laws: engine ->
    mm that it ends ahead."""
    # Box2D's float32 rounds a place of up to 16 m by 1 um in each of up to 1024 steps, and seldom
    # up as often as down.
    place, speed = 0.2, 3e-5  # mm, m/s

    def grows_and_stays(shown: Shown, name: str, law: float) -> bool:
        t, y = shown.x(name), shown.y(name)
        middle = y[np.searchsorted(t, (START + STOP) / 2)]  # half of what the law says
        return bool(
            np.abs(y[t <= START]).max() <= place
            and abs(middle - law / 2) <= place + 1e-3 * abs(law)
            and np.ptp(y[t >= STOP]) <= place
        )

    yield Claim(
        "After a thrust of T seconds every engine that plays to the end is (α − ½) a dt T ahead of"
        " the exact answer, or behind it where this is negative. The table below has the numbers."
        " Box2D, which computes in single precision, agrees with this formula within"
        f" {place} mm, all others to rounding.",
        lambda shown: all(
            abs(shown.y(name)[-1] - law) <= (place if "box2d" in name else 1e-9)
            for name, law in laws.items()
        ),
    )
    yield Claim(
        "The offset grows while the force acts, from 0.5 s to 2.5 s. Then the ship coasts and the"
        " offset stays.",
        lambda shown: all(grows_and_stays(shown, name, law) for name, law in laws.items() if law),
    )
    yield Claim(
        f"All engines agree on the velocity, within {number(speed)} m/s.",
        lambda shown: all(shown.gap(name, chart=1) <= speed for name in laws),
    )
    yield Claim(
        "The engines with α = 1 end ahead of the exact answer. Those with α = 0 end as far behind"
        " it.",
        lambda shown: all(
            abs(shown.y(name)[-1] + (1 - 2 * ENGINES[name].alpha) * abs(law)) <= place
            and np.sign(shown.y(name)[-1]) == np.sign(law)
            for name, law in laws.items()
            if ENGINES[name].alpha in (0.0, 1.0)
        ),
    )


THRUST = Lesson(
    name="thrust",
    number="2",
    title="Force and thrust",
    asks="Does a force move the ship equally far in every engine?",
    text="""
    A force changes the velocity by <code>F/m dt</code> in a step. How far the ship moves
    depends on the order of updates in a step. Write the step as <code>x' = x + v dt + α a
    dt²</code>: velocity first is <code>α = 1</code>, position first is <code>α = 0</code>, the
    exact parabola is <code>α = ½</code>. [order] shows this for gravity.
    """,
    sliders=(
        time_step(1 / 16, (16, 8, 4, 2, 1), 3),
        Slider("a", "Acceleration a", (0.25, 1.0, 4.0), 0, "m/s²"),
    ),
    names=(*NAMES, TRUTH),
    show=show_thrust,
)
