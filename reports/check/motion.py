"""Task 1: one sphere, one step; a wrong integration is compared with known wrong formulas.

Symplectic Euler: v' = v + F/m dt, then x' = x + v' dt; spin and angle alike (Hairer, Lubich &
Wanner, Geometric Numerical Integration, I.1).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from crosscheck2d.reports.check.questions import QUESTIONS, Ball, SolverAnswer
from crosscheck2d.reports.check.rows import CheckRow, Law, follows, judged, near, not_asked, shown
from crosscheck2d.scenarios.model import Array

TURNED = ("turned", "turned far", "turned back")
FORCED = ("force", "force, other numbers", "coast")
X: Array = np.array([1.0, 0.0])
Y: Array = np.array([0.0, 1.0])
G: Array = np.array([0.0, -9.81])  # m/s2


def taken(vector: Array, part: int) -> Array:
    """A vector with one component in both places; an angular quantity has only one."""
    return np.full_like(vector, vector.flat[part if vector.ndim else 0])


OWN_MOI = "pi / 2 size4 is used as MoI, which it is for every sphere of the exercise"
NEVER = "it is never changed"  # of each quantity: several that are missing are several faults
# (v or w, force or torque, mass or inertia, the other of the two, dt) -> v' or w'
UNDER_FORCE: dict[str, Law] = {
    "": lambda v, f, m, _o, dt: v + f / m * dt,
    NEVER: lambda v, *_: v,
    "the force is not divided by the {mass}": lambda v, f, _m, _o, dt: v + f * dt,
    "the force is divided by the {other} instead of the {mass}": lambda v, f, _m, o, dt: (
        v + f / o * dt
    ),
    "the force is multiplied by the {mass}": lambda v, f, m, _o, dt: v + f * m * dt,
    "the {mass} is squared": lambda v, f, m, _o, dt: v + f / m**2 * dt,
    "dt is missing": lambda v, f, m, _o, _dt: v + f / m,
    "dt is squared": lambda v, f, m, _o, dt: v + f / m * dt * dt,
    "dt is halved": lambda v, f, m, _o, dt: v + f / m * dt / 2,
    "dt is counted twice": lambda v, f, m, _o, dt: v + 2 * f / m * dt,
    "it divides by dt": lambda v, f, m, _o, dt: v + f / m / dt,
    "the sign is wrong": lambda v, f, m, _o, dt: v - f / m * dt,
    "it is set to F/m dt, which must be added": lambda v, f, m, _o, dt: f / m * dt + 0 * v,
    "the force is used as the velocity": lambda v, f, _m, _o, _dt: f + 0 * v,
    "gravity is added, which the exercise does not have": lambda v, f, m, _o, dt: (
        v + (f / m + G[: np.size(v)]) * dt
    ),
    "x and y of the force are exchanged": lambda v, f, m, _o, dt: v + np.flip(f) / m * dt,
    "y uses the force along x": lambda v, f, m, _o, dt: v + taken(f, 0) / m * dt,
    "x uses the force along y": lambda v, f, m, _o, dt: v + taken(f, 1) / m * dt,
    "the quotient is rounded down (// or floor)": lambda v, f, m, _o, dt: v + np.floor(f / m) * dt,
    "only x is changed": lambda v, f, m, _o, dt: v + f / m * dt * X[: np.size(v)],
    "only y is changed": lambda v, f, m, _o, dt: v + f / m * dt * Y[: np.size(v)],
    "it is converted to degrees": lambda v, f, m, _o, dt: v + np.degrees(f / m * dt),
    "it is converted to radians, though it is in radians already": lambda v, f, m, _o, dt: (
        v + np.radians(f / m * dt)
    ),
    "dt is divided by 1000, though it is in seconds already": lambda v, f, m, _o, dt: (
        v + f / m * dt / 1000
    ),
    "y is computed from x": lambda v, f, m, _o, dt: taken(v, 0) + f / m * dt,
    "y is computed from the new x": lambda v, f, m, _o, dt: (
        taken(v, 0) + (f + taken(f, 0) * Y[: np.size(f)]) / m * dt
    ),
}
# the same for a torque, with the size as a sixth argument
UNDER_TORQUE: dict[str, Law] = {
    name: (lambda *given, law=law: law(*given[:5])) for name, law in UNDER_FORCE.items()
} | {
    "the torque is multiplied by the size; it needs no lever": lambda w, t, i, _m, dt, r: (
        w + t * r / i * dt
    ),
    "the torque is divided by the size; it needs no lever": lambda w, t, i, _m, dt, r: (
        w + t / r / i * dt
    ),
    "mass size2 / 2 is used instead of the {mass}": lambda w, t, _i, m, dt, r: (
        w + t / (m * r * r / 2) * dt
    ),
    "mass size2 is used instead of the {mass}": lambda w, t, _i, m, dt, r: w + t / (m * r * r) * dt,
    OWN_MOI: lambda w, t, _i, _m, dt, r: w + t / (np.pi / 2 * r**4) * dt,
}
# (x or alpha, v or w before, the same after, acceleration by the right formula, dt) -> x' or alpha'
MOVED: dict[str, Law] = {
    "": lambda x, _v, new, _a, dt: x + new * dt,
    "it is moved by the old {velocity} (explicit Euler); symplectic Euler takes the new one": (
        lambda x, v, _n, _a, dt: x + v * dt
    ),
    NEVER: lambda x, *_: x,
    "dt is missing": lambda x, _v, new, _a, _dt: x + new,
    "dt is missing, and it is moved by the old {velocity}": lambda x, v, _n, _a, _dt: x + v,
    "dt is squared": lambda x, _v, new, _a, dt: x + new * dt * dt,
    "dt is counted twice": lambda x, _v, new, _a, dt: x + 2 * new * dt,
    "dt is halved": lambda x, _v, new, _a, dt: x + new * dt / 2,
    "the sign is wrong": lambda x, _v, new, _a, dt: x - new * dt,
    "it is moved by v dt + a dt2 / 2, the mean of old and new {velocity}": (
        lambda x, v, new, _a, dt: x + (v + new) / 2 * dt
    ),
    "it is moved by v dt + a dt2": lambda x, _v, new, a, dt: x + new * dt + a * dt * dt,
    "it is moved by v dt + a dt2 / 2 with the new {velocity}": lambda x, _v, new, a, dt: (
        x + new * dt + a * dt * dt / 2
    ),
    "it is moved by the acceleration, not by the {velocity}": lambda x, _v, _n, a, dt: x + a * dt,
    "y uses the velocity along x": lambda x, _v, new, _a, dt: x + taken(new, 0) * dt,
    "x uses the velocity along y": lambda x, _v, new, _a, dt: x + taken(new, 1) * dt,
    "x is moved by both parts of the velocity, y by none": lambda x, _v, new, _a, dt: (
        x + X[: np.size(x)] * new.sum() * dt
    ),
    "it is moved by a dt2 alone": lambda x, _v, _n, a, dt: x + a * dt * dt,
    "it is moved by a dt2 / 2 alone": lambda x, _v, _n, a, dt: x + a * dt * dt / 2,
    "it is set to {velocity} times dt, which must be added": lambda x, _v, new, _a, dt: (
        new * dt + 0 * x
    ),
    "only x is moved": lambda x, _v, new, _a, dt: x + new * dt * X[: np.size(x)],
    "only y is moved": lambda x, _v, new, _a, dt: x + new * dt * Y[: np.size(x)],
    "it is converted to degrees": lambda x, _v, new, _a, dt: x + np.degrees(new * dt),
    "it is converted to radians, though it is in radians already": lambda x, _v, new, _a, dt: (
        x + np.radians(new * dt)
    ),
    "y is computed from x": lambda x, _v, new, _a, dt: taken(x, 0) + new * dt,
    "y is computed from the new x": lambda x, _v, new, _a, dt: (
        taken(x, 0) + (new + taken(new, 0) * Y[: np.size(x)]) * dt
    ),
    "dt is divided by 1000, though it is in seconds already": lambda x, _v, new, _a, dt: (
        x + new * dt / 1000
    ),
    "the old {velocity} is converted to degrees": lambda x, v, _n, _a, dt: x + np.degrees(v * dt),
}
# the same with the mass or MoI as a sixth argument
MOVED_BY_MASS: dict[str, Law] = {
    name: (lambda *given, law=law: law(*given[:5])) for name, law in MOVED.items()
} | {
    "the {velocity} is divided by the {mass} once more": lambda x, _v, new, _a, dt, m: (
        x + new / m * dt
    ),
    "the {velocity} is multiplied by the {mass}": lambda x, _v, new, _a, dt, m: x + new * m * dt,
}


def motion_rows(answers: dict[str, SolverAnswer]) -> list[CheckRow]:
    """The rows of task 1, for a function whose calls do not fail."""
    seen = [
        (QUESTIONS[name].balls[0], QUESTIONS[name].calls[0][2], answers[name].last[0])
        for name in FORCED
    ]
    linear = [(np.array(b.v), np.array(b.F), b.m, b.MoI, dt) for b, dt, _ in seen]
    angular = [(np.array(b.w), np.array(b.torque), b.MoI, b.m, dt, b.r) for b, dt, _ in seen]
    # The positions are judged with the file's own velocities, so that one mistake counts once.
    places = [
        (np.array(b.x), np.array(b.v), np.array(a.v), np.array(b.F) / b.m, dt, b.m)
        for b, dt, a in seen
    ]
    angles = [
        (np.array(b.alpha), np.array(b.w), np.array(a.w), b.torque / b.MoI, dt, b.MoI)
        for b, dt, a in seen
    ]
    after = [a for _, _, a in seen]
    velocity = law_row(
        "velocity",
        "What is the velocity of a sphere after one step under a force?",
        "m/s",
        UNDER_FORCE,
        linear,
        [a.v for a in after],
        {"mass": "mass", "other": "MoI"},
    )
    spin = law_row(
        "spin",
        "What is the angular velocity of a sphere after one step under a torque?",
        "rad/s",
        UNDER_TORQUE,
        angular,
        [a.w for a in after],
        {"mass": "MoI", "other": "mass"},
    )
    angle = law_row(
        "angle",
        "What is the angle of a sphere after that step, by its new angular velocity?",
        "rad",
        MOVED_BY_MASS,
        angles,
        [a.alpha for a in after],
        {"velocity": "angular velocity", "mass": "MoI"},
    )
    return [
        velocity,
        law_row(
            "position",
            "Where is a sphere after that step, by its new velocity?",
            "m",
            MOVED_BY_MASS,
            places,
            [a.x for a in after],
            {"velocity": "velocity", "mass": "mass"},
        ),
        spin,
        angle,
        *([turning(answers)] if angle.verdict == "right" else []),
        coasting(seen[2][0], seen[2][2], velocity.cause or spin.cause),
        lasting(answers["force twice"]),
        untouched(seen),
    ]


def law_row(
    name: str,
    asked: str,
    unit: str,
    laws: dict[str, Law],
    given: list[tuple[Any, ...]],
    answers: list[Any],
    words: dict[str, str],
) -> CheckRow:
    """A row whose cause is the formula of the table that reproduces the answers."""
    found = follows(laws, given, answers)
    with np.errstate(all="ignore"):
        right = np.asarray(laws[""](*given[0]), float)
    if not np.isfinite(right).all():  # it is judged by the file's own velocity
        return not_asked(name, "1", f"the {words['velocity']} is not a number")
    if found != "" and laws is MOVED_BY_MASS and moved_rightly(given, answers):
        found = ""
    if found is None and all(np.isfinite(np.asarray(answer, float)).all() for answer in answers):
        found = beyond_formulas(name, laws, given, answers)
    if found == OWN_MOI:
        got, expected = f"{shown(answers[0])} {unit}", f"{shown(right)} {unit}"
        return CheckRow(name, "1", asked, got, expected, "free choice", OWN_MOI)
    cause = f"the {name} is never changed" if found == NEVER else (found or "").format(**words)
    if name == "spin":
        cause = cause.replace("the force", "the torque").replace("F/m", "torque/MoI")
    if not np.isfinite(np.asarray(answers[0], float)).all():
        cause = "it is not a number (a field that does not exist, text, a division by zero?)"
    return judged(
        name,
        "1",
        asked,
        f"{shown(answers[0])} {unit}",
        f"{shown(right)} {unit}",
        found == "",
        cause,
    )


def beyond_formulas(
    name: str, laws: dict[str, Law], given: list[tuple[Any, ...]], answers: list[Any]
) -> str | None:
    """The cause of finite answers that no formula of the table gives, in words; None if none is
    known."""
    found = damped(given, answers) if name in ("velocity", "spin") else None
    found = found or fixed_step(laws[""], given, answers)
    if found is None and np.ndim(answers[0]):
        found = one_axis(laws, given, answers) or limited(laws[""], given, answers)
    return found or multiplied(laws[""], given, answers)


def moved_rightly(given: list[tuple[Any, ...]], answers: list[Any]) -> bool:
    """Whether places or angles are those of the right velocity, which the file then computes but
    does not keep: that is one mistake, and not in the place."""
    wanted = [x + (old + a * dt) * dt for x, old, _, a, dt, _ in given]
    return all(near(answer, place, 0.1) for answer, place in zip(answers, wanted))


def ratio(
    law: Law, given: list[tuple[Any, ...]], answers: list[Any], per: Callable[[Any], Any]
) -> float | None:
    """The factor between the change in every answer and `per` of the question times the right
    change; None if it is not the same everywhere."""
    changed = [np.asarray(answer, float) - q[0] for q, answer in zip(given, answers)]
    wanted = [(np.asarray(law(*q), float) - q[0]) * per(q) for q in given]
    one, other = (np.concatenate([np.atleast_1d(x) for x in both]) for both in (changed, wanted))
    factor = float(one @ other / (other @ other))
    return factor if near(one, factor * other, 0.01) else None


def fixed_step(law: Law, given: list[tuple[Any, ...]], answers: list[Any]) -> str | None:
    """The cause that one step size, in words, is used for every dt that is asked; else None."""
    step = ratio(law, given, answers, lambda question: 1 / question[4])
    if step is None:
        return None
    return f"a step of {shown(step)} s is written into the file and used instead of dt"


def multiplied(law: Law, given: list[tuple[Any, ...]], answers: list[Any]) -> str | None:
    """The cause that the change is the right one times a factor, in words; else None."""
    factor = ratio(law, given, answers, lambda question: 1.0)
    return None if factor is None else f"the change is {shown(factor)} times the right one"


def limited(law: Law, given: list[tuple[Any, ...]], answers: list[Any]) -> str | None:
    """The cause that no component, or no vector, may exceed a limit, in words; else None."""
    wanted = np.array([law(*question) for question in given], float)
    reached = np.array(answers, float)
    largest, longest = np.abs(reached).max(), np.hypot(*reached.T).max()
    shortened = np.minimum(1.0, longest / np.hypot(*wanted.T))[:, None] * wanted
    for limit, clamped in (
        (largest, np.clip(wanted, -largest, largest)),
        (longest, shortened),
    ):
        if near(reached, clamped):
            return f"it is limited to {shown(limit)}: the exercise has no limit"
    return None


def one_axis(laws: dict[str, Law], given: list[tuple[Any, ...]], answers: list[Any]) -> str | None:
    """The mistakes in x and y, if they differ or one is right."""
    axes = []
    for axis in range(2):
        asked = [
            tuple(value[axis] if np.ndim(value) else value for value in question)
            for question in given
        ]
        axes.append(follows(laws, asked, [np.asarray(value)[axis] for value in answers]))
    if None in axes:
        return None
    return "; ".join(f"of {name}: {mistake}" for name, mistake in zip("xy", axes) if mistake)


def damped(given: list[tuple[Any, ...]], answers: list[Any]) -> str | None:
    """The constant, in words, if the velocity is also multiplied by one."""
    given = [question[:5] for question in given]
    coasting_v, coasting_after = np.asarray(given[2][0]), np.asarray(answers[2], float)
    factor = float(np.mean(coasting_after / coasting_v))
    law: Law = lambda v, f, m, _o, dt: factor * (v + f / m * dt)  # noqa: E731
    late: Law = lambda v, f, m, _o, dt: factor * v + f / m * dt  # noqa: E731
    if follows({"after": law, "before": late}, given, answers):
        return f"it is also multiplied by {factor:.4g} in every step: the exercise has no damping"
    return None


def turning(answers: dict[str, SolverAnswer]) -> CheckRow:
    """The row on an angle beyond half a turn: it may be reduced by whole turns, a free choice."""
    seen = [(QUESTIONS[name], answers[name].last[0]) for name in TURNED]
    ways = [
        (question.balls[0].alpha + after.w * question.calls[0][2], after.alpha)
        for question, after in seen
    ]
    turns = [(answer - right) / (2 * np.pi) for right, answer in ways]
    whole = [near(turn, np.round(turn)) for turn in turns]
    right, answer = ways[whole.index(False) if False in whole else 0]
    asked = "What is the angle of a sphere that has turned by more than half a turn?"
    got, expected = f"{shown(answer)} rad", f"{shown(right)} rad, or whole turns more or less"
    if all(whole) and not near(turns, 0.0):
        said = "it is reduced by whole turns, which does not change the direction"
        return CheckRow("turns", "1", asked, got, expected, "free choice", said)
    cause = (
        f"the angle is changed by {shown(abs(answer - right))} rad, which is not a multiple of 2 pi"
    )
    return judged("turns", "1", asked, got, expected, all(whole), cause)


def coasting(before: Ball, after: Ball, mistake: str) -> CheckRow:
    """The row on a sphere without force: velocity and spin stay constant. `mistake`: their known
    mistake."""
    return judged(
        "coasting",
        "1",
        "Does a sphere without force and torque keep its velocity and spin?",
        f"v = {shown(after.v)} m/s, w = {shown(after.w)} rad/s",
        f"v = {shown(before.v)} m/s, w = {shown(before.w)} rad/s",
        near(after.v, before.v) and near(after.w, before.w),
        mistake or "its velocity or spin changes, though force and torque are zero",
    )


def lasting(answer: SolverAnswer) -> CheckRow:
    """The row on force and torque, which stay until the keys change them."""
    before, after = QUESTIONS["force twice"].balls[0], answer.last[0]
    right = near(after.F, before.F) and near(after.torque, before.torque)
    cleared = near(after.F, (0, 0)) or near(after.torque, 0)
    return judged(
        "force kept",
        "1",
        "Are force and torque the same after a step?",
        f"F = {shown(after.F)} N, torque = {shown(after.torque)} N m",
        f"F = {shown(before.F)} N, torque = {shown(before.torque)} N m",
        right,
        (
            "they are set to 0: a key that is held would act for one step only"
            if cleared
            else "integrate changes them"
        ),
    )


def untouched(seen: list[tuple[Ball, float, Ball]]) -> CheckRow:
    """The row on mass, inertia and size, which an integration must not change."""
    changed = [
        name
        for name in ("m", "MoI", "r")
        for before, _, after in seen
        if not near(getattr(after, name), getattr(before, name))
    ]
    words = {"m": "mass", "MoI": "MoI", "r": "size"}
    what = ", ".join(dict.fromkeys(words[name] for name in changed))
    return judged(
        "sphere kept",
        "1",
        "Does integrate leave mass, MoI and size alone?",
        f"changes {what}" if what else "all as before",
        "all as before",
        not what,
        f"integrate writes {what}",
    )
