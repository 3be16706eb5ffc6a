"""The page of the game as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from adapters.engines import ENGINES, OWN
from reports.game.divergence import DIVERGED, WAIT
from reports.game.flight import FRAME, SUBSTEPS
from reports.page.documents import render
from reports.page.own_solvers import Said
from reports.page.style import looks_of
from scenarios.model import Scenario


def game_page(
    engines: Sequence[str],
    file: Scenario | None,
    mark: str,
    restitution: float,
    said: Mapping[str, Sequence[Said]],
) -> str:
    """The page, which begins with these engines, in a field of this restitution.

    `file`: the flight it shows again; `mark`: its server's; `said`: engine -> what `check` says of
    its file.
    """
    # in space there is no friction, and who adds it gives the bits of another engine
    offered = [name for name, row in ENGINES.items() if not row.adds_friction]
    rows = {name: ENGINES[name] for name in dict.fromkeys([*engines, *offered])}
    return render(
        "game/game.html.j2",
        generator="crosscheck play",
        scripts=["game/field.js", "game/game.js"],
        styles=["game/game.css"],
        looks=looks_of(rows),
        connects=True,
        rows=rows,
        labels=labels(list(rows)),
        flown=list(engines),
        steps={k: FRAME / k for k in SUBSTEPS},
        file=file,
        mark=mark,
        diverged=DIVERGED,
        wait=WAIT,
        restitution=restitution,
        said=said,
    )


def labels(names: Sequence[str]) -> dict[str, str]:
    """How the field calls each engine: a solver's file by as much of the end of its path as tells
    it from the others, all else by its name."""
    paths = {name: Path(name.removesuffix(OWN)).parts for name in names if name.endswith(OWN)}
    found = {name: name for name in names}
    for name, parts in paths.items():
        others = [other for one, other in paths.items() if one != name]
        ends = (parts[-k:] for k in range(1, len(parts) + 1))
        found[name] = "/".join(
            next((end for end in ends if all(o[-len(end) :] != end for o in others)), parts)
        )
    return found
