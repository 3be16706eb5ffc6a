"""What adapters/README.md says of versions, and of what an engine has and its binding does not hand
on: a version that does fails a test."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import Box2D
import pyb2d3
import pymunk
import pytest

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
