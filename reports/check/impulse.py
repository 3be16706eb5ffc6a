"""Task 2 (c) and (d): the impulse of a hit and what it does to both velocities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reports.check.hits import Hit, changes, hit_of
from reports.check.impacts import IMPULSES, PARTING, UPDATES, Finding, tangent
from reports.check.questions import HITS, QUESTIONS, Answer, finite
from reports.check.restitution import Restitution
from reports.check.rows import Row, judged, near, not_asked, shown
from scenarios.model import Array


def impulse_rows(answers: dict[str, Answer], restitution: Restitution, found: Finding | None) -> list[Row]:
    """The rows of (c) and (d)."""
    if not finite(answers, "v"):
        return [*no_number(answers, restitution.own), bystanders(answers)]
    e = found.e if found else restitution.own
    name = next(iter(HITS if found else wrong_hits(answers, e) or HITS))  # numbers that show what is wrong
    balls, after = QUESTIONS[name].balls, answers[name].last
    hit, came = hit_of(balls, after), changes(balls, after)
    P = IMPULSES[""](hit, e)
    acts = acting(hit, found, P)
    fine_c = found is not None and not found.impulse
    impulse = restitution.mistake or (found.impulse if found else partly(answers, e))
    update = found.update if found and found.task == "2d" else ""
    mistake = impulse or (found.mistake if found else "")
    spoilt = "2d" if fine_c else "2c"  # the part in which lies what spoils energy and restitution
    got, lost = hit.ma * came[0], energy(hit, came)
    across, gained = float(got @ tangent(hit)), hit.ma * came[0] + hit.mb * came[1]
    rows = [
        judged("impulse", "2c", f"What impulse has A from B, for {shown(hit.ma)} and {shown(hit.mb)} kg?",
               f"{shown(got @ hit.n)} N s along the normal", f"{shown(P @ hit.n)} N s", fine_c, impulse),
        judged("tangential part", "2c", "What impulse is there across the normal?", f"{shown(across)} N s", "0 N s",
               near(across, 0.0) or fine_c, impulse),
        judged("energy", spoilt, "How much kinetic energy does the hit add?", f"{shown(lost)} J",
               f"{shown(-(1 - e * e) / 2 * hit.mu * hit.vn**2)} J", bool(lost <= 1e-9), mistake),
        replace(restitution.row(mistake), task=spoilt if not near(restitution.came, e) else "2c"),
        restitution.speeds(mistake), separating(answers, found, e),
        judged("velocity of A", "2d", "What velocity has A after the hit, by the impulse that acts?",
               f"{shown(after[0].v)} m/s", f"{shown(hit.va + acts / hit.ma)} m/s",
               right_update(found) or near(came[0], acts / hit.ma), update or impulse),
        judged("velocity of B", "2d", "What velocity has B after the hit, by the impulse that acts?",
               f"{shown(after[1].v)} m/s", f"{shown(hit.vb - acts / hit.mb)} m/s",
               right_update(found) or near(came[1], -acts / hit.mb), update or impulse),
        judged("momentum", "2d", "How much momentum does the hit add?", f"{shown(gained)} kg m/s", "(0, 0) kg m/s",
               near(gained, 0.0), update or impulse),
        symmetry(answers, mistake), bystanders(answers),
    ]  # fmt: skip
    # The velocities say more of a mistake in (d) than the energy and the restitution that it spoils.
    return sorted(rows, key=lambda row: (row.task, row.task == "2d" and row.name in ("energy", "restitution")))


def no_number(answers: dict[str, Answer], e: float) -> list[Row]:
    """The one row on velocities that are no numbers: nothing else can be read from them."""
    if not finite(answers, "x"):
        return impulse_not_asked("the positions become no numbers before it")
    lost = {name: [not np.isfinite(ball.v).all() for ball in answers[name].last] for name in HITS}
    name = next(name for name in HITS if any(lost[name]))
    balls, after = QUESTIONS[name].balls, answers[name].last
    hit, came = hit_of(balls, after), changes(balls, after)
    P = IMPULSES[""](hit, e)
    a, b = (any(both) for both in zip(*lost.values()))
    why = "(a field that does not exist, a division by zero?)"
    if a and b:
        asked = f"What impulse has A from B, for {shown(hit.ma)} and {shown(hit.mb)} kg?"
        return [
            judged("impulse", "2c", asked, f"{shown(hit.ma * came[0])} N s", f"{shown(P)} N s", False,
                   f"the impulse is no number {why}"),
            not_asked("velocity of A", "2d", "the impulse is no number"),
        ]  # fmt: skip
    who, right = ("A", hit.va + P / hit.ma) if a else ("B", hit.vb - P / hit.mb)
    return [
        not_asked("impulse", "2c", f"the velocity of {who} becomes no number"),
        judged(f"velocity of {who}", "2d", f"What velocity has {who} after the hit?",
               f"{shown(after[int(b)].v)} m/s", f"{shown(right)} m/s", False,
               f"the velocity of {who} becomes no number {why}"),
    ]  # fmt: skip


def right_update(found: Finding | None) -> bool:
    """Whether (d) is known to be right."""
    return found is not None and (not found.update or found.task != "2d")


def partly(answers: dict[str, Answer], e: float) -> str:
    """Where no single mistake gives all hits: whether some of them are right, or the order of A and B matters."""
    if symmetry(answers, "").verdict == "fault":
        return UNALIKE
    wrong = wrong_hits(answers, e)
    if 0 < len(wrong) < len(HITS):
        names = ", ".join(name.removeprefix("hit/") for name in wrong)
        return f"unknown: it is right for some pairs and wrong for others ({names})"
    return ""


def wrong_hits(answers: dict[str, Answer], e: float) -> list[str]:
    """The questions of `HITS` whose velocities are not those of the formula."""
    wrong = []
    for name, question in HITS.items():
        h = hit_of(question.balls, answers[name].last)
        if not near(UPDATES[""].change(h, IMPULSES[""](h, e), e), changes(question.balls, answers[name].last)):
            wrong.append(name)
    return wrong


def acting(hit: Hit, found: Finding | None, right: Array) -> Array:
    """The impulse the file computes, right or wrong, so that (d) is judged by itself."""
    return found.law(hit, found.e) if found else right


def energy(hit: Hit, came: Array) -> float:
    """J, what a hit adds to the kinetic energy."""
    before = hit.ma * hit.va @ hit.va + hit.mb * hit.vb @ hit.vb
    va, vb = hit.va + came[0], hit.vb + came[1]
    return float(hit.ma * va @ va + hit.mb * vb @ vb - before) / 2


def separating(answers: dict[str, Answer], found: Finding | None, e: float) -> Row:
    """On pairs that part: nothing, or the printed formula; both are free."""
    asked = "What happens to a pair that overlaps and moves apart?"
    either = "no impulse, or that of the formula"
    seen = [
        (hit_of(QUESTIONS[n].balls, answers[n].last), changes(QUESTIONS[n].balls, answers[n].last)) for n in PARTING
    ]
    if all(near(came, 0.0) for _, came in seen):
        return Row("parting", "2c", asked, "no impulse", either, "note", "only pairs that approach get an impulse")
    law, change = (found.law, found.change) if found else (IMPULSES[""], UPDATES[""].change)
    if all(near(change(h, law(h, e), e), came, 0.1) for h, came in seen):
        note = "pairs that part get an impulse too, as the formula is printed; it turns them back"
        return Row("parting", "2c", asked, "an impulse, by the same formula", either, "note", note)
    got = f"A is changed by {shown(seen[0][1][0])} m/s"
    return judged("parting", "2c", asked, got, either, False, found.mistake if found else "")


UNALIKE = "A and B are not treated alike: it matters which is called first"


def symmetry(answers: dict[str, Answer], mistake: str) -> Row:
    """Who is called A must not matter to the velocities."""
    names = list(HITS)
    came = [np.array([b.v for b in answers[n].last]) for n in names]
    swapped = [np.array([b.v for b in answers[n.replace("hit/", "swapped/")].last]) for n in names]
    same = all(near(x, y) for x, y in zip(came, swapped))
    return judged("order", "2d", "Are the velocities the same if A and B change places in the call?",
                  shown(swapped[0][0]) + " m/s", shown(came[0][0]) + " m/s", same,
                  mistake or UNALIKE)  # fmt: skip


def bystanders(answers: dict[str, Answer]) -> Row:
    """Forces, angles, spins, masses and sizes are not changed by a hit without friction."""
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
        word for field, word in words.items() for name, question in HITS.items()
        for before, after in zip(question.balls, answers[name].last)
        if not near(getattr(after, field), getattr(before, field))
    ]  # fmt: skip
    what = ", ".join(dict.fromkeys(changed))
    return judged("rest kept", "2d", "Does a hit leave force, angle, spin, mass and size alone?",
                  f"changes {what}" if what else "all as before", "all as before", not what,
                  f"it writes {what}")  # fmt: skip


def impulse_not_asked(why: str) -> list[Row]:
    """The rows of (c) and (d) where there is no hit to look at."""
    return [not_asked("impulse", "2c", why), not_asked("velocity of A", "2d", why)]
