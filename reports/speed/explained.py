"""The share of the errors that the error budget explains, and the share of the scenes that is
evaluated."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from crosscheck2d.reports.speed.budget import LIMIT, RESIDUAL, TOTAL, WHOSE
from crosscheck2d.reports.terminal.counts import counted

LEAST = 1e-9  # radii; smaller errors are rounding and need no explanation
TO = (0.01, 0.001)  # of an error: an error with a smaller residual counts as explained
COLUMNS = [*WHOSE, "error_radii", "residual_radii", "note"]


class Cut(NamedTuple):
    """A scene that is evaluated for a shorter time than its exact answer lasts; both in s."""

    scenario: str
    until: float
    horizon: float

    @property
    def share(self) -> float:
        """The part of the exact answer that is evaluated."""
        return self.until / self.horizon


class Extent(NamedTuple):
    """The number of scenes, the simulated seconds that are evaluated and those that have an
    exact answer, and the scenes that are cut."""

    scenes: int
    evaluated: float
    horizon: float
    cuts: list[Cut]


class Share(NamedTuple):
    """How many errors there are, how many have a relative residual below each of `TO`, and how many
    runs are left out.

    exact: errors below `LEAST`, which need no explanation; failed: runs that were not played. whole
    and whole_within: errors of scenes that are not cut, and how many of them have a relative
    residual below the first of `TO`.
    """

    errors: int
    within: tuple[int, ...]
    exact: int
    failed: int
    whole: int
    whole_within: int


def explained(budget: pd.DataFrame) -> pd.DataFrame:
    """A row for each scene and engine, of `COLUMNS`: its error, its residual (root mean squares),
    and how far the scene was evaluated, its exact answer goes, and the scene goes; note: why the
    engine has no error.
    """
    total, residual = (budget[budget.contribution == name] for name in (TOTAL, RESIDUAL))
    errors = total.rename(columns={"position_radii": "error_radii"})
    left = residual[[*WHOSE, "position_radii"]].set_axis([*WHOSE, "residual_radii"], axis=1)
    return errors.merge(left, on=WHOSE, how="left")[COLUMNS]


def extent(table: pd.DataFrame) -> Extent:
    """The part of the scenes for which errors have a budget; `table` as `explained` gives it."""
    scenes = table.drop_duplicates("scenario")
    rows = zip(scenes.scenario, scenes.until_s.astype(float), scenes.horizon_s.astype(float))
    cuts = [Cut(*row) for row in rows if row[1] < row[2] * (1 - 1e-9)]
    return Extent(len(scenes), float(scenes.until_s.sum()), float(scenes.horizon_s.sum()), cuts)


def share(table: pd.DataFrame) -> Share:
    """The number of errors that are explained; `table` as `explained` gives it."""
    played = table[table.note == ""]
    errors = played[played.error_radii > LEAST]
    left = errors.residual_radii / errors.error_radii
    whole = ~errors.scenario.isin([cut.scenario for cut in extent(table).cuts])
    return Share(
        len(errors),
        tuple(int((left <= bound).sum()) for bound in TO),
        len(played) - len(errors),
        len(table) - len(played),
        int(whole.sum()),
        int((left[whole] <= TO[0]).sum()),
    )


EXPLAINED = "is explained", "are explained"


def sentence(table: pd.DataFrame) -> str:
    """The share and the extent in words, as the page and README show them."""
    known, over = share(table), extent(table)
    engines = table[["engine", "profile"]].drop_duplicates().shape[0]
    said = (
        f"of {counted(known.errors, 'error')} ({counted(engines, 'engine')} in"
        f" {counted(over.scenes, 'scene')}"
        + (f"; {known.exact} more below {LEAST:g} radii" if known.exact else "")
        + (f"; {known.failed} not played" if known.failed else "")
        + f") {counted(known.within[0], *EXPLAINED)} to 1 %, {known.within[1]} to 0.1 %, "
        f"over {over.evaluated:.0f} of {over.horizon:.0f} simulated seconds"
    )
    if not over.cuts:
        return f"{said}, up to the end of every exact answer"
    cuts = ", ".join(
        f"{cut.scenario} at {cut.until:.2g} of {cut.horizon:.2g} s" for cut in over.cuts
    )
    are_cut = "1 scene is" if len(over.cuts) == 1 else f"{len(over.cuts)} scenes are"
    return (
        f"{said}: {are_cut} cut where end-of-step detection alone puts a disk"
        f" {LIMIT:g} radii off ({cuts}). Of the {counted(known.whole, 'error')} in scenes that are"
        f" not cut, {counted(known.whole_within, *EXPLAINED)} to 1 %"
    )
