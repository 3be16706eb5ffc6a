"""The step around the two tasks: every sphere once, every pair, the edges; judged by the file's own
functions."""

from __future__ import annotations

import numpy as np

from adapters.own_solver.file import SolverFailed
from adapters.own_solver.process import SolverProcess
from reports.check.questions import Answer, Ball, Question, ask
from reports.check.rows import FOLLOWS, CheckRow, judged, near, not_asked, shown

DT = 1e-3  # s, the exercise's
# m, a place beyond each
EDGES = {"right": (5.2, 0.1), "left": (-5.2, -0.1), "top": (0.1, 3.2), "bottom": (-0.1, -3.2)}
ONTO = {"right": (-5.0, 0.1), "left": (5.0, -0.1), "top": (0.1, -3.0), "bottom": (-0.1, 3.0)}
# a pair that collides
A, B = Ball((-0.2, 0.0), (1.0, 0.2), r=0.3), Ball((0.25, 0.1), (-1.0, 0.1), m=2.0, r=0.3)


def loop_rows(process: SolverProcess, faulty: bool, begun: object) -> list[CheckRow]:
    """The rows of the step; where the file has none, a row that says so.

    `faulty`: the functions it calls are; `begun`: what came of its first initScene.
    """
    has = process.functions
    if not (has["begin"] and has["step"]):
        missing = "initScene" if not has["begin"] else "performSimStep"
        return [not_asked("step", "loop", f"the file has no function {missing}")]
    try:
        if isinstance(begun, SolverFailed):
            raise begun
        process.do("begin", limit=2.0)
    except SolverFailed as failure:
        cause = f"initScene: {failure}"
        return [
            judged(
                "step", "loop", "Does initScene make a scene?", "it fails", "a scene", False, cause
            )
        ]
    start = process.do("globals")
    if not start or len(start) < 3:
        got = f"{len(start)} spheres" if start else "no ufo or no asteroids"
        return [
            judged(
                "step",
                "loop",
                "Does initScene make a ufo and asteroids?",
                got,
                "a ufo and 20 asteroids",
                False,
                "initScene leaves the globals ufo and asteroids without spheres",
            )
        ]
    asked = worlds(len(start), has["wrap"])
    came = ask(process, asked)
    failed = next((answer.failed for answer in came.values() if answer.failed), None)
    if failed:
        cause = FOLLOWS if faulty else f"performSimStep: {failed}"
        return [
            judged(
                "step", "loop", "Does performSimStep come back?", "it fails", "yes", False, cause
            )
        ]
    if faulty:
        rows = [
            not_asked("all spheres", "loop", "the functions that it calls have faults of their own")
        ]
    else:
        rows = [integrated(asked["free"], came["free"], came["alone"]), pairs(asked, came)]
        rows += (
            [wrapping(asked["edges in a step"], came["edges in a step"], came["edges"])]
            if has["wrap"]
            else []
        )
    if has["wrap"]:
        rows += edges(asked["edges"], came["edges"], start, process.surface == "exercise")
    return rows


def worlds(n: int, wraps: bool) -> dict[str, Question]:
    """Questions on `n` of the file's own spheres, the ufo first."""
    step = (("step", DT),)
    plain = parked(n)
    forced = tuple(
        b._replace(v=(0.4, -0.3), F=(2.0, 1.0), w=0.5, torque=0.3, m=1.5, MoI=0.7) for b in plain
    )
    found = {
        "free": Question(forced, step, world=True),
        "alone": Question((forced[0],), (("integrate", 0, DT),)),
    }
    middle = n // 2
    for i, j in sorted(
        {(0, 1), (0, middle), (0, n - 1), (1, 2), (1, n - 1), (n - 2, n - 1), (middle - 1, middle)}
    ):
        if 0 <= i < j < n:
            spheres = list(plain)
            spheres[i], spheres[j] = A, B
            found[f"pair {i} {j}"] = Question(tuple(spheres), step, world=True)
    if wraps:
        spheres = list(plain)
        for k, place in enumerate(list(EDGES.values())[: n - 1]):
            spheres[k + 1] = plain[k + 1]._replace(x=place, v=(0.2, 0.3))
        spheres[0] = plain[0]._replace(x=(5.4, 0.5))
        found["edges"] = Question(tuple(spheres), (("wrap",),), world=True)
        resting = tuple(b._replace(v=(0.0, 0.0)) for b in spheres)
        found["edges in a step"] = Question(resting, step, world=True)
    return found


def parked(n: int) -> tuple[Ball, ...]:
    """Small spheres at rest in four rows near the edges, so that nothing touches."""
    columns = -(-n // 4)
    x, y = np.linspace(-4.5, 4.5, columns), (-2.6, -2.0, 2.0, 2.6)
    return tuple(
        Ball((float(x[k % columns]), y[k // columns]), m=1.0, r=min(0.05, 2.0 / columns))
        for k in range(n)
    )


def integrated(question: Question, came: Answer, alone: Answer) -> CheckRow:
    """Every sphere moves as one alone does by the file's own integrate."""
    asked = "Does a step integrate every sphere once?"
    start, end = question.balls[0], alone.last[0]
    moved = np.subtract(end.x, start.x)
    wrong = [
        k
        for k, (b, a) in enumerate(zip(question.balls, came.last))
        if not (near(a.x, np.add(b.x, moved)) and near(a.v, end.v) and near(a.w, end.w))
    ]
    if not wrong:
        return judged("all spheres", "loop", asked, "yes", "yes", True)
    first = came.last[wrong[0]]
    who = name_of(wrong[0])
    cause = (
        "a loop of performSimStep leaves spheres out"
        if near(first.v, question.balls[0].v)
        else ("performSimStep integrates more than once, or not by dt")
    )
    got = f"{who} moves at {shown(first.v)} m/s ({len(wrong)} of {len(came.last)} wrong)"
    return judged("all spheres", "loop", asked, got, f"{shown(end.v)} m/s", False, cause)


def pairs(asked: dict[str, Question], came: dict[str, Answer]) -> CheckRow:
    """Every pair that is put together reacts, and nobody else."""
    silent, others = [], []
    for name, question in asked.items():
        if not name.startswith("pair"):
            continue
        i, j = map(int, name.split()[1:])
        kicked = [
            k for k, (b, a) in enumerate(zip(question.balls, came[name].last)) if not near(a.v, b.v)
        ]
        if not {i, j} <= set(kicked):
            silent.append(name_of(i, j))
        elif set(kicked) != {i, j}:
            others.append(name_of(min(set(kicked) - {i, j})))
    got = (
        f"no collision of {', '.join(silent)}"
        if silent
        else f"another sphere is struck: {others[0]}"
        if others
        else "yes"
    )
    cause = (
        "a loop of performSimStep leaves pairs out"
        if silent
        else "performSimStep lets spheres react that are apart"
    )
    return judged(
        "pairs",
        "loop",
        "Does a step let every pair collide, the ufo with each asteroid too?",
        got,
        "yes",
        not silent and not others,
        cause,
    )


def wrapping(question: Question, came: Answer, alone: Answer) -> CheckRow:
    """A step sets who is beyond an edge where projectObjects does; all are at rest, so that only
    this moves them."""
    wrong = [k for k, (a, b) in enumerate(zip(came.last, alone.last)) if not near(a.x, b.x)]
    got = f"{name_of(wrong[0])} is at {shown(came.last[wrong[0]].x)} m" if wrong else "yes"
    expected = (
        f"at {shown(alone.last[wrong[0]].x)} m, where projectObjects sets it" if wrong else "yes"
    )
    stayed = all(near(a.x, b.x) for b, a in zip(question.balls, came.last))
    return judged(
        "edges in a step",
        "loop",
        "Does a step set who is beyond an edge where projectObjects does?",
        got,
        expected,
        not wrong,
        "performSimStep does not call projectObjects" if stayed else "",
    )


def name_of(*spheres: int) -> str:
    """Spheres as people call them."""
    return " and ".join("the ufo" if k == 0 else f"asteroid {k - 1}" for k in spheres)


def edges(question: Question, came: Answer, start: list[list[float]], ufo: bool) -> list[CheckRow]:
    """An asteroid beyond an edge comes in at the opposite one; a ufo that leaves is set back to its
    start."""
    pairs = list(zip(question.balls, came.last))[1:]
    got, expected, cause = next(
        filter(None, map(wrong_at_edge, ONTO.items(), pairs)), ("yes", "yes", "")
    )
    moved = [(before, after) for before, after in pairs[len(ONTO) :] if not near(before.x, after.x)]
    if moved and not cause:
        before, after = moved[0]
        got, expected = (
            f"one inside, at {shown(before.x)} m, is set to {shown(after.x)} m",
            "it stays",
        )
        cause = "projectObjects moves spheres that are inside"
    asked = "Is an asteroid beyond an edge set onto the opposite one?"
    rows = [judged("edges", "loop", asked, got, expected, not cause, cause)]
    if ufo:
        home, place = start[0][:2], came.last[0].x
        asked = "Is a ufo that leaves set back to its start?"
        cause = "projectObjects does not set it back"
        got, expected = f"it is at {shown(place)} m", f"at {shown(home)} m"
        rows.append(judged("ufo", "loop", asked, got, expected, near(place, home), cause))
    return rows


def wrong_at_edge(
    edge: tuple[str, tuple[float, float]], pair: tuple[Ball, Ball]
) -> tuple[str, str, str] | None:
    """What came of one beyond this edge, what should have, and the likely cause; None if it is
    right."""
    (name, onto), (before, after) = edge, pair
    if not near(after.x, onto):
        got = f"one beyond the {name} edge, at {shown(before.x)} m, is set to {shown(after.x)} m"
        return got, f"it is set to {shown(onto)} m", "projectObjects sets it onto the wrong place"
    if not near(after.v, before.v):
        got = f"one beyond the {name} edge flies on at {shown(after.v)} m/s"
        return got, f"at {shown(before.v)} m/s, as it came", "projectObjects changes its velocity"
    return None
