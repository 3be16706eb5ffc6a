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
        again: the command that takes the times.
    """

    table: pd.DataFrame
    noise: Noise
    asked: float
    again: str = ""

    @property
    def fault(self) -> str:
        """Why no time is shown, as a sentence; "" if times are shown."""
        take = f" To take them: {self.again}" if self.again else ""
        if self.table.empty and not self.asked:
            return f"No times were taken.{take}"
        if self.table.empty or not self.noise.pairs:
            return f"The engines could not be timed within {self.asked:g} s.{take}"
        if self.noise.floor > BUSY:
            return (
                "The machine was busy: an engine timed twice differs from itself by"
                f" {style.number(100 * self.noise.floor, 2)} %, so no times are shown.{take}"
            )
        return ""


NO_CLOCK = RunTimes(pd.DataFrame(columns=COLUMNS), noise_of([]), 0.0)
