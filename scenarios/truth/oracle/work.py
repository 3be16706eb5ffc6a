"""Limits on the work for an answer: a number of steps, the same on every machine, and a time limit
where somebody waits for the answer."""

from __future__ import annotations

from math import inf
from time import monotonic

from crosscheck2d.scenarios.truth.oracle.path import MotionEnds

# collisions, edges crossed, records made anew, orders of simultaneous collisions tried
MOST_STEPS = 60_000


class TimeLimit:
    """A time limit for all attempts at an answer, from the creation of the object on.

    An answer that it cuts short depends on the machine, and is never cached.

    Attributes:
        end: s, as of `monotonic`, when the time runs out.
        reason: why an answer that is cut short ends.
        expired: whether an attempt was cut short.
    """

    def __init__(self, seconds: float = inf, reason: str = "") -> None:
        self.end, self.reason, self.expired = monotonic() + seconds, reason, False


class WorkLimit:
    """The limits of one attempt: `left` steps, and a share of the time that its clock has left."""

    def __init__(
        self, left: int = MOST_STEPS, clock: TimeLimit | None = None, share: float = 1.0
    ) -> None:
        self.left, self.clock, now = left, clock or TimeLimit(), monotonic()
        self.stop = now + share * (self.clock.end - now)

    def step(self, t: float, bits: int) -> None:
        """Count a step that led to `t` s in numbers of `bits` bits; raises `MotionEnds` if none is
        left."""
        self.left -= 1
        if self.left < 0:
            raise MotionEnds(t, f"the work allowed for an answer in {bits} bits is used up")
        if monotonic() > self.stop:
            self.clock.expired = True
            raise MotionEnds(t, self.clock.reason)
