"""The phases of a collision within its step, over which a limit is searched."""

import numpy as np
import pytest

from crosscheck2d.reports.stability.cases_few import EDGE, phase


def test_phases_are_spread_evenly_and_drawn_and_fewer_are_the_first_of_more():
    # The step's very beginning first; no gap between 32 phases is wider than a sixteenth of a step.
    phases = [phase(run) for run in range(32)]

    assert phases[0] == EDGE
    assert phases[1:8:2] == pytest.approx([0.5, 0.25, 0.75, 0.125], abs=2 * EDGE)
    assert all(EDGE <= one <= 1 - EDGE for one in phases)
    assert np.diff(sorted(phases)).max() < 1 / 16 + 2 * EDGE
    random = phases[2::2]
    # what is random is no round share of a step
    assert min(abs(one * 32 - round(one * 32)) for one in random) > 1e-3
