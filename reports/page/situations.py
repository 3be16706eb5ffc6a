"""Which engine for what: each scene belongs to a situation, and in each situation engines, the
reader's own solvers and this project's solvers are ranked separately."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from typing import NamedTuple

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.engines import OWN as OWN_PROFILE
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.scenarios.model import Scenario, Trajectory

FLIGHT, SINGLE, ROWS, STACKS, CROWDS, SPIN, FRICTION = (
    "Flight",
    "Single collisions",
    "Rows",
    "Stacks and rest",
    "Crowds",
    "Spin",
    "Friction",
)
ALL = "All scenes"
SITUATIONS = {
    FLIGHT: "no collisions in the exact answer",
    SINGLE: "at most two disks move, or no disk meets two others",
    ROWS: "two or more disks on one line, and a third body",
    STACKS: "gravity and e = 0: contacts that last",
    CROWDS: "disks that meet many others",
    SPIN: "a disk turns; these scenes also count above",
    ALL: "all situations above",
    FRICTION: "with friction; these scenes count in no other row",
}
YOURS, ENGINE = "Your solver", "Engines"
OWN, EXACT = "Solvers of this project", "Solvers of this project that order collisions by time"
RIGHT = 1e-6  # radii: a smaller error is right
FAR_OFF = 1.0  # radii: a larger error is visible
COLUMNS = ["scenario", "name", "error", "angle", "cost", "dt_s"]


def situations_of(scenario: Scenario, truth: Trajectory | None) -> list[str]:
    """The situation of a scene, of the first five of `SITUATIONS`, and `SPIN` if a disk turns;
    `FRICTION` alone of a scene with friction.

    truth: its collisions say which disks meet; without it all disks may meet.
    """
    scene = scenario.scene
    if scene.friction:
        return [FRICTION]
    moving = int(np.isfinite(scene.mass).sum())
    turns = bool(scene.angular_velocity.any()) or any(t.torque for t in scenario.thrusts)
    met = None if truth is None else partners(truth)
    if scene.gravity.any() and scene.restitution == 0:
        found = STACKS
    elif met == {}:
        found = FLIGHT
    elif moving > 1 and scene.n + len(scene.walls) > 2 and on_one_line(scenario):
        found = ROWS
    elif moving <= 2 or (met is not None and all(len(others) < 2 for others in met.values())):
        found = SINGLE
    else:
        found = CROWDS
    return [found, SPIN] if turns else [found]


def by_friction(comparisons: Sequence[Comparison]) -> tuple[list[Comparison], list[Comparison]]:
    """The scenes without friction, which medians, findings and pictures use, and those with
    friction, which have their own summary. If all have friction, they are the first."""
    smooth = [each for each in comparisons if not each.scenario.scene.friction]
    rough = [each for each in comparisons if each.scenario.scene.friction]
    return (smooth, rough) if smooth else (rough, [])


def partners(truth: Trajectory) -> dict[int, set[int]]:
    """Disk -> the other disks with which it collides; empty if it meets walls only."""
    met: dict[int, set[int]] = {}
    for i, j in zip(truth.collisions.i.tolist(), truth.collisions.j.tolist()):
        for one, other in ((i, j), (j, i)):
            if one >= 0:
                met.setdefault(one, set()).update({other} if other >= 0 else ())
    return met


def on_one_line(scenario: Scenario) -> bool:
    """Whether all centres lie on one line, with all velocities and gravity along it."""
    scene = scenario.scene
    spread = scene.position - scene.position[0]
    along = [spread, scene.velocity, scene.gravity[None]]
    rows = np.vstack([each / (np.abs(each).max() or 1.0) for each in along])
    return int(np.linalg.matrix_rank(rows, tol=1e-9)) <= 1


class Ranked(NamedTuple):
    """An engine in a situation.

    Attributes:
        name: `engine:profile`.
        median, worst: error over the scenes, radii (rad of an angle); inf: no result.
        worst_in: the scene of the worst.
        right: number of scenes with an error below `RIGHT`.
        fails: scene -> error, if above `FAR_OFF`, the worst first.
        cost: µs of engine time per simulated second, median of the timed scenes; nan if there are
            none.
    """

    name: str
    median: float
    worst: float
    worst_in: str
    right: int
    fails: Mapping[str, float]
    cost: float


class Recommendation(NamedTuple):
    """A row of the table: the best engine for a situation, and the other engines.

    Attributes:
        title, meaning, unit: of the situation.
        scenes: which belong to it.
        steps: s, the smallest and the largest step size of these scores.
        best, others: the engine nearest to the exact answers; and the best profile of each other
            engine, the nearest first.
        yours: the reader's own solvers, the best first.
        own: the best of `OWN`, if it is not `best` itself.
        exact: those of `EXACT`.
    """

    title: str
    meaning: str
    unit: str
    scenes: Sequence[str]
    steps: tuple[float, float]
    best: Ranked
    others: Sequence[Ranked]
    yours: Sequence[Ranked]
    own: Ranked | None
    exact: Sequence[Ranked]


def grouped(names: Iterable[str]) -> dict[str, list[str]]:
    """`YOURS`, `ENGINE`, `OWN`, `EXACT` -> their names in the given order; empty groups are left
    out.

    `YOURS` are solvers' files; `ENGINE` are libraries. This project's solvers belong to `EXACT` if
    their row says so, whatever scenes were played.
    """
    groups: dict[str, list[str]] = {YOURS: [], ENGINE: [], OWN: [], EXACT: []}
    for name in names:
        row = ENGINES.get(name)
        if name.endswith(OWN_PROFILE):
            groups[YOURS].append(name)
        elif row is None or row.outside:
            groups[ENGINE].append(name)
        else:
            groups[EXACT if row.orders_collisions else OWN].append(name)
    return {group: members for group, members in groups.items() if members}


def answers(
    scores: pd.DataFrame, situations: Mapping[str, Sequence[str]], untrusted: Set[str]
) -> list[Recommendation]:
    """A row for each situation that has a scene with an exact answer, and one for all scenes
    without friction if there are more.

    scores: columns `COLUMNS`: errors in radii and in rad, inf without a result, angle nan if not
        known; cost in µs per simulated second; dt in s.
    situations: scene -> its `situations_of`. Engines in `untrusted` are left out.
    """
    scores = scores[~scores.name.isin(untrusted)]
    rough = scores.scenario.map(lambda scene: FRICTION in situations[scene]).astype(bool)
    rows: list[Recommendation] = []
    for title, meaning in SITUATIONS.items():
        of_kind = scores[rough if title == FRICTION else ~rough]
        members = [s for s in dict.fromkeys(of_kind.scenario) if title in [*situations[s], ALL]]
        here = of_kind[of_kind.scenario.isin(members)]
        groups = grouped(dict.fromkeys(of_kind.name))
        ranked = next((groups[each] for each in (ENGINE, OWN, EXACT, YOURS) if each in groups), [])
        by_angle = title == SPIN and not here.angle.isna().all()
        if by_angle:
            here = here.assign(error=here.angle.fillna(np.inf))
        # a scene without exact answer has only the engines that fail a verdict in it
        judged = len(set(here.name)) == len(set(of_kind.name)) or np.isfinite(here.error).any()
        if members and judged and not (title == ALL and len(rows) < 2):
            rows.append(
                answer(title, meaning, "rad" if by_angle else "radii", here, groups, ranked)
            )
    return rows


def whole(rows: Sequence[Recommendation]) -> Recommendation | None:
    """The row of `answers` for all scenes without friction, or the last row."""
    smooth = [row for row in rows if row.title != FRICTION]
    return next(reversed(smooth or rows), None)


def answer(
    title: str,
    meaning: str,
    unit: str,
    here: pd.DataFrame,
    groups: Mapping[str, Sequence[str]],
    ranked: Sequence[str],
) -> Recommendation:
    """The row of one situation, from the scores of its scenes."""

    def in_order(names: Iterable[str]) -> list[Ranked]:
        found = [rank(name, here[here.name == name]) for name in names if name in set(here.name)]
        return sorted(found, key=lambda one: (one.median, one.worst))

    best, *rest = in_order(ranked) or in_order(dict.fromkeys(here.name))
    others: dict[str, Ranked] = {}
    for one in rest:
        engine = one.name.split(":")[0]
        if engine != best.name.split(":")[0]:
            others.setdefault(engine, one)
    own = in_order(groups.get(OWN, []))
    return Recommendation(
        title,
        meaning,
        unit,
        list(dict.fromkeys(here.scenario)),
        (float(here.dt_s.min()), float(here.dt_s.max())),
        best,
        list(others.values()),
        in_order(name for name in groups.get(YOURS, []) if name not in ranked),
        own[0] if own and own[0].name not in ranked else None,
        in_order(name for name in groups.get(EXACT, []) if name not in ranked),
    )


def rank(name: str, mine: pd.DataFrame) -> Ranked:
    """An engine ranked by its scores in some scenes."""
    errors = mine.set_index("scenario").error.sort_values(ascending=False, kind="stable")
    costs = mine.cost.dropna()
    return Ranked(
        name,
        float(errors.median()),
        float(errors.iloc[0]),
        str(errors.index[0]),
        int((errors < RIGHT).sum()),
        {str(scene): float(error) for scene, error in errors.items() if error > FAR_OFF},
        float(costs.median()) if len(costs) else np.nan,
    )
