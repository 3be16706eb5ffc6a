"""The smallest scene that shows a fault: sampled and shrunk by hypothesis, and judged by closed
forms only."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from operator import itemgetter
from tempfile import TemporaryDirectory
from time import monotonic

import numpy as np
from hypothesis import HealthCheck, Phase, find, settings
from hypothesis import strategies as st
from hypothesis.configuration import set_hypothesis_home_dir
from hypothesis.errors import Flaky, NoSuchExample

from crosscheck2d.adapters.own_solver.file import SolverFailed
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.reports.check.rows import SAME_AGAIN, TOLERANCE, CheckRow, near, shown
from crosscheck2d.reports.check.scenes import (
    SceneAnswer,
    first_wrong,
    play_scene,
    scene_of,
    truth_of,
)
from crosscheck2d.reports.check.smallest_scene import DT, Smallest
from crosscheck2d.scenarios.model import Collisions, Scenario, Thrust, Trajectory, frozen
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.exact import computed

SECONDS = 1.5  # s for sampling and shrinking together
DURATION, INTERVAL = 1.0, 0.02  # s
EXAMPLES = 400
# m or rad: the rounding of 4 m in single precision in every step
SINGLE = 2.0**-24 * DURATION / DT * 4 / TOLERANCE
GAP = 0.05  # m, least distance of two surfaces at the start

Sphere = tuple[int, int, int, int, int, int]
"""x, y in half metres, vx, vy in m/s, radius in quarters of a metre, mass in kg."""
Example = tuple[list[Sphere], tuple[int, int, int]]
"""The spheres, and the thrust if there is only one: force x, y in N, torque in tenths of a N m."""
Play = Callable[[Scenario], SceneAnswer]
"""A scene by the solver's file, in steps of `DT`."""
# Tried before sampling: on a busy machine the time may end before a colliding pair is sampled.
FIRST: list[Example] = [
    ([(0, 0, 1, 1, 1, 2)], (1, 2, 1)),
    ([(-1, 0, 1, 0, 1, 1), (1, 0, 0, 0, 1, 2)], (0, 0, 0)),
    ([(-1, 0, 1, 0, 1, 1), (1, 1, -1, 0, 2, 3)], (0, 0, 0)),
]


# Task, or row of a task -> what a scene shows of it: end of a flight, its rotation, an overlap
# found or missed, a distance, velocities, momentum.
PARTS = {"1": "1", "2a": "2a", "2b": "2b", "2c": "2c", "2d": "2d", "file": "", "scenes": ""}
ROWS = {
    "velocity": "place",
    "position": "place",
    "spin": "turn",
    "angle": "turn",
    "turns": "turn",
    "velocities": "2c",
}
UNSEEN = ("rest kept", "force kept", "sphere kept", "input only", SAME_AGAIN)  # in no scene
BOTH = "2c and 2d"


def smallest_scenes(
    process: SolverProcess, e: float, findings: Sequence[CheckRow], afresh: bool = False
) -> list[Smallest]:
    """For each fault the smallest scene that shows it, if one is found. A fault in 2c and one in 2d
    share a scene that shows both. A fault of the loop has none, because scenes are played with the
    exercise's own loop."""
    search = partial(smallest_scene, process, e, afresh)
    of = {part: k for k, part in reversed([*enumerate(map(part_of, findings), 1)])}
    if list(of) == [None]:  # a single fault may show in any part
        of = {"": 1}
    found = []
    if "2c" in of and "2d" in of:
        # a collision that shows one of them would not say which
        pair = tuple(sorted((of.pop("2c"), of.pop("2d"))))
        found.append((pair, search(BOTH)))
    found += [((k,), search(part)) for part, k in of.items() if part is not None]
    return [
        replace(scene, of=faults) for faults, scene in sorted(found, key=itemgetter(0)) if scene
    ]


def part_of(row: CheckRow) -> str | None:
    """The part in which a scene shows a fault; None if it does not."""
    if row.name == "rest kept" and ("alpha" in row.cause or "angularVelocity" in row.cause):
        return "turn"
    return None if row.name in UNSEEN else ROWS.get(row.name, PARTS.get(row.task))


def smallest_scene(
    process: SolverProcess, e: float, afresh: bool = False, part: str = ""
) -> Smallest | None:
    """The smallest scene found within `SECONDS`; None if none shows a fault.

    afresh: load the file again for each scene, for a file that keeps state.
    part: the required fault: a value of `PARTS` or `ROWS`, or `BOTH`; "" for any.
    """
    play = partial(play_scene, process, dt=DT, afresh=afresh)
    best = next((example for example in FIRST if fault_of(play, *example, e, part)), None)
    deadline = monotonic() + SECONDS

    def faulty(example: Example) -> bool:
        nonlocal best
        if monotonic() > deadline or not fault_of(play, *example, e, part):
            return False
        best = example if best is None else min(best, example, key=size)
        return True

    sphere = st.tuples(ints(4), ints(3), ints(2), ints(2), st.integers(1, 2), st.integers(1, 3))
    scene = st.tuples(
        st.lists(sphere, min_size=1, max_size=3), st.tuples(ints(2), ints(2), ints(1))
    )
    rules = settings(
        max_examples=EXAMPLES,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=(Phase.generate, Phase.shrink),
    )
    # nothing found, or no time left for shrinking
    with in_temporary_folder(), suppress(NoSuchExample, Flaky):
        find(scene, faulty, settings=rules)
    return shown_by(play, *without_idle_spheres(play, *best, e, part), e, part) if best else None


def size(example: Example) -> tuple[int, int]:
    """The sort key of a scene: number of spheres, and size of its numbers."""
    spheres, thrust = example
    return len(spheres), sum(map(abs, thrust)) + sum(
        abs(number) for sphere in spheres for number in sphere
    )


@contextmanager
def in_temporary_folder() -> Iterator[None]:
    """Context in which hypothesis writes its .hypothesis folder into a temporary folder, not into
    the working directory."""
    with TemporaryDirectory() as home:
        set_hypothesis_home_dir(home)
        try:
            yield
        finally:
            set_hypothesis_home_dir(None)


def without_idle_spheres(
    play: Play, spheres: list[Sphere], thrust: tuple[int, int, int], e: float, part: str
) -> tuple[list[Sphere], tuple[int, int, int]]:
    """The scene without the spheres that the fault does not need. Hypothesis also removes these,
    but may run out of time."""
    for k in range(len(spheres)):
        fewer = spheres[:k] + spheres[k + 1 :]
        if fewer and fault_of(play, fewer, thrust, e, part):
            return without_idle_spheres(play, fewer, thrust, e, part)
    return spheres, thrust


def ints(most: int) -> st.SearchStrategy[int]:
    """Integers from -most to most; hypothesis shrinks them to 0."""
    return st.integers(-most, most)


def scenario_of(
    spheres: list[Sphere], thrust: tuple[int, int, int], e: float, interval: float
) -> Scenario | None:
    """The scene of these numbers; None if spheres are too close at the start. A single sphere also
    has a thrust."""
    rows = [(x / 2, y / 2, float(u), float(v)) for x, y, u, v, _, _ in spheres]
    radius, mass = [r / 4 for *_, r, _ in spheres], [float(m) for *_, m in spheres]
    for i in range(len(rows)):
        for j in range(i):
            if (
                np.hypot(rows[i][0] - rows[j][0], rows[i][1] - rows[j][1])
                < radius[i] + radius[j] + GAP
            ):
                return None
    alone = len(rows) == 1 and any(thrust)
    thrusts = (
        [Thrust(0, 0.0, DURATION, np.array(thrust[:2], float), thrust[2] * 0.1)] if alone else []
    )
    return Scenario(
        name="smallest",
        asks="Which scene is the smallest that shows the fault?",
        source="sampled and shrunk",
        scene=scene_of(rows, radius, mass, e),
        duration=DURATION,
        sample_interval=interval,
        substeps=(round(interval / DT),),
        thrusts=thrusts,
    )


def fault_of(
    play: Play, spheres: list[Sphere], thrust: tuple[int, int, int], e: float, part: str
) -> str:
    """What is wrong with the file's motion in a scene, in `part` as in `smallest_scene`; "" if
    nothing is, or if there is no such scene."""
    scenario = scenario_of(spheres, thrust, e, DURATION)
    if scenario is None:
        return ""
    try:
        played = play(scenario)
    except SolverFailed as failure:
        return str(failure) if failure.kind == "error" else ""
    if part in FLIGHTS:
        return flight_fault(scenario, played, part)
    met = first_wrong(scenario, played.contacts, DT, MEETING.get(part, part))
    return met or ("" if part else flight_fault(scenario, played, "1"))


FLIGHTS = ("1", "place", "turn")
MEETING = {"2d": "2c"}  # any wrong velocity, if only 2d has a fault


def flight_fault(scenario: Scenario, played: SceneAnswer, part: str) -> str:
    """What is wrong with the place of a sphere that did not collide, or with the angle of any: no
    collision turns one. `part`: "place", "turn", or "1" for both."""
    t, right = scenario.duration, by_formulas(scenario)
    met = {int(i) for row in played.contacts for i in row[1:3]}
    for k in range(scenario.scene.n):
        x, angle = right.position[-1, k], right.angle[-1, k]
        flew = part != "turn" and k not in met
        if flew and not near(played.position[-1, k], x, SINGLE):
            return (
                f"sphere {k} is at {shown(played.position[-1, k])} m after {shown(t)} s, not at"
                f" {shown(x)} m"
            )
        if part != "place" and not near(played.angle[-1, k], angle, SINGLE):
            turned = shown(played.angle[-1, k])
            return (
                f"sphere {k} is turned by {turned} rad after {shown(t)} s, not by"
                f" {shown(angle)} rad"
            )
    return ""


def by_formulas(scenario: Scenario) -> Trajectory:
    """The motion by the exercise's formulas in steps of `DT`, as if no spheres met: symplectic
    Euler gives v0 + a t and x0 + v0 t + a t (t + dt) / 2."""
    scene, t = scenario.scene, scenario.times[:, None]
    acceleration, spin = np.zeros((scene.n, 2)), np.zeros(scene.n)
    for thrust in scenario.thrusts:
        acceleration[thrust.disk] += thrust.force / scene.mass[thrust.disk]
        spin[thrust.disk] += thrust.torque / scene.inertia[thrust.disk]
    far, seconds = t * (t + DT) / 2, t[:, None]
    return Trajectory(
        frozen(scenario.times),
        frozen(scene.position + scene.velocity * seconds + acceleration * far[:, None]),
        frozen(scene.velocity + acceleration * seconds),
        frozen(scene.angle + scene.angular_velocity * t + spin * far),
        frozen(scene.angular_velocity + spin * t),
        Collisions.of([]),
    )


def shown_by(
    play: Play, spheres: list[Sphere], thrust: tuple[int, int, int], e: float, part: str
) -> Smallest:
    """The result: the scene with the file's motion and the right one."""
    scenario = scenario_of(spheres, thrust, e, INTERVAL)
    assert scenario is not None
    fault = fault_of(play, spheres, thrust, e, part)
    played = play(scenario)
    kicked = [row for row in played.contacts if not near(row[[5, 6, 9, 10]], row[[13, 14, 17, 18]])]
    collisions = Collisions.of(
        [((row[0] + 1) * DT, int(row[1]), int(row[2]), float("nan")) for row in kicked]
    )
    yours = Trajectory(
        frozen(scenario.times),
        frozen(played.position),
        frozen(played.velocity),
        frozen(played.angle),
        frozen(played.angular_velocity),
        collisions,
    )
    return Smallest(scenario, fault.removeprefix("smallest, "), yours, right_motion(scenario))


def right_motion(scenario: Scenario) -> Trajectory | None:
    """The motion that is shown beside the file's: by the formulas under a force, else the exact
    answer; None if there is none."""
    if scenario.thrusts:
        return by_formulas(scenario)
    try:
        return truth_of(scenario, None if scenario.scene.n == 1 else computed(scenario))
    except NoTruth:
        return None
