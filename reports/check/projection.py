"""Task 2 (b): the displacement of two overlapping spheres."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.own_solver.restitution import EXERCISE
from crosscheck2d.reports.check.collisions import changes
from crosscheck2d.reports.check.impacts import (
    BACKWARDS,
    HALF_TURNED,
    NORMAL_IN_DEGREES,
    CollisionExplanation,
    in_degrees,
)
from crosscheck2d.reports.check.questions import COLLISIONS, Ball, SolverAnswer, direction, finite
from crosscheck2d.reports.check.rows import CheckRow, judged, near, not_asked, shown
from crosscheck2d.scenarios.model import Array


class Shift(NamedTuple):
    """The displacement of a pair: of A along the normal, of B against it, and the larger one across
    it; and before the call the overlap, the distance and the sum of the sizes. All in m."""

    a: float
    b: float
    across: float
    overlap: float
    distance: float
    sizes: float


WRONG_SIGN = "the sign is wrong: they are moved into each other"
# (shift) -> the total displacement of both that a mistake gives, m
TOTALS: dict[str, Callable[[Shift, Ball, Ball], float]] = {
    "the positions are never changed: not implemented": lambda s, a, b: 0.0,
    WRONG_SIGN: lambda s, a, b: -s.overlap,
    "only half of the overlap is corrected: it is halved twice": lambda s, a, b: s.overlap / 2,
    "the overlap is counted twice: each is moved by all of it": lambda s, a, b: 2 * s.overlap,
    HALF_TURNED: lambda s, a, b: s.overlap * np.sign(a.x[0] - b.x[0]),
    "the sign is wrong, and the overlap is counted twice": lambda s, a, b: -2 * s.overlap,
    "the sign is wrong, and the overlap is halved twice": lambda s, a, b: -s.overlap / 2,
    "the normal is not normalised": lambda s, a, b: s.overlap * s.distance,
    "the normal is not normalised, and the overlap is counted twice": lambda s, a, b: (
        2 * s.overlap * s.distance
    ),
    "the normal is not normalised, and the overlap is halved twice": lambda s, a, b: (
        s.overlap * s.distance / 2
    ),
    "it is divided by the distance once too often": lambda s, a, b: s.overlap / s.distance,
    "they are moved by the sum of the sizes, not by the overlap": lambda s, a, b: s.sizes,
    "they are moved by their distance, not by the overlap": lambda s, a, b: s.distance,
    "the normal is divided by the sum of the sizes, not by the distance": lambda s, a, b: (
        s.overlap * s.distance / s.sizes
    ),
    "the overlap is multiplied by e, which belongs to the velocities": lambda s, a, b: (
        EXERCISE * s.overlap
    ),
    "the overlap is computed from squares": lambda s, a, b: s.sizes**2 - s.distance**2,
    "the overlap is computed as sizes plus distance": lambda s, a, b: s.sizes + s.distance,
    "the squared distance is used as the distance": lambda s, a, b: (
        (s.sizes - s.distance**2) / s.distance
    ),
    "brackets are missing: each is moved by sizes - distance / 2": lambda s, a, b: (
        2 * s.sizes - s.distance
    ),
    "brackets are missing: sizes / 2 - distance": lambda s, a, b: s.sizes / 2 - s.distance,
    "only the size of A is used": lambda s, a, b: a.r - s.distance,
    "only the size of B is used": lambda s, a, b: b.r - s.distance,
    "the size of A is used twice": lambda s, a, b: 2 * a.r - s.distance,
    "the size of B is used twice": lambda s, a, b: 2 * b.r - s.distance,
    "the shares are the inverse masses, which do not add up to 1": lambda s, a, b: (
        s.overlap * (1 / a.m + 1 / b.m)
    ),
    "both are moved by the share of A": lambda s, a, b: 2 * s.overlap * a.m / (a.m + b.m),
    "both are moved by the share of B": lambda s, a, b: 2 * s.overlap * b.m / (a.m + b.m),
    "the shares are the masses, which do not add up to 1": lambda s, a, b: s.overlap * (a.m + b.m),
}


def moved_together(answers: dict[str, SolverAnswer]) -> bool:
    """Whether colliding pairs are moved into each other."""
    shifts = [shift_of(answers[name]) for name in COLLISIONS]
    return all(s.a + s.b < 0 and near(s.across, 0.0, 0.1) for s in shifts)


def shift_of(answer: SolverAnswer) -> Shift:
    """The displacement of a pair, relative to its normal."""
    (a, b), after = answer.asked.balls, answer.last
    n, distance = direction(a, b)
    t = np.array([-n[1], n[0]])
    da, db = np.subtract(after[0].x, a.x), np.subtract(after[1].x, b.x)
    across = float(np.abs([da @ t, db @ t]).max())  # NaN if one is
    return Shift(float(da @ n), float(-(db @ n)), across, a.r + b.r - distance, distance, a.r + b.r)


AT_REST = ("at rest to each other", "at rest, other velocity")
DISPLACED = (*AT_REST, "separate", *COLLISIONS)  # the questions that (b) needs
TAKEN_TO_BE_APART = "the file takes the overlapping pairs of these questions not to collide"


def reacts(answers: dict[str, SolverAnswer]) -> bool:
    """Whether the function reacts to every colliding pair; a failure is a reaction."""
    return all(
        answers[name].failed
        or not np.array_equal(
            [b.numbers() for b in answers[name].last],
            [b.numbers() for b in answers[name].asked.balls],
        )
        for name in COLLISIONS
    )


def overlap(answers: dict[str, SolverAnswer]) -> bool:
    """Whether the pairs of these questions overlap."""
    return all(shift_of(answers[name]).overlap > 0 for name in COLLISIONS)


def rows_before_failure(answers: dict[str, SolverAnswer]) -> list[CheckRow]:
    """The rows of (b) if the function fails later, from the positions at the failure."""
    if not reacts(answers):
        return [not_asked("one point", "2b", TAKEN_TO_BE_APART)]
    readable = all(answers[name].balls for name in DISPLACED)
    if not readable or not all(displaced(answers[name]) for name in COLLISIONS):
        return [not_asked("one point", "2b", "the call fails before it has moved both spheres")]
    return projection_rows(answers, None)


def displaced(answer: SolverAnswer) -> bool:
    """Whether a failed call had finished the displacement of a pair: the pair is in the right
    place, or all four coordinates changed. Otherwise the failure may have come in between."""
    if not answer.failed:
        return True
    shift = shift_of(answer)
    moved = np.not_equal([b.x for b in answer.asked.balls], [b.x for b in answer.last])
    touch = near(shift.a + shift.b, shift.overlap, 0.1) and near(shift.across, 0.0, 0.1)
    return bool(moved.all()) or touch


def distance_of(balls: list[Ball]) -> float:
    """The distance of the centres of a pair, m."""
    return float(np.hypot(*np.subtract(balls[0].x, balls[1].x)))


def projection_rows(
    answers: dict[str, SolverAnswer], found: CollisionExplanation | None
) -> list[CheckRow]:
    """The rows of (b); `found`: the explanation of the velocities."""
    seen = [
        (answers[name].asked.balls, shift_of(answers[name]), answers[name].last)
        for name in COLLISIONS
    ]
    met = [near(distance_of(after), shift.sizes, 0.1) for _, shift, after in seen]
    balls, shift, after = seen[met.index(False) if False in met else 0]
    distance = distance_of(after)
    along = all(near(s.across, 0.0, 0.1) for _, s, _ in seen)
    backwards = found is not None and found.impulse == BACKWARDS
    instead = displaced_velocity(answers) == INSTEAD
    explained = found is not None and bool(found.mistake) and found.task != "2b"
    rows = [
        judged(
            "one point",
            "2b",
            "How far apart are the centres of a pair after the call?",
            f"centres {shown(distance)} m apart",
            f"{shown(shift.sizes)} m, the sum of their sizes",
            all(met),
            INSTEAD if instead else BACKWARDS if backwards else total_cause(seen),
        ),
        judged(
            "normal",
            "2b",
            "Are they moved along the line of their centres?",
            f"moved {shown(shift.across)} m across the line of their centres",
            "0 m across it",
            along,
            no_numbers(seen) or across_cause(seen) or placed(seen),
        ),
        (
            split(balls, shift)
            if all(met) and along
            else not_asked("shares", "2b", "they are not moved along n until they meet")
        ),
    ]
    return [*rows, *at_rest(answers, explained), separation(answers["separate"])]


def at_rest(answers: dict[str, SolverAnswer], explained: bool) -> list[CheckRow]:
    """The row on a pair at relative rest, whose displacement must not change a velocity, and one in
    (d) if something else changes it. None if a mistake in the impulse explains the change, or
    velocities are not numbers."""
    answer = answers["at rest to each other"]
    still, after = answer.asked.balls, answer.last
    kept = all(near(x.v, y.v) for x, y in zip(still, after))
    if not kept and answer.failed:
        return [not_asked("velocities", "2b", "the call fails after it has changed velocities")]
    if not kept and (explained or not finite(answers, "v")):
        return []
    task, cause = "2b", displaced_velocity(answers)
    if not np.isfinite([b.v for b in after]).all():
        task, cause = "2c", NOT_FINITE
    asked = "Is a pair at relative rest displaced without a change of velocity?"
    got, expected = shown(after[0].v) + " m/s", shown(still[0].v) + " m/s"
    if not kept and not cause:
        question = "Does a pair at relative rest keep its velocities?"
        return [
            judged("velocities", "2b", asked, "yes", "yes", True),
            judged("at rest", "2d", question, got, expected, False, WITHOUT_IMPULSE),
        ]
    return [judged("velocities", task, asked, got, expected, kept, cause)]


NOT_FINITE = (
    "the velocities of a pair at relative rest become NaN or infinite (a division by zero?)"
)
WITHOUT_IMPULSE = "a pair that needs no impulse does not keep its velocities"
DISPLACES_VELOCITY = "the displacement changes the velocity, too"
INSTEAD = "the displacement changes the velocity instead of the position"


def displaced_velocity(answers: dict[str, SolverAnswer]) -> str:
    """The cause that the displacement changes velocities, too, or only these; "" if it does not.

    Only then a pair at relative rest gets the same change whatever its velocity is.
    """
    before, after = answers[AT_REST[0]].asked.balls, answers[AT_REST[0]].last
    one, other = (changes(answers[name].asked.balls, answers[name].last) for name in AT_REST)
    if near(one, 0.0) or not near(one, other):
        return ""
    placed_as_before = all(near(x.x, y.x) for x, y in zip(before, after))
    return INSTEAD if placed_as_before else DISPLACES_VELOCITY


Pairs = list[tuple[tuple[Ball, ...], Shift, list[Ball]]]
"""For every colliding pair: the state before the call, its displacement, the state after the
call."""


def total_cause(seen: Pairs) -> str:
    """The mistake that explains the displacement of all pairs; "" if none does."""
    mistakes = (no_numbers, half_of_one, b_as_a, across_cause, wrong_total, partial, rest_left)
    return next((cause for mistake in mistakes if (cause := mistake(seen))), "")


def no_numbers(seen: Pairs) -> str:
    """The cause that positions are not numbers, which is tested before any other; "" if all are."""
    finite = np.isfinite([b.x for *_, after in seen for b in after]).all()
    return "" if finite else "the positions become NaN or infinite"


def half_of_one(seen: Pairs) -> str:
    """The cause that only one sphere is moved, by half of the overlap; else ""."""
    halved = all(near(s.a + s.b, s.overlap / 2, 0.1) for _, s, _ in seen)
    for who, still in (("A", "b"), ("B", "a")):
        if halved and all(abs(getattr(s, still)) <= 1e-9 for _, s, _ in seen):
            return f"only {who} is moved, by half of the overlap"
    return ""


def b_as_a(seen: Pairs) -> str:
    """The cause that both are moved the same way, by distances that add up to the overlap; else
    ""."""
    alike = (near(abs(s.a) + abs(s.b), s.overlap, 0.1) and s.a * s.b < 0 for _, s, _ in seen)
    return "B is moved the same way as A: its sign is wrong" if all(alike) else ""


def wrong_total(seen: Pairs) -> str:
    """The formula of `TOTALS` that gives the total displacement, if all pairs are moved along their
    normals."""
    if not all(near(s.across, 0.0, 0.1) for _, s, _ in seen):
        return ""
    with np.errstate(all="ignore"):
        for name, law in TOTALS.items():
            if all(near(s.a + s.b, law(s, *balls), 0.1) for balls, s, _ in seen):
                return name
    return ""


def partial(seen: Pairs) -> str:
    """The cause that the displacement is a multiple of the overlap; else ""."""
    factor = (seen[0][1].a + seen[0][1].b) / seen[0][1].overlap
    if not all(near(s.a + s.b, factor * s.overlap, 0.1) for _, s, _ in seen):
        return ""
    if all(near(min(s.a, s.b), s.overlap / 4, 0.1) for _, s, _ in seen) and near(factor, 0.75):
        return "the overlap is computed again after the first sphere has been moved"
    return f"they are moved by {shown(factor)} times the overlap"


def rest_left(seen: Pairs) -> str:
    """The cause that a constant part of the overlap is not corrected; else ""."""
    rest = seen[0][1].overlap - (seen[0][1].a + seen[0][1].b)
    if rest > 0 and all(near(s.a + s.b, s.overlap - rest, 0.1) for _, s, _ in seen):
        return f"{shown(rest)} m of the overlap is left"
    return ""


# n -> the direction from A to B in which a mistake would place B
DIRECTIONS: dict[str, Callable[[Array], Array]] = {
    "x and y of the normal are exchanged": lambda n: -n[::-1],
    "one part of the normal has the wrong sign": lambda n: n * [1, -1],
    "one part of the normal has the wrong sign (y)": lambda n: n * [-1, 1],
    NORMAL_IN_DEGREES: lambda n: -in_degrees(n),
    f"{NORMAL_IN_DEGREES} (n from A to B)": lambda n: in_degrees(-n),
    "the normal has the wrong direction": lambda n: n,
}


def placed(seen: Pairs) -> str:
    """The cause that one sphere is placed at the right distance from the other in a wrong, known
    direction; else ""."""
    for name, direction_of in DIRECTIONS.items():
        if all(
            near(np.subtract(after[1].x, after[0].x), s.sizes * direction_of(direction(*b)[0]), 0.1)
            for b, s, after in seen
        ):
            return name.removesuffix(" (y)")
    return ""


# (n, A or B before, the other) -> the direction in which a mistake would move it
WAYS: dict[str, Callable[[Array, Ball, Ball], Array]] = {
    "along x only": lambda n, one, other: np.array([1.0, 0.0]),
    "along y only": lambda n, one, other: np.array([0.0, 1.0]),
    "with the wrong sign of x or of y": lambda n, one, other: n * [1, -1],
    "by the x part of the normal in x and in y": lambda n, one, other: np.ones(2) * n[0],
    "by the y part of the normal in x and in y": lambda n, one, other: np.ones(2) * n[1],
    "along their relative velocity": lambda n, one, other: np.subtract(one.v, other.v),
    "along its own velocity": lambda n, one, other: np.array(one.v),
    "by the absolute values of the normal": lambda n, one, other: np.abs(n),
    "along the tangent": lambda n, one, other: np.array([-n[1], n[0]]),
    "with x and y of the normal exchanged": lambda n, one, other: n[::-1],
    "along the sum of their positions": lambda n, one, other: np.add(one.x, other.x),
    "along its own position": lambda n, one, other: np.array(one.x),
}


def across_cause(seen: Pairs) -> str:
    """The cause that one or both are moved in another known direction; else ""."""
    moved = [way_of([(b[who], b[1 - who], after[who]) for b, _, after in seen]) for who in (0, 1)]
    if moved[0] == moved[1]:
        who = "each is" if moved[0] and "its own" in moved[0] else "they are"
        return f"{who} moved {moved[0]}" if moved[0] else ""
    parts = (
        f"{who}.{way}" if "is set" in way else f"{who} is moved {way}"
        for who, way in zip("AB", moved)
        if way
    )
    return "; ".join(parts)


def way_of(seen: list[tuple[Ball, Ball, Ball]]) -> str | None:
    """The direction in which one of a pair is moved, from (it before, the other, it after); "" for
    the normal, None if unknown."""
    ways: dict[str, Callable[[Array, Ball, Ball], Array]] = {"": lambda n, one, other: n} | WAYS
    for name, way in ways.items():
        crosses = []
        for one, other, after in seen:
            (x, y), (u, v) = np.subtract(after.x, one.x), way(direction(one, other)[0], one, other)
            crosses.append(x * v - y * u)
        if near(crosses, 0.0, 0.01):
            return name
    return next(
        (f"{which} is set instead of changed (= for +=)" for which in SET if was_set(which, seen)),
        None,
    )


SET = ("position", "position.x", "position.y")


def was_set(which: str, seen: list[tuple[Ball, Ball, Ball]]) -> bool:
    """Whether a position, or one component of it, equals the displacement itself, along the
    normal."""
    crosses = []
    for one, other, after in seen:
        n, moved = direction(one, other)[0], np.subtract(after.x, one.x)
        x = after.x[0] if which != "position.y" else moved[0]
        y = after.x[1] if which != "position.x" else moved[1]
        crosses.append(x * n[1] - y * n[0])
    return near(crosses, 0.0, 0.01)


def split(balls: tuple[Ball, ...], shift: Shift) -> CheckRow:
    """The row on how the overlap is shared, and the motion of the centre of mass: a free choice."""
    a, b = balls
    share = shift.a / shift.overlap
    known = {
        "both are moved by half of it": 0.5,
        "it is shared by inverse mass": b.m / (a.m + b.m),
        ONE.format("A", "B"): 1.0,
        "it is shared by mass, so that the heavier is moved farther": a.m / (a.m + b.m),
        ONE.format("B", "A"): 0.0,
    }
    how = next(
        (name for name, wanted in known.items() if near(share, wanted)),
        f"A is moved by {share:.3g} of it, B by the rest",
    )
    centre = (a.m * shift.a - b.m * shift.b) / (a.m + b.m)
    aside = "stays" if abs(centre) < 1e-9 else f"moves by {shown(abs(centre))} m"
    asked = f"How is the overlap shared, for masses of {shown(a.m)} and {shown(b.m)} kg?"
    got = f"A {shown(shift.a)} m, B {shown(shift.b)} m"
    return CheckRow(
        "shares",
        "2b",
        asked,
        got,
        "any shares",
        "free choice",
        f"{how}; the centre of mass {aside}",
    )


ONE = (
    "only {0} is moved, by the whole overlap. The task asks to displace the two until they meet in"
    " one point and does not say how far each one moves, so {1} may stay where it is"
)


def separation(answer: SolverAnswer) -> CheckRow:
    """The row on a pair that overlaps and moves apart: whether to displace it is a free choice."""
    shift = shift_of(answer)
    moved = abs(shift.a) + abs(shift.b) > 1e-9
    if answer.failed and not moved:
        return not_asked("separating pair", "2b", "the call fails before it moves such a pair")
    said = (
        "it is displaced like any other pair"
        if moved
        else "it is left as it is: the function returns early where spheres move apart"
    )
    return CheckRow(
        "separating pair",
        "2b",
        "Is a pair displaced that overlaps and moves apart?",
        "yes" if moved else "no",
        "yes or no",
        "free choice",
        said,
    )
