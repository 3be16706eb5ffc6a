"""The questions: a few spheres each, on which a solver's functions are called; and the answers,
which must not depend on earlier questions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from crosscheck2d.adapters.host.engine import BEGIN_LIMIT
from crosscheck2d.adapters.host.file import SolverFailed
from crosscheck2d.adapters.host.process import Request, SolverProcess
from crosscheck2d.reports.check.rows import TOLERANCE
from crosscheck2d.scenarios.model import Array

LIMIT = 1.0  # s a question may take: it needs a few microseconds
TOGETHER = 50  # fresh worlds in a request, because its time is limited, too
LOADING = 3.0  # s that loading the file again may take


class Ball(NamedTuple):
    """A sphere of the exercise: vectors x, v, F in m, m/s, N; angle, spin, torque, mass, MoI and
    size in SI."""

    x: tuple[float, float]
    v: tuple[float, float] = (0.0, 0.0)
    F: tuple[float, float] = (0.0, 0.0)
    alpha: float = 0.0
    w: float = 0.0
    torque: float = 0.0
    m: float = 1.0
    MoI: float = 1.0
    r: float = 0.5

    def numbers(self) -> list[float]:
        """The 12 numbers from which the worker makes a sphere."""
        return [
            *self.x,
            *self.v,
            *self.F,
            self.alpha,
            self.w,
            self.torque,
            self.m,
            self.MoI,
            self.r,
        ]


def ball(numbers: Iterable[float]) -> Ball:
    """A sphere from its 12 numbers."""
    n = [*map(float, numbers)]
    return Ball((n[0], n[1]), (n[2], n[3]), (n[4], n[5]), *n[6:])


class Question(NamedTuple):
    """Spheres and the calls on them; `world`: use the file's own ufo and asteroids; `watch`: record
    the calls that the file makes to its own functions."""

    balls: tuple[Ball, ...]
    calls: tuple[tuple[Any, ...], ...]
    world: bool = False
    watch: bool = False

    @property
    def request(self) -> dict[str, object]:
        """The request to the worker."""
        spheres = [b.numbers() for b in self.balls]
        return {
            "spheres": spheres,
            "calls": self.calls,
            "world": self.world,
            "watch": self.watch,
        }


NOTHING = Question((), ())


@dataclass(frozen=True)
class SolverAnswer:
    """The answer to a question.

    Attributes:
        balls: the spheres after each call; for a failed question those of the calls before it, or
            those found by `left_by` of failing.py.
        returned: whether a function returned an object.
        strayed: whether the file's own ufo or asteroids changed, though they were not arguments.
        strange: fields that the spheres did not have before.
        kept: global numbers of the file that the calls have changed.
        calls: the calls of the file, for a watched question: ("integrate", sphere, dt),
            ("collide", sphere, sphere), ("wrap",).
        failed: how it failed, or None.
        asked: the question.
    """

    balls: list[list[Ball]]
    returned: bool = False
    strayed: bool = False
    strange: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()
    calls: tuple[tuple[Any, ...], ...] = ()
    failed: SolverFailed | None = None
    asked: Question = NOTHING

    @property
    def last(self) -> list[Ball]:
        """The spheres after the last call."""
        return self.balls[-1]


def forced(dt: float, **changes: Any) -> Question:
    """A sphere with a force and a torque, integrated once; its mass and inertia do not fit a solid
    disk."""
    plain = Ball((0.3, -0.7), (1.1, -0.4), (2.0, 3.0), 0.2, 0.9, 0.7, 1.7, 0.6, 0.25)
    return Question((plain._replace(**changes),), (("integrate", 0, dt),))


def pair(a: Ball, b: Ball, first: int = 0) -> Question:
    """Two spheres given to the collision function, in this order or the other."""
    return Question((a, b), (("collide", first, 1 - first),))


def meeting(
    masses: tuple[float, float],
    va: tuple[float, float],
    vb: tuple[float, float],
    turn: float,
    depth: float = 0.12,
) -> Question:
    """Two spheres of 0.5 and 0.3 m that overlap by `depth` m, with b in the direction `turn` rad
    from a."""
    d = 0.8 - depth
    a = Ball((0.2, -0.1), va, (0.5, -0.3), 0.4, 0.6, 0.2, masses[0], 0.7, 0.5)
    b = Ball(
        (0.2 + d * np.cos(turn), -0.1 + d * np.sin(turn)),
        vb,
        (-0.2, 0.1),
        -0.3,
        -0.5,
        0.1,
        masses[1],
        0.3,
        0.3,
    )
    return pair(a, b)


# m; sums below, near and above 1, where squares differ from the values
SIZES = ((0.25, 0.5), (0.6, 0.35), (1.5, 0.75), (0.9, 0.9))
TURNS = (0.0, 0.65, 1.57, 3.6)  # rad
# distances over the sum of sizes
SHARES = (0.1, 0.3, 0.45, 0.6, 0.7, 0.85, 0.97, 1.03, 1.15, 1.3, 1.6, 2.2, 4.0)
COLLISIONS = {
    "collision/light on heavy": meeting((1.3, 5.1), (1.4, 0.3), (-0.6, 0.5), 0.5),
    "collision/heavy on light": meeting((4.2, 0.9), (0.7, -1.1), (0.2, 0.8), -1.1),
    "collision/from behind": meeting((2.0, 3.0), (2.1, 0.4), (0.5, 0.1), 0.2),
    "collision/upwards": meeting((0.8, 2.9), (-0.2, 1.9), (0.3, -0.7), 1.9),
    "collision/shallow": meeting((3.3, 1.2), (1.2, 0.9), (-0.9, -0.2), 0.4, 0.02),
}


def head_on(speed: float) -> Question:
    """Two equal spheres that meet along x, closing at `speed` m/s."""
    return pair(Ball((-0.45, 0.0), (speed / 2, 0.0)), Ball((0.45, 0.0), (-speed / 2, 0.0)))


def questions() -> dict[str, Question]:
    """All questions by name, except those about the file's own scene."""
    found = {
        "force": forced(0.1),
        "force, other numbers": forced(
            0.03, x=(-1.2, 0.4), v=(-0.5, 0.8), F=(-1.5, 4.0), m=0.6, MoI=1.9, w=-0.7
        ),
        "coast": forced(0.1, F=(0.0, 0.0), torque=0.0),
        "force twice": Question(forced(0.1).balls, (("integrate", 0, 0.1), ("integrate", 0, 0.1))),
        "turned": forced(0.1, F=(0.0, 0.0), torque=0.0, alpha=3.1, w=2.0),
        "turned far": forced(0.1, F=(0.0, 0.0), torque=0.0, alpha=6.2, w=2.0),
        "turned back": forced(0.1, F=(0.0, 0.0), torque=0.0, alpha=-3.1, w=-2.0),
        "touch": pair(Ball((0.0, 0.0), (1.0, 0.0), r=0.25), Ball((0.75, 0.0), (-1.0, 0.0), r=0.5)),
        "at rest to each other": meeting((1.3, 5.1), (0.3, 0.2), (0.3, 0.2), 0.5),
        "at rest, other velocity": meeting((1.3, 5.1), (-0.7, 0.4), (-0.7, 0.4), 0.5),
        "separate": meeting((1.3, 5.1), (-1.1, 0.2), (0.7, 0.4), 0.5),
        "separate, other numbers": meeting((2.2, 1.7), (-0.3, -0.9), (0.2, 1.1), 1.3),
        "slow": head_on(2e-3),
        "even": head_on(2.0),
        "fast": head_on(200.0),
    } | COLLISIONS
    found |= {
        name.replace("collision/", "swapped/"): question._replace(calls=(("collide", 1, 0),))
        for name, question in COLLISIONS.items()
    }
    for k, (ra, rb, turn, share) in enumerate(
        (*s, t, f) for s in SIZES for t in TURNS for f in SHARES
    ):
        n, d = np.array([np.cos(turn), np.sin(turn)]), share * (ra + rb)
        a = Ball((0.4, 0.3), tuple(0.9 * n), r=ra, m=1.3)
        found[f"reach/{k}"] = pair(
            a, Ball(tuple(np.array(a.x) + d * n), tuple(-0.9 * n), r=rb, m=2.1)
        )
    # last, so that the others are answered if this call never returns
    found["same centre"] = pair(Ball((0.1, 0.2), (1.0, 0.5)), Ball((0.1, 0.2), (-0.5, 0.3), m=2.0))
    return found


QUESTIONS = questions()
# Their exact numbers are what they are about: a distance, or a speed at a threshold.
EXACT = ("touch", "same centre", "slow", "even", "fast")
MOTION = ("force", "coast", "turned")  # questions on one sphere, which are compared


def vary(name: str, question: Question, seed: int) -> Question:
    """A question with other numbers for the same situation: the pair elsewhere, and masses, speeds
    and forces larger by up to a tenth. Distances, angles and the signs of all numbers stay."""
    alike = "motion" if name.startswith(MOTION) else name.removeprefix("swapped/")
    draws = np.random.default_rng([seed, *alike.removeprefix("collision/").encode()])
    dx, dy = map(float, draws.uniform(-0.5, 0.5, 2))
    v, F, w, torque, m, MoI = map(float, draws.uniform(1.0, 1.1, 6))
    return question._replace(
        balls=tuple(
            b._replace(
                x=(b.x[0] + dx, b.x[1] + dy),
                v=(v * b.v[0], v * b.v[1]),
                F=(F * b.F[0], F * b.F[1]),
                w=w * b.w,
                torque=torque * b.torque,
                m=m * b.m,
                MoI=MoI * b.MoI,
            )
            for b in question.balls
        )
    )


@lru_cache(maxsize=1)  # a class is asked with one seed
def use_seed(seed: int) -> None:
    """Ask with the numbers of a seed from now on; 0: those above. A recording of the answers to
    one seed is worth nothing at another."""
    for name, question in questions().items():
        fixed = not seed or name in EXACT
        QUESTIONS[name] = question if fixed else vary(name, question, seed)
    for name in ON_COLLISIONS:
        CLOSER[name], APART[name] = closer(QUESTIONS[name], 0.35), closer(QUESTIONS[name], 1.5)


def closer(question: Question, share: float) -> Question:
    """A question on two spheres, with their distance multiplied by `share`."""
    a, b = question.balls
    place = np.array(a.x) + share * np.subtract(b.x, a.x)
    return question._replace(balls=(a, b._replace(x=(float(place[0]), float(place[1])))))


ON_COLLISIONS = [
    name
    for name in QUESTIONS
    if name.startswith(("collision/", "swapped/", "at rest", "separate"))
    or name in ("slow", "even", "fast")
]
# The questions on 2b to 2d for a file that takes their overlaps for gaps: these are below the
# smaller of the two sizes.
CLOSER = {name: closer(QUESTIONS[name], 0.35) for name in ON_COLLISIONS}
# The same for a file in which only pairs with a gap between them collide.
APART = {name: closer(QUESTIONS[name], 1.5) for name in ON_COLLISIONS}


def ask(
    process: SolverProcess, asked: dict[str, Question], afresh: bool = False
) -> dict[str, SolverAnswer]:
    """The answers by name; `afresh`: ask each question in a fresh world, else all in the present
    one. Raises `SolverFailed` if the process is lost."""
    before = fresh_world(process) if afresh else []
    answers: dict[str, SolverAnswer] = {}
    # One request for all: the worker does not repeat a call that did not return.
    for names in batched(asked, TOGETHER if afresh else len(asked)):
        requests: list[Request] = []
        for name in names:
            requests += [*before, ("ask", asked[name].request, LIMIT)]
        replies = process.request(requests)[len(before) :: len(before) + 1]
        answers |= {name: answered(reply, asked[name]) for name, reply in zip(names, replies)}
    return answers


def batched(names: Iterable[str], size: int) -> Iterator[list[str]]:
    """The names in lists of at most `size`."""
    left = iter(names)
    while batch := list(islice(left, size)):
        yield batch


def fresh_world(process: SolverProcess) -> list[Request]:
    """Requests that load the file again and call its initScene."""
    begin: list[Request] = [("begin", None, BEGIN_LIMIT)] if process.functions["begin"] else []
    return [("renew", None, LOADING), *begin]


def renew(process: SolverProcess) -> None:
    """Begin a fresh world. Raises `SolverFailed` if the file cannot be loaded again."""
    loaded, *_ = process.request(fresh_world(process))
    if isinstance(loaded, SolverFailed):
        raise SolverFailed(loaded.kind, f"it can be loaded only once: {loaded}")


def ask_in_two_orders(
    process: SolverProcess, asked: dict[str, Question]
) -> tuple[dict[str, SolverAnswer], dict[str, SolverAnswer]]:
    """The answer to each question in a fresh world, and the answers that differ after other
    questions.

    A fresh world costs 10 ms in V8. So all questions are asked in one world, and in reverse order
    in a second one. If the answers agree, earlier questions do not matter. If not, each question is
    asked again in a fresh world.
    """
    renew(process)
    answers = ask(process, asked)
    if was_stopped(answers):
        return answers, {}
    renew(process)
    again = ask(process, dict(reversed(asked.items())))
    if all(name in BY_CHANCE or alike(answers[name], again[name]) for name in asked):
        return answers, {}
    alone = ask(process, asked, afresh=True)
    others = {
        name: other
        for name in asked
        if name not in BY_CHANCE
        for other in (answers[name], again[name])
        if not alike(alone[name], other)
    }
    return alone, others


BY_CHANCE = ("same centre",)  # without a normal a solver may choose one at random


def alike(one: SolverAnswer, other: SolverAnswer) -> bool:
    """Whether two answers agree about the spheres."""
    if bool(one.failed) != bool(other.failed) or len(one.balls) != len(other.balls):
        return False
    if one.balls == other.balls:  # as nearly all are: `allclose` takes 30 us
        return True
    first, second = (
        np.array([b.numbers() for balls in answer.balls for b in balls]) for answer in (one, other)
    )
    return np.allclose(first, second, rtol=TOLERANCE, atol=TOLERANCE, equal_nan=True)


def was_stopped(answers: dict[str, SolverAnswer]) -> bool:
    """Whether a call had to be stopped; it would have to be stopped again."""
    return any(
        answer.failed and answer.failed.kind in ("timeout", "memory") for answer in answers.values()
    )


def answered(reply: dict[str, Any] | SolverFailed, asked: Question) -> SolverAnswer:
    """The answer from a reply of the worker."""
    if isinstance(reply, SolverFailed):
        return SolverAnswer([], failed=reply, asked=asked)
    failed = reply["error"]
    balls = [[ball(numbers) for numbers in state] for state in reply["states"]]
    return SolverAnswer(
        balls,
        reply["returned"],
        reply["strayed"],
        tuple(reply["strange"]),
        tuple(reply["kept"]),
        tuple(map(tuple, reply["calls"])),
        failed,
        asked,
    )


def direction(a: Ball, b: Ball) -> tuple[Array, float]:
    """The unit vector from b to a, and the distance of their centres, m."""
    r = np.subtract(a.x, b.x)
    distance = float(np.hypot(*r))
    return r / distance, distance


def finite(answers: dict[str, SolverAnswer], part: str) -> bool:
    """Whether "x" or "v" of both spheres is a number after every collision."""
    return bool(
        np.isfinite([getattr(b, part) for name in COLLISIONS for b in answers[name].last]).all()
    )
