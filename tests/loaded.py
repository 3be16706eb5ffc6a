"""Imported once, in the process that others are forked from: all that a run takes, with its kernels
loaded."""

from __future__ import annotations

import os
from pathlib import Path

from numba.core.dispatcher import Dispatcher

import crosscheck2d.reports.commands.run
import crosscheck2d.reports.run.known_answers
import crosscheck2d.reports.run.playing
import crosscheck2d.reports.run.tables  # noqa: F401
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.scenarios.catalogue import scenario
from tests.forks import LOCKS, compiling_alone

if LOCKS in os.environ:
    Dispatcher.compile = compiling_alone(Path(os.environ[LOCKS]))

scene = scenario("slow_collision")
compare(
    scene,
    [
        play(ENGINES[name].make(), name, scene, scene.dt(scene.substeps[0]))
        for name in (
            "reference:exercise",
            "reference:ordered",
            "event_driven:float64",
            "pymunk:matched",
            "box2d:matched",
            "box2d_v3:matched",
        )
    ],
)
