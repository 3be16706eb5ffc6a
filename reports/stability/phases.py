"""Where within its step a collision happens in the runs of a case: half of the phases evenly
spread, half random, in an order such that the first few are a good sample."""

from __future__ import annotations

from functools import cache

import numpy as np

EDGE = 1e-3  # of a step: how near to a step's very beginning, or end, a phase comes
MOST = 1024  # runs, more than any case has


@cache
def sampled(seed: int) -> tuple[float, ...]:
    """`MOST` numbers from 0 to 1, the same for a seed on every machine."""
    return tuple(float(x) for x in np.random.default_rng(seed).random(MOST))


def phase(run: int) -> float:
    """Where within its step the collision of a run happens: 0 is the beginning of the step, 1
    its end.

    Run 0 has it at the very beginning, where it is found latest. Of the other runs every second
    follows an even sequence (van der Corput: 1/2, 1/4, 3/4, 1/8 ...) and the rest are random,
    because an error that repeats with the step could escape the even ones.
    """
    if run == 0:
        return EDGE
    where = radical_inverse((run + 1) // 2) if run % 2 else sampled(seed=0)[run // 2]
    return EDGE + (1 - 2 * EDGE) * where


def radical_inverse(k: int) -> float:
    """The binary digits of k mirrored at the point: 1 -> 1/2, 2 -> 1/4, 3 -> 3/4 (van der Corput,
    1935)."""
    value, share = 0.0, 0.5
    while k:
        value, k, share = value + share * (k & 1), k >> 1, share / 2
    return value
