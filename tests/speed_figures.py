"""README's sentences on speed and accuracy, from the kept tables: `python -m tests.speed_figures` prints them.

A sentence names every engine of which it does not hold, so that none can be spoken for by the others.
"""

from __future__ import annotations

import re

import pandas as pd

from adapters.engines import ENGINES
from reports.speed import explained, figures
from reports.speed.figures import AGAINST, AGAINST_BARE
from reports.speed.tables import no_nearer
from reports.speed.versus import LATE, OWN
from scenarios.catalogue import scenario

SHIPPED = tuple(name for name in ENGINES if name.endswith(":shipped"))
MATCHED = tuple(name for name in ENGINES if name.endswith(":matched"))
MILLIONTH = "1e-6"


def named(table: pd.DataFrame) -> pd.DataFrame:
    """With a column name, `engine:profile`."""
    return table.assign(name=table.engine + ":" + table.profile)


def nearer(orders: pd.DataFrame) -> str:
    """In how many scenes finer steps bring an engine no nearer, engine by engine."""
    rows = named(orders)
    none = rows[no_nearer(rows)].groupby("name").size()
    counts = {name: int(none.get(name, 0)) for name in (*SHIPPED, *MATCHED)}
    shipped = listed([f"{name.split(':')[0]} {counts[name]}" for name in SHIPPED])
    matched = listed([f"{name.split(':')[0]} {counts[name]}" for name in MATCHED])
    return (
        f"From its coarsest to its finest step the error falls by less than a tenth in so many of "
        f"{rows.scenario.nunique()} scenes: shipped, {shipped}; matched, {matched}."
    )


def spelt(table: pd.DataFrame) -> str:
    """How much of the errors is explained, and over how much of the scenes."""
    return explained.sentence(table) + "."


def costs(kept: pd.DataFrame) -> str:
    """In how many scenes our own solver costs least at the same steps; who costs less elsewhere, and where."""
    rows, bare = (named(kept[(kept.figure == figure) & (kept["at"] == "")]) for figure in (AGAINST, AGAINST_BARE))
    total = max(int(of(note)[1]) for note in rows.note)
    less = {row.name: where(row.note) for row in rows.set_index("name", drop=False).itertuples(index=False)}
    scenes = sorted({scene for each in less.values() for scene in each})
    said = f"Of the engines with end-of-step detection, `{OWN}` costs least in {total - len(scenes)} of {total} scenes"
    if scenes:
        said += f"; in {listed(scenes)} {listed([name for name, each in less.items() if each])} cost less"
    if scenes and all(scenario(scene).thrusts for scene in scenes):
        said += ", as a force in every step is a call from Python in every step"
    without = sorted({scene for note in bare.note for scene in where(note)})
    if without != scenes:
        said += f" (without what an idle step costs, in {listed(without) if without else 'none'})"
    changed = named(kept[(kept.figure == AGAINST) & (kept["at"] != "")])
    cheaper = [f"{name} with {change}" for name, change, note in zip(changed.name, changed["at"], changed.note)
               if where(note)]  # fmt: skip
    if cheaper:
        return f"{said}. Changed in a setting, {listed(cheaper)} cost less, too."
    return f"{said}. None of {len(changed)} changed settings of the matched engines costs less in any scene tried."


def where(note: str) -> list[str]:
    """The scenes of a note like "2 of 38: one another"."""
    return note.split(":")[1].split()


def of(note: str) -> tuple[int, int]:
    """k and n of a note that begins with, or holds, "k of n"."""
    found = re.search(r"(\d+) of (\d+)", note)
    assert found is not None, note
    return int(found[1]), int(found[2])


def as_far(kept: pd.DataFrame) -> str:
    """How far off the matched engines are at the same step, over our own solver, and what a halved step does."""
    table = named(kept)
    error, cost = (table[table.figure == f"pooled {what}"].pivot(index="name", columns="at", values="value")
                   for what in ("error", "cost"))  # fmt: skip
    over = error.loc[list(MATCHED)] / error.loc[OWN]
    late = [OWN, *MATCHED]
    falls, grows = (table.loc[late].to_numpy() for table in (error, cost))
    falls, grows = falls[:, :-1] / falls[:, 1:], grows[:, 1:] / grows[:, :-1]
    return (
        f"At the same step the matched engines are {over.min(axis=None):.1f} to {over.max(axis=None):.1f} times as far "
        f"off as it is. Halving the step divides their errors by {falls.min():.1f} to {falls.max():.1f} and multiplies "
        f"the cost by {grows.min():.1f} to {grows.max():.1f}"
    )


def millionth(kept: pd.DataFrame) -> str:
    """In how many scenes each engine gets to a millionth of a radius."""
    rows = named(kept[(kept.figure == "cost at accuracy") & (kept["at"] == MILLIONTH)]).set_index("name")
    got = {name: of(rows.note[name])[0] for name in rows.index}
    total, late = of(rows.note.iloc[0])[1], [got[name] for name in (OWN, *LATE)]
    ordered, driven = got["reference:ordered"], got["event_driven:float64"]
    failed = named(kept[kept.figure == "pooled error"])
    lost = max(int(of(note)[0]) for note in failed[failed.name == "event_driven:float64"].note)
    return (
        f"With end-of-step detection an engine gets to a millionth of a radius in {min(late)} to {max(late)} of "
        f"{total} scenes; `reference:ordered` in {ordered}, and the event-driven engine, which fails {lost}, in "
        f"{driven}"
    )


def listed(words: list[str]) -> str:
    """As a sentence lists them."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def sentences() -> list[str]:
    """All of them, as README holds them but for its line breaks."""
    kept, orders, table = (figures.read(path) for path in (figures.KEPT, figures.ORDERS, figures.EXPLAINED))
    return [costs(kept), as_far(kept), millionth(kept), nearer(orders), spelt(table)]


if __name__ == "__main__":
    print("\n\n".join(sentences()))
