"""A winner tree (tournament tree): finds the disk with the earliest event, with log n comparisons
per change.

Node k holds the earlier of 2 k and 2 k + 1, and node 1 the earliest of all; disk i is leaf p + i, p
a power of two.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.adapters.event_driven.compiled import inlined

# Time and disk lie in one cache line. The disk is a float, so that the processor selects it without
# a branch, as it selects the earlier time. With an integer it branches, mispredicts at every other
# node, and takes twice as long for an event.
NODE = np.dtype([("time", "f8"), ("who", "f8")])
Tree = NDArray[np.void]


def empty_queue(n: int) -> Tree:
    """The tree (2 p,) of n disks without events."""
    p = 1 << max(n - 1, 1).bit_length()
    tree = np.zeros(2 * p, NODE)
    tree["time"] = np.inf
    tree["who"][p:] = np.arange(p)
    for k in range(p - 1, 0, -1):
        tree[k] = tree[2 * k]
    return tree.view(np.recarray)


@inlined
def put(tree: Tree, i: int, time: float) -> None:
    """Set the time of the next event of disk `i`, and update the nodes above it."""
    node, who = (len(tree) >> 1) + i, np.float64(i)
    tree[node].time = time
    while node > 1:
        rival = tree[node ^ 1]
        rival_time, rival_who = rival.time, rival.who
        who = rival_who if rival_time < time else who
        time = rival_time if rival_time < time else time
        node >>= 1
        tree[node].time, tree[node].who = time, who
