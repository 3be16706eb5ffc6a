"""The figures of the oracle that are written down: computed again, and what they claim.

`python -m tests.bench.oracle` writes them; `uv run pytest -m slow
tests/bench/test_oracle_figures.py` computes them again.
"""

from __future__ import annotations

import csv

import numpy as np
import pytest

from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.exact import ACCURACY, computed
from tests.bench.oracle import FIGURES, FLOORS, questions, said
from tests.scenarios.test_catalogue import smallest_gap

WRITTEN = list(csv.DictReader(FIGURES.open(encoding="utf-8")))


def row_of(name: str, duration: float) -> dict[str, str]:
    return next(
        row for row in WRITTEN if (row["scene"], float(row["duration_s"])) == (name, duration)
    )


def test_the_box_is_certified_within_its_floors():
    # 60 s within 0.2 s and 600 s within 3 s, on the machine that wrote the figures.
    boxes = [row for row in WRITTEN if row["scene"].startswith("box")]
    assert {float(row["duration_s"]) for row in boxes} == set(FLOORS)
    for row in boxes:
        assert (row["method"], row["ends_because"]) == ("certified", "")
        assert float(row["seconds"]) < FLOORS[float(row["duration_s"])]


def test_falling_boxes_are_answered_beyond_their_first_rest():
    falls = [row for row in WRITTEN if row["scene"].startswith("fall")]
    assert len(falls) >= 9
    for row in falls:
        assert float(row["horizon_s"]) > float(row["first_rest_s"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "one"),
    [
        pytest.param(name, one, marks=[pytest.mark.long] if k % 4 else [])
        for k, (name, _, one) in enumerate(questions())
    ],
)
def test_the_figures_are_what_is_computed(name: str, one: Scenario):
    # The same collisions, rests and horizon to the microsecond they are written with; nothing
    # overlaps, energy falls.
    record, written = computed(one), row_of(name, one.duration)
    found, truth, scene = said(one, record), record.sampled(one.scene, [], one.times), one.scene
    energy = (scene.mass * ((truth.velocity**2).sum(-1) / 2 - truth.position @ scene.gravity)).sum(
        axis=1
    )

    assert {name: str(value) for name, value in found.items()} == {
        name: written[name] for name in found
    }
    assert smallest_gap(scene, truth.position).min() > -ACCURACY
    # Energies of up to 500 J, rounded.
    assert (np.diff(energy) < 1e-11).all()
