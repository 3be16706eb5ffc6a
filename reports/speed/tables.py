"""The tables made from samples and errors: points, orders, cost of an accuracy, sizes, options,
noise floor."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.options import SWEEPS
from crosscheck2d.reports.compare.order import Order, median_interval, order_of
from crosscheck2d.reports.compare.pareto import (
    ACCURACIES,
    FAILED,
    NOT_REACHED,
    NOT_TIMED,
    UNREACHABLE,
    YARDSTICK,
    cost_to_reach,
    paired_cost,
    yardstick_of,
)
from crosscheck2d.reports.compare.pooling import POOLED, WHO, pooled
from crosscheck2d.reports.run.stepping import CALL, EMPTY, READ, binding_of
from crosscheck2d.reports.run.timing import WARM_UP
from crosscheck2d.reports.speed.measure import IN_PILE, SIZE, SLEEPING, WORST_STEP, Measured
from crosscheck2d.reports.speed.plan import OPTION, PLAIN, SCENE, SWEEP
from crosscheck2d.reports.speed.sizes import exponent
from crosscheck2d.reports.terminal.counts import listed
from crosscheck2d.scenarios.model import Scenario

NOT_GOT = {"never": UNREACHABLE, "failed": FAILED, "untimed": NOT_TIMED}  # how it is counted -> why
TIMES = ["cost", "low", "high", "best", "wrapping"]


def rows_by(
    table: pd.DataFrame, keys: Sequence[str], row: Callable[[pd.DataFrame], Mapping[str, Any]]
) -> pd.DataFrame:
    """A row for each group of `keys`, in the order of appearance: the keys and `row` of the
    group."""
    groups = table.groupby(list(keys), sort=False)
    return pd.DataFrame([dict(zip(keys, key)) | {**row(group)} for key, group in groups])


def points(measured: Measured, seed: int) -> pd.DataFrame:
    """A row for each scenario, engine and dt: the columns of `summed`, and step_size (0:
    coarsest)."""
    found = summed(measured, SCENE, seed)
    return found.assign(step_size=doublings(found))


def sweeps(measured: Measured, seed: int) -> pd.DataFrame:
    """The columns of `summed`, and step_size: the sweeps over their values, and their engines over
    a ladder of dt."""
    if not (measured.errors.kind == SWEEP).any():
        return pd.DataFrame()
    found = summed(measured, SWEEP, seed)
    places = {
        (sweep.name, str(value)): k
        for sweep in SWEEPS
        for k, value in enumerate(sweep.parameter.values)
    }
    names = found.engine + ":" + found.profile
    turned = [places.get(who, -1) for who in zip(names, found.change)]
    return found.assign(
        step_size=np.where(found.change == PLAIN, doublings(found), turned), idle=np.nan
    )


def pooled_sweeps(found: pd.DataFrame) -> pd.DataFrame:
    """As `pooled`, of cost and error over those of the matched engine at the dt at which its
    parameter is swept.

    change is the value of the sweep; a ladder of dt has none. Scenes of `without_ratio` have no
    part in it.
    """
    if found.empty:
        return found
    both = found.merge(at_matched(found), on=["scenario", "engine"], suffixes=("", "_here"))
    both = both[measurable(both)]
    for of in ("cost", "error"):
        both[of] /= both[f"{of}_here"]
    parts = [
        pooled(group).assign(change=str(change))
        for (_, change), group in both.groupby(["profile", "change"])
    ]
    return pd.concat(parts).sort_values("step_size", kind="stable") if parts else found.head(0)


def without_ratio(found: pd.DataFrame) -> list[tuple[str, str]]:
    """(engine, scenario) of the sweeps where the matched engine failed, was not timed, or is right
    to the last bit."""
    here = at_matched(found)
    lost = here[~measurable(here)]
    return list(zip(lost.engine, lost.scenario))


def at_matched(found: pd.DataFrame) -> pd.DataFrame:
    """scenario, engine, cost_here and error_here: each matched engine at the dt at which its
    parameter is swept."""
    dt = found[found.change != PLAIN].groupby("scenario").dt_s.first()
    here = found[(found.change == PLAIN) & (found.dt_s == found.scenario.map(dt))]
    both = here[["scenario", "engine", "cost", "error"]]
    return both.rename(columns={"cost": "cost_here", "error": "error_here"})


def measurable(here: pd.DataFrame) -> pd.Series:
    """Whether there is a value to divide by."""
    finite: pd.Series = np.isfinite(here.cost_here) & np.isfinite(here.error_here)
    return finite & (here.error_here > 0)


def summed(measured: Measured, kind: str, seed: int) -> pd.DataFrame:
    """A row for each scenario, engine, change and dt of one kind.

    Columns: scenario, engine, profile, change, dt_s, substeps, until_s and duration_s (of the first
    seed, see `ladder.errors_of`), seeds, failed (how many), status and reason (of the
    first that failed), error (median over the seeds, radii; inf where it failed) and its 95 %
    interval error_low, error_high; cost (median, µs per simulated second; nan where not timed), its
    quartiles low and high, best, wrapping, rounds.
    """

    def over_seeds(group: pd.DataFrame) -> dict[str, Any]:
        values, failed = group.error_radii.to_numpy(float), group[group.status != "ok"]
        low, high = median_interval(values, seed)
        method: Any = "higher" if np.isinf(values).any() else "linear"
        worst = group.iloc[0] if failed.empty else failed.iloc[0]
        return {
            **group[["until_s", "duration_s"]].iloc[0],
            "seeds": len(group),
            "failed": len(failed),
            "status": worst.status,
            "reason": "" if failed.empty else worst.reason,
            "error": float(np.percentile(values, 50, method=method)),
            "error_low": low,
            "error_high": high,
        }

    keys = ["scenario", *WHO, "change", "dt_s"]
    errors = measured.errors[measured.errors.kind == kind]
    first = measured.samples[(measured.samples.kind == kind) & (measured.samples.copy_of == 0)]
    times = in_us(summed_up(first, keys))
    return rows_by(errors, [*keys, "substeps"], over_seeds).merge(times, on=keys, how="left")


def doublings(found: pd.DataFrame) -> pd.Series:
    """How often the step of a row has been halved from the scenario's coarsest."""
    coarsest = found.groupby("scenario").substeps.transform("min")
    return (found.substeps / coarsest).map(np.log2).round().astype(int)


def in_us(table: pd.DataFrame) -> pd.DataFrame:
    """The same times in µs."""
    return table.assign(**{column: table[column] * 1e6 for column in TIMES})


def orders(measured: Measured, seed: int) -> pd.DataFrame:
    """A row for each scenario and engine: slope, low, high, verdict, see `order.Order`;
    coarsest_error and finest_error in radii (medians over the seeds), the latter at finest_dt_s;
    steps, how many were played, and failed, at how many of them a seed failed: what failed has no
    part in slope and verdict.
    """

    def fit(group: pd.DataFrame) -> dict[str, Any]:
        errors, changes = (
            group.pivot(index="seed", columns="substeps", values=value).to_numpy(float)
            for value in ("error_radii", "change_radii")
        )
        dt = np.sort(group.dt_s.unique())[::-1]  # coarse to fine, as the columns
        failed = ~np.isfinite(errors)
        order = Order(np.nan, np.nan, np.nan, FAILED if failed.all() else "")
        if len(dt) > 1 and not failed.all():
            order = order_of(dt, errors, changes, seed)
        coarsest, finest = np.median(errors[:, [0, -1]], axis=0).tolist()
        return order._asdict() | {
            "finest_dt_s": dt[-1],
            "steps": len(dt),
            "coarsest_error": coarsest,
            "finest_error": finest,
            "failed": int(failed.any(axis=0).sum()),
        }

    scenes = measured.errors[measured.errors.kind == SCENE]
    return rows_by(scenes, ["scenario", *WHO], fit)


def reached(found: pd.DataFrame, fitted: pd.DataFrame) -> pd.DataFrame:
    """A row for each scenario, engine and accuracy: accuracy (radii), cost (µs per simulated
    second), dt_s, why it is not, and lost: it is not at any dt, or failed."""
    keys = ["scenario", *WHO]
    both = found.merge(fitted[[*keys, "verdict"]], on=keys)

    def reach(accuracy: str, group: pd.DataFrame) -> dict[str, Any]:
        dts, costs, errors = (group[name].to_numpy(float) for name in ("dt_s", "cost", "error"))
        verdict = group.verdict.iloc[0]
        cost, dt, why = cost_to_reach(ACCURACIES[accuracy], dts, costs, errors, verdict)
        if why == NOT_REACHED:
            why = f"not down to dt {group.dt_s.min():.2g} s"
        lost = why in (UNREACHABLE, FAILED)
        return {"accuracy": accuracy, "cost": cost, "dt_s": dt, "why": why, "lost": lost}

    parts = [rows_by(both, keys, partial(reach, accuracy)) for accuracy in ACCURACIES]
    return pd.concat(parts).sort_index(kind="stable", ignore_index=True)


def pooled_reached(part: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    """As `reached`, one cost for all scenarios where an engine gets there in more than half of
    them: `paired_cost`, and how many do and do not.

    A median over all of them would be that of other scenarios for each engine; with many out
    of reach, of the dearest. Columns besides: of, how many scenarios; got, in how many it gets
    there; never, at no dt; failed; untimed; in the others it does not down to the finest dt.
    lost: half or more are never or failed. `part`: the rows of `found`, from `reached`, of the
    scenarios that are pooled.
    """
    own = yardstick_of(found)

    def pool(group: pd.DataFrame) -> dict[str, Any]:
        got, count = int(group.cost.notna().sum()), len(group)
        others = {name: int((group.why == why).sum()) for name, why in NOT_GOT.items()}
        parts = [f"{got} of {count}", *(f"{name} in {k}" for name, k in others.items() if k)]
        mine = own[own.accuracy == group.accuracy.iloc[0]]
        return {
            "scenario": POOLED,
            "cost": paired_cost(group, mine) if 2 * got > count else np.nan,
            "dt_s": np.nan,
            "why": ", ".join(parts),
            "lost": 2 * int(group.lost.sum()) >= count,
            "of": count,
            "got": got,
            **others,
        }

    return rows_by(part, [*WHO, "accuracy"], pool)


def noise(measured: Measured) -> pd.DataFrame:
    """A row for each scenario and engine: ratio of the median costs of an engine and its copy in
    the same rounds."""
    samples = measured.samples[measured.samples.kind == SCENE]
    both = (
        summed_up(samples, ["scenario", *WHO, "dt_s", "copy_of"])
        .pivot(index=["scenario", *WHO, "dt_s"], columns="copy_of", values="cost")
        .reindex(columns=[0, 1])
    )
    return (both[1] / both[0]).dropna().rename("ratio").reset_index()


def bindings(measured: Measured) -> pd.DataFrame:
    """scenario, engine, profile, step_us, call_us and read_us: what a step and a call cost where
    there is nothing to do, measured in the rounds of that scenario, and a read-out of it."""
    samples = measured.samples[measured.samples.kind.isin([EMPTY, CALL, READ])]
    if samples.empty:
        return pd.DataFrame(columns=["scenario", *WHO, "step_us", "call_us", "read_us"])
    # The fastest samples: on a busy machine a difference of medians may have either sign.
    wide = in_us(summed_up(samples, ["scenario", *WHO, "kind"])).pivot(
        index=["scenario", *WHO], columns="kind", values="best"
    )
    call = (wide[CALL] - wide[EMPTY]).clip(lower=0.0)
    return pd.DataFrame(
        {"step_us": wide[EMPTY], "call_us": call, "read_us": wide[READ]}
    ).reset_index()


def driving(found: pd.DataFrame) -> pd.DataFrame:
    """engine, profile, and of `bindings` the median over the scenes, besides read_most_us, the
    largest."""
    each = found.groupby(WHO)
    medians = each[["step_us", "call_us", "read_us"]].median()
    return in_order(medians.assign(read_most_us=each.read_us.max()).reset_index())


def idle(found: pd.DataFrame, points: pd.DataFrame, scenarios: Mapping[str, Scenario]) -> pd.Series:
    """Of each row of `points` what its steps and calls cost where there is nothing to do, µs per
    simulated second; nan where `found`, of `bindings`, does not say."""
    both = points[["scenario", *WHO, "substeps"]].merge(found, on=["scenario", *WHO], how="left")
    rows = zip(both.scenario, both.step_us, both.call_us, both.substeps)
    values = [binding_of(step, step + call, scenarios[name], k) for name, step, call, k in rows]
    return pd.Series(values, points.index, dtype=float)


def in_order(table: pd.DataFrame) -> pd.DataFrame:
    """Its rows in the order of `ENGINES`, otherwise as they were."""
    ranks = {name: rank for rank, name in enumerate(ENGINES)}
    names = table.engine + ":" + table.profile
    return table.loc[names.map(ranks).sort_values(kind="stable").index]


def sizes(measured: Measured) -> pd.DataFrame:
    """engine, profile, n, cost in µs a step, the other columns of `summed_up`, worst: µs of the
    dearest step."""
    samples = measured.samples[measured.samples.kind == SIZE]
    costs = in_us(summed_up(samples, [*WHO, "n"]))
    dearest = measured.samples[measured.samples.kind == WORST_STEP]
    worst = dearest.set_index([*WHO, "n"]).cost.mul(1e6).rename("worst")
    costs = costs.join(worst, on=[*WHO, "n"]).sort_values("n", kind="stable")
    return in_order(costs.reset_index(drop=True))


def end_of_all_pairs(costs: pd.DataFrame) -> str:
    """A sentence on the number of disks from which on testing all pairs, as `YARDSTICK` does, costs
    more than other engines, interpolated; "" if it costs more than none."""
    table = costs.assign(name=costs.engine + ":" + costs.profile)
    table = table.pivot(index="n", columns="name", values="cost")
    ends = []
    for name in table.columns.drop(YARDSTICK, errors="ignore") if YARDSTICK in table else ():
        both = table[[YARDSTICK, name]].dropna()
        ratio = np.log(both[YARDSTICK].to_numpy() / both[name].to_numpy())
        k = int(np.argmax(ratio > 0))  # 0: the first already, or none
        if k:
            n = np.interp(0.0, ratio[k - 1 : k + 1], np.log(both.index[k - 1 : k + 1]))
            ends.append(f"{name} from {np.exp(n):.2g} disks on")
    return f"Testing all pairs costs more than {listed(ends)}." if ends else ""


def pile(measured: Measured) -> pd.DataFrame:
    """name, n and what a step of a settled pile of n disks costs, µs: `PLAIN` and `SLEEPING`; no
    rows if none was timed."""
    samples = measured.samples[measured.samples.kind == IN_PILE]
    costs = in_us(summed_up(samples, [*WHO, "change", "n"]))
    named = costs.assign(name=costs.engine + ":" + costs.profile)
    wide = named.pivot(index=["name", "n"], columns="change", values="cost")
    return wide.reindex(columns=[PLAIN, SLEEPING]).dropna().reset_index()


def growth(costs: pd.DataFrame, stopped: Mapping[tuple[str, int], str]) -> pd.DataFrame:
    """engine, profile, exponent of the costs of `sizes`, low, high, most (disks), and where and why
    it was first stopped, `Measured.stopped`."""
    first = {name: f"{n}: {why}" for (name, n), why in reversed([*stopped.items()])}
    timed, rows = costs.engine + ":" + costs.profile, []
    # some engines were stopped at the smallest number of disks
    for name in dict.fromkeys([*timed, *(name for name, _ in stopped)]):
        group = costs[timed == name]
        fitted = exponent(group.n.to_numpy(float), group.cost.to_numpy(float))
        most = int(group.n.max()) if len(group) else 0
        rows.append([*name.split(":"), *fitted, most, first.get(name, "")])
    return pd.DataFrame(rows, columns=[*WHO, "exponent", "low", "high", "most", "stopped"])


def options(measured: Measured) -> pd.DataFrame:
    """A row for each scenario, engine and change: cost and error, each over the unchanged engine's;
    and both errors."""
    samples = measured.samples[measured.samples.kind == OPTION]
    errors = measured.errors[measured.errors.kind == OPTION]
    if samples.empty or errors.empty:
        return pd.DataFrame()
    keys = ["scenario", *WHO, "change"]
    table = errors[[*keys, "status", "reason", "error_radii"]].merge(
        in_us(summed_up(samples, keys))[[*keys, "cost", "low", "high", "best"]], on=keys, how="left"
    )
    plain = table[table.change == PLAIN][["scenario", *WHO, "error_radii", "cost"]]
    both = table[table.change != PLAIN].merge(plain, on=["scenario", *WHO], suffixes=("", "_plain"))
    both["cost_ratio"] = both.cost / both.cost_plain
    both["error_ratio"] = both.error_radii / both.error_radii_plain.where(
        both.error_radii_plain > 0
    )
    return both


def summed_up(samples: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Columns `by`, then cost (the median), low, high (quartiles), best (the minimum), wrapping,
    rounds; no warm-up."""
    counted = samples[samples["round"] != WARM_UP].groupby(list(by), sort=False)
    cost = counted["cost"]
    quartiles = {"low": cost.quantile(0.25), "high": cost.quantile(0.75)}
    table = pd.DataFrame({"cost": cost.median(), **quartiles, "best": cost.min()})
    return table.assign(wrapping=counted["wrapping"].median(), rounds=cost.size()).reset_index()
