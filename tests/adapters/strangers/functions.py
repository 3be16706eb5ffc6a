"""Functions of a ball and of two, with numpy: speeds in m/s, the size of the box as arguments."""

import numpy as np


class Disk:
    def __init__(self, center, velocity, r, m):
        self.center = np.array(center, dtype=float)
        self.velocity = np.array(velocity, dtype=float)
        self.r, self.m = r, m


def advance_disk(disk, dt, w, h):
    disk.center += disk.velocity * dt
    for k, size in enumerate((w, h)):
        if disk.center[k] - disk.r < 0:
            disk.velocity[k] = abs(disk.velocity[k])
        elif disk.center[k] + disk.r > size:
            disk.velocity[k] = -abs(disk.velocity[k])


def elastic(d1, d2):
    n = d1.center - d2.center
    if np.linalg.norm(n) > d1.r + d2.r or (d1.velocity - d2.velocity) @ n > 0:
        return
    common = 2 * (d1.velocity - d2.velocity) @ n / (n @ n) / (d1.m + d2.m)
    d1.velocity -= d2.m * common * n
    d2.velocity += d1.m * common * n
