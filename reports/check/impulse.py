"""Task 2 (c) and (d): the impulse of a collision and what it does to both velocities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reports.check.collisions import PairCollision, changes, collision_of
from reports.check.impacts import IMPULSES, SEPARATING, UPDATES, Finding, tangent
from reports.check.questions import COLLISIONS, QUESTIONS, Answer, finite
from reports.check.restitution import Restitution
from reports.check.rows import CheckRow, judged, near, not_asked, shown
from scenarios.model import Array


def impulse_rows(
    answers: dict[str, Answer], restitution: Restitution, found: Finding | None
) -> list[CheckRow]:
    """The rows of (c) and (d)."""
    if not finite(answers, "v"):
        return [*no_number(answers, restitution.own), bystanders(answers)]
    e = found.e if found else restitution.own
    name = next(
        iter(COLLISIONS if found else wrong_collisions(answers, e) or COLLISIONS)
    )  # numbers that show what is wrong
    balls, after = QUESTIONS[name].balls, answers[name].last
    collision, came = collision_of(balls, after), changes(balls, after)
    P = IMPULSES[""](collision, e)
    acts = acting(collision, found, P)
    fine_c = found is not None and not found.impulse
    impulse = restitution.mistake or (found.impulse if found else partly(answers, e))
    update = found.update if found and found.task == "2d" else ""
    mistake = impulse or (found.mistake if found else "")
    spoilt = "2d" if fine_c else "2c"  # the part in which lies what spoils energy and restitution
    got, lost = collision.ma * came[0], energy(collision, came)
    across, gained = (
        float(got @ tangent(collision)),
        collision.ma * came[0] + collision.mb * came[1],
    )
    rows = [
        judged(
            "impulse",
            "2c",
            f"What impulse has A from B, for {shown(collision.ma)} and {shown(collision.mb)} kg?",
            f"{shown(got @ collision.n)} N s along the normal",
            f"{shown(P @ collision.n)} N s",
            fine_c,
            impulse,
        ),
        judged(
            "tangential part",
            "2c",
            "What impulse is there across the normal?",
            f"{shown(across)} N s",
            "0 N s",
            near(across, 0.0) or fine_c,
            impulse,
        ),
        judged(
            "energy",
            spoilt,
            "How much kinetic energy does the collision add?",
            f"{shown(lost)} J",
            f"{shown(-(1 - e * e) / 2 * collision.mu * collision.vn**2)} J",
            bool(lost <= 1e-9),
            mistake,
        ),
        replace(restitution.row(mistake), task=spoilt if not near(restitution.came, e) else "2c"),
        restitution.speeds(mistake),
        separating(answers, found, e),
        judged(
            "velocity of A",
            "2d",
            "What velocity has A after the collision, by the impulse that acts?",
            f"{shown(after[0].v)} m/s",
            f"{shown(collision.va + acts / collision.ma)} m/s",
            right_update(found) or near(came[0], acts / collision.ma),
            update or impulse,
        ),
        judged(
            "velocity of B",
            "2d",
            "What velocity has B after the collision, by the impulse that acts?",
            f"{shown(after[1].v)} m/s",
            f"{shown(collision.vb - acts / collision.mb)} m/s",
            right_update(found) or near(came[1], -acts / collision.mb),
            update or impulse,
        ),
        judged(
            "momentum",
            "2d",
            "How much momentum does the collision add?",
            f"{shown(gained)} kg m/s",
            "(0, 0) kg m/s",
            near(gained, 0.0),
            update or impulse,
        ),
        symmetry(answers, mistake),
        bystanders(answers),
    ]
    # The velocities say more of a mistake in (d) than the energy and the restitution that it
    # spoils.
    return sorted(
        rows, key=lambda row: (row.task, row.task == "2d" and row.name in ("energy", "restitution"))
    )


def no_number(answers: dict[str, Answer], e: float) -> list[CheckRow]:
    """The one row on velocities that are no numbers: nothing else can be read from them."""
    if not finite(answers, "x"):
        return impulse_not_asked("the positions become no numbers before it")
    lost = {
        name: [not np.isfinite(ball.v).all() for ball in answers[name].last] for name in COLLISIONS
    }
    name = next(name for name in COLLISIONS if any(lost[name]))
    balls, after = QUESTIONS[name].balls, answers[name].last
    collision, came = collision_of(balls, after), changes(balls, after)
    P = IMPULSES[""](collision, e)
    a, b = (any(both) for both in zip(*lost.values()))
    why = "(a field that does not exist, a division by zero?)"
    if a and b:
        asked = (
            f"What impulse has A from B, for {shown(collision.ma)} and {shown(collision.mb)} kg?"
        )
        return [
            judged(
                "impulse",
                "2c",
                asked,
                f"{shown(collision.ma * came[0])} N s",
                f"{shown(P)} N s",
                False,
                f"the impulse is no number {why}",
            ),
            not_asked("velocity of A", "2d", "the impulse is no number"),
        ]
    who, right = (
        ("A", collision.va + P / collision.ma) if a else ("B", collision.vb - P / collision.mb)
    )
    return [
        not_asked("impulse", "2c", f"the velocity of {who} becomes no number"),
        judged(
            f"velocity of {who}",
            "2d",
            f"What velocity has {who} after the collision?",
            f"{shown(after[int(b)].v)} m/s",
            f"{shown(right)} m/s",
            False,
            f"the velocity of {who} becomes no number {why}",
        ),
    ]


def right_update(found: Finding | None) -> bool:
    """Whether (d) is known to be right."""
    return found is not None and (not found.update or found.task != "2d")


def partly(answers: dict[str, Answer], e: float) -> str:
    """Where no single mistake gives all collisions: whether some of them are right, or the order of
    A and B matters."""
    if symmetry(answers, "").verdict == "fault":
        return UNALIKE
    wrong = wrong_collisions(answers, e)
    if 0 < len(wrong) < len(COLLISIONS):
        names = ", ".join(name.removeprefix("collision/") for name in wrong)
        return f"unknown: it is right for some pairs and wrong for others ({names})"
    return ""


def wrong_collisions(answers: dict[str, Answer], e: float) -> list[str]:
    """The questions of `COLLISIONS` whose velocities are not those of the formula."""
    wrong = []
    for name, question in COLLISIONS.items():
        h = collision_of(question.balls, answers[name].last)
        if not near(
            UPDATES[""].change(h, IMPULSES[""](h, e), e),
            changes(question.balls, answers[name].last),
        ):
            wrong.append(name)
    return wrong


def acting(collision: PairCollision, found: Finding | None, right: Array) -> Array:
    """The impulse the file computes, right or wrong, so that (d) is judged by itself."""
    return found.law(collision, found.e) if found else right


def energy(collision: PairCollision, came: Array) -> float:
    """J, what a collision adds to the kinetic energy."""
    before = collision.ma * collision.va @ collision.va + collision.mb * collision.vb @ collision.vb
    va, vb = collision.va + came[0], collision.vb + came[1]
    return float(collision.ma * va @ va + collision.mb * vb @ vb - before) / 2


def separating(answers: dict[str, Answer], found: Finding | None, e: float) -> CheckRow:
    """On pairs that part: nothing, or the printed formula; both are free."""
    asked = "What happens to a pair that overlaps and moves apart?"
    either = "no impulse, or that of the formula"
    seen = [
        (
            collision_of(QUESTIONS[n].balls, answers[n].last),
            changes(QUESTIONS[n].balls, answers[n].last),
        )
        for n in SEPARATING
    ]
    if all(near(came, 0.0) for _, came in seen):
        return CheckRow(
            "separating",
            "2c",
            asked,
            "no impulse",
            either,
            "note",
            "only pairs that approach get an impulse",
        )
    law, change = (found.law, found.change) if found else (IMPULSES[""], UPDATES[""].change)
    if all(near(change(h, law(h, e), e), came, 0.1) for h, came in seen):
        note = "pairs that part get an impulse too, as the formula is printed; it turns them back"
        return CheckRow(
            "separating", "2c", asked, "an impulse, by the same formula", either, "note", note
        )
    got = f"A is changed by {shown(seen[0][1][0])} m/s"
    return judged("separating", "2c", asked, got, either, False, found.mistake if found else "")


UNALIKE = "A and B are not treated alike: it matters which is called first"


def symmetry(answers: dict[str, Answer], mistake: str) -> CheckRow:
    """Who is called A must not matter to the velocities."""
    names = list(COLLISIONS)
    came = [np.array([b.v for b in answers[n].last]) for n in names]
    swapped = [
        np.array([b.v for b in answers[n.replace("collision/", "swapped/")].last]) for n in names
    ]
    same = all(near(x, y) for x, y in zip(came, swapped))
    return judged(
        "order",
        "2d",
        "Are the velocities the same if A and B change places in the call?",
        shown(swapped[0][0]) + " m/s",
        shown(came[0][0]) + " m/s",
        same,
        mistake or UNALIKE,
    )


def bystanders(answers: dict[str, Answer]) -> CheckRow:
    """Forces, angles, spins, masses and sizes are not changed by a collision without friction."""
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
        for name, question in COLLISIONS.items()
        for before, after in zip(question.balls, answers[name].last)
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


def impulse_not_asked(why: str) -> list[CheckRow]:
    """The rows of (c) and (d) where there is no collision to look at."""
    return [not_asked("impulse", "2c", why), not_asked("velocity of A", "2d", why)]
