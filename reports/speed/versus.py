"""The cost of every engine with end-of-step detection over that of this project's own solver,
scene by scene, each at its cheapest.

A pooled number alone must not make our own solver the cheapest: this lists every scene in which
it is not, with and without the cost of an idle step (the binding and the engine's fixed cost),
and for every changed setting that was measured.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.reports.compare.pareto import YARDSTICK
from crosscheck2d.reports.speed.plan import PLAIN
from crosscheck2d.reports.speed.tables import rows_by

COMPARED = tuple(name for name in MECHANISMS if name in ENGINES and name != YARDSTICK)
KEYS = ["engine", "profile", "change"]
COLUMNS = [*KEYS, "scenes", "ratio", "low", "high", "cheaper", "cheaper_in"]
COLUMNS += ["bare_cheaper", "bare_cheaper_in", "not_timed_in"]


def against_own(points: pd.DataFrame, options: pd.DataFrame) -> pd.DataFrame:
    """A row for each engine with end-of-step detection, and one each of its changed settings, of
    `COLUMNS`.

    ratio, low, high: its cost over that of `YARDSTICK` at the same steps, geometric mean, least
        and most over the scenes;
    cheaper: in how many scenes it costs less, and bare_cheaper: less where an idle step is taken
    off both (nan where that is not known); scenes: in how many both were timed, and not_timed_in
    those in which one was not.
    """
    plain = points.assign(change=PLAIN, name=points.engine + ":" + points.profile)
    at = ["scenario", "dt_s"]
    own = plain[plain.name == YARDSTICK][[*at, "cost", "idle"]].rename(
        columns={"cost": "own", "idle": "own_idle"}
    )
    both = plain[plain.name.isin(COMPARED)].merge(own, on=at, how="left")
    if own.empty or both.empty:
        return pd.DataFrame(columns=COLUMNS)
    if len(options):  # the changed settings, timed in the same rounds
        named = options.assign(name=options.engine + ":" + options.profile)
        costs = named[named.name == YARDSTICK].groupby("scenario").cost_plain.first()
        changed = named[named.name.isin(COMPARED)]
        changed = changed.assign(own=changed.scenario.map(costs), idle=np.nan, own_idle=np.nan)
        both = pd.concat([both, changed])
    return rows_by(both, KEYS, over_own)[COLUMNS]


def over_own(group: pd.DataFrame) -> dict[str, object]:
    """One row of `against_own` from those of one engine in all scenes and steps."""
    logs = group.assign(log=np.log(group.cost) - np.log(group.own))
    ratios = logs.groupby("scenario", sort=False)["log"].mean()
    timed = np.exp(ratios.dropna())
    bare = ((group.cost - group.idle) - (group.own - group.own_idle)) * group.get("dt_s", np.nan)
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
