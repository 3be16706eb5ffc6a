"""What adapters/README.md says of versions, and of what an engine has and its binding does not hand
on: a version that does fails a test."""

from __future__ import annotations

import inspect
import re
import tomllib
from pathlib import Path

import Box2D
import pyb2d3
import pymunk
import pytest
from pymunk import batch

from crosscheck2d.adapters.npm_packages import missing, pinned, pinned_library

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "adapters" / "README.md").read_text(encoding="utf-8")
RELEASES = dict(
    (name, (number, day))
    for name, number, day in re.findall(
        r"^\| (\S+) (\d+\.\d+\.\d+) \| (\d{4}-\d\d-\d\d) \|", TEXT, re.MULTILINE
    )
)


def test_the_table_has_the_pinned_versions_and_the_days_of_their_release():
    lock = tomllib.loads((ROOT / "uv.lock").read_text(encoding="utf-8"))
    locked = {package["name"]: package for package in lock["package"]}
    npm = pinned()["dependencies"]
    assert set(RELEASES) == {"pymunk", "box2d-py", "pyb2d3"} | {*npm} - {"gl-matrix"}
    for name, (number, day) in RELEASES.items():
        if name in npm:
            assert number == npm[name]
        else:
            released = str(locked[name]["sdist"]["upload-time"])
            assert (number, day) == (locked[name]["version"], released[:10])


def test_pyb2d3_hands_on_none_of_what_box2d_3_has():
    assert not hasattr(pyb2d3.BodyDef(), "allow_fast_rotation")
    assert hasattr(pyb2d3.BodyDef(), "fixed_rotation")
    names = " ".join(dir(pyb2d3.World)).lower()
    assert not [word for word in ("warm", "speculative", "callback", "mixing") if word in names]
    assert "continuous" in names


def test_box2d_py_has_copies_of_what_is_compiled_in():
    assert (Box2D.b2_maxTranslation, Box2D.b2_velocityThreshold) == (2.0, 1.0)
    assert Box2D.b2_maxRotation == pytest.approx(1.5707964)


def test_pymunk_has_neither_ccd_nor_a_switch_for_warm_starting():
    names = " ".join([*dir(pymunk.Space), *dir(pymunk.Body)]).lower()
    assert not [word for word in ("warm", "bullet", "continuous", "ccd") if word in names]
    assert "sleep" in names


RAPIER = "@dimforge/rapier2d-compat"


@pytest.mark.skipif(bool(missing(RAPIER)), reason=missing(RAPIER))
def test_the_npm_package_of_rapier_does_not_hand_on_the_cap_on_speed():
    dynamics = pinned_library(RAPIER).folder / "dist" / "dynamics"
    text = (dynamics / "integration_parameters.d.ts").read_text(encoding="utf-8").lower()
    assert "velocity" not in text
    assert "lengthunit" in text


# An engine takes as many steps in a call of its library as its public API allows: none of those
# pinned here has a call that takes more than one. A version that has one fails these tests.


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
