"""Numbers published by others come out of our adapters."""

import pytest

from crosscheck2d.reports.run.known_answers import KNOWN_ANSWERS, KnownAnswer


@pytest.mark.parametrize(
    "known",
    [
        pytest.param(
            known,
            id=f"{known.column} {known.made_by} {known.dt_s:g}",
            marks=pytest.mark.slow if known.dt_s < 1e-3 else (),
        )
        for known in KNOWN_ANSWERS
    ],
)
def test_a_published_number_comes_out_digit_for_digit(known: KnownAnswer):
    # Published with six significant digits; both sides sum the same doubles in another order.
    assert f"{known.reproduce():.6g}" == f"{known.published_J2:.6g}"
