"""What README.md and reports/speed/README.md say in numbers, from the kept tables.

`python -m tests.reports.speed.statements` prints it. Every engine is named of which a statement
does not hold, so that none can be spoken for by the others.
"""

from __future__ import annotations

import re
from math import inf

import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.compare.accuracy import FINEST, NEARER, YARDSTICK
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import figures
from crosscheck2d.reports.speed.budget import explained_share
from crosscheck2d.reports.speed.figures import AGAINST, AGAINST_BARE
from crosscheck2d.reports.speed.tables import COMPARED, names_of
from crosscheck2d.reports.terminal.counts import counted

SHIPPED = tuple(name for name in ENGINES if name.endswith(":shipped"))
MATCHED = tuple(name for name in ENGINES if name.endswith(":matched"))
MILLIONTH = "1e-6"


def named(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(name=names_of(table))


LATE_BY_KIND = {
    f"`{YARDSTICK}` and the matched engines": (YARDSTICK, *MATCHED),
    "`reference:lesson`": ("reference:lesson",),
    "the engines as shipped": SHIPPED,
}
"""Of whom the caption speaks -> the engines with end-of-step detection that it speaks of: all of
them."""


def caption(kept: pd.DataFrame) -> str:
    rows = named(kept[(kept.figure == "cost at accuracy") & (kept["at"] == MILLIONTH)]).set_index(
        "name"
    )
    got = {name: of(rows.note[name])[0] for name in rows.index}
    failed = named(kept[kept.figure == "pooled error"])
    lost = max(int(of(note)[0]) for note in failed[failed.name == "event_driven:float64"].note)
    reached = [got[name] for name in (YARDSTICK, *COMPARED)]
    falls, grows = halving(kept)
    spans = [span(falls.loc[list(names)]) for names in LATE_BY_KIND.values()]
    by = ", ".join(f"by {text} for {kind}" for kind, text in zip(LATE_BY_KIND, spans))
    return (
        f"Halving the step multiplies the time of these engines by {span(grows)}, and divides"
        f" their error {by}"
        f"{' (below 1: the error grows)' if falls.min(axis=None) < 1 else ''}"
        f"{', where not too many scenes fail' if falls.isna().any(axis=None) else ''}. These come"
        f" within a millionth of a radius of the exact answer in {min(reached)} to {max(reached)}"
        f" of {of(rows.note.iloc[0])[1]} scenes. The two engines that take each collision at its"
        f" own time do so in {got['reference:ordered']} (`reference:ordered`) and"
        f" {got['event_driven:float64']} (event-driven; it fails in {lost})."
    )


def halving(kept: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """By what each halving of the step divides the pooled error, and multiplies the cost: a row an
    engine. NaN where an engine fails in so many scenes that its pooled error is infinite."""
    late = [name for names in LATE_BY_KIND.values() for name in names]
    error, cost = (table.loc[late].sort_index(axis=1) for table in pooled(kept))
    error = error.where(error < inf)
    coarse, fine = list(error.columns[:-1]), list(error.columns[1:])
    return (
        pd.DataFrame(error[coarse].to_numpy() / error[fine].to_numpy(), late),
        pd.DataFrame(cost[fine].to_numpy() / cost[coarse].to_numpy(), late),
    )


def span(ratios: pd.DataFrame) -> str:
    return f"{ratios.min(axis=None):.1f} to {ratios.max(axis=None):.1f}"


def costs(kept: pd.DataFrame) -> str:
    rows, bare = (
        named(kept[(kept.figure == figure) & (kept["at"] == "")])
        for figure in (AGAINST, AGAINST_BARE)
    )
    total = max(int(of(note)[1]) for note in rows.note)
    less = scenes_of(rows)
    said = (
        f"Of the engines with end-of-step detection, `{YARDSTICK}` costs least in"
        f" {total - len(less)} of {total} scenes"
    )
    said += (
        ". In the others these cost less:\n\n| scene | engines |\n|---|---|\n" if less else ".\n"
    )
    said += "".join(f"| {scene} | {', '.join(names)} |\n" for scene, names in less.items())
    without = scenes_of(bare)
    if set(without) != set(less):
        said += (
            "\nIf the cost of an idle step is subtracted, some engine costs less in"
            f" {counted(len(without), 'scene')}: "
        )
        said += f"{', '.join(without) if without else 'none'}.\n"
    changed = named(kept[(kept.figure == AGAINST) & (kept["at"] != "")])
    cheaper = scenes_of(changed.assign(name=changed.name + " with " + changed["at"]))
    if cheaper:
        names = dict.fromkeys(name for names in cheaper.values() for name in names)
        return (
            f"{said}\nWith one setting changed, these cost less in {', '.join(cheaper)}:"
            f" {', '.join(names)}.\n"
        )
    return (
        f"{said}\nNone of {len(changed)} changed settings of the matched engines costs less in any"
        " scene tried.\n"
    )


def scenes_of(rows: pd.DataFrame) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for row in rows.itertuples(index=False):
        for scene in where(row.note):
            found.setdefault(scene, []).append(row.name)
    return dict(sorted(found.items()))


def where(note: str) -> list[str]:
    return note.split(":")[1].split()


def of(note: str) -> tuple[int, int]:
    found = re.search(r"(\d+) of (\d+)", note)
    assert found is not None, note
    return int(found[1]), int(found[2])


def pooled(kept: pd.DataFrame) -> list[pd.DataFrame]:
    table = named(kept)
    return [
        table[table.figure == f"pooled {what}"].pivot(index="name", columns="at", values="value")
        for what in ("error", "cost")
    ]


def as_far(kept: pd.DataFrame) -> str:
    error, _ = pooled(kept)
    over = error.loc[list(MATCHED)] / error.loc[YARDSTICK]
    return (
        f"At the same step the matched engines are {over.min(axis=None):.1f} to"
        f" {over.max(axis=None):.1f} times as far off as `{YARDSTICK}`.\n"
    )


def no_nearer(fitted: pd.DataFrame) -> pd.Series:
    """For each row of `orders`, whether the error falls by less than a tenth from the coarsest
    to the finest step.

    False if all steps failed, or if the finest one has an error of at most `FINEST`; True if
    only the finest step failed.
    """
    falls = fitted.finest_error < NEARER * fitted.coarsest_error
    return ~falls & (fitted.finest_error > FINEST) & (fitted.failed < fitted.steps)


def nearer(orders: pd.DataFrame) -> str:
    rows = named(orders)
    none = rows[no_nearer(rows)].groupby("name").size()
    said = (
        f"In how many of {rows.scenario.nunique()} scenes the error falls by less than a tenth from"
        " the coarsest to the finest step, and is not yet below a millionth of a radius:\n\n"
        "| engine | scenes |\n|---|---|\n"
    )
    return said + "".join(
        f"| {name} | {none.get(name, 0)} |\n" for name in ENGINES if name in set(rows.name)
    )


def budget(table: pd.DataFrame) -> str:
    smooth, rough = (explained_share(part) for part in apart(table))
    return f"Without friction: {smooth}. With friction: {rough}.\n"


def apart(table: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    rough = {name for name in set(table.scenario) if open_scene(name, 0).scene.friction}
    with_friction = table.scenario.isin(rough)
    return table[~with_friction], table[with_friction]


def measured() -> str:
    kept, orders, table = (
        figures.read(path) for path in (figures.KEPT, figures.ORDERS, figures.EXPLAINED)
    )
    return "\n".join([costs(kept), as_far(kept), nearer(apart(orders)[0]), budget(table)])


if __name__ == "__main__":
    print(caption(figures.read(figures.KEPT)), measured(), sep="\n\n")
