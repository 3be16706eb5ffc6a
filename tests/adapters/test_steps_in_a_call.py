"""An engine takes as many steps in a call of its library as its public API allows: none of those
pinned here has a call that takes more than one. A version that has one fails this test."""

from __future__ import annotations

import inspect

import Box2D
import pyb2d3
import pymunk
from pymunk import batch


def stepping(owner: object) -> set[str]:
    """Its public names that speak of stepping."""
    words = ("step", "advance", "simulate", "run")
    return {
        name
        for name in dir(owner)
        if not name.startswith("_") and any(word in name.lower() for word in words)
    }


def test_pymunk_steps_once_a_call():
    """`Space.step(dt)` has no count; the other names are a callback and what dt was last."""
    assert list(inspect.signature(pymunk.Space.step).parameters) == ["self", "dt"]
    assert stepping(pymunk.Space) == {"step", "add_post_step_callback", "current_time_step"}
    assert stepping(batch) == set()


def test_box2d_steps_once_a_call():
    """`Step(timeStep, velocityIterations, positionIterations)`; `subStepping` is a flag of
    continuous collision."""
    assert "float32 timeStep, int32 velocityIterations, int32 positionIterations)" in (
        Box2D.b2World.Step.__doc__
    )
    assert stepping(Box2D.b2World) == {"Step", "subStepping"}


def test_pyb2d3_steps_once_a_call():
    """`step(time_step, sub_step_count)`: substeps are parts of one step, with one collision search;
    a step with four is no four steps."""
    assert "time_step: float, sub_step_count: int" in pyb2d3.World.step.__doc__
    assert stepping(pyb2d3.World) == {"step"}


def test_a_call_that_took_several_steps_would_be_found():
    """A library with one."""

    class Later:
        def step(self) -> None: ...

        def step_many(self, count: int) -> None: ...

    assert stepping(Later) == {"step", "step_many"}
