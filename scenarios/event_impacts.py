"""What a hit does in the event engine: Newton's restitution along the line of centres, without friction."""

from __future__ import annotations

from math import sqrt

from scenarios.compiled import kernel
from scenarios.event_kernels import (
    CX,
    LAST,
    NOISE,
    RADIUS,
    ROUNDING,
    VX,
    VY,
    WEIGHT,
    Disks,
    Grid,
    Rules,
    X,
    Y,
)


@kernel
def image(d: Disks, g: Grid, i: int, j: int, axis: int) -> float:
    """What to add to the position of `j` for its image next to `i`, m: by the cells they are in, not by nearness."""
    apart = d.tag[j, CX + axis] - d.tag[i, CX + axis]
    if not g.torus or -1 <= apart <= 1:
        return 0.0
    return -g.span[axis] if apart > 1 else g.span[axis]


@kernel
def collide(d: Disks, g: Grid, i: int, j: int, restitution: float) -> float:
    """Hit of two disks that are in contact; the impulse N s, 0 if they do not close in.

    v_i -= q w_i dr, v_j += q w_j dr, q = -(1 + e) b / (dr.dr (w_i + w_j)): a normal that is made a unit vector by a
    square root would let the energy drift by 1.5e-17 a hit.
    """
    a, b = d.row[i], d.row[j]
    dx, dy = b[X] - a[X] + image(d, g, i, j, 0), b[Y] - a[Y] + image(d, g, i, j, 1)
    closing = dx * (b[VX] - a[VX]) + dy * (b[VY] - a[VY])
    d.tag[i, LAST], d.tag[j, LAST] = j, i
    a[NOISE] = b[NOISE] = ROUNDING * (abs(a[VX]) + abs(a[VY]) + abs(b[VX]) + abs(b[VY]))
    if closing >= 0.0:
        return 0.0
    distance2 = dx * dx + dy * dy
    q = -(1.0 + restitution) * closing / (distance2 * (a[WEIGHT] + b[WEIGHT]))
    a[VX] -= q * a[WEIGHT] * dx
    a[VY] -= q * a[WEIGHT] * dy
    b[VX] += q * b[WEIGHT] * dx
    b[VY] += q * b[WEIGHT] * dy
    return q * sqrt(distance2)


@kernel
def collide_wall(d: Disks, rules: Rules, i: int, w: int, part: int) -> float:
    """Hit of disk `i` on a wall it touches, set exactly beside the face; the impulse N s, 0 if it does not close in."""
    row, ux, uy = d.row[i], rules.walls[w, 2], rules.walls[w, 3]
    dx, dy = row[X] - rules.walls[w, 0], row[Y] - rules.walls[w, 1]
    d.tag[i, LAST], row[NOISE] = -1 - w, ROUNDING * (abs(row[VX]) + abs(row[VY]))
    if part == 0:
        height = dy * ux - dx * uy
        away = row[RADIUS] * (1.0 if height > 0.0 else -1.0) - height
        row[X] -= away * uy
        row[Y] += away * ux
        dx, dy = (-uy, ux) if height > 0.0 else (uy, -ux)
    elif part == 2:
        dx, dy = dx - rules.walls[w, 4] * ux, dy - rules.walls[w, 4] * uy
    closing = dx * row[VX] + dy * row[VY]
    if closing >= 0.0:
        return 0.0
    distance2 = dx * dx + dy * dy
    q = -(1.0 + rules.restitution) * closing / distance2
    row[VX] += q * dx
    row[VY] += q * dy
    return q * sqrt(distance2) / row[WEIGHT]
