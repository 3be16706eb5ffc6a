"""Reads the numbers of the page from the tables of the comparisons: the summary, the map, the table
of a scenario."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import NamedTuple

import numpy as np

from crosscheck2d.adapters.engines import OWN
from crosscheck2d.adapters.friction import REFUSAL
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.against import ITSELF
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.verdicts import VERDICTS, fails, failures_at
from crosscheck2d.reports.compare.view import NOT_JUDGED
from crosscheck2d.reports.page import pooled, situations
from crosscheck2d.reports.page.style import TRUTH, heat, number
from crosscheck2d.reports.terminal.counts import counted

OUTCOMES = {
    "unsupported": "refused",
    "diverged": "diverged",
    "error": "error",
    "crashed": "crashed",
    "timeout": "time-out",
}
MAPPED = "position_max_radii"
NO_FRICTION = "no friction"  # text for an engine without a model of friction


class OverviewCell(NamedTuple):
    """A cell of a table: text, a longer remark, a step of the heat ramp (-1: none), failed, the
    best, one of `pooled.flukes`, of how many collisions it speaks; for a median also its value, the
    worst value as text, its scene, and of how many scenes it is."""

    text: str
    remark: str = ""
    heat: int = -1
    failed: bool = False
    best: bool = False
    fluke: bool = False
    share: str = ""
    value: float = np.nan
    worst: str = ""
    worst_in: str = ""
    scenes: int = 0


class TableNumber(NamedTuple):
    """A number of the tables: value, remark, and whether it is judged; if not, the remark says
    why."""

    value: float
    remark: str
    judged: bool

    @property
    def text(self) -> str:
        """The text in a table."""
        return number(self.value) if self.judged else NOT_JUDGED


Found = dict[tuple[str, str], TableNumber]  # (`engine:profile`, metric) -> its number


class SummaryColumn(NamedTuple):
    """A column of the summary, lower is better: heading, unit, what it means in a line, and the
    unit in nine letters for a terminal."""

    title: str
    unit: str
    meaning: str
    short: str


class FailedRuns(NamedTuple):
    """The runs of one engine that did not play a scenario to its end, for one reason."""

    name: str
    outcome: str
    reason: str
    steps: str


SUMMARY: dict[str, SummaryColumn] = {
    MAPPED: SummaryColumn(
        "Position", "radii", "largest distance of any disk from its exact position", "radii"
    ),
    "momentum_error": SummaryColumn(
        "Momentum", "of Σ m|v|", "largest difference from the expected momentum", "of Σ m|v|"
    ),
    "energy_error": SummaryColumn(
        "Energy",
        "of the energy at hand",
        "largest difference from the expected energy",
        "of energy",
    ),
    "restitution_error": SummaryColumn(
        "Restitution",
        "no unit",
        "largest |e measured − e of the scene| of any collision",
        "in e",
    ),
    "wrong_collisions": SummaryColumn(
        "Wrong collisions",
        "number",
        "missed and spurious collisions of a scene together",
        "number",
    ),
    "fails": SummaryColumn(
        "Fails", "scenes", "a verdict: tunnels, sinks, gains energy (list verdicts)", "scenes"
    ),
    "failed": SummaryColumn(
        "Not played", "scenes", "refused, crashed, diverged or timed out", "scenes"
    ),
}
COUNTED = ("fails", "failed")  # columns that count scenes


def names_of(comparisons: Iterable[Comparison]) -> list[str]:
    """Every requested `engine:profile`, in the order of appearance."""
    return list(dict.fromkeys(run.name for comparison in comparisons for run in comparison.runs))


@laws.cached
def values(comparison: Comparison) -> Found:
    """The numbers of a scenario at the middle dt, against the truth or else the laws of physics."""
    table = comparison.table
    near = table.dt_s == comparison.middle_dt
    found: Found = {}
    for versus in (ITSELF, TRUTH):  # the truth comes last and replaces the laws
        rows = table[near & (table.versus == versus) & table.metric.isin([*METRICS, *VERDICTS])]
        for row in rows.to_dict("records"):
            where = (
                f"disk {row['disk']}"
                if row["disk"] >= 0 and comparison.scenario.scene.n > 1
                else ""
            )
            when = f"at {row['at_s']:.4g} s" if np.isfinite(row["at_s"]) else ""
            remark = ", ".join(filter(None, (where, when, str(row["note"]))))
            judged = not str(row["note"]).startswith(NOT_JUDGED)
            found[f"{row['engine']}:{row['profile']}", str(row["metric"])] = TableNumber(
                row["value"], remark, judged
            )
    return found


def failures(comparison: Comparison) -> list[FailedRuns]:
    """Every run that is not "ok", grouped by engine and reason."""
    steps: dict[tuple[str, str, str], list[str]] = {}
    for run in comparison.runs:
        if run.status != "ok":
            outcome = OUTCOMES.get(run.status, run.status), run.reason
            key = (run.name, NO_FRICTION if not_modelled(outcome) else outcome[0], run.reason)
            steps.setdefault(key, []).append(number(run.dt))
    return [FailedRuns(*key, ", ".join(dts)) for key, dts in steps.items()]


def outcome_at_middle_dt(comparison: Comparison) -> dict[str, tuple[str, str]]:
    """`engine:profile` -> (what happened, reason) of the runs at the middle dt that are not
    "ok"."""
    return {
        run.name: (OUTCOMES.get(run.status, run.status), run.reason)
        for run in comparison.middle_runs
        if run.status != "ok"
    }


def summary(
    comparisons: Sequence[Comparison], names: Sequence[str], untrusted: Set[str]
) -> dict[str, list[OverviewCell]]:
    """`engine:profile` -> a cell for each of `SUMMARY`: the median over the scenarios and the worst
    of them; the last two count the scenarios that fail a verdict, and those not played. Both are
    infinitely far off in each median.

    A scene that a solver's own file refuses, because the file is written for another restitution,
    does not count; a file that refuses all of them was not asked. The best is the lowest of its
    group (`situations.grouped`), and all that show the same number. Engines in `untrusted` broke
    the protocol of the harness and are not scored.
    """
    found = [values(comparison) for comparison in comparisons]
    failed = [outcome_at_middle_dt(comparison) for comparison in comparisons]
    scores = pooled.scores(comparisons)
    scored = set(scores.scenario)
    broken = [failures_at(each.table, each.middle_dt) for each in comparisons]
    rows: dict[str, list[OverviewCell]] = {}
    for name in names:
        lost = [
            name in fails or (name in each and not refused_by_file(name, each))
            for each, fails in zip(failed, broken)
        ]
        count = sum(name in fails for fails in broken)
        failure = "fails" if count else "not played"
        cells = [
            pool(metric, name, comparisons, found, lost, scored, failure)
            for metric in SUMMARY
            if metric not in COUNTED
        ]
        played = sum(name not in each for each in failed)
        cells.append(
            OverviewCell(f"{count} of {played}", failed=count > 0, value=count)
            if played
            else OverviewCell("–", "no scene was played")
        )
        if name in untrusted:
            untested = OverviewCell(
                "breaks", "breaks the protocol or a law: not scored", failed=True
            )
            cells = [untested] * len(cells)
        asked = [each for each in failed if not refused_by_file(name, each)]
        count = sum(name in each for each in asked)
        cells.append(
            OverviewCell(f"{count} of {len(asked)}", failed=count > 0, value=count)
            if asked
            else OverviewCell("not asked", "the file refuses every scene")
        )
        if failed and all(not_modelled(each.get(name)) for each in failed):
            cells = [OverviewCell("–", REFUSAL) for _ in cells[:-1]] + [OverviewCell(NO_FRICTION)]
        rows[name] = cells
    groups = situations.grouped(names)
    marked = [mark_best({name: rows[name] for name in each}, untrusted) for each in groups.values()]
    return {name: each[name] for name in names for each in marked if name in each}


def with_numbers(
    rows: Mapping[str, list[OverviewCell]],
) -> tuple[list[SummaryColumn], dict[str, list[OverviewCell]]]:
    """The columns of `SUMMARY`, and the rows of `summary`, without those in which no engine has a
    number."""
    kept = [
        k
        for k in range(len(SUMMARY))
        if not rows or any(not np.isnan(cells[k].value) for cells in rows.values())
    ]
    columns = list(SUMMARY.values())
    return [columns[k] for k in kept], {
        name: [cells[k] for k in kept] for name, cells in rows.items()
    }


def not_modelled(outcome: tuple[str, str] | None) -> bool:
    """Whether an engine refused a scene because it does not model friction, which is not a
    failure."""
    return outcome is not None and REFUSAL in outcome[1]


def refused_by_file(name: str, outcomes: Mapping[str, tuple[str, str]]) -> bool:
    """Whether a solver's own file refused a scene; `outcomes`: those of the engines that did not
    play it."""
    return name.endswith(OWN) and outcomes.get(name, ("", ""))[0] == OUTCOMES["unsupported"]


def mark_best(
    rows: Mapping[str, list[OverviewCell]], untrusted: Set[str]
) -> dict[str, list[OverviewCell]]:
    """The rows with the lowest of each column marked, and all that show the same number."""
    scored = [rows[name] for name in rows if name not in untrusted]
    if not scored:
        return dict(rows)
    lowest = [
        min(column, key=lambda cell: np.inf if np.isnan(cell.value) else cell.value).text
        for column in zip(*scored)
    ]
    return {
        name: [
            cell._replace(best=name not in untrusted and cell.text == best and best != "–")
            for cell, best in zip(cells, lowest)
        ]
        for name, cells in rows.items()
    }


def pool(
    metric: str,
    name: str,
    comparisons: Sequence[Comparison],
    found: Sequence[Found],
    lost: Sequence[bool],
    scored: Set[str],
    failure: str,
) -> OverviewCell:
    """Median and worst of a metric over the scenarios in which it is judged, and their number.

    In those that are `lost` the engine fails, which counts as an infinite error where the metric
    is judged of any engine; the position where it is `scored`.

    Wrong collisions are the missed and the spurious ones of a scene together; if the truth has no
    collision, only the spurious ones.
    """
    kinds = (
        ("collisions_missed", "collisions_spurious") if metric == "wrong_collisions" else (metric,)
    )
    known = [[each[name, kind] for kind in kinds if (name, kind) in each] for each in found]
    totals = {
        comparison.scenario.name: sum(one.value for one in each if one.judged)
        for comparison, each in zip(comparisons, known)
        if any(one.judged for one in each)
    }
    left_out = sum(bool(each) for each in known) - len(totals)
    for comparison, numbers, is_lost in zip(comparisons, found, lost):
        scene = comparison.scenario.name
        applies = any(key in kinds and number.judged for (_, key), number in numbers.items())
        if is_lost and (scene in scored if metric == MAPPED else applies):
            totals[scene] = np.inf
    less = f", {NOT_JUDGED} in {left_out}" if left_out else ""
    remark = f"in {counted(len(totals), 'scene')}{less}"
    if not totals:
        return OverviewCell(number(np.nan), remark)
    value, worst_in = float(np.median(list(totals.values()))), max(totals, key=totals.__getitem__)
    worst = totals[worst_in]
    text, worst_text = (failure if np.isinf(each) else number(each) for each in (value, worst))
    return OverviewCell(
        text,
        remark,
        value=value,
        worst=worst_text if worst else "",
        worst_in=worst_in,
        scenes=len(totals),
    )


def heat_map(
    comparisons: Sequence[Comparison], names: Sequence[str]
) -> dict[str, list[OverviewCell]]:
    """scenario -> a cell for each name: the largest position error in radii, or why there is
    none: the verdict that fails, in words, or what ended the run."""
    rows = {}
    flukes = set(pooled.flukes(pooled.scores(comparisons)))
    for comparison in comparisons:
        found, failed = values(comparison), outcome_at_middle_dt(comparison)
        played = {run.name for run in comparison.middle_runs}
        broken = failures_at(comparison.table, comparison.middle_dt)
        cells = []
        for name in names:
            if name in failed:
                cells.append(outcome_cell(failed[name]))
            elif name in broken:
                off = found.get((name, MAPPED))
                remark = f"{off.text} radii off where an exact answer says it" if off else ""
                cells.append(OverviewCell(broken[name], remark, failed=True))
            elif (name, MAPPED) in found:
                value, remark, judged = found[name, MAPPED]
                cells.append(
                    OverviewCell(
                        number(value, 2),
                        remark,
                        heat(value),
                        fluke=(comparison.scenario.name, name) in flukes,
                    )
                    if judged
                    else OverviewCell(NOT_JUDGED, remark)
                )
            elif name in played:
                cells.append(OverviewCell("no truth", comparison.scenario.without_truth))
            else:
                cells.append(OverviewCell("–", "not asked to play"))
        rows[comparison.scenario.name] = cells
    return rows


def outcome_cell(outcome: tuple[str, str]) -> OverviewCell:
    """The cell of a run that was not played to its end."""
    if not_modelled(outcome):
        return OverviewCell(NO_FRICTION, outcome[1])
    return OverviewCell(*outcome, failed=True)


def scenario_table(
    comparison: Comparison, names: Sequence[str]
) -> list[tuple[str, str, str, list[OverviewCell]]]:
    """(metric, unit, which value is better, a cell for each name) of every metric of this
    scenario, and of every verdict that an engine fails."""
    found, failed = values(comparison), outcome_at_middle_dt(comparison)
    table = fails(comparison.table[comparison.table.dt_s == comparison.middle_dt])
    broken = {*zip(table.engine + ":" + table.profile, table.metric)}
    kinds = {key: (kind.unit, "lower") for key, kind in VERDICTS.items() if key in {*table.metric}}
    kinds |= {key: (metric.unit, metric.better) for key, metric in METRICS.items()}
    rows = []
    for key, (unit, best) in kinds.items():
        if not any((name, key) in found for name in names):
            continue
        cells = []
        for name in names:
            if (name, key) in found:
                _, remark, _ = cell = found[name, key]
                share, is_broken = share_of(key, remark), (name, key) in broken
                cells.append(OverviewCell(cell.text, remark, failed=is_broken, share=share))
            else:
                cells.append(outcome_cell(failed[name]) if name in failed else OverviewCell("–"))
        better = {"lower": "↓", "higher": "↑", "zero": "◦", "as stated": "="}[best]
        rows.append((key, "" if unit == "1" else unit, better, cells))
    return rows


def share_of(metric: str, remark: str) -> str:
    """For a metric that counts collisions: "43 of 86 judged", or for their number "48 of 86", where
    the two differ; else ""."""
    found = re.search(r"(\d+) of (\d+)( collisions)?( judged)?", remark)
    if not metric.startswith("collision") or found is None or found[1] == found[2]:
        return ""
    return f"{found[1]} of {found[2]}{found[4] or ''}"


def between_engines(comparison: Comparison, names: Sequence[str]) -> dict[str, list[OverviewCell]]:
    """name -> the largest deviation, in radii, of its trajectory from that of each other name; {}
    if there is no pair."""
    table = comparison.table
    near = table.dt_s == comparison.middle_dt
    deviations: dict[frozenset[str], float] = {}
    for row in table[near & (table.metric == MAPPED) & table.versus.isin(list(names))].to_dict(
        "records"
    ):
        deviations[frozenset((f"{row['engine']}:{row['profile']}", str(row["versus"])))] = float(
            row["value"]
        )
    if not deviations:
        return {}

    def cell(one: str, other: str) -> OverviewCell:
        value = deviations.get(frozenset((one, other)))
        return (
            OverviewCell("–") if value is None else OverviewCell(number(value, 2), "", heat(value))
        )

    return {one: [cell(one, other) for other in names[:k]] for k, one in enumerate(names)}


Settings = dict[tuple[str, str], tuple[str, str]]


def settings(comparison: Comparison) -> Settings:
    """(`engine:profile`, setting) -> (asked, used) at the middle dt; asked "–" for the engine's
    default."""
    return {
        (run.name, setting): (number(asked, 6), number(used, 6))
        for run in comparison.middle_runs
        for setting, (asked, used) in run.settings.items()
    }


def common_settings(comparisons: Sequence[Comparison]) -> Settings:
    """The settings that are equal in all scenarios, so that a scenario need only show its own."""
    common: Settings = {}
    otherwise: set[tuple[str, str]] = set()
    for comparison in comparisons:
        for key, pair in settings(comparison).items():
            if common.setdefault(key, pair) != pair:
                otherwise.add(key)
    return {key: pair for key, pair in common.items() if key not in otherwise}
