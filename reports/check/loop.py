"""The step around the two tasks: every sphere once, every pair, the edges. The file's own functions
give the expected results."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from crosscheck2d.adapters.own_solver.file import SolverFailed
from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.reports.check.questions import (
    LIMIT,
    Ball,
    Question,
    SolverAnswer,
    ask,
    ask_in_two_orders,
    fresh_world,
)
from crosscheck2d.reports.check.rows import FOLLOWS, CheckRow, judged, near, not_asked, shown

DT = 1e-3  # s, the exercise's
# m, a place beyond each
EDGES = {"right": (5.2, 0.1), "left": (-5.2, -0.1), "top": (0.1, 3.2), "bottom": (-0.1, -3.2)}
ONTO = {"right": (-5.0, 0.1), "left": (5.0, -0.1), "top": (0.1, -3.0), "bottom": (-0.1, 3.0)}
# a pair that collides
A, B = Ball((-0.2, 0.0), (1.0, 0.2), r=0.3), Ball((0.25, 0.1), (-1.0, 0.1), m=2.0, r=0.3)
# a pair that overlaps by 0.5 mm after a step if both move, and not if only one does
LEFT, RIGHT = Ball((-0.3, 0.0), (1.0, 0.0), r=0.3), Ball((0.3015, 0.0), (-1.0, 0.0), r=0.3)


def loop_rows(process: SolverProcess, faulty: bool, kicks_apart: bool) -> list[CheckRow]:
    """The rows of the step; if the file has no step, a row that says so.

    faulty: whether the functions that it calls have faults. kicks_apart: whether overlapping pairs
    that move apart get an impulse.
    """
    has = process.functions
    if not has["step"]:
        return [not_asked("step", "loop", "the file has no function performSimStep")]
    start, no_scene = scene_of(process)
    if no_scene and not has["begin"]:
        return [not_asked("step", "loop", "the file has no function initScene")]
    if no_scene:
        return [no_scene]
    asked = worlds(len(start), has["wrap"])
    answers, _ = ask_in_two_orders(process, asked)
    if has["wrap"]:  # a step may change the edges of the box
        answers |= ask(process, {"edges": asked["edges"]}, afresh=True)
    if failed := next((answer.failed for answer in answers.values() if answer.failed), None):
        cause = FOLLOWS if faulty else f"performSimStep: {failed}"
        return [
            judged("step", "loop", "Does performSimStep return?", "it fails", "yes", False, cause)
        ]
    kept = {name for answer in answers.values() for name in answer.kept}
    resized = [name for name in BOX if name in kept]
    if resized:
        rows = [box(resized), not_asked("all spheres", "loop", "the step changes the box")]
    elif faulty:
        rows = call_rows(asked, answers, len(start))
    else:
        rows = step_rows(asked, answers, kicks_apart)
    if has["wrap"]:
        rows += edges(asked["edges"], answers["edges"], start, process.surface == "exercise")
    return rows


BOX = ("minX", "maxX", "minY", "maxY")


def box(changed: list[str]) -> CheckRow:
    """The fault that a step changes the edges of the box."""
    names = " and ".join(changed)
    asked = "Does a step leave minX, maxX, minY and maxY as they are?"
    cause = f"a step changes {names}: projectObjects then moves spheres at other edges"
    return judged("box", "loop", asked, f"changes {names}", "yes", False, cause)


def scene_of(process: SolverProcess) -> tuple[list[list[float]], CheckRow | None]:
    """The numbers of the spheres that initScene makes in a fresh world, or the file when it is
    loaded; or a fault if there are none."""
    *_, begun, start = process.request([*fresh_world(process), ("globals", None, LIMIT)])
    if isinstance(begun, SolverFailed):
        asked, got, expected = "Does initScene make a scene?", "it fails", "a scene"
        return [], judged("step", "loop", asked, got, expected, False, f"initScene: {begun}")
    if isinstance(start, SolverFailed) or not start or len(start) < 3:
        found = start if isinstance(start, list) else []
        asked = "Does initScene make a ufo and asteroids?"
        got = f"{len(found)} spheres" if found else "no ufo or no asteroids"
        cause = "initScene leaves the globals ufo and asteroids without spheres"
        return [], judged("step", "loop", asked, got, "a ufo and 20 asteroids", False, cause)
    return start, None


def step_rows(
    asked: dict[str, Question], answers: dict[str, SolverAnswer], kicks_apart: bool
) -> list[CheckRow]:
    """The rows of a step whose functions are right; `kicks_apart` as above."""
    itself = against_itself(asked["free"], answers)
    if itself and itself.verdict == "fault":
        return [itself, not_asked("all spheres", "loop", "a sphere collides with itself")]
    moved, met = integrated(asked["free"], answers), pairs(asked, answers)
    twice = handled_twice(answers["watched"], kicks_apart)
    rows = [moved, met, *([itself] if itself else []), *twice]
    if moved.verdict == met.verdict == "right":
        rows.append(integration_first(asked, answers))
    if "edges in a step" in answers:
        rows.append(
            wrapping(asked["edges in a step"], answers["edges in a step"], answers["edges"])
        )
    return [*rows, *edges_last(answers["watched"])]


def worlds(n: int, wraps: bool) -> dict[str, Question]:
    """Questions on `n` of the file's own spheres, the ufo first."""
    step = (("step", DT),)
    plain = parked(n)
    forced = tuple(
        b._replace(v=(0.4, -0.3), F=(2.0, 1.0), w=0.5, torque=0.3, m=1.5, MoI=0.7) for b in plain
    )
    found = {
        "free": Question(forced, step, world=True),
        "watched": Question(forced, step, world=True, watch=True),
        "alone": Question((forced[0],), (("integrate", 0, DT),)),
    }
    middle = n // 2
    for i, j in sorted(
        {(0, 1), (0, middle), (0, n - 1), (1, 2), (1, n - 1), (n - 2, n - 1), (middle - 1, middle)}
    ):
        if 0 <= i < j < n:
            found[f"pair {i} {j}"] = Question(put(plain, i, A, j, B), step, world=True)
            a, b = A._replace(v=(0.0, 0.0)), B._replace(v=(0.0, 0.0))
            resting = put(plain, i, a, j, b)
            found[f"calls for {i} {j}"] = Question(resting, step, world=True, watch=True)
    for i, j in ((0, 1), (1, 2)):
        found[f"about to meet {i} {j}"] = Question(put(plain, i, LEFT, j, RIGHT), step, world=True)
    if wraps:
        spheres = list(plain)
        for k, place in enumerate(list(EDGES.values())[: n - 1]):
            spheres[k + 1] = plain[k + 1]._replace(x=place, v=(0.2, 0.3))
        spheres[0] = plain[0]._replace(x=(5.4, 0.5))
        found["edges"] = Question(tuple(spheres), (("wrap",),), world=True)
        still = tuple(b._replace(v=(0.0, 0.0)) for b in spheres)
        found["edges in a step"] = Question(still, step, world=True)
    return found


def pairs_asked(asked: dict[str, Question], kind: str) -> Iterator[tuple[tuple[int, int], str]]:
    """The pairs of spheres of the questions of a kind, each with the name of the question."""
    for name in asked:
        if name.startswith(kind):
            i, j = map(int, name.split()[-2:])
            yield (i, j), name


def put(spheres: tuple[Ball, ...], i: int, a: Ball, j: int, b: Ball) -> tuple[Ball, ...]:
    """The spheres with a and b in the places i and j."""
    return tuple({i: a, j: b}.get(k, sphere) for k, sphere in enumerate(spheres))


def parked(n: int) -> tuple[Ball, ...]:
    """Small spheres at rest in four rows near the edges, without contacts."""
    columns = -(-n // 4)
    x, y = np.linspace(-4.5, 4.5, columns), (-2.6, -2.0, 2.0, 2.6)
    return tuple(
        Ball((float(x[k % columns]), y[k // columns]), m=1.0, r=min(0.05, 2.0 / columns))
        for k in range(n)
    )


def call_rows(
    asked: dict[str, Question], answers: dict[str, SolverAnswer], n: int
) -> list[CheckRow]:
    """The rows of a step whose functions have faults: for `n` spheres only its calls can be judged.
    A row says so if they cannot be recorded."""
    calls = answers["watched"].calls
    counts = [sum(call[:2] == ("integrate", k) for call in calls) for k in range(n)]
    met = collided(answers["watched"])
    if not any(counts) or not met:
        return [not_asked("all spheres", "loop", FAULTY)]
    wrong = next((k for k in range(n) if counts[k] != 1), None)
    # A step may leave out pairs that are far apart: these overlap.
    missed = next(
        (
            pair
            for pair, name in pairs_asked(asked, "calls for")
            if frozenset(pair) not in met | collided(answers[name])
        ),
        None,
    )
    got = "yes" if wrong is None else f"{name_of(wrong)}: {counts[wrong]} times"
    rows = [
        not_asked("integration first", "loop", FAULTY),
        judged(
            "all spheres",
            "loop",
            EVERY_SPHERE,
            got,
            "yes",
            wrong is None,
            LEAVES_SPHERES_OUT
            if wrong is None or not counts[wrong]
            else f"performSimStep integrates {name_of(wrong)} {counts[wrong]} times",
        ),
        judged(
            "pairs",
            "loop",
            EVERY_PAIR,
            f"no call for {name_of(*missed)}" if missed else "yes",
            "yes",
            missed is None,
            LEAVES_PAIRS_OUT,
        ),
    ]
    if "edges in a step" in asked:
        # The call of a function that is a constant cannot be recorded, only what it does.
        wrapped = any(call[0] == "wrap" for call in calls)
        wrapped = wrapped or not stayed(asked["edges in a step"], answers["edges in a step"])
        question, got = "Does a step call projectObjects?", "yes" if wrapped else "no"
        rows.append(judged("edges in a step", "loop", question, got, "yes", wrapped, NOT_WRAPPED))
    return [*rows, *edges_last(answers["watched"])]


def stayed(question: Question, answer: SolverAnswer) -> bool:
    """Whether all spheres are where they were."""
    return all(near(b.x, a.x) for b, a in zip(question.balls, answer.last))


def collided(answer: SolverAnswer) -> set[frozenset[int]]:
    """The pairs that a step gives to the collision function, in either order."""
    return {frozenset(call[1:]) for call in answer.calls if call[0] == "collide"}


EVERY_SPHERE = "Does a step integrate every sphere once?"
EVERY_PAIR = "Does a step let every pair collide, the ufo with each asteroid too?"
FAULTY = "the functions that the step calls have faults"
LEAVES_SPHERES_OUT = "a loop of performSimStep leaves spheres out"
LEAVES_PAIRS_OUT = "a loop of performSimStep leaves pairs out"
NOT_WRAPPED = "performSimStep does not call projectObjects"


def integrated(question: Question, answers: dict[str, SolverAnswer]) -> CheckRow:
    """The row on integration: every sphere moves as by one call of the file's own integrate."""
    after, end = answers["free"].last, answers["alone"].last[0]
    moved = np.subtract(end.x, question.balls[0].x)
    wrong = [
        k
        for k, (b, a) in enumerate(zip(question.balls, after))
        if not (near(a.x, np.add(b.x, moved)) and near(a.v, end.v) and near(a.w, end.w))
    ]
    if not wrong:
        return judged("all spheres", "loop", EVERY_SPHERE, "yes", "yes", True)
    first = wrong[0]
    got = f"{name_of(first)} moves at {shown(after[first].v)} m/s"
    got += f" (wrong: {len(wrong)} of {len(after)} spheres)"
    cause = integration_cause(first, question.balls[first], after[first], answers["watched"])
    return judged("all spheres", "loop", EVERY_SPHERE, got, f"{shown(end.v)} m/s", False, cause)


def integration_cause(k: int, before: Ball, after: Ball, watched: SolverAnswer) -> str:
    """The likely cause if a step does not integrate sphere `k` exactly once."""
    steps = [call[2] for call in watched.calls if call[:2] == ("integrate", k)]
    if near(after.v, before.v):
        return LEAVES_SPHERES_OUT
    if len(steps) > 1:
        return f"performSimStep integrates {name_of(k)} {len(steps)} times"
    if steps and not near(steps[0], DT):
        return f"performSimStep gives integrate a dt of {shown(steps[0])} s, not its own dt"
    return "performSimStep integrates more than once, or not by dt"


def against_itself(question: Question, answers: dict[str, SolverAnswer]) -> CheckRow | None:
    """The row on a sphere that is passed to the collision function twice; None if none is.

    No two spheres are near each other here, so a sphere that changes has collided with itself.
    """
    calls = [call for call in answers["watched"].calls if call[0] == "collide"]
    alone = [call[1] for call in calls if call[1] == call[2] >= 0]
    if not alone:
        return None
    who = name_of(alone[0])
    asked = "Which spheres does a step give to the collision function?"
    got = f"{who} and {who} again ({len(alone)} such calls)"
    expected = "two different spheres"
    right = integrated(question, answers).verdict == "right"
    cause = "performSimStep lets a sphere collide with itself: j begins at i, not at i + 1"
    if again := pairs_again(answers["watched"]):
        cause = (
            "performSimStep lets a sphere collide with itself, and handles"
            f" {len(again)} pairs of asteroids twice: j begins at 0, not at i + 1"
        )
    if right:
        cause = f"{who} is also tested against itself, which changes nothing"
        return CheckRow("itself", "loop", asked, got, "any", "free choice", cause)
    return judged("itself", "loop", asked, got, expected, False, cause)


def pairs_again(watched: SolverAnswer) -> set[frozenset[int]]:
    """The pairs of different asteroids that a step gives to the collision function more than
    once."""
    met = [frozenset(call[1:]) for call in watched.calls if call[0] == "collide"]
    return {
        pair
        for pair, times in Counter(met).items()
        if times > 1 and len(pair) == 2 and min(pair) > 0
    }


def handled_twice(watched: SolverAnswer, kicks_apart: bool) -> list[CheckRow]:
    """A row if pairs of asteroids are handled more than once: a fault if the second call gives them
    an impulse where rounding has left an overlap, else a free choice."""
    again = pairs_again(watched)
    if not again:
        return []
    asked = "Which pairs of asteroids does a step give to the collision function more than once?"
    got, said = f"{len(again)} pairs", "every pair of asteroids is handled more than once"
    if not kicks_apart:
        said += ", which changes nothing: the pair no longer approaches"
        return [CheckRow("each pair once", "loop", asked, got, "any", "free choice", said)]
    cause = f"{said}: where rounding leaves an overlap, the impulse acts again"
    return [judged("each pair once", "loop", asked, got, "none", False, cause)]


def edges_last(watched: SolverAnswer) -> list[CheckRow]:
    """The fault that a step calls projectObjects before other functions; nothing if it comes last,
    or if the calls are not known."""
    called = [call[0] for call in watched.calls]
    if not {"integrate", "wrap"} <= {*called} or called[-1] == "wrap":
        return []
    asked, last = "What does a step call last?", called[-1]
    names = {"integrate": "integrate", "collide": "sphereSphereCollisionHandling"}
    got = names[last]
    cause = f"performSimStep calls {got} after projectObjects: a sphere may end beyond an edge"
    return [judged("edges last", "loop", asked, got, "projectObjects", False, cause)]


def pairs(asked: dict[str, Question], answers: dict[str, SolverAnswer]) -> CheckRow:
    """The row on pairs: every overlapping pair collides, and no other sphere changes."""
    silent, others, handled = [], [], []
    for (i, j), name in pairs_asked(asked, "pair"):
        struck = struck_in(asked[name], answers[name])
        if not met(asked[name], answers[name], i, j):
            silent.append((i, j))
            continue
        handled.append((i, j))
        if not struck <= {i, j}:
            others.append(name_of(min(struck - {i, j})))
    got = (
        f"no collision of {left_out(silent, handled, answers['watched'])}"
        if silent
        else f"a third sphere changes, too: {others[0]}"
        if others
        else "yes"
    )
    cause = (
        LEAVES_PAIRS_OUT if silent else "performSimStep lets spheres collide that do not overlap"
    )
    return judged(
        "pairs",
        "loop",
        EVERY_PAIR,
        got,
        "yes",
        not silent and not others,
        cause,
    )


def left_out(
    silent: Sequence[tuple[int, int]], handled: Sequence[tuple[int, int]], watched: SolverAnswer
) -> str:
    """The pairs asked that do not collide, in words; with the number of all that are left out, if
    the step's calls tell it: a step that leaves out pairs far apart calls for none here."""
    named = ", ".join(name_of(*pair) for pair in silent)
    calls = collided(watched)
    if not handled or not all(frozenset(pair) in calls for pair in handled):
        return named
    n = len(watched.last)
    missing = [pair for pair in combinations(range(n), 2) if frozenset(pair) not in calls]
    if len(missing) <= len(silent):
        return named
    return f"{len(missing)} pairs, for example {named}"


def met(question: Question, answer: SolverAnswer, i: int, j: int) -> bool:
    """Whether a step lets spheres i and j collide: it changes the velocities of both, or they do
    not overlap afterwards.

    A step may give a pair to the collision function twice, as the exercise's own does. Where
    rounding leaves an overlap, the second impulse acts, too, and e = 1 restores the velocities.
    """
    a, b = answer.last[i], answer.last[j]
    apart, reach = float(np.hypot(*np.subtract(a.x, b.x))), a.r + b.r
    return {i, j} <= struck_in(question, answer) or apart > reach or near(apart, reach)


def struck_in(question: Question, answer: SolverAnswer) -> set[int]:
    """The spheres whose velocities a step without forces changes."""
    return {k for k, (b, a) in enumerate(zip(question.balls, answer.last)) if not near(a.v, b.v)}


def integration_first(asked: dict[str, Question], answers: dict[str, SolverAnswer]) -> CheckRow:
    """The row on order: a pair that touches only at the end of a step collides in it if all spheres
    are integrated first."""
    missed = [
        name_of(*pair)
        for pair, name in pairs_asked(asked, "about to meet")
        if not met(asked[name], answers[name], *pair)
    ]
    return judged(
        "integration first",
        "loop",
        "Does a pair collide in the step in which it begins to overlap?",
        f"not {' and not '.join(missed)}" if missed else "yes",
        "yes",
        not missed,
        "the step handles collisions before all spheres are integrated: it finds them a step late",
    )


def wrapping(question: Question, answer: SolverAnswer, alone: SolverAnswer) -> CheckRow:
    """The row on the edges in a step: a sphere beyond an edge ends where projectObjects puts it.
    All spheres are at rest, so that nothing else moves them."""
    wrong = [k for k, (a, b) in enumerate(zip(answer.last, alone.last)) if not near(a.x, b.x)]
    got = f"{name_of(wrong[0])} is at {shown(answer.last[wrong[0]].x)} m" if wrong else "yes"
    expected = (
        f"at {shown(alone.last[wrong[0]].x)} m, where projectObjects puts it" if wrong else "yes"
    )
    return judged(
        "edges in a step",
        "loop",
        "After a step, is a sphere beyond an edge where projectObjects puts it?",
        got,
        expected,
        not wrong,
        NOT_WRAPPED if stayed(question, answer) else "",
    )


def name_of(*spheres: int) -> str:
    """The name of a sphere in messages."""
    return " and ".join("the ufo" if k == 0 else f"asteroid {k - 1}" for k in spheres)


def edges(
    question: Question, answer: SolverAnswer, start: list[list[float]], ufo: bool
) -> list[CheckRow]:
    """The rows on projectObjects: an asteroid beyond an edge enters at the opposite one; a ufo that
    leaves is set back to its start."""
    pairs = list(zip(question.balls, answer.last))[1:]
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
    asked = "Is an asteroid beyond an edge moved to the opposite edge?"
    rows = [judged("edges", "loop", asked, got, expected, not cause, cause)]
    if ufo:
        home, place = start[0][:2], answer.last[0].x
        asked = "Is a ufo that leaves the box moved back to its start?"
        cause = "projectObjects does not move it back"
        got, expected = f"it is at {shown(place)} m", f"at {shown(home)} m"
        rows.append(judged("ufo", "loop", asked, got, expected, near(place, home), cause))
    return rows


def wrong_at_edge(
    edge: tuple[str, tuple[float, float]], pair: tuple[Ball, Ball]
) -> tuple[str, str, str] | None:
    """The result for a sphere beyond this edge, the expected result, and the likely cause; None if
    it is right."""
    (name, onto), (before, after) = edge, pair
    if not near(after.x, onto):
        got = f"one beyond the {name} edge, at {shown(before.x)} m, is set to {shown(after.x)} m"
        return got, f"it is set to {shown(onto)} m", "projectObjects puts it in the wrong place"
    if not near(after.v, before.v):
        got = f"one beyond the {name} edge flies on at {shown(after.v)} m/s"
        return got, f"at {shown(before.v)} m/s, as it came", "projectObjects changes its velocity"
    return None
