"""Tables of slow rows of which the gate plays some, and the long run all."""

from collections.abc import Iterable
from typing import Any

import pytest


def thinned(rows: Iterable[Any], step: int) -> list[Any]:
    """Every `step`-th row for the gate, the others for the long run."""
    return [
        pytest.param(row, marks=[pytest.mark.long] if k % step else [])
        for k, row in enumerate(rows)
    ]
