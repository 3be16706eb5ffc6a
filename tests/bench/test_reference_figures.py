"""The figures of the reference that are written down: they are as demanded, and some are measured
again.

`python -m tests.bench.reference` writes them; `.ci/long tests/bench/test_reference_figures.py`
measures again, on an otherwise idle machine.
"""

from __future__ import annotations

import csv

import pytest

from tests.adapters.event_driven.gases import boxed_gas
from tests.bench.reference import DT, FIGURES, LEAST, compared, engines

WRITTEN = [
    line for line in FIGURES.read_text(encoding="utf-8").splitlines() if not line.startswith("#")
]
# of what is demanded: on a busy machine the engines and the reference lose their caches unequally
LOOSE = 2.0


def test_every_figure_is_as_demanded():
    rows = [row for row in csv.DictReader(WRITTEN) if row["at_least"] or row["at_most"]]
    assert len(rows) >= 14
    for row in rows:
        assert (
            float(row["at_least"] or 0) <= float(row["value"]) <= float(row["at_most"] or "inf")
        ), row


@pytest.mark.long
def test_the_reference_is_still_several_times_as_fast_as_the_engines():
    found = list(compared("gas", 1000, engines(boxed_gas(1000, 0.3), DT), LEAST))
    demanded = [figure for figure in found if figure.at_least is not None]
    assert len(demanded) == 6
    for figure in demanded:
        assert figure.value > figure.at_least / LOOSE, figure
