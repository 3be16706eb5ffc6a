"""Several contacts at once as a linear complementarity problem: impulses where nothing bounces
back, and the forces of contacts that last.

Contact a closes at w_a = q_a + sum A_ab l_b along its direction, for impulses (or forces) l. A is
the Delassus matrix. Where no entry off its diagonal is positive, A is an M-matrix: then taking the
contacts in any fair order, each with the impulse that ends its approach, converges to the one
solution l >= 0, w >= 0, l w = 0 (Cottle, Pang & Stone, The Linear Complementarity Problem, 3.11).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from crosscheck2d.scenarios.model import Array
from crosscheck2d.scenarios.truth.oracle.numbers import Number, Numbers

MOST_PIVOTS = 300
# Orders of collisions at one instant with 0 < e < 1: states whose ratios agree within this are one
ALIKE = 0.01
MOST_STATES = 40_000
MARGIN = 1.5  # every order stays by this factor below the ratio at which collisions could end


def is_m_matrix(k: Numbers, matrix: Sequence[Sequence[Number]]) -> bool:
    n = range(len(matrix))
    return not any(k.sign(matrix[a][b]) > 0 for a in n for b in n if a != b)


def complementary(
    k: Numbers, matrix: Sequence[Sequence[Number]], q: Sequence[Number]
) -> dict[int, Number] | None:
    """The l > 0 of the linear complementarity problem, by contact; None where the matrix is
    singular.

    Pivots on the least index that is wrong; they end, as all principal minors of a Delassus matrix
    with independent contacts are positive (Murty, Linear Algebra Appl. 7, 65, 1974).
    """
    active: list[int] = []
    for _ in range(MOST_PIVOTS):
        part = [[matrix[a][b] for b in active] for a in active]
        solution = solve(k, part, [-q[a] for a in active])
        if solution is None:
            return None
        forces = dict(zip(active, solution))
        speeds = (
            q[a] + sum(matrix[a][b] * force for b, force in forces.items()) for a in range(len(q))
        )
        values = (forces.get(a, speed) for a, speed in enumerate(speeds))
        wrong = next((a for a, value in enumerate(values) if k.sign(value) < 0), None)
        if wrong is None:
            return {a: force for a, force in forces.items() if k.sign(force)}
        active = sorted({*active} ^ {wrong})
    return None


def solve(
    k: Numbers, matrix: Sequence[Sequence[Number]], right: Sequence[Number]
) -> list[Number] | None:
    """Of a symmetric positive definite system; None where a pivot is 0."""
    n, rows = len(right), [[*row, value] for row, value in zip(matrix, right)]
    for a in range(n):
        if k.sign(rows[a][a]) <= 0:
            return None
        for b in range(a + 1, n):
            factor = rows[b][a] / rows[a][a]
            rows[b] = [value - factor * above for value, above in zip(rows[b], rows[a])]
    solution: list[Number] = []
    for a in reversed(range(n)):
        known = sum(rows[a][a + 1 + c] * value for c, value in enumerate(solution))
        solution.insert(0, (rows[a][n] - known) / rows[a][a])
    return solution


def collapse(matrix: Array, impulses: Array, restitution: float) -> bool:
    """Whether collisions at 0 < e < 1 never end in any order, so that they close all K contacts.

    matrix: (K, K), an M-matrix. impulses: (K,) > 0, those that close all contacts.

    Let z be the impulses that are still needed to close all contacts. A collision at k changes only
    z_k, to (1 + e) s - e z_k, s = sum |A_kl| z_l / A_kk; k approaches if z_k > s. As long as no z_k
    passes (1 + e) s / e, all z stay positive: then some contact approaches, and z goes to 0. All
    orders are followed until their ratios repeat. That is no proof, as states within `ALIKE` are
    taken for one; `MARGIN` is what this may be wrong by.
    """
    if not impulses.min() > 0:  # or below what float64 can tell from 0
        return False
    coupling = np.abs(matrix) / np.diag(matrix)[:, None]
    np.fill_diagonal(coupling, 0.0)
    begin = impulses / impulses.max()
    waiting, known = deque([begin]), set[tuple[int, ...]]()
    most = (1 + restitution) / restitution / MARGIN
    while waiting:
        z = waiting.popleft()
        support = coupling @ z
        for a in np.flatnonzero(z > support * (1 + ALIKE**2)):
            if z[a] > most * support[a]:
                return False
            after = z.copy()
            after[a] = (1 + restitution) * support[a] - restitution * z[a]
            after /= after.max()
            place = tuple(np.round(np.log(after) / ALIKE).astype(int).tolist())
            if place not in known:
                known.add(place)
                waiting.append(after)
        if len(known) > MOST_STATES:
            return False
    return True
