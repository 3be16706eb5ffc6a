"""Published results as known answers: SimBenchmark's bouncing test, reproduced by adapters and by
six lines of Python."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass

import numpy as np

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.scenarios.families.placing import lay_out

KNOWN_SCENE = "simbenchmark_bouncing"  # a run of this scenario makes this table
DISKS, MASS, RADIUS, HEIGHT, GRAVITY, DURATION = 49, 10.0, 0.1, 5.0, 9.81, 20.0
ENERGY = DISKS * MASS * GRAVITY * HEIGHT  # 24034.5 J


@dataclass(frozen=True)
class KnownAnswer:
    """A published mean over the steps of (E - 24034.5 J)^2.

    Attributes:
        column: the engine of the published column.
        dt_s: s.
        published_J2: J2, six digits.
        made_by: what reproduces it: a key of `ENGINES`, or `SIX_LINES`.
        source: where it was published.
    """

    column: str
    dt_s: float
    published_J2: float
    made_by: str
    source: str = "leggedrobotics/SimBenchmark, data/bouncing/sample.csv"

    def reproduce(self) -> float:
        if self.made_by in SIX_LINES:
            return six_lines(self.dt_s, SIX_LINES[self.made_by])
        return mean_squared_error_of(self.made_by, self.dt_s)


# Whether the step that reflects the ball also lets it fall.
SIX_LINES = {"six lines: fall, then reflect": True, "six lines: fall or reflect": False}
KNOWN_ANSWERS = (
    *(
        KnownAnswer("ODE", dt, published, made_by)
        for made_by in ("pymunk:shipped", "six lines: fall or reflect")
        for dt, published in ((1e-2, 18808.3), (1e-3, 185.027), (1e-4, 1.85055))
    ),
    *(
        KnownAnswer("Bullet", dt, published, "six lines: fall, then reflect")
        for dt, published in ((1e-2, 7.40664e6), (1e-3, 75245.4), (1e-4, 752.345))
    ),
)
MEANING = (
    "49 balls of 10 kg dropped from 5 m on a floor, e = 1, for 20 s: SimBenchmark ranks engines"
    " by how well they keep the energy. pymunk as shipped gives its ODE column, digit for digit."
    " So do six lines of Python in which a step either falls or reflects. The same lines give"
    " its Bullet column if a step first falls, and then reflects the velocity that gravity has"
    " just changed. So the factor of a hundred and more between the two columns comes from the"
    " order of operations in a step, not from the quality of contacts."
)


def mean_squared_error_of(name: str, dt: float) -> float:
    """J2, from one disk of an engine times 49, because the disks never meet. E is taken before each
    step, as in the publication."""
    scene = lay_out(
        position=[[0.0, HEIGHT]],
        radius=RADIUS,
        mass=MASS,
        gravity=[0.0, -GRAVITY],
        walls=[[[-1.0, 0.0], [1.0, 0.0]]],
    )
    steps = round(DURATION / dt)
    y, v = np.empty(steps), np.empty(steps)
    with closing(ENGINES[name].make()) as engine:
        engine.load(scene, dt)
        for k in range(steps):
            state = engine.read()
            y[k], v[k] = state.position[0, 1], state.velocity[0, 1]
            engine.step()
    return mean_squared_error(y, v)


def six_lines(dt: float, falls_when_it_reflects: bool) -> float:
    """J2 of a ball that moves by v dt and is reflected in a step that finds it in the floor and
    approaching.

    Such a step applies gravity first (Bullet), or not at all (ODE, pymunk: the solver aims at e
    times the velocity before gravity, so that its impulse cancels the gravity of the step).
    """
    steps = round(DURATION / dt)
    ys, vs = np.empty(steps), np.empty(steps)
    y, v = HEIGHT, 0.0
    for k in range(steps):
        ys[k], vs[k] = y, v
        if falls_when_it_reflects:
            v -= GRAVITY * dt
            v = -v if y < RADIUS and v < 0 else v
            y += v * dt
        else:
            y += v * dt
            v = -v if y < RADIUS and v < 0 else v - GRAVITY * dt
    return mean_squared_error(ys, vs)


def mean_squared_error(y: np.ndarray, v: np.ndarray) -> float:
    """Mean over the steps of (E - 24034.5 J)^2 in J2, for 49 disks that do as this one."""
    energy = DISKS * (MASS * GRAVITY * y + MASS * v**2 / 2)
    return float(((energy - ENERGY) ** 2).mean())
