"""What `crosscheck tune` searches of planck, matter and Rapier: the public settings of their
matched profiles, as the files of this folder name them. searched.csv has a row for each, for two
that are tried together, and for each that is not searched."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

from crosscheck2d.adapters.matched import Searched


def searched_of(engine: str) -> Searched:
    with Path(__file__).with_suffix(".csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["engine"] == engine]
    chosen, settings, pairs, left_alone = dict[str, Any](), {}, [], {}
    for row in rows:
        name, tried = row["setting"], json.loads(row["tried"] or "null")
        if row["chosen"]:
            chosen[name] = json.loads(row["chosen"])
            settings[name] = (tuple(tried), row["meaning"])
        elif tried:
            first, second = name.split(" + ")
            pairs.append(((first, second), tuple(tried[0]), tuple(tried[1])))
        else:
            left_alone[name] = row["meaning"]
    return Searched(chosen, settings, tuple(pairs), left_alone)
