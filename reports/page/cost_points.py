"""The times of a run, and why none is shown."""

from __future__ import annotations

from typing import NamedTuple

import pandas as pd

from crosscheck2d.reports.page import style
from crosscheck2d.reports.run.timing import Noise, noise_of
from crosscheck2d.reports.run.timing_pass import BUSY, COLUMNS


class RunTimes(NamedTuple):
    """The times of a run.

    Attributes:
        table: timings.csv.
        noise: the ratios of two timings of one engine.
        asked: the time limit of the timing pass, s.
    """

    table: pd.DataFrame
    noise: Noise
    asked: float

    @property
    def fault(self) -> str:
        """Why no time is shown, as a sentence; "" if times are shown."""
        if not self.asked:
            return "This run took no times (--timings 0)."
        if self.table.empty or not self.noise.pairs:
            return f"The engines could not be timed within {self.asked:g} s."
        if self.noise.floor > BUSY:
            return (
                "The machine was busy: an engine timed twice differs from itself by"
                f" {style.number(100 * self.noise.floor, 2)} %, so no times are shown."
            )
        return ""


NO_CLOCK = RunTimes(pd.DataFrame(columns=COLUMNS), noise_of([]), 0.0)
