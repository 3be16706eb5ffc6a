"""The settings of the matched profiles, of matched.toml, which `crosscheck tune` searches."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Searched:
    """The public settings of an engine that `crosscheck tune` searches for its matched profile."""

    chosen: dict[str, Any]  # setting -> its value in the matched profile
    # setting -> (the values tried, the chosen one among them; meaning and unit)
    settings: Mapping[str, tuple[Sequence[Any], str]]
    # two settings with related effects, tried together: names, values of the first, of the second
    pairs: Sequence[tuple[Sequence[str], Sequence[Any], Sequence[Any]]]
    left_alone: Mapping[str, str]  # a setting that is not searched -> why


@cache
def read_table() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def read_searched(engine: str) -> Searched:
    table = read_table()[engine]
    settings = table["settings"]
    return Searched(
        {name: row["chosen"] for name, row in settings.items()},
        {name: (row["tried"], row["meaning"]) for name, row in settings.items() if "tried" in row},
        table.get("pairs", ()),
        table["left_alone"],
    )
