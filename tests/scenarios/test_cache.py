"""The cache of truth records: it is never trusted blindly and never needed."""

from __future__ import annotations

import os
import sqlite3
import stat
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scenario, Scene
from crosscheck2d.scenarios.truth import cache as truth_cache
from crosscheck2d.scenarios.truth import exact as oracle
from crosscheck2d.scenarios.truth.exact import OracleTruth, TruthRecord


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    names: list[str] = []
    real = oracle.computed

    def computed(one: Scenario, *_: object) -> TruthRecord:
        names.append(one.name)
        return real(one)

    monkeypatch.setattr(oracle, "computed", computed)
    return names


def record_of(one: Scenario) -> TruthRecord:
    return OracleTruth(one).record()


ONE = scenario("oblique_e09")


def test_a_record_is_computed_once(folder: Path, made: list[str]):
    first, second = record_of(ONE), record_of(ONE)

    assert made == [ONE.name]
    assert first.legs.tobytes() == second.legs.tobytes()
    assert first.events.tobytes() == second.events.tobytes()
    assert [getattr(first, name) for name in truth_cache.NUMBERS] == [
        getattr(second, name) for name in truth_cache.NUMBERS
    ]
    assert [path.name for path in folder.iterdir()] == [truth_cache.FILE]


def test_a_damaged_row_is_made_anew(folder: Path, made: list[str]):
    record_of(ONE)
    with sqlite3.connect(folder / truth_cache.FILE) as file:
        file.execute("update results set blob = substr(blob, 1, 100)")
    file.close()
    record_of(ONE)

    assert len(made) == 2


def test_a_file_that_is_no_cache_is_one_sentence_and_stays(folder: Path, made: list[str]):
    folder.mkdir()
    (folder / truth_cache.FILE).write_bytes(b"no cache, but a text that is long enough" * 100)
    record_of(ONE)

    assert made == [ONE.name]
    assert truth_cache.fault().startswith(
        f"exact answers are not kept for later: {folder / truth_cache.FILE}: is damaged"
    )
    assert (folder / truth_cache.FILE).read_bytes().startswith(b"no cache")


def test_what_decides_the_answer_decides_the_key():
    keys = {
        truth_cache.key_of(one)
        for one in (
            ONE,
            replace(ONE, duration=3.0),
            replace(ONE, scene=replace(ONE.scene, restitution=0.8)),
            replace(ONE, scene=replace(ONE.scene, velocity=ONE.scene.velocity * (1 + 2**-52))),
            replace(ONE, scene=replace(ONE.scene, friction=0.25)),
            replace(ONE, scene=replace(ONE.scene, friction=0.25, inertia=ONE.scene.mass)),
            replace(ONE, thrusts=[oracle.Thrust(0, 0.0, 1.0, np.ones(2))]),
        )
    }
    assert len(keys) == 7
    assert truth_cache.key_of(replace(ONE, name="other", substeps=(3,))) in keys


def test_with_friction_every_field_of_a_scene_decides_the_key():
    rough = replace(ONE.scene, friction=0.25)
    lines = {"walls": [[[-9.0, -9.0], [9.0, -9.0]]], "wrap": [[-9.0, -9.0], [9.0, 9.0]]}
    names = [field.name for field in fields(Scene)]
    scenes = [
        replace(rough, **{name: lines[name] if name in lines else getattr(rough, name) + 2**-10})
        for name in names
    ]
    keys = {truth_cache.key_of(replace(ONE, scene=scene)) for scene in (rough, *scenes)}

    assert len(keys) == 1 + len(names)


def test_many_writers_leave_one_whole_record(folder: Path):
    with ThreadPoolExecutor(8) as pool:
        records = list(pool.map(record_of, [ONE] * 16))

    assert len({record.legs.tobytes() for record in records}) == 1
    assert [path.name for path in folder.iterdir()] == [truth_cache.FILE]


def test_without_a_home_there_is_no_cache(monkeypatch: pytest.MonkeyPatch, made: list[str]):
    for name in ("CROSSCHECK_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)

    def homeless() -> Path:
        raise RuntimeError("no home")

    monkeypatch.setattr(Path, "home", homeless)
    record_of(ONE)
    record_of(ONE)
    assert len(made) == 2


def test_a_folder_that_cannot_be_written_to_is_no_cache(folder: Path, made: list[str]):
    folder.write_text("in the way")
    record_of(ONE)
    assert len(made) == 1
    folder.unlink()
    folder.mkdir()
    folder.chmod(stat.S_IRUSR | stat.S_IXUSR)
    record_of(ONE)
    assert len(list(folder.iterdir())) == (os.geteuid() == 0)


def test_the_folder_follows_the_platform(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("CROSSCHECK_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert truth_cache.folder() == tmp_path / ".cache" / "crosscheck2d"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert truth_cache.folder() == tmp_path / "xdg" / "crosscheck2d"
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path / "own"))
    assert truth_cache.folder() == tmp_path / "own"
