"""What an answer may cost: steps, which are the same everywhere, and the time of somebody who waits
for it."""

from __future__ import annotations

from math import inf
from time import monotonic

from scenarios.truth.oracle.path import Ends

# collisions, edges crossed, records made anew, orders of simultaneous collisions tried
MOST_STEPS = 60_000


class Clock:
    """A limit of time for all attempts at an answer; it runs from when it is made.

    What it cuts off depends on the machine, and is never kept.

    Attributes:
        end: s, as of `monotonic`, when it is over.
        reason: why an answer goes no further then.
        struck: whether an attempt was cut off.
    """

    def __init__(self, seconds: float = inf, reason: str = "") -> None:
        self.end, self.reason, self.struck = monotonic() + seconds, reason, False


class Work:
    """What one attempt may cost: so many steps, and a share of the time that its clock has left."""

    def __init__(
        self, left: int = MOST_STEPS, clock: Clock | None = None, share: float = 1.0
    ) -> None:
        self.left, self.clock, now = left, clock or Clock(), monotonic()
        self.stop = now + share * (self.clock.end - now)

    def step(self, t: float, bits: int) -> None:
        """Count a step that led to `t` s in numbers of so many bits; raises `Ends` where none is
        left."""
        self.left -= 1
        if self.left < 0:
            raise Ends(t, f"the work allowed for an answer in {bits} bits is used up")
        if monotonic() > self.stop:
            self.clock.struck = True
            raise Ends(t, self.clock.reason)
