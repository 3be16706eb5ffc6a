"""Whole scenes: the position error of a solver, beside the error that its step size explains; and
its first wrong collision."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.own_solver.engine import spheres_of
from crosscheck2d.adapters.own_solver.file import SolverFailed
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.reports.check.functions import keeps_state
from crosscheck2d.reports.check.questions import fresh_world
from crosscheck2d.reports.check.rows import (
    FOLLOWS,
    TOLERANCE,
    CheckRow,
    judged,
    near,
    not_asked,
    shown,
)
from crosscheck2d.scenarios.model import Array, Scenario, Scene, Thrust, Trajectory
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.closed_forms import world_thrusts
from crosscheck2d.scenarios.truth.exact import OracleTruth
from crosscheck2d.scenarios.truth.record import TruthRecord

DT = 1e-3  # s, the exercise's
INTERVAL = 0.02  # s
SLACK = 2.0  # on a bound of first order in dt: higher orders are smaller by another dt v / r
LIMIT = 5.0  # s that the steps of a scene may take
SCENE_LIMIT = 10.0  # s, wall time that a whole scene may take: it needs a tenth of a second


class SceneAnswer(NamedTuple):
    """A scene by a solver: position and velocity (k, n, 2) m, m/s, and its contacts (c, 19).

    A contact is: step, i, j, then x, y, vx, vy of i and of j before the call, and of both after it.
    """

    position: Array
    velocity: Array
    angle: Array
    angular_velocity: Array
    contacts: Array


def step_of(process: SolverProcess) -> float:
    """s; coarser where every pair costs a call of `advance` with new arrays, some 0.1 ms."""
    return DT if process.surface == "exercise" else 5 * DT


def play_scene(
    process: SolverProcess, scenario: Scenario, dt: float, afresh: bool = False
) -> SceneAnswer:
    """Play a scene with the file's own functions; its forces act all the time.

    afresh: load the file again first, for a file that keeps state. Raises `SolverFailed`.
    """
    scene, count = scenario.scene, round(scenario.sample_interval / dt)
    forces = np.zeros((scene.n, 3))
    for thrust in scenario.thrusts:
        forces[thrust.disk] += [*thrust.force, thrust.torque]
    step = {"count": count, "forces": forces.tolist() if forces.any() else None, "held": True}
    start: dict[str, Any] = {
        "spheres": spheres_of(scene),
        "dt": dt,
        "gravity": [0.0, 0.0],
        "wrap": None,
    }
    before = fresh_world(process) if afresh else []
    requests = [
        *before,
        ("load", start, LIMIT),
        ("samples", {"step": step, "count": scenario.intervals}, LIMIT),
        ("contacts", None, LIMIT),
    ]
    answers = process.request(requests, SCENE_LIMIT)[len(before) :]
    for answer in answers:
        if isinstance(answer, SolverFailed):
            raise answer
    _, samples, contacts = answers
    rows = np.array(samples, float)
    return SceneAnswer(
        rows[..., 0:2],
        rows[..., 2:4],
        rows[..., 6],
        rows[..., 7],
        np.array(contacts, float).reshape(-1, 19),
    )


def scene_rows(process: SolverProcess, rows: Sequence[CheckRow], e: float | None) -> list[CheckRow]:
    """The rows on whole scenes with restitution `e`, and the row on the first wrong collision in
    them."""
    if any(row.name == "implemented" and (e is None or row.task == "1") for row in rows):
        return [not_asked("scenes", "scenes", "a function of the file cannot be used")]
    blamed = any(row.verdict == "fault" for row in rows)
    if e is None:
        return [not_asked("scenes", "scenes", "the collision function cannot be judged further")]
    found, wrong, dt = [], "", step_of(process)
    try:
        for scenario, record in scenes(round(e, 9)):
            played = play_scene(process, scenario, dt, keeps_state(rows))
            found.append(scene_row(scenario, record, played, dt, FOLLOWS if blamed else ""))
            wrong = wrong or first_wrong(scenario, played.contacts, dt)
            if not np.isfinite(played.position).all():
                break  # a scene that is not a number may be slow, and other scenes add nothing
    except SolverFailed as failure:
        return [
            judged(
                "scenes",
                "scenes",
                "Does it play whole scenes?",
                "it fails",
                "yes",
                False,
                FOLLOWS if blamed else str(failure),
            )
        ]
    return [
        *found,
        judged(
            "first wrong collision",
            "scenes",
            "Does every collision of these scenes follow the formula from the state before it?",
            wrong or "yes",
            "yes",
            not wrong,
            FOLLOWS if blamed else "",
        ),
    ]


def scene_row(
    scenario: Scenario, record: TruthRecord | None, played: SceneAnswer, dt: float, cause: str
) -> CheckRow:
    """The row on a scene: the largest position error, beside the error that the step size
    explains."""
    truth = truth_of(scenario, record)
    k = len(truth)
    away = np.hypot(*np.moveaxis(played.position[:k] - truth.position, -1, 0))
    allowed = (
        bounds(scenario, record, truth.t, dt)
        + rounding(truth.position, truth.velocity, truth.t, dt)
    )[:, None]
    with np.errstate(over="ignore"):
        ratio = np.where(np.isfinite(away), away, np.inf) / allowed
    at, disk = np.unravel_index(int(ratio.argmax()), ratio.shape)
    turned = np.abs(played.angle[:k] - truth.angle)
    may_turn = turning_bounds(scenario, truth.t, dt) + rounding(
        truth.angle, truth.angular_velocity, truth.t, dt
    )
    if not (turned <= may_turn[:, None]).all():
        got = f"a sphere is turned by {shown(turned.max())} rad too much or too little"
        expected = f"at most {shown(may_turn[-1])} rad, by dt = {shown(dt)} s"
        return judged(scenario.name, "scenes", scenario.asks, got, expected, False, cause)
    where = f"{shown(away[at, disk])} m from its exact position"
    got = f"sphere {disk} is {where} at {shown(truth.t[at])} s"
    by = f"by dt = {shown(dt)} s"
    if scenario.scene.n > 1:
        by += f"; the exact position is that of e = {shown(scenario.scene.restitution)}"
    expected = f"at most {shown(allowed[at, 0])} m, {by}"
    return judged(
        scenario.name, "scenes", scenario.asks, got, expected, bool(ratio.max() <= 1), cause
    )


def truth_of(scenario: Scenario, record: TruthRecord | None) -> Trajectory:
    """The exact motion, up to its horizon."""
    if record is None:
        return world_thrusts(scenario.scene, scenario.thrusts, scenario.times)
    return record.sampled(scenario.scene, scenario.thrusts, scenario.times)


def rounding(place: Array, rate: Array, t: Array, dt: float) -> Array:
    """(k,) bound on the error of single precision, in the unit of `place`: every step rounds place
    and rate by 2^-24."""
    room: Array = TOLERANCE + 2.0**-24 * t / dt * (np.abs(place).max() + np.abs(rate).max() * t / 2)
    return room


def turning_bounds(scenario: Scenario, t: Array, dt: float) -> Array:
    """(k,) rad, bound on the error of an angle: symplectic Euler is w' dt t / 2 ahead, and a
    collision changes no spin."""
    spin_up = max(
        (abs(p.torque) / scenario.scene.inertia[p.disk] for p in scenario.thrusts), default=0.0
    )
    return 1.001 * spin_up * dt * t / 2


def bounds(scenario: Scenario, record: TruthRecord | None, t: Array, dt: float) -> Array:
    """(k,) m, bound on the position error of a right solver with steps of `dt` s, at the times t
    (k,) s.

    Free flight under a thrust: symplectic Euler is a dt t / 2 ahead. A collision is found up to dt
    late, so that each disk moves on by u dt. This and the earlier errors, over (rA + rB) cos, turn
    the normal, and so the change of velocity. Errors add up and grow with time. After several
    collisions the bound is generous; then the row on the first wrong collision finds the faults.
    """
    scene = scenario.scene
    fastest = max(
        (float(np.hypot(*p.force)) / scene.mass[p.disk] for p in scenario.thrusts), default=0.0
    )
    if record is None:
        return 1.001 * fastest * dt * t / 2
    place, speed, before = 0.0, 0.0, 0.0
    steps = [(0.0, 0.0, 0.0)]
    for at, i, j, kick, cosine in record.events:
        i, j = int(i), int(j)
        place += speed * (at - before)
        mu = 1 / (1 / scene.mass[i] + 1 / scene.mass[j])
        u = kick / (1 + scene.restitution) / mu / cosine
        turned = (2 * place + u * dt) / ((scene.radius[i] + scene.radius[j]) * cosine)
        speed += 2 * speed + turned * kick / min(scene.mass[i], scene.mass[j])
        place += u * dt
        steps.append((at, place, speed))
        before = at
    known = np.array(steps)
    # A solver may be a step late, so that what a collision adds is allowed from a step before it
    # on.
    leg = np.searchsorted(known[:, 0] - dt, t, side="right") - 1
    room: Array = SLACK * (known[leg, 1] + known[leg, 2] * np.abs(t - known[leg, 0]))
    return room


def first_wrong(scenario: Scenario, contacts: Array, dt: float, part: str = "") -> str:
    """A sentence on the first contact whose outcome differs from the formula; "" if there is none.
    `part`: look only for faults in this part of task 2, as in `contact_faults`."""
    scene = scenario.scene
    for row in contacts:
        step, i, j = int(row[0]), int(row[1]), int(row[2])
        faults = contact_faults(row[3:].reshape(2, 2, 4), scene, i, j)
        if fault := faults.get(part, "") if part else next(iter(faults.values()), ""):
            return f"{scenario.name}, spheres {i} and {j} at {shown((step + 1) * dt)} s: {fault}"
    return ""


def contact_faults(states: Array, scene: Scene, i: int, j: int) -> dict[str, str]:
    """Part of task 2 -> what is wrong with one call: "2a", "2b", "2c" for the velocities, and "2c
    and 2d" if neither sphere gets the right impulse and the total momentum changes; {} if nothing
    is wrong.

    states: (2, 2, 4) before and after, of i and j, x, y, vx, vy.
    """
    (a, b), (a2, b2) = states
    if not np.isfinite(states).all():
        wrong = "the numbers become NaN or infinite"
        lost = "2c" if np.isfinite(states[..., :2]).all() else "2b"
        return {lost: wrong}
    r, reach = a[:2] - b[:2], scene.radius[i] + scene.radius[j]
    d = float(np.hypot(*r))
    changed = np.array([a2[2:] - a[2:], b2[2:] - b[2:]])
    touching = abs(d - reach) <= TOLERANCE * reach
    if d == 0 or (touching and near(changed, 0.0)):
        return {}
    if d > reach and not touching:
        if near(states[1], states[0]):
            return {}
        return {"2a": f"they collide at a distance of {shown(d)} m, beyond {shown(reach)} m"}
    n, apart = r / d, float(np.hypot(*(a2[:2] - b2[:2])))
    vn = float((a[2:] - b[2:]) @ n)
    J = -(1 + scene.restitution) * vn / (1 / scene.mass[i] + 1 / scene.mass[j])
    change = np.array([J / scene.mass[i] * n, -J / scene.mass[j] * n])
    free = vn >= 0 and near(changed, 0.0)
    faults = {}
    if vn < 0 and not touching and near(states[1], states[0]):
        faults["2a"] = f"they overlap by {shown(reach - d)} m, and nothing is changed"
    if not (near(apart, reach) or (vn >= 0 and near(apart, d))):
        faults["2b"] = f"their centres are {shown(apart)} m apart after it, not {shown(reach)} m"
    if not (free or near(changed, change)):
        k = 0 if not near(changed[0], change[0]) else 1
        faults["2c"] = (
            f"sphere {(i, j)[k]} has {shown(states[1, k, 2:])} m/s after it, not"
            f" {shown(states[0, k, 2:] + change[k])} m/s"
        )
        impulse = changed * scene.mass[[i, j], None]
        wrong_both = not near(impulse[0], J * n) and not near(impulse[1], -J * n)
        if wrong_both and not near(impulse.sum(axis=0), 0.0):
            added = f"together they get {shown(impulse.sum(axis=0))} kg m/s"
            faults["2c and 2d"] = f"{faults['2c']}; {added}"
    return faults


# question, duration s, a row x, y, vx, vy (m, m/s) for every sphere, radii m, masses kg
COLLISION_SCENES: dict[str, tuple[Any, ...]] = {
    "head_on": (
        "Where are two unequal spheres after they meet head-on?",
        1.0,
        [[-0.6, 0.0, 0.9, 0.0], [0.5, 0.0, -0.7, 0.0]],
        [0.25, 0.3],
        [1.0, 2.5],
    ),
    "oblique": (
        "Where are two unequal spheres after an oblique collision?",
        1.0,
        [[-0.7, 0.1, 1.1, 0.1], [0.5, -0.05, -0.5, 0.0]],
        [0.3, 0.25],
        [2.0, 0.8],
    ),
    "row": (
        (
            "Where are three spheres in a row after the first has struck the second, and that the"
            " third?"
        ),
        1.2,
        [[-1.0, 0.0, 1.3, 0.0], [0.0, 0.0, 0.0, 0.0], [0.9, 0.0, 0.0, 0.0]],
        [0.25, 0.25, 0.25],
        [1.0, 1.5, 0.7],
    ),
    "crowd": (
        "Where are five spheres after they have collided?",
        1.0,
        [
            [-1.1, 0.0, 1.4, 0.1],
            [-0.2, 0.1, 0.0, 0.0],
            [0.8, 0.3, -0.7, 0.0],
            [0.1, 1.0, 0.0, -0.8],
            [0.2, -1.1, 0.1, 0.7],
        ],
        [0.3, 0.25, 0.2, 0.25, 0.3],
        [1.0, 2.0, 0.5, 1.2, 0.8],
    ),
}


@lru_cache(maxsize=8)
def scenes(e: float) -> tuple[tuple[Scenario, TruthRecord | None], ...]:
    """The scenes of a check with restitution `e`, each with its exact motion: a closed form, or the
    oracle, computed once for each `e` and cached."""
    forced = Scenario(
        name="forced",
        asks="Where is a sphere after a second of a constant force and torque?",
        source="F = m a",
        scene=scene_of([[-1.0, 0.5, 0.6, -0.2]], [0.3], [1.4], e),
        duration=1.0,
        sample_interval=INTERVAL,
        thrusts=[Thrust(0, 0.0, 1.0, np.array([0.5, 0.9]), 0.02)],
    )
    found: list[tuple[Scenario, TruthRecord | None]] = [(forced, None)]
    for name, (asks, duration, rows, radius, mass) in COLLISION_SCENES.items():
        scenario = Scenario(
            name=name,
            asks=asks,
            source="sampled for this check",
            scene=scene_of(rows, radius, mass, e),
            duration=duration,
            sample_interval=INTERVAL,
        )
        try:
            found.append((scenario, OracleTruth(scenario).record()))
        except NoTruth:  # e = 0 leaves touching spheres, whose motion the oracle does not follow
            continue
    return tuple(found)


def scene_of(
    rows: Sequence[Sequence[float]], radius: Sequence[float], mass: Sequence[float], e: float
) -> Scene:
    """A scene from rows x, y, vx, vy, in m and m/s."""
    state = np.array(rows, float)
    return Scene(
        position=state[:, :2],
        velocity=state[:, 2:],
        radius=np.array(radius),
        mass=np.array(mass),
        inertia=np.pi / 2 * np.array(radius) ** 4,  # the exercise's, whatever the mass is
        restitution=e,
    )
