"""Box2D 2.3 comes from one of two distributions, and what a message says to install fits what was
installed."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from crosscheck2d.adapters import library_versions
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.library_versions import BOX2D
from crosscheck2d.reports.run.cells import versions

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
WORLDS = Path(__file__).with_name("box2d_worlds.py")


def hashes_of_worlds(first: Path) -> list[str]:
    done = subprocess.run(
        [sys.executable, WORLDS],
        env=os.environ | {"PYTHONPATH": str(first)},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


@pytest.mark.slow
@pytest.mark.skipif(BOX2D != "box2d-py", reason="the wheel itself is installed")
def test_the_wheel_gives_the_bits_of_what_is_built_from_source(tmp_path: Path):
    # The published package depends on the wheel, a clone on Linux builds box2d-py: a collapsing
    # pile with friction and a gas, 60 disks each.
    [pin] = [
        line.partition(";")[0] for line in PROJECT["project"]["dependencies"] if "box2d=" in line
    ]
    options = [
        "--quiet",
        "--no-config",
        "--no-deps",
        "--only-binary",
        ":all:",
        "--target",
        tmp_path,
    ]
    fetched = subprocess.run(
        [os.environ.get("UV", "uv"), "pip", "install", *options, pin],
        capture_output=True,
        text=True,
    )
    if fetched.returncode and "CI" not in os.environ:
        pytest.skip(fetched.stderr)
    assert fetched.returncode == 0, fetched.stderr
    assert (tmp_path / "Box2D").exists()
    built, wheel = hashes_of_worlds(tmp_path / "nothing"), hashes_of_worlds(tmp_path)

    assert built == wheel
    assert len({*built}) == 2  # the control: other worlds have other hashes


@pytest.mark.parametrize(("there", "name"), [({"box2d-py"}, "box2d-py"), (set(), "box2d")])
def test_the_distribution_that_is_there_is_recorded(monkeypatch, there: set[str], name: str):
    def version(library: str) -> str:
        if library not in there:
            raise metadata.PackageNotFoundError(library)
        return "2.3.8"

    monkeypatch.setattr(library_versions, "version", version)
    assert library_versions._box2d() == name


def test_a_run_records_the_distribution_that_is_installed():
    assert ENGINES["box2d:shipped"].distributions == (BOX2D,)
    assert versions()[BOX2D] == metadata.version(BOX2D)


@pytest.mark.parametrize(
    ("clone", "made_by", "hint"),
    [
        (True, "\nuv = 0.9\n", "uv run --extra js crosscheck ..."),
        (True, "\nversion = 3.11\n", 'pip install -e ".[js]"'),
        (False, "\nuv = 0.9\n", 'pip install "crosscheck2d[js]"'),
    ],
)
def test_the_way_to_an_extra_is_that_of_the_installation(
    tmp_path: Path, monkeypatch, clone: bool, made_by: str, hint: str
):
    (tmp_path / "pyvenv.cfg").write_text(f"home = x{made_by}")
    monkeypatch.setattr(library_versions, "CLONE", clone)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert library_versions.how_to_add("js") == hint
