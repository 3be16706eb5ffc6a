"""A list of the module and one update for all: dicts with lists, seconds, gravity down."""

import math

balls = []
W = 10.0
H = 10.0
GRAVITY = 9.81
E = 0.9


def update(dt):
    for b in balls:
        b["v"][1] -= GRAVITY * dt
        b["p"][0] += b["v"][0] * dt
        b["p"][1] += b["v"][1] * dt
        for k, size in ((0, W), (1, H)):
            if b["p"][k] < b["radius"] and b["v"][k] < 0:
                b["v"][k] *= -E
            if b["p"][k] > size - b["radius"] and b["v"][k] > 0:
                b["v"][k] *= -E
    for i, a in enumerate(balls):
        for b in balls[:i]:
            bounce(a, b)


def bounce(a, b):
    nx, ny = a["p"][0] - b["p"][0], a["p"][1] - b["p"][1]
    d = math.hypot(nx, ny)
    if d > a["radius"] + b["radius"]:
        return
    nx, ny = nx / d, ny / d
    vn = (a["v"][0] - b["v"][0]) * nx + (a["v"][1] - b["v"][1]) * ny
    if vn >= 0:
        return
    j = -(1 + E) * vn / (1 / a["mass"] + 1 / b["mass"])
    a["v"][0] += j / a["mass"] * nx
    a["v"][1] += j / a["mass"] * ny
    b["v"][0] -= j / b["mass"] * nx
    b["v"][1] -= j / b["mass"] * ny
