"""The tables of a measurement, made from its samples and errors, for the page and for the files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.options import SWEEPS
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.reports.compare.accuracy import (
    ACCURACIES,
    FAILED,
    FINEST,
    NOT_REACHED,
    NOT_TIMED,
    POOLED,
    UNREACHABLE,
    WHO,
    YARDSTICK,
    Order,
    cost_to_reach,
    median_interval,
    order_of,
    paired_cost,
    pooled,
    yardstick_of,
)
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.stepping import CALL, EMPTY, READ, binding_of
from crosscheck2d.reports.run.timing import WARM_UP, Noise, noise_of
from crosscheck2d.reports.speed import budget
from crosscheck2d.reports.speed.measure import IN_PILE, SIZE, SLEEPING, WORST_STEP, Measured
from crosscheck2d.reports.speed.plan import OPTION, PLAIN, SCENE, SWEEP, SpeedPlan
from crosscheck2d.reports.speed.sizes import exponent
from crosscheck2d.reports.terminal.counts import listed
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM

NOT_GOT = {"never": UNREACHABLE, "failed": FAILED, "untimed": NOT_TIMED}  # how it is counted -> why
TIMES = ["cost", "low", "high", "best", "wrapping"]
HERE = ["scenario", *WHO]
QUIET = 0.05  # how far from 1 the middle half of an engine against itself may read
# engines with end-of-step detection, but for our own solver
COMPARED = tuple(name for name in MECHANISMS if name in ENGINES and name != YARDSTICK)


def names_of(table: pd.DataFrame) -> pd.Series:
    names: pd.Series = table.engine + ":" + table.profile
    return names


def rows_by(
    table: pd.DataFrame, keys: Sequence[str], row: Callable[[pd.DataFrame], Mapping[str, Any]]
) -> pd.DataFrame:
    """A row for each group of `keys`, in the order of appearance: the keys and `row` of the
    group."""
    groups = table.groupby(list(keys), sort=False)
    return pd.DataFrame([dict(zip(keys, key)) | {**row(group)} for key, group in groups])


def summed_up(samples: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Columns `by`, then cost (the median), low, high (quartiles), best (the minimum), wrapping,
    rounds; no warm-up."""
    counted = samples[samples["round"] != WARM_UP].groupby(list(by), sort=False)
    cost = counted["cost"]
    columns = {"cost": cost.median(), "low": cost.quantile(0.25), "high": cost.quantile(0.75)}
    columns |= {"best": cost.min(), "wrapping": counted["wrapping"].median(), "rounds": cost.size()}
    return pd.DataFrame(columns).reset_index()


def times_in_us(samples: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    table = summed_up(samples, by)
    return table.assign(**{column: table[column] * 1e6 for column in TIMES})


def doublings(table: pd.DataFrame) -> pd.Series:
    # how often the step of a row has been halved from the scenario's coarsest
    coarsest = table.groupby("scenario").substeps.transform("min")
    return (table.substeps / coarsest).map(np.log2).round().astype(int)


def in_order(table: pd.DataFrame) -> pd.DataFrame:
    # of `ENGINES`, otherwise as it was
    ranks = {name: rank for rank, name in enumerate(ENGINES)}
    return table.loc[names_of(table).map(ranks).sort_values(kind="stable").index]


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

    keys = [*HERE, "change", "dt_s"]
    errors = measured.errors[measured.errors.kind == kind]
    first = measured.samples[(measured.samples.kind == kind) & (measured.samples.copy_of == 0)]
    table = rows_by(errors, [*keys, "substeps"], over_seeds)
    return table.merge(times_in_us(first, keys), on=keys, how="left")


def points(measured: Measured, seed: int) -> pd.DataFrame:
    """The columns of `summed`, and step_size (0: coarsest)."""
    table = summed(measured, SCENE, seed)
    return table.assign(step_size=doublings(table))


def sweeps(measured: Measured, seed: int) -> pd.DataFrame:
    """The columns of `summed`, and step_size: the sweeps over their values, and their engines over
    a ladder of dt."""
    if not (measured.errors.kind == SWEEP).any():
        return pd.DataFrame()
    table = summed(measured, SWEEP, seed)
    values = {
        (sweep.name, str(value)): k
        for sweep in SWEEPS
        for k, value in enumerate(sweep.parameter.values)
    }
    places = [values.get(key, -1) for key in zip(names_of(table), table.change)]
    step_size = np.where(table.change == PLAIN, doublings(table), places)
    return table.assign(step_size=step_size, idle=np.nan)


def pooled_sweeps(table: pd.DataFrame) -> tuple[pd.DataFrame, list[tuple[str, str]]]:
    """As `pooled`, of cost and error over those of the matched engine at the dt at which its
    parameter is swept; and the (engine, scenario) that have no part in it, because the matched
    engine failed there, was not timed, or is right to the last bit.

    change is the value of the sweep; a ladder of dt has none.
    """
    if table.empty:
        return table, []
    dt = table[table.change != PLAIN].groupby("scenario").dt_s.first()
    matched = table[(table.change == PLAIN) & (table.dt_s == table.scenario.map(dt))]
    usable = np.isfinite(matched.cost) & np.isfinite(matched.error) & (matched.error > 0)
    here = matched[usable][["scenario", "engine", "cost", "error"]]
    both = table.merge(here, on=["scenario", "engine"], suffixes=("", "_here"))
    both = both.assign(cost=both.cost / both.cost_here, error=both.error / both.error_here)
    parts = [
        pooled(group).assign(change=str(change))
        for (_, change), group in both.groupby(["profile", "change"])
    ]
    pool = pd.concat(parts).sort_values("step_size", kind="stable") if parts else table.head(0)
    without_ratio = matched[~usable][["engine", "scenario"]]
    return pool, list(without_ratio.itertuples(index=False, name=None))


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

    return rows_by(measured.errors[measured.errors.kind == SCENE], HERE, fit)


def reached(found: pd.DataFrame, fitted: pd.DataFrame) -> pd.DataFrame:
    """A row for each scenario, engine and accuracy: accuracy (radii), cost (µs per simulated
    second), dt_s, why it is not, and lost: it is not at any dt, or failed."""
    rows = []
    both = found.merge(fitted[[*HERE, "verdict"]], on=HERE)
    for key, group in both.groupby(HERE, sort=False):
        dts, costs, errors = (group[name].to_numpy(float) for name in ("dt_s", "cost", "error"))
        for accuracy, radii in ACCURACIES.items():
            cost, dt, why = cost_to_reach(radii, dts, costs, errors, group.verdict.iloc[0])
            if why == NOT_REACHED:
                why = f"not down to dt {group.dt_s.min():.2g} s"
            lost = why in (UNREACHABLE, FAILED)
            rows.append((*key, accuracy, cost, dt, why, lost))
    return pd.DataFrame(rows, columns=[*HERE, "accuracy", "cost", "dt_s", "why", "lost"])


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
        counts = {name: int((group.why == why).sum()) for name, why in NOT_GOT.items()}
        parts = [f"{got} of {count}", *(f"{name} in {k}" for name, k in counts.items() if k)]
        own_rows = own[own.accuracy == group.accuracy.iloc[0]]
        return {
            "scenario": POOLED,
            "cost": paired_cost(group, own_rows) if 2 * got > count else np.nan,
            "dt_s": np.nan,
            "why": ", ".join(parts),
            "lost": 2 * int(group.lost.sum()) >= count,
            "of": count,
            "got": got,
            **counts,
        }

    return rows_by(part, [*WHO, "accuracy"], pool)


def noise(measured: Measured) -> pd.DataFrame:
    samples = measured.samples[measured.samples.kind == SCENE]
    costs = summed_up(samples, [*HERE, "dt_s", "copy_of"])
    both = costs.pivot(index=[*HERE, "dt_s"], columns="copy_of", values="cost")
    both = both.reindex(columns=[0, 1])
    return (both[1] / both[0]).dropna().rename("ratio").reset_index()


def bindings(measured: Measured) -> pd.DataFrame:
    """scenario, engine, profile, step_us, call_us and read_us: what a step and a call cost where
    there is nothing to do, measured in the rounds of that scenario, and a read-out of it."""
    samples = measured.samples[measured.samples.kind.isin([EMPTY, CALL, READ])]
    if samples.empty:
        return pd.DataFrame(columns=[*HERE, "step_us", "call_us", "read_us"])
    # The fastest samples: on a busy machine a difference of medians may have either sign.
    best = times_in_us(samples, [*HERE, "kind"]).pivot(index=HERE, columns="kind", values="best")
    call = (best[CALL] - best[EMPTY]).clip(lower=0.0)
    table = {"step_us": best[EMPTY], "call_us": call, "read_us": best[READ]}
    return pd.DataFrame(table).reset_index()


def driving(bound: pd.DataFrame) -> pd.DataFrame:
    """engine, profile, and of `bindings` the median over the scenes, besides read_most_us, the
    largest."""
    engines = bound.groupby(WHO)
    medians = engines[["step_us", "call_us", "read_us"]].median()
    return in_order(medians.assign(read_most_us=engines.read_us.max()).reset_index())


def idle(bound: pd.DataFrame, points: pd.DataFrame, scenarios: Mapping[str, Scenario]) -> pd.Series:
    """Of each row of `points` what its steps and calls cost where there is nothing to do, µs per
    simulated second; nan where `bound`, of `bindings`, does not say."""
    both = points[[*HERE, "substeps"]].merge(bound, on=HERE, how="left")
    rows = zip(both.scenario, both.step_us, both.call_us, both.substeps)
    values = [binding_of(step, step + call, scenarios[name], k) for name, step, call, k in rows]
    return pd.Series(values, points.index, dtype=float)


def sizes(measured: Measured) -> pd.DataFrame:
    """engine, profile, n, cost in µs a step, the other columns of `summed_up`, worst: µs of the
    dearest step."""
    samples = measured.samples
    costs = times_in_us(samples[samples.kind == SIZE], [*WHO, "n"])
    dearest = samples[samples.kind == WORST_STEP].set_index([*WHO, "n"])
    costs = costs.join(dearest.cost.mul(1e6).rename("worst"), on=[*WHO, "n"])
    return in_order(costs.sort_values("n", kind="stable").reset_index(drop=True))


def end_of_all_pairs(costs: pd.DataFrame) -> str:
    """A sentence on the number of disks from which on testing all pairs, as `YARDSTICK` does, costs
    more than other engines, interpolated; "" if it costs more than none."""
    table = costs.assign(name=names_of(costs)).pivot(index="n", columns="name", values="cost")
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
    costs = times_in_us(samples, [*WHO, "change", "n"])
    named = costs.assign(name=names_of(costs))
    wide = named.pivot(index=["name", "n"], columns="change", values="cost")
    return wide.reindex(columns=[PLAIN, SLEEPING]).dropna().reset_index()


def growth(costs: pd.DataFrame, stopped: Mapping[tuple[str, int], str]) -> pd.DataFrame:
    """engine, profile, exponent of the costs of `sizes`, low, high, most (disks), and where and why
    it was first stopped, `Measured.stopped`."""
    first = {name: f"{n}: {reason}" for (name, n), reason in reversed([*stopped.items()])}
    timed, rows = names_of(costs), []
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
    keys = [*HERE, "change"]
    costs = times_in_us(samples, keys)[[*keys, "cost", "low", "high", "best"]]
    table = errors[[*keys, "status", "reason", "error_radii"]].merge(costs, on=keys, how="left")
    plain = table[table.change == PLAIN][[*HERE, "error_radii", "cost"]]
    both = table[table.change != PLAIN].merge(plain, on=HERE, suffixes=("", "_plain"))
    error = both.error_radii_plain.where(both.error_radii_plain > 0)
    return both.assign(cost_ratio=both.cost / both.cost_plain, error_ratio=both.error_radii / error)


def against_own(points: pd.DataFrame, options: pd.DataFrame) -> pd.DataFrame:
    """A row for each of `COMPARED` and for each of its changed settings.

    ratio, low, high: its cost over that of `YARDSTICK` at the same steps, geometric mean, least
        and most over the scenes;
    cheaper: in how many scenes it costs less, and bare_cheaper: less where an idle step (the
        binding and the engine's fixed cost) is taken off both (nan where that is not known);
        scenes: in how many both were timed, and not_timed_in those in which one was not.

    A pooled number alone must not make our own solver the cheapest: this lists every scene in which
    it is not.
    """
    plain = points.assign(change=PLAIN, name=names_of(points))
    own = plain[plain.name == YARDSTICK][["scenario", "dt_s", "cost", "idle"]]
    own = own.rename(columns={"cost": "own", "idle": "own_idle"})
    both = plain[plain.name.isin(COMPARED)].merge(own, on=["scenario", "dt_s"], how="left")
    columns = [*WHO, "change", "scenes", "ratio", "low", "high", "cheaper", "cheaper_in"]
    columns += ["bare_cheaper", "bare_cheaper_in", "not_timed_in"]
    if own.empty or both.empty:
        return pd.DataFrame(columns=columns)
    if len(options):  # the changed settings, timed in the same rounds
        named = options.assign(name=names_of(options))
        costs = named[named.name == YARDSTICK].groupby("scenario").cost_plain.first()
        changed = named[named.name.isin(COMPARED)]
        changed = changed.assign(own=changed.scenario.map(costs), idle=np.nan, own_idle=np.nan)
        both = pd.concat([both, changed])

    def over_own(group: pd.DataFrame) -> dict[str, object]:
        logs = group.assign(log=np.log(group.cost) - np.log(group.own))
        ratios = logs.groupby("scenario", sort=False)["log"].mean()
        timed = np.exp(ratios.dropna())
        bare = (group.cost - group.idle) - (group.own - group.own_idle)
        bare = bare * group.get("dt_s", np.nan)
        bare = bare.groupby(group.scenario, sort=False).mean().dropna()
        cheaper, bare_cheaper = timed[timed < 1].index, bare[bare < 0].index
        return {
            "scenes": len(timed),
            "ratio": np.exp(np.log(timed).mean()),
            "low": timed.min(),
            "high": timed.max(),
            "cheaper": len(cheaper),
            "cheaper_in": " ".join(cheaper),
            "bare_cheaper": len(bare_cheaper) if len(bare) else np.nan,
            "bare_cheaper_in": " ".join(bare_cheaper),
            "not_timed_in": " ".join(ratios[ratios.isna()].index),
        }

    return rows_by(both, [*WHO, "change"], over_own)[columns]


def cheapest_models(truths: pd.DataFrame, points: pd.DataFrame) -> pd.DataFrame:
    """A row for each scenario: truth, closed_us, and the cheapest engines with an error of at
    most `FINEST` and of at most 1 % of a radius.

    The first are the columns model, engine and cost_us, the second loose_engine and loose_us; ""
    and nan where no engine is that accurate.
    """

    def cheapest(scenario: str, error: float) -> tuple[str, float]:
        here = points[(points.scenario == scenario) & points.cost.notna() & (points.error <= error)]
        rows = here.nsmallest(1, "cost")
        return (names_of(rows).iloc[0], float(rows.cost.iloc[0])) if len(rows) else ("", np.nan)

    rows = []
    for row in truths.to_dict("records"):
        engine, cost = cheapest(row["scenario"], FINEST)
        loose_engine, loose_cost = cheapest(row["scenario"], 0.01)
        model = "step by step" if engine else ""
        if engine.startswith("event_driven:"):
            model = "collision to collision, float64"
        if np.isfinite(row["closed_us"]) and not row["closed_us"] > cost:
            model = CLOSED_FORM
        row |= {"model": model, "engine": engine, "cost_us": cost}
        rows.append(row | {"loose_engine": loose_engine, "loose_us": loose_cost})
    return pd.DataFrame(rows)


class Results:
    """What was measured, which must be an error at least, and the tables made from it.

    Attributes, beside the tables that a function of this module of the same name describes:
        asks: scenario -> its question, for the measured scenarios in the order in which they were
            asked for.
        points: as of `points`; and idle, what as many steps cost where there is nothing to do, µs
            per simulated s.
        pooled: see `accuracy.pooled`; of scenes without friction, as is `pooled_reached`, unless
            every scene has friction.
        versus, models, explained: see `against_own`, `cheapest_models`, `budget.explain`.
    """

    def __init__(self, plan: SpeedPlan, measured: Measured) -> None:
        self.plan, self.measured, seed = plan, measured, plan.seed
        scenarios = {s.name: s for s in (open_scene(scene, seed) for scene in plan.effort.scenes)}
        self.bindings = bindings(measured)
        self.driving = driving(self.bindings)
        self.points = points(measured, seed)
        self.points["idle"] = idle(self.bindings, self.points, scenarios)
        played = {*self.points.scenario}
        self.asks = {name: s.asks for name, s in scenarios.items() if name in played}
        self.orders = orders(measured, seed)
        self.reached = reached(self.points, self.orders)
        rough = {name for name, scenario in scenarios.items() if scenario.scene.friction}
        rough = set() if rough >= played else rough
        self.pooled = pooled(self.points[~self.points.scenario.isin(rough)])
        smooth = self.reached[~self.reached.scenario.isin(rough)]
        self.pooled_reached = pooled_reached(smooth, self.reached)
        self.sizes = sizes(measured)
        self.growth = growth(self.sizes, measured.stopped)
        self.pile = pile(measured)
        self.sweeps = sweeps(measured, seed)
        self.options = options(measured)
        self.versus = against_own(self.points, self.options)
        self.models = cheapest_models(measured.truths, self.points)
        self.explained = budget.explain(measured.budget)
        self.noise = noise(measured)

    @property
    def files(self) -> dict[str, pd.DataFrame]:
        own = "pooled orders reached sizes pile options driving bindings noise models sweeps"
        tables = {name: getattr(self, name) for name in (*own.split(), "explained", "versus")}
        measured = {name: getattr(self.measured, name) for name in ("samples", "errors", "budget")}
        named = {f"speed_{name}.csv": table for name, table in (tables | measured).items()}
        return {"speed.csv": self.points} | named

    def noise_floor(self, scene: str = "") -> Noise:
        # of an engine against itself, in one scene or in all
        ratios = self.noise[self.noise.scenario == scene].ratio if scene else self.noise.ratio
        return noise_of(ratios.to_numpy(float))

    @property
    def noise_sentence(self) -> str:
        noise = self.noise_floor()
        if not noise.pairs:
            return "No engine was timed against itself, so the noise floor is not known."
        sentence = (
            "Noise floor: the time of an engine over its own time again, in the same rounds, is"
            f" {noise.median:.3f}"
        )
        if noise.pairs > 1:
            sentence += (
                f"; for half of {noise.pairs} pairs it is from {noise.low:.3f} to"
                f" {noise.high:.3f}, at worst {noise.least:.3f} and {noise.most:.3f}"
            )
        if noise.floor <= QUIET:
            return f"{sentence}."
        return (
            f"{sentence}. It must stay between {1 - QUIET:g} and {1 + QUIET:g}: differences of time"
            " below this floor mean nothing. Measure again while nothing else runs before you quote"
            " a time."
        )
