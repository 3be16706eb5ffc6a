"""`crosscheck run --bits`: which engines have other bits than those kept, and from where on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.adapters.engines import ENGINES, UNASKED, told_apart
from crosscheck2d.adapters.play import play_once
from crosscheck2d.reports.run import bits
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.run.store import reading, writing
from crosscheck2d.reports.run.suite import Means, RunPlan, carry_out
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS
from tests.measured import MEASURED, TABLE
from tests.reports.terminal.command_line import crosscheck

SCENE = "head_on_equal_e09"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bits") / "out"
    names = ("pymunk:matched", "reference:exercise")
    plan = RunPlan(
        [SCENE], {name: ENGINES[name] for name in names}, 0, [], False, timings=0, command="test"
    )
    with writing(folder, COMMAND) as store, Progress() as progress:
        carry_out(plan, Means(workers=2), store, progress)
    return folder


def compared(kept: Sequence[dict[str, str]], now: Sequence[dict[str, str]]):
    tables = [bits.read(bits.written(list(rows), {})) for rows in (kept, now)]
    return bits.differences(*tables)


def test_the_same_engine_has_the_same_bits_and_another_has_not(made: Path):
    with reading(made, COMMAND) as store:
        one, other = bits.rows_of(RunResults.read(store))
    scenario = open_scene(SCENE, 0)
    dt = scenario.dt(scenario.middle_substeps)
    again = play_once(ENGINES["pymunk:matched"].make, "pymunk:matched", scenario, dt).trajectory
    assert again is not None
    same = dict(zip(("bits", "until"), bits.bits_of(again)))

    assert one["dt_s"] == other["dt_s"] == f"{dt:.9g}"
    assert compared([one], [one | same])[1].empty
    assert one["bits"] == same["bits"] != other["bits"]


@pytest.mark.parametrize(("at", "said"), [(0, (-1, 0)), (3, (2, 4)), (5, (4, 8))])
def test_it_is_said_from_which_sample_on_they_differ(at: int, said: tuple[int, int]):
    name, scenario = "pymunk:matched", open_scene("head_on_equal_e09", 0)
    played = play_once(ENGINES[name].make, name, scenario, scenario.dt(2)).trajectory
    assert played is not None
    position = played.position.copy()
    position[at:, 0, 0] = np.nextafter(position[at:, 0, 0], np.inf)
    changed = type(played)(
        played.t,
        position,
        played.velocity,
        played.angle,
        played.angular_velocity,
        played.collisions,
    )

    assert bits.first_other(bits.bits_of(played)[1], bits.bits_of(changed)[1]) == said


def test_an_engine_is_kept_in_every_scene():
    names = set(zip(TABLE.scenario, TABLE.engine + ":" + TABLE.profile))

    assert names == {
        (scene, name)
        for scene in SCENARIOS
        for name in told_apart(UNASKED, open_scene(scene, 0).scene)
        if name in MEASURED
    }
    assert (TABLE.bits[TABLE.status == "ok"].str.len() == 16).all()


@pytest.mark.slow
def test_a_run_names_what_differs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    kept = tmp_path / "kept.csv"
    monkeypatch.setattr(bits, "KEPT", kept)
    kept.write_text(bits.written([], {"system": "Linux"}))
    words = ("run", SCENE, "--engine", "pymunk:matched", "--timings", "0", "--bits", "--out", "out")
    empty = crosscheck(*words, cwd=tmp_path)
    here = (tmp_path / "out" / "bits.csv").read_text()
    kept.write_text(here)
    same = crosscheck(*words, cwd=tmp_path)
    *about, line = here.splitlines()
    hashes = " ".join([line.rsplit(" ", 3)[0], "0000 0000 0000"])
    kept.write_text("\n".join([*about, hashes]).replace(line.split(",")[5], "0" * 16) + "\n")
    other = crosscheck(*words, cwd=tmp_path)

    assert (empty.returncode, same.returncode, other.returncode) == (1, 0, 1)
    assert "No bits are kept of pymunk:matched" in empty.stdout
    assert "No bits are kept" not in same.stdout
    assert f"pymunk:matched in {SCENE}: the same bits up to sample" in other.stdout


def test_random_scenes_of_another_seed_are_not_compared(made: Path):
    with reading(made, COMMAND) as store:
        results = RunResults.read(store)
        seeded = replace(results, records=[record | {"seed": 1} for record in results.records])

        assert len(bits.rows_of(results)) == 2
        assert bits.rows_of(seeded) == []


@pytest.mark.long
def test_this_machine_has_the_kept_bits(tmp_path: Path):
    engines = [word for name in sorted(MEASURED) for word in ("--engine", name)]
    words = ("run", *engines, "--timings", "0", "--bits", "--out", "out")

    assert crosscheck(*words, cwd=tmp_path).returncode == 0
