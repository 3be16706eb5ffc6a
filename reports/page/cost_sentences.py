"""What error against cost says, in three sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from crosscheck2d.reports.compare.order import FINEST
from crosscheck2d.reports.compare.pareto import NEAR, front, kept_from
from crosscheck2d.reports.compare.pooling import UNSURE, middle_half
from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.cost_points import bare, by_engine, no_nearer
from crosscheck2d.reports.run.timing_pass import BUSY
from crosscheck2d.reports.terminal.counts import counted

MARGIN = 1 + BUSY  # costs closer than the accepted noise count as equal


def sentences(found: pd.DataFrame, table: pd.DataFrame, fault: str) -> list[str]:
    """Three sentences on error and cost: the engines that no other beats in both, the cheapest for
    an error of `NEAR` radii, the effect of halving the step. Without times two, on errors.

    table: the points of the first picture; `found` has those scene by scene.
    """
    if fault:
        return [nearest(table), halving(table, False)]
    return [unbeaten(table), cheapest(found), halving(table, True)]


def unbeaten(table: pd.DataFrame) -> str:
    """The engines for which no other is both nearer and cheaper; and those that would join them
    without the binding's part."""
    rows = table[table.cost.notna() & np.isfinite(table.error)]
    rows = rows.assign(name=rows.engine + ":" + rows.profile, bare=bare(rows))
    if rows.empty:
        return "No engine has both a time and an error."
    best, joining = front_of(rows)
    rest = rows[~rows.name.isin(rows.name[rows.error <= FINEST])]
    others, joining_others = front_of(rest)
    said = (
        f"No engine is both nearer to the exact answer and cheaper, per simulated second, than"
        f" {', '.join(best)}."
    )
    if len(rest) < len(rows) and others:
        said += (
            " Among the engines that are not right to a millionth of a radius, the same is true of"
            f" {', '.join(others)}."
        )
    if names := list(dict.fromkeys([*joining, *joining_others])):
        said += f" If calls from Python cost nothing, it is also true of {', '.join(names)}."
    return said


def front_of(rows: pd.DataFrame) -> tuple[list[str], list[str]]:
    """The engines on the Pareto front, each with error and cost of its cheapest point there; and
    the names of those that only the binding's part keeps off it."""
    error = np.maximum(rows.error.to_numpy(float), FINEST)
    cost, names = rows.cost.to_numpy(float), rows.name.tolist()
    best: dict[str, str] = {}
    for k in front(cost, error):
        numbers = style.number(rows.error.iloc[k], 2), style.number(cost[k], 2)
        best.setdefault(names[k], f"{numbers[0]} radii for {numbers[1]} µs")
    bare_best = dict.fromkeys(names[k] for k in front(rows.bare.to_numpy(float), error))
    joining = [name for name in bare_best if name not in best]
    return [f"{name} ({numbers})" for name, numbers in best.items()], joining


def cheapest(found: pd.DataFrame) -> str:
    """The engine of least cost for an error of `NEAR` radii, scene by scene, each at its cheapest
    step size; none where only the binding decides."""
    wins: dict[str, list[float]] = {}
    even = 0
    scenes = list(dict.fromkeys(found.scenario))
    for scene in scenes:
        ways = [
            way
            for _, _, group in by_engine(found[found.scenario == scene])
            for way in cheapest_step(group)
        ]
        if not ways:
            continue
        name, cost, left = min(ways, key=lambda way: way[1])
        rivals = [other for other in ways if other[0] != name]
        if all(surely_less((cost, left), (c, b)) for _, c, b in rivals):
            wins.setdefault(name, []).append(cost)
        else:
            even += 1
    if not wins and not even:
        return f"No engine keeps within {NEAR:g} radii in any of {counted(len(scenes), 'scene')}."
    of = f"Of {counted(len(scenes), 'scene')}"
    if not wins:
        return f"In none {of.lower()} one engine is clearly the cheapest within {NEAR:g} radii."
    parts = [
        f"{name} in {len(costs)} ({style.number(middle_half(np.array(costs)), 2)} µs)"
        for name, costs in sorted(wins.items(), key=lambda item: -len(item[1]))
    ]
    parts += [f"in {even} none is clearly the cheapest"] if even else []
    nowhere = len(scenes) - even - sum(map(len, wins.values()))
    parts += [f"in {nowhere} none has so small an error"] if nowhere else []
    return (
        f"{of}, the cheapest engine with an error of at most {NEAR:g} radii is {', '.join(parts)}."
        " It is the same engine if calls from Python cost nothing."
    )


def surely_less(mine: tuple[float, float], theirs: tuple[float, float]) -> bool:
    """Whether one (cost, cost without the binding's part) is less than another in both numbers, by
    more than their noise."""
    (cost, left), (other, other_left) = mine, theirs
    return MARGIN * cost < other and left + UNSURE * cost < other_left - UNSURE * other


def cheapest_step(group: pd.DataFrame) -> Iterator[tuple[str, float, float]]:
    """(name, cost, cost without the binding's part) of the cheapest step size from which on the
    error is at most `NEAR`; empty if there is none."""
    group = group.sort_values("step_size")
    held = group[kept_from(group.error.to_numpy(float), NEAR) & group.cost.notna().to_numpy()]
    if len(held):
        k = int(np.argmin(held.cost.to_numpy(float)))
        row = held.iloc[k]
        yield f"{row.engine}:{row.profile}", float(row.cost), float(bare(held)[k])


def nearest(table: pd.DataFrame) -> str:
    """The engines nearest to the exact answer at the finest step size, and the farthest."""
    finest = table[table.step_size == table.step_size.max()].sort_values("error", kind="stable")
    finest = finest[np.isfinite(finest.error)]
    if finest.empty:
        return "No engine was played to its end."
    said = [
        f"{row['engine']}:{row['profile']} ({style.number(row['error'], 2)} radii)"
        for row in finest.to_dict("records")
    ]
    last = f", last {said[-1]}" if len(said) > 3 else ""
    return (
        f"Nearest to the exact answer at the smallest step size: {', then '.join(said[:3])}{last}."
    )


def halving(table: pd.DataFrame, timed: bool) -> str:
    """The mean effect of halving the step on time and error, from the coarsest to the finest step,
    and the engines whose error it does not reduce. (A single halving may do more, or increase the
    error.)"""
    dearer, nearer, stuck = [], [], []
    for engine, profile, group in by_engine(table):
        fine = group[group.cost.notna() & np.isfinite(group.error)].sort_values("step_size")
        error, cost = fine.error.to_numpy(float), fine.cost.to_numpy(float)
        if len(fine) < 2 or error[0] <= FINEST:
            continue
        halvings = fine.step_size.iloc[-1] - fine.step_size.iloc[0]
        if no_nearer(fine):
            stuck.append(f"{engine}:{profile}")
        else:
            dearer.append((cost[-1] / cost[0]) ** (1 / halvings))
            nearer.append((error[0] / max(error[-1], FINEST)) ** (1 / halvings))
    if not nearer and not stuck:
        return "At every step size all engines are right to a millionth of a radius."
    spent = ", at more cost" if timed else ""
    lost = f"bring{{}} {', '.join(stuck)} no nearer to the exact answer here{spent}."
    if not nearer:
        return f"Smaller steps {lost.format('')}"
    costs = f"multiplies the time by {span(dearer)} and " if timed else ""
    said = f"On average, halving the step {costs}divides the error by {span(nearer)}"
    return (
        f"{said}; it {lost.format('s')}" if stuck else f"{said}, for every engine that takes steps."
    )


def span(ratios: Sequence[float]) -> str:
    """The range of the ratios as text."""
    low, high = f"{min(ratios):.1f}", f"{max(ratios):.1f}"
    return low if low == high else f"{low} to {high}"
