"""The share of the errors that the error budget explains, and the share of the scenes that is
evaluated."""

from __future__ import annotations

import pandas as pd

from crosscheck2d.reports.speed.budget import LIMIT, RESIDUAL, TOTAL, WHOSE
from crosscheck2d.reports.terminal.counts import counted

LEAST = 1e-9  # radii; smaller errors are rounding and need no explanation
TO = (0.01, 0.001)  # of an error: an error with a smaller residual counts as explained
COLUMNS = [*WHOSE, "error_radii", "residual_radii", "note"]


def explained(budget: pd.DataFrame) -> pd.DataFrame:
    """A row for each scene and engine, of `COLUMNS`: its error, its residual (root mean squares),
    and how far the scene was evaluated, its exact answer goes, and the scene goes; note: why the
    engine has no error.
    """
    total, residual = (budget[budget.contribution == name] for name in (TOTAL, RESIDUAL))
    errors = total.rename(columns={"position_radii": "error_radii"})
    left = residual[[*WHOSE, "position_radii"]].set_axis([*WHOSE, "residual_radii"], axis=1)
    return errors.merge(left, on=WHOSE, how="left")[COLUMNS]


def cuts(table: pd.DataFrame) -> pd.DataFrame:
    """scenario, until_s and horizon_s of the scenes that are evaluated for a shorter time than
    their exact answer lasts; `table` as `explained` gives it."""
    scenes = table.drop_duplicates("scenario")[["scenario", "until_s", "horizon_s"]]
    return scenes[scenes.until_s < scenes.horizon_s * (1 - 1e-9)]


def sentence(table: pd.DataFrame) -> str:
    """How many errors have a residual below each of `TO`, over which part of the scenes, and what
    is left out, as the page and README show it; `table` as `explained` gives it."""
    are_explained = "is explained", "are explained"
    scenes, short = table.drop_duplicates("scenario"), cuts(table)
    engines = table[["engine", "profile"]].drop_duplicates().shape[0]
    played = table[table.note == ""]
    errors = played[played.error_radii > LEAST]
    exact, failed = len(played) - len(errors), len(table) - len(played)
    left = errors.residual_radii / errors.error_radii
    within = [int((left <= bound).sum()) for bound in TO]
    said = (
        f"of {counted(len(errors), 'error')} ({counted(engines, 'engine')} in"
        f" {counted(len(scenes), 'scene')}"
        + (f"; {exact} more below {LEAST:g} radii" if exact else "")
        + (f"; {failed} not played" if failed else "")
        + f") {counted(within[0], *are_explained)} to 1 %, {within[1]} to 0.1 %, "
        f"over {scenes.until_s.sum():.0f} of {scenes.horizon_s.sum():.0f} simulated seconds"
    )
    if short.empty:
        return f"{said}, up to the end of every exact answer"
    places = ", ".join(
        f"{row.scenario} at {row.until_s:.2g} of {row.horizon_s:.2g} s"
        for row in short.itertuples()
    )
    are_cut = "1 scene is" if len(short) == 1 else f"{len(short)} scenes are"
    whole = left[~errors.scenario.isin(short.scenario)]
    return (
        f"{said}: {are_cut} cut where end-of-step detection alone puts a disk"
        f" {LIMIT:g} radii off ({places}). Of the {counted(len(whole), 'error')} in scenes that are"
        f" not cut, {counted(int((whole <= TO[0]).sum()), *are_explained)} to 1 %"
    )
