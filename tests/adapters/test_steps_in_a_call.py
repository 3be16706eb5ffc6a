"""An engine takes as many steps in a call of its library as its public API allows: none of those
pinned here has a call that takes more than one. A version that has one fails this test."""

from __future__ import annotations

import inspect

import Box2D
import pyb2d3
import pymunk
import pytest
from pymunk import batch


class Later:
    """A library that takes several steps in a call: the control."""

    def step(self) -> None: ...

    def step_many(self, count: int) -> None: ...


@pytest.mark.parametrize(
    ("owner", "names"),
    [
        # a callback, and what dt was last
        (pymunk.Space, {"step", "add_post_step_callback", "current_time_step"}),
        (batch, set()),
        (Box2D.b2World, {"Step", "subStepping"}),  # a flag of continuous collision
        (pyb2d3.World, {"step"}),
        (Later, {"step", "step_many"}),
    ],
)
def test_a_library_has_no_call_for_several_steps(owner: object, names: set[str]):
    words = ("step", "advance", "simulate", "run")
    public = {name for name in dir(owner) if not name.startswith("_")}
    assert {name for name in public if any(word in name.lower() for word in words)} == names


def test_a_call_takes_no_count_of_steps():
    assert list(inspect.signature(pymunk.Space.step).parameters) == ["self", "dt"]
    assert "float32 timeStep, int32 velocityIterations, int32 positionIterations)" in (
        Box2D.b2World.Step.__doc__
    )
    # substeps are parts of one step, with one collision search: a step with four is no four steps
    assert "time_step: float, sub_step_count: int" in pyb2d3.World.step.__doc__
