"""Gases of hard disks by the event engine: pressure, rate of collisions and speeds of the
literature; nothing drifts."""

from __future__ import annotations

import numpy as np
import pytest

from crosscheck2d.reports.stability.predicates_gas import compressibility
from tests.adapters.event_driven.event_figures import PACKINGS, measured, read


def check(row, tolerance):
    excess = compressibility(row["packing"]) - 1
    assert abs(row["Z"] - row["Z_reference"]) < tolerance * excess
    assert abs(row["rate"] / row["rate_reference"] - 1) < tolerance
    assert row["energy_drift"] < 1e-12
    assert row["momentum_drift"] < 1e-12


def test_a_gas_has_the_pressure_energy_and_momentum_of_the_literature():
    # A million collisions of 1024 disks at packing 0.3; 0.6 % is three times the statistical error.
    check(measured(0.3, collisions=1_000_000), 0.006)


@pytest.mark.parametrize("packing", PACKINGS)
def test_the_committed_figures_are_those_of_the_literature(packing):
    # Within four standard errors, reported by the blocks; Z is off by (Z - 1) / N at first order,
    # by the next one too.
    row = read()[packing]
    assert row["collisions"] > 9.9e6
    for name in ("Z", "rate"):
        assert (
            abs(row[name] - row[f"{name}_reference"])
            < 4 * row[f"{name}_error"] + row[f"{name}_reference"] / 1024**1.5
        )
    check(row, 0.002)
    # <v4> / <v2>2 = 2 N / (N + 1); 1024 samples of an exponential: their standard
    # deviation is 2 sqrt(5 / N).
    assert abs(row["v4_over_v2_squared"] - 2) < 4 * 2 * np.sqrt(5 / 1024)


@pytest.mark.slow
@pytest.mark.parametrize(
    "packing",
    [PACKINGS[0], *(pytest.param(packing, marks=pytest.mark.long) for packing in PACKINGS[1:])],
)
def test_the_committed_figures_come_out_again(packing):
    # Other code generation rounds otherwise, and chaos makes it another sample: within the errors
    # of both.
    row, new = read()[packing], measured(packing)
    for name in ("Z", "rate"):
        assert abs(new[name] - row[name]) < 4 * np.sqrt(2) * row[f"{name}_error"]
    check(new, 0.002)
