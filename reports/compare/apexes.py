"""How much higher or lower a disk comes from one bounce on a level floor to the next."""

from __future__ import annotations

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.faces import ALONG, interval, on_faces
from crosscheck2d.reports.compare.view import View
from crosscheck2d.scenarios.model import Array

LEAST = 5  # sample intervals that the rise to an apex takes; a lower one has too few samples
FLIES = 0.01  # of g: by so much the acceleration at an apex may differ from it


def bounce_changes(view: View, disk: int) -> Array:
    """(m,) for each bounce of a disk on a level wall, with nothing else between two apexes: height
    after over e2 times the height before, minus 1.

    Heights are those of the disk's lowest point over the wall, at the vertex of the parabola
    through three samples (`laws.apexes`). If no apex follows by the time at which it is due, the
    highest sample until then counts: a disk that does not bounce loses all.
    """
    scene, played = view.scenario.scene, view.played
    g, h = float(np.linalg.norm(scene.gravity)), interval(played)
    if not g or not scene.restitution or view.scenario.thrusts or not len(scene.walls):
        return np.zeros(0)
    up, e = -scene.gravity / g, scene.restitution
    y, met = played.position[:, disk] @ up, on_faces(played, scene)
    mine = (met.i == disk) | (met.j == disk)
    top, vertex = laws.apexes(y)
    flies = np.abs((y[top - 1] - 2 * y[top] + y[top + 1]) / (g * h**2) + 1) < FLIES
    top, vertex = top[flies], vertex[flies]
    changes = []
    for k, (start, height) in enumerate(zip(played.t[top], vertex)):
        times, walls = met.t[mine & (met.t > start)], met.j[mine & (met.t > start)]
        if not len(times) or walls[0] >= 0:
            continue
        a, b = scene.walls[-1 - walls[0]]
        level = a @ up + scene.radius[disk]
        fall = np.sqrt(2 * max(height - level, 0.0) / g)
        due = times[0] + e * fall
        tilted = abs((b - a) @ up) > ALONG * laws.lengths(b - a)
        if tilted or e * fall < LEAST * h or due + h > played.t[-1]:
            continue
        until = played.t[top[k + 1]] if k + 1 < len(top) else np.inf
        follows = not (times[times < until] > times[0] + 2 * h).any() and until < np.inf
        until = until if follows else due
        if (walls[times <= until] != walls[0]).any():
            continue
        flight = (played.t > times[0]) & (played.t <= due)
        reached = vertex[k + 1] if follows else y[flight].max()
        changes.append((reached - level) / (height - level) / e**2 - 1)
    return np.array(changes)
