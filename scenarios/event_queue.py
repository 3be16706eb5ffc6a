"""A winner tree: which of n keys is the smallest, kept up to date in log n comparisons a change.

`tree` has 2 p leaves and nodes for p = the next power of two above n: node k wins of 2 k and 2 k + 1, leaf p + i is i.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenarios.compiled import kernel
from scenarios.model import Array


def empty_queue(n: int) -> tuple[Array, NDArray[np.int32]]:
    """Keys (p,), all inf, and their tree (2 p,)."""
    p = 1 << max(n - 1, 1).bit_length()
    tree = np.zeros(2 * p, np.int32)
    tree[p:] = np.arange(p)
    for node in range(p - 1, 0, -1):
        tree[node] = tree[2 * node]
    return np.full(p, np.inf), tree


@kernel
def put(key: Array, tree: NDArray[np.int32], i: int, new: float) -> None:
    """Give `i` a new key; above a match that `i` neither won nor wins, nothing changes."""
    key[i] = new
    node = (len(key) + i) >> 1
    while node > 0:
        left, right = tree[2 * node], tree[2 * node + 1]
        winner = left if key[left] <= key[right] else right
        if tree[node] == winner and winner != i:
            return
        tree[node] = winner
        node >>= 1
