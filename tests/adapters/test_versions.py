"""NAME@VERSION: another version of a library plays by the same adapter in a process of its own.
Tests that fetch one are skipped where neither the index nor a copy in the cache is there."""

from __future__ import annotations

import os
import signal
from contextlib import closing
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pymunk
import pytest

from crosscheck2d.adapters import library_at_version as versions
from crosscheck2d.adapters.conformance.probe import plain
from crosscheck2d.adapters.engine import NO_SUCH, Unsupported
from crosscheck2d.adapters.engines import ENGINES, known_row, packages, parsed, row_of
from crosscheck2d.adapters.host import apart
from crosscheck2d.adapters.host.process import end
from crosscheck2d.adapters.library_at_version import (
    RECORD,
    LibraryAtVersion,
    NotInstalled,
    digest_of,
    reason_in,
)
from crosscheck2d.adapters.play import play_once
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.run.arguments import checked_engines
from crosscheck2d.scenarios.catalogue import scenario
from tests.reports.terminal.command_line import crosscheck

# thrusts in the frame of the body; a torus; walls and lasting contacts
SCENES = ("body_frame_thrust", "asteroids", "column_of_ten")
# Those of npm packages are played from the very folder of the usual ones.
PINNED = {"pymunk": "7.3.1", "box2d": "2.3.10", "box2d_v3": "0.11.1"}


@cache
def lacking(library: LibraryAtVersion) -> str:
    try:
        if not library.recorded:
            library.fetch()
        library.checked()
    except NotInstalled as reason:
        return str(reason)
    return ""


def need(name: str) -> str:
    _, library = parsed(name)
    if reason := lacking(library):
        pytest.skip(reason)
    return name


@pytest.fixture
def empty(tmp_path, monkeypatch):
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path))
    yield tmp_path
    for process in apart.waiting.values():
        end(process)
    apart.waiting.clear()


@pytest.fixture
def version_0(empty):
    # A version 0 of each library that is a folder without files, so that the process imports the
    # one that is installed.
    for package, npm in packages().values():
        folder = LibraryAtVersion(package, "0", npm).folder
        folder.mkdir(parents=True)
        (folder / RECORD).write_text(digest_of(folder), "utf-8")
    return empty


def played(name: str, scene: str) -> Run:
    one = scenario(scene)
    return play_once(row_of(name).make, name, one, one.dt(1))


def bits(run: Run) -> list[object]:
    assert run.status == "ok", run.reason
    path = run.trajectory
    arrays = (path.position, path.velocity, path.angle, path.angular_velocity)
    heard = path.collisions
    return [array.tobytes() for array in (*arrays, heard.t, heard.i, heard.j, heard.impulse)]


@pytest.mark.usefixtures("version_0")
@pytest.mark.parametrize("profile", ["shipped", "matched"])
@pytest.mark.parametrize("engine", ["pymunk", "box2d", "box2d_v3"])
def test_an_adapter_in_a_process_of_its_own_gives_the_bits_of_this_one(engine, profile):
    for scene in SCENES:
        here, there = (played(f"{at}:{profile}", scene) for at in (engine, f"{engine}@0"))
        assert bits(here) == bits(there)
        assert repr(here.settings) == repr(there.settings)


@pytest.mark.parametrize("engine", PINNED)
def test_the_pinned_version_asked_for_by_its_number_gives_the_bits_of_the_usual_one(engine):
    name = need(f"{engine}@{PINNED[engine]}:matched")
    for scene in SCENES:
        assert bits(played(name, scene)) == bits(played(f"{engine}:matched", scene))


@pytest.mark.slow
def test_another_version_of_rapier_gives_other_bits():
    usual = played("rapier2d:matched", "asteroids")
    if usual.status == "unsupported":
        pytest.skip(usual.reason)
    assert bits(played(need("rapier2d@0.14.0:matched"), "asteroids")) != bits(usual)


def test_another_version_of_pymunk_is_the_one_that_plays_and_is_recorded():
    name = need("pymunk@6.8.1:matched")
    row, run = row_of(name), played(name, "asteroids")
    assert run.versions["pymunk"] == "6.8.1"
    assert run.versions["Chipmunk"].startswith("7.0.3")  # pymunk 7 has Munk2D
    assert run.versions["pymunk, SHA-256 of its files"] == row.source
    assert len(row.source) == 16


@pytest.mark.slow
def test_a_run_has_both_versions_side_by_side_and_needs_no_index_with_the_cache(
    tmp_path, monkeypatch
):
    need("pymunk@6.8.1")
    monkeypatch.setattr(LibraryAtVersion, "fetch", None)
    words = ["--engine", "pymunk@6.8.1", "--engine", "pymunk", "--timings", "0", "--out", "out"]
    done = crosscheck("run", "free_fall", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    table = pd.read_csv(tmp_path / "out" / "runs.csv")
    assert list(dict.fromkeys(table.engine + ":" + table.profile)) == [
        f"{engine}:{profile}"
        for profile in ("shipped", "matched")
        for engine in ("pymunk", "pymunk@6.8.1")
    ]
    assert set(table.status) == {"ok"}
    here, there = dict.fromkeys(table.versions)
    assert here.startswith("pymunk 7.3.1;")
    assert "pymunk 6.8.1" in there
    assert "SHA-256" in there


@pytest.mark.slow
@pytest.mark.usefixtures("empty")
def test_without_the_index_a_version_is_refused_in_one_sentence(tmp_path, monkeypatch):
    for name in ("UV_DEFAULT_INDEX", "PIP_INDEX_URL"):
        monkeypatch.setenv(name, "http://127.0.0.1:9/simple")
    done = crosscheck("run", "free_fall", "--engine", "pymunk@6.8.1", cwd=tmp_path)
    assert done.returncode == 2
    said = done.stderr.splitlines()[-1]
    assert said.startswith(
        "--engine pymunk@6.8.1: pymunk 6.8.1 could not be fetched from the package index ("
    )
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.slow
@pytest.mark.usefixtures("empty")
@pytest.mark.parametrize("name", ["pymunk@99.9.9", "planck@99.9.9"])
def test_a_version_that_does_not_exist_is_refused_in_one_sentence(name):
    library = parsed(name)[1]
    with pytest.raises(NotInstalled, match=f"{library.package} 99.9.9 could not be fetched"):
        library.fetch()


@pytest.mark.usefixtures("empty")
def test_without_uv_and_pip_a_sentence_names_both(monkeypatch):
    monkeypatch.setattr(versions.shutil, "which", lambda _name: None)
    monkeypatch.setattr(versions, "find_spec", lambda _name: None)
    with pytest.raises(NotInstalled, match="neither uv nor pip is installed"):
        LibraryAtVersion("pymunk", "6.8.1", False).fetch()


@pytest.mark.parametrize(
    ("output", "reason"),
    [
        (
            "error: Request failed after 3 retries\n  cause: Failed to fetch: http://x\n"
            "  cause: Connection refused (os error 111)\n",
            "Connection refused (os error 111)",
        ),
        (
            "error: No solution found\n  cause: Because there is no version of pymunk==9.9.9\n\n"
            "hint: build it",
            "Because there is no version of pymunk==9.9.9",
        ),
        (
            "ERROR: Could not find a version that satisfies pymunk==9\nERROR: No match",
            "Could not find a version that satisfies pymunk==9",
        ),
        (
            "npm error code ETARGET\nnpm error notarget No match for planck@77",
            "No match for planck@77",
        ),
        (
            "npm error code ECONNREFUSED\nnpm error syscall connect\nnpm error errno 1\n"
            "npm error FetchError: request to http://127.0.0.1:9/planck failed",
            "FetchError: request to http://127.0.0.1:9/planck failed",
        ),
        (
            "npm error code E404\nnpm error 404 Not Found - GET http://x",
            "404 Not Found - GET http://x",
        ),
        (
            "npm error code EINTEGRITY\nnpm error sha512-dl== integrity checksum failed",
            "sha512-dl== integrity checksum failed",
        ),
        ("", "no reason given"),
    ],
)
def test_the_reason_is_the_last_cause_that_the_tool_names(output, reason):
    assert reason_in(output) == reason


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("reference@1.0", "reference is in no package that has versions, as those of pymunk, "),
        ("mine.py@1.0", "mine.py is in no package that has versions"),
        ("pymunk@latest", "write pymunk@VERSION[:PROFILE], a version such as 1.0.0 and one of"),
        ("pymunk@../../x", "write pymunk@VERSION"),
        ("pymunk@--index", "write pymunk@VERSION"),
        ("pymunk@6.8.1:own", "the profiles shipped, matched"),
        ("pimunk@6.8.1", "engine 'pimunk@6.8.1' is not known; did you mean"),
    ],
)
def test_a_name_without_a_version_to_fetch_is_refused_in_one_sentence(name, sentence, capsys):
    with pytest.raises(SystemExit) as ended:
        checked_engines([name])
    assert ended.value.code == 2
    assert sentence in " ".join(capsys.readouterr().err.split())


@pytest.mark.usefixtures("version_0")
def test_a_file_that_has_changed_since_it_was_fetched_is_refused():
    library = LibraryAtVersion("pymunk", "0", False)
    folder = library.folder
    (folder / "__pycache__").mkdir()
    (folder / "__pycache__" / "a.pyc").write_bytes(b"compiled")
    digest_of.cache_clear()
    assert library.checked() == folder
    (folder / "a.py").write_bytes(b"x")
    digest_of.cache_clear()
    with pytest.raises(NotInstalled, match="has changed since it was fetched; delete this folder"):
        library.checked()
    run = played("pymunk@0:matched", "free_fall")
    assert (run.status, "has changed since" in run.reason) == ("unsupported", True)
    digest_of.cache_clear()


def test_a_setting_that_a_version_does_not_have_is_named_and_left_out(monkeypatch):
    monkeypatch.delattr(pymunk.Space, "collision_persistence")
    with closing(ENGINES["pymunk:matched"].make()) as engine:
        engine.load(plain(), 0.01)
        engine.step(3)
        assert engine.settings()["collision_persistence"] == (1, NO_SUCH)
        assert not hasattr(engine.space, "collision_persistence")


def test_rapier_before_its_length_unit_names_it_and_plays():
    run = played(need("rapier2d@0.12.0:matched"), "free_fall")
    assert run.status == "ok", run.reason
    assert run.settings["length unit in m"][1] == NO_SUCH


@pytest.mark.usefixtures("version_0")
def test_what_an_adapter_refuses_in_its_process_is_refused_here():
    scene = replace(plain(), mass=np.full(plain().n, 1e300))
    with closing(row_of("box2d@0:matched").make()) as engine:
        with pytest.raises(Unsupported, match="mass 1e\\+300 does not fit into float32"):
            engine.load(scene, 0.01)
        engine.load(plain(), 0.01)  # and goes on
        engine.step()


@pytest.mark.usefixtures("version_0")
def test_a_process_that_dies_is_a_crash_and_the_next_engine_gets_a_new_one():
    with closing(row_of("pymunk@0:matched").make()) as engine:
        engine.load(plain(), 0.01)
        first = engine.process.pid
    with closing(row_of("pymunk@0:shipped").make()) as engine:
        engine.load(plain(), 0.01)
        assert engine.process.pid == first  # it is used again
        os.kill(first, signal.SIGKILL)
        with pytest.raises(Exception, match="the process of pymunk 0 ended") as raised:
            engine.step()
        assert raised.value.status == "crashed"
    assert bits(played("pymunk@0:matched", "free_fall")) == bits(
        played("pymunk:matched", "free_fall")
    )


@pytest.mark.usefixtures("version_0")
def test_the_time_of_the_wrap_is_that_in_the_process():
    one = scenario("asteroids")
    with closing(row_of("pymunk@0:matched").make()) as engine:
        engine.load(one.scene, one.dt(1))
        engine.step(10)
        assert engine.wrapping > 0
        engine.wrapping = 0.0
        engine.read()
        assert engine.wrapping == 0.0


def test_a_row_at_a_version_is_that_of_its_engine_but_for_what_is_fetched():
    row, usual = known_row("planck@1.0.0:matched"), known_row("planck:matched")
    assert (row.alpha, row.rounding, row.outside) == (usual.alpha, usual.rounding, True)
    assert (row.package, row.mark) == ("", None)
    for name in ("planck@1.0.0", "planck@x:matched", "/a@1/b.py:own", "reference@1:exercise"):
        assert known_row(name) is None
