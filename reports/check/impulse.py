"""Task 2 (c) and (d): the impulse of a collision and the new velocities."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from crosscheck2d.adapters.own_solver.restitution import EXERCISE
from crosscheck2d.reports.check.collisions import PairCollision, outcome
from crosscheck2d.reports.check.impacts import (
    IMPULSES,
    MASSLESS,
    NEVER,
    SEPARATING,
    SWAPPED,
    UPDATES,
    WITHOUT_J,
    ZEROED,
    CollisionExplanation,
    in_call,
    tangent,
)
from crosscheck2d.reports.check.questions import COLLISIONS, SolverAnswer, finite
from crosscheck2d.reports.check.restitution import Restitution
from crosscheck2d.reports.check.rows import CheckRow, judged, near, not_asked, shown
from crosscheck2d.scenarios.model import Array


@dataclass(frozen=True)
class CollisionCase:
    """A collision computed by a file, with the mistakes found in it.

    Attributes:
        pair: before the collision; one of the collisions asked that shows the fault.
        after: velocities of A and B after it, (2, 2) m/s.
        found: the impulse and the update that reproduce all collisions, None if none do.
        e: the restitution by which it is judged.
        impulse, update: the mistake in (c) and the one in (d); "" if none is known.
        opposite: whether A and B get opposite impulses in every collision: then J, right or wrong,
            is applied as in (d).
        for_one: whether in every collision one of the spheres gets the right impulse: then J is
            right, whatever the other gets.
    """

    pair: PairCollision
    after: Array
    found: CollisionExplanation | None
    e: float
    impulse: str
    update: str
    opposite: bool
    for_one: bool

    @property
    def mistake(self) -> str:
        """The mistake to report first."""
        return self.impulse or self.update or (self.found.mistake if self.found else "")

    @property
    def right_impulse(self) -> Array:
        """J n by the exercise's formula, N s."""
        return IMPULSES[""](self.pair, self.e)

    @property
    def computed_impulse(self) -> Array:
        """J n as computed by the file, right or wrong, N s; so (d) is judged independently of
        (c)."""
        if self.found:
            return self.found.law(self.pair, self.found.e)
        return self.received if self.opposite and not self.for_one else self.right_impulse

    @property
    def change(self) -> Array:
        """The changes of both velocities, (2, 2) m/s."""
        return self.after - [self.pair.va, self.pair.vb]

    @property
    def received(self) -> Array:
        """The impulse on A from B, N s."""
        return np.asarray(self.pair.ma * self.change[0])

    @property
    def shown_impulse(self) -> Array:
        """J n as far as it is known, N s: a mistake in (d) changes the impulse on A."""
        known = self.right_c or (self.found is not None and self.found.impulse not in MASSLESS)
        return self.computed_impulse if known else self.received

    @property
    def right_c(self) -> bool:
        """Whether the impulse is known to be right."""
        return self.for_one if self.found is None else not self.found.impulse

    @property
    def right_d(self) -> bool:
        """Whether the update is known to be right."""
        if self.found is None:
            return False
        return self.found.change is UPDATES[""].change or self.found.task != "2d"


def impulse_rows(
    answers: dict[str, SolverAnswer],
    restitution: Restitution,
    found: CollisionExplanation | None,
    computed: bool,
    written: bool,
) -> list[CheckRow]:
    """The rows of (c) and (d); `computed`: whether the function reads velocities to compute
    something from them; `written`: whether it writes velocities."""
    if not finite(answers, "v"):
        return [*no_number(answers, restitution.own), quantities_kept(answers)]
    case, rest = case_to_show(answers, restitution, found), quantities_kept(answers)
    if found and not found.impulse and found.update in WITHOUT_J:
        why = "there is no impulse by which the velocities could be judged"
        return [no_impulse(f"no impulse is computed: {found.update}"), *unseen("2d", why), rest]
    if (idle := without_effect(answers, found, written)) and rest.verdict != "fault":
        none = no_impulse("not implemented, or never reached: no velocity is read")
        unknown = unseen("2c", "the velocities after the call do not depend on the impulse")
        return [*(unknown if computed else [none]), no_velocities(idle), rest]
    if case.impulse == NEVER and rest.verdict == "fault":
        rest = replace(rest, cause=f"the velocities never change: {rest.cause} instead")
        case = replace(case, impulse=rest.cause)
    apart = separating(answers, case)
    # the part whose mistake makes energy and restitution wrong
    spoilt = "2d" if case.right_c else "2c"
    speeds = restitution.speeds(case.mistake)
    return [
        normal_impulse(case),
        tangential_impulse(case),
        *([] if spoilt == "2d" else energy_rows(case, restitution, spoilt)),
        replace(speeds, task=spoilt) if speeds.verdict == "fault" else speeds,
        *([] if apart.task == "2d" else [apart]),
        new_velocity(case, 0),
        new_velocity(case, 1),
        momentum(case),
        *([apart] if apart.task == "2d" else []),
        # A mistake in (d) shows more clearly in the velocities than in the energy.
        *(energy_rows(case, restitution, spoilt) if spoilt == "2d" else []),
        symmetry(answers, case),
        rest,
    ]


def without_effect(
    answers: dict[str, SolverAnswer], found: CollisionExplanation | None, written: bool
) -> str:
    """Why no impulse shows in the velocities after a collision; "" if one does. `written`: whether
    the function writes velocities."""
    if found is None or {found.impulse, found.update}.isdisjoint({NEVER, ZEROED}):
        return ""
    if found.update == ZEROED:
        return ZEROED
    if any(answers[name].returned for name in COLLISIONS):
        return RETURNED
    return UNCHANGED if written else NEVER


UNCHANGED = "the velocities never change: the function writes the velocities, but unchanged"
RETURNED = (
    "the velocities never change: sphereSphereCollisionHandling returns something new; it must"
    " change the spheres it is given"
)


def no_impulse(cause: str) -> CheckRow:
    """The fault that (c) is not implemented."""
    asked = "Is an impulse computed from the velocities, the masses and e?"
    return judged("implemented", "2c", asked, "no", "yes", False, cause)


def no_velocities(cause: str) -> CheckRow:
    """The fault that (d) is not implemented."""
    asked = "Are the velocities changed by the impulse?"
    return judged("implemented", "2d", asked, "no", "yes", False, cause)


def unseen(task: str, why: str) -> list[CheckRow]:
    """The rows of (c) or (d) if it cannot be judged."""
    return [not_asked({"2c": "impulse", "2d": "velocity of A"}[task], task, why)]


def rows_before_failure(answers: dict[str, SolverAnswer]) -> list[CheckRow]:
    """The row of (c) if the function fails in (d). J is right if in every collision one of the
    spheres got it before the failure; restitution and energy then need no rows. Otherwise J is not
    known: no row."""
    if not all(answers[name].balls for name in COLLISIONS):
        return []
    seen = [outcome(answers[name]) for name in COLLISIONS]
    right = [IMPULSES[""](pair, EXERCISE) for pair, _ in seen]
    for_a = [pair.ma * change[0] for pair, change in seen]
    for_b = [-pair.mb * change[1] for pair, change in seen]
    if not (near(for_a, right) or near(for_b, right)):
        return []
    pair, wanted = seen[0][0], f"{shown(right[0] @ seen[0][0].n)} N s"
    got = f"{wanted} along the normal"
    return [judged("impulse", "2c", asked_of_impulse(pair), got, wanted, True)]


def asked_of_impulse(pair: PairCollision) -> str:
    """The question about J."""
    return (
        f"What impulse does A get from B, for masses of {shown(pair.ma)} and {shown(pair.mb)} kg?"
    )


def case_to_show(
    answers: dict[str, SolverAnswer], restitution: Restitution, found: CollisionExplanation | None
) -> CollisionCase:
    """The collision to show, with the mistakes in it."""
    e = found.e if found else restitution.own
    name = next(iter(wrong_collisions(answers, e) or COLLISIONS))
    pair, _ = outcome(answers[name])
    for_one = right_for_one(answers, e)
    if found:
        impulse, update = found.impulse, found.update if found.task == "2d" else ""
    elif only := only_wrong(answers, e):
        impulse, update = "", only
    else:
        known = partly(answers, e)
        impulse, update = ("", known) if for_one else (known, "")
    return CollisionCase(
        pair,
        np.array([b.v for b in answers[name].last]),
        found,
        e,
        restitution.mistake or impulse,
        update,
        opposite_impulses(answers),
        for_one,
    )


def only_wrong(answers: dict[str, SolverAnswer], e: float) -> str:
    """The cause that in all collisions no velocity is wrong but that of one sphere, or one
    component of it; "" if more are wrong, or none."""
    wrong = wrong_components(answers, e)
    if len({who for who, _ in wrong}) != 1:
        return ""
    (who, axis), *more = sorted(wrong)
    name = "AB"[who] + ("" if more else f".{'xy'[axis]}")
    return f"{ONLY}{name} is wrong: no known mistake gives its numbers"


ONLY = "only v"  # how these causes begin


def wrong_components(answers: dict[str, SolverAnswer], e: float) -> set[tuple[int, int]]:
    """The components of velocities, (0: A, 1: B; 0: x, 1: y), that differ from the formula in a
    collision, with A and B in the order of the call."""
    wrong = set()
    for name in (*COLLISIONS, *SWAPPED):
        pair, changed = in_call(answers[name])
        wrong |= differing(pair, changed, IMPULSES[""](pair, e), e)
    return wrong


def differing(pair: PairCollision, changed: Array, P: Array, e: float) -> set[tuple[int, int]]:
    """The components of the changes of both velocities that differ from those by the impulse P."""
    right = UPDATES[""].change(pair, P, e)
    return {k for k in product((0, 1), (0, 1)) if not near(changed[k], right[k[0]][k[1]])}


def right_for_one(answers: dict[str, SolverAnswer], e: float) -> bool:
    """Whether in every collision A or B has the right velocity afterwards."""
    for name in (*COLLISIONS, *SWAPPED):
        pair, changed = in_call(answers[name])
        right = UPDATES[""].change(pair, IMPULSES[""](pair, e), e)
        if not any(near(one, wanted) for one, wanted in zip(changed, right)):
            return False
    return True


def opposite_impulses(answers: dict[str, SolverAnswer]) -> bool:
    """Whether every pair keeps its momentum, whichever sphere is called A."""
    for name in (*COLLISIONS, *SWAPPED):
        h, (a, b) = outcome(answers[name])
        if not near(h.ma * a, -h.mb * b):
            return False
    return True


def swapped(name: str) -> str:
    """The question about the same pair with A and B exchanged in the call."""
    return name.replace("collision/", "swapped/")


def normal_impulse(case: CollisionCase) -> CheckRow:
    """The row on J, the impulse along the normal."""
    return judged(
        "impulse",
        "2c",
        asked_of_impulse(case.pair),
        f"{shown(case.shown_impulse @ case.pair.n)} N s along the normal",
        f"{shown(case.right_impulse @ case.pair.n)} N s",
        # the next row judges the tangential part
        case.right_c or near(case.received @ case.pair.n, case.right_impulse @ case.pair.n),
        case.impulse,
    )


def tangential_impulse(case: CollisionCase) -> CheckRow:
    """The row on the tangential impulse, which is 0 because there is no friction."""
    across = float(case.shown_impulse @ tangent(case.pair))
    return judged(
        "tangential part",
        "2c",
        "What impulse does A get along the tangent?",
        f"{shown(across)} N s",
        "0 N s",
        near(across, 0.0) or case.right_c,
        case.impulse,
    )


def energy_rows(case: CollisionCase, restitution: Restitution, task: str) -> list[CheckRow]:
    """The rows on energy and restitution, in the task whose mistake they show."""
    added = energy(case.pair, case.change)
    kept = bool(added <= 1e-9)  # J; any loss is explained by the rows on the impulse
    return [
        judged(
            "energy",
            task,
            "Does the collision add kinetic energy?",
            "no" if kept else f"yes, {shown(added)} J",
            "no",
            kept,
            case.mistake,
        ),
        replace(
            restitution.row(case.mistake),
            task="2c" if near(restitution.measured, case.e) else task,
        ),
    ]


def new_velocity(case: CollisionCase, k: int) -> CheckRow:
    """The row on the velocity of A (k = 0) or B (k = 1), for the impulse that the file computes."""
    before, mass = ((case.pair.va, case.pair.ma), (case.pair.vb, case.pair.mb))[k]
    change = (1 - 2 * k) * case.computed_impulse / mass
    return judged(
        f"velocity of {'AB'[k]}",
        "2d",
        f"What is the velocity of {'AB'[k]} after the collision, by the impulse that the file"
        " computes?",
        f"{shown(case.after[k])} m/s",
        f"{shown(before + change)} m/s",
        case.right_d or near(case.change[k], change),
        case.update or case.impulse,
    )


def momentum(case: CollisionCase) -> CheckRow:
    """The row on the total momentum, which no collision changes."""
    added = case.pair.ma * case.change[0] + case.pair.mb * case.change[1]
    return judged(
        "momentum",
        "2d",
        "How much momentum does the collision add?",
        f"{shown(added)} kg m/s",
        "(0, 0) kg m/s",
        near(added, 0.0),
        case.update or case.impulse,
    )


def no_number(answers: dict[str, SolverAnswer], e: float) -> list[CheckRow]:
    """The only row if velocities are not numbers: nothing else can be judged."""
    if not finite(answers, "x"):
        why = "the positions become NaN or infinite before it"
        return [not_asked("impulse", "2c", why), not_asked("velocity of A", "2d", why)]
    lost = {
        name: [not np.isfinite(ball.v).all() for ball in answers[name].last] for name in COLLISIONS
    }
    name = next(name for name in COLLISIONS if any(lost[name]))
    after = answers[name].last
    collision, changed = outcome(answers[name])
    P = IMPULSES[""](collision, e)
    a, b = (any(both) for both in zip(*lost.values()))
    why = "(a field that does not exist, a division by zero?)"
    if a and b:
        return [
            judged(
                "impulse",
                "2c",
                asked_of_impulse(collision),
                f"{shown(collision.ma * changed[0])} N s",
                f"{shown(P)} N s",
                False,
                f"the impulse is not a number {why}",
            ),
            not_asked("velocity of A", "2d", "the impulse is not a number"),
        ]
    who, right = (
        ("A", collision.va + P / collision.ma) if a else ("B", collision.vb - P / collision.mb)
    )
    return [
        not_asked("impulse", "2c", f"the velocity of {who} becomes NaN or infinite"),
        judged(
            f"velocity of {who}",
            "2d",
            f"What is the velocity of {who} after the collision?",
            f"{shown(after[int(b)].v)} m/s",
            f"{shown(right)} m/s",
            False,
            f"the velocity of {who} becomes NaN or infinite {why}",
        ),
    ]


def partly(answers: dict[str, SolverAnswer], e: float) -> str:
    """A cause if no single mistake explains all collisions: the order of A and B matters, only the
    tangential part is wrong, or some collisions are right; else ""."""
    if not alike_if_swapped(answers):
        return UNALIKE
    if only_across(answers, e):
        return FRICTION
    wrong = wrong_collisions(answers, e)
    if 0 < len(wrong) < len(COLLISIONS):
        names = ", ".join(name.removeprefix("collision/") for name in wrong)
        return f"unknown: it is right for some pairs and wrong for others ({names})"
    return ""


FRICTION = "the velocities along the tangent are changed, too: the exercise has no friction"


def only_across(answers: dict[str, SolverAnswer], e: float) -> bool:
    """Whether the impulse along the normal is right in every collision, and momentum is kept."""
    for name in COLLISIONS:
        h, changed = outcome(answers[name])
        along = h.ma * changed[0] @ h.n
        if not (
            near(along, IMPULSES[""](h, e) @ h.n) and near(h.ma * changed[0], -h.mb * changed[1])
        ):
            return False
    return True


def wrong_collisions(answers: dict[str, SolverAnswer], e: float) -> list[str]:
    """The questions of `COLLISIONS` whose velocities differ from the formula."""
    wrong = []
    for name in COLLISIONS:
        h, changed = outcome(answers[name])
        if not near(UPDATES[""].change(h, IMPULSES[""](h, e), e), changed):
            wrong.append(name)
    return wrong


def energy(collision: PairCollision, changed: Array) -> float:
    """J (joule), the kinetic energy that a collision adds."""
    before = collision.ma * collision.va @ collision.va + collision.mb * collision.vb @ collision.vb
    va, vb = collision.va + changed[0], collision.vb + changed[1]
    return float(collision.ma * va @ va + collision.mb * vb @ vb - before) / 2


def separating(answers: dict[str, SolverAnswer], case: CollisionCase) -> CheckRow:
    """The row on pairs that move apart: no impulse, or that of the printed formula; the choice is
    free."""
    found, e = case.found, case.e
    asked = "Which impulse acts on a pair that overlaps and moves apart?"
    expected = "none, or that of the formula"
    seen = [outcome(answers[name]) for name in SEPARATING]

    def chosen(got: str, said: str) -> CheckRow:
        return CheckRow("separating", "2c", asked, got, expected, "free choice", said)

    if all(near(changed, 0.0) for _, changed in seen):
        return chosen("none", "only pairs that approach get an impulse")
    law, change = (found.law, found.change) if found else (IMPULSES[""], UPDATES[""].change)
    if all(near(change(h, law(h, e), e), changed, 0.1) for h, changed in seen):
        return chosen("that of the formula", AS_PRINTED)
    got = "A is changed by {} m/s, B by {} m/s".format(*map(shown, seen[0][1]))
    cause = found.mistake if found else ""
    if case.update.startswith(ONLY):
        wrong = wrong_components(answers, e)
        alike = all(differing(h, changed, law(h, e), e) <= wrong for h, changed in seen)
        cause = case.update if alike else ""
    if all(near(change(h, -law(h, e), e), changed, 0.1) for h, changed in seen):
        cause = ABSOLUTE
    task = "2d" if case.right_c and not case.right_d else "2c"
    return judged("separating", task, asked, got, expected, False, cause)


AS_PRINTED = "as the formula is printed, pairs that move apart get an impulse, too"
ABSOLUTE = (
    "it takes the absolute value of (vA - vB).n: a pair that moves apart is driven further apart"
)
UNALIKE = "the result depends on which sphere is A: the two are not treated alike"


FIRST = next(iter(COLLISIONS))


def alike_if_swapped(
    answers: dict[str, SolverAnswer], asked: Iterable[str] = tuple(COLLISIONS)
) -> bool:
    """Whether the velocities after each of these collisions do not depend on which sphere is A."""
    return all(
        near([b.v for b in answers[name].last], [b.v for b in answers[swapped(name)].last])
        for name in asked
    )


def symmetry(answers: dict[str, SolverAnswer], case: CollisionCase) -> CheckRow:
    """The velocities must not depend on which sphere is A. If both get opposite impulses, (d) is
    right, and the impulse depends on it."""
    first = next((name for name in COLLISIONS if not alike_if_swapped(answers, [name])), FIRST)
    task, mistake = ("2c", case.impulse) if case.opposite else ("2d", case.update)
    return judged(
        "A and B exchanged",
        task,
        "Are the velocities the same if A and B are exchanged in the call?",
        f"the same sphere has {shown(answers[swapped(first)].last[0].v)} m/s",
        f"{shown(answers[first].last[0].v)} m/s, as before the exchange",
        alike_if_swapped(answers),
        mistake or case.mistake or UNALIKE,
    )


def quantities_kept(answers: dict[str, SolverAnswer]) -> CheckRow:
    """The row on force, angle, spin, mass and size, which a collision without friction does not
    change."""
    words = {
        "F": "force",
        "alpha": "alpha",
        "w": "angularVelocity",
        "torque": "torque",
        "m": "mass",
        "MoI": "MoI",
        "r": "size",
    }
    changed = [
        word
        for field, word in words.items()
        for name in COLLISIONS
        for before, after in zip(answers[name].asked.balls, answers[name].last)
        if not near(getattr(after, field), getattr(before, field))
    ]
    what = ", ".join(dict.fromkeys(changed))
    return judged(
        "rest kept",
        "2d",
        "Does a collision leave force, angle, spin, mass and size alone?",
        f"changes {what}" if what else "all as before",
        "all as before",
        not what,
        f"it writes {what}",
    )
