"""The lines of a journal, and a journal of other lines, each with its right sum."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from crosscheck2d.reports.run.journal import JOURNAL, written


def contents(folder: Path) -> list[dict[str, Any]]:
    """What the lines hold, without their sums."""
    lines = [json.loads(line) for line in (folder / JOURNAL).read_text().splitlines()]
    return [{key: value for key, value in line.items() if key != "sum"} for line in lines]


def put(folder: Path, lines: Iterable[dict[str, Any]]) -> Path:
    """A folder with these lines."""
    (folder / JOURNAL).write_bytes(b"".join(map(written, lines)))
    return folder
