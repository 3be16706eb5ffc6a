"""The timing pass: within its time, in whole rounds, of what was played; kept, not done twice."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.run import timing_pass
from crosscheck2d.reports.run.results import RunResults
from crosscheck2d.reports.run.stepping import Spent, binding_of
from crosscheck2d.reports.run.timing import WARM_UP, Timed, interleaved, noise_of
from crosscheck2d.reports.run.timing_pass import (
    BUSY,
    SCENES,
    SHARE,
    SLOW,
    TABLE,
    WORK,
    CellToTime,
    is_busy,
    noise_floor,
    timed_scenes,
)
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from tests.reports.run.small_runs import read
from tests.reports.terminal.command_line import crosscheck

pytestmark = pytest.mark.slow  # each times a run

RUN = ("near_miss", "--engine", "pymunk", "--out", "out", "--workers", "1")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("timed")
    assert crosscheck("run", *RUN, cwd=folder).returncode == 0
    return folder


def times_of(folder: Path) -> dict[str, dict]:
    return read(folder / "out").times


def test_every_cell_that_was_played_is_timed_and_its_binding_beside_it(folder: Path):
    table = pd.read_csv(folder / "out" / TABLE)
    steps = len(scenario("near_miss").substeps)

    assert list(table.columns) == timing_pass.COLUMNS
    assert len(table) == 2 * steps
    assert (table[["cost_us_per_s", "binding_us_per_s", "read_us"]] > 0).all(axis=None)
    assert table.again_us_per_s.notna().sum() == 2
    assert noise_floor(read(folder / "out")).pairs == 2


def test_times_are_used_again_with_their_date_and_taken_again_on_demand(folder: Path):
    path, before = folder / "out" / TABLE, times_of(folder)
    written = path.read_bytes()
    path.unlink()
    crosscheck("report", "out", cwd=folder)
    again = path.read_bytes()
    done = crosscheck("run", *RUN, cwd=folder)

    assert again == path.read_bytes() == written
    assert times_of(folder) == before
    taken = read(folder / "out").timing["taken"]
    assert f"The times are of {taken}. To take them again: crosscheck report " in done.stdout
    assert crosscheck("report", "out", "--timings", "10", cwd=folder).returncode == 0
    assert times_of(folder) != before


def test_without_a_second_nothing_is_timed(tmp_path: Path):
    done = crosscheck("run", *RUN, "--timings", "0", cwd=tmp_path)
    take = f"crosscheck report {tmp_path / 'out'} --timings 12"

    assert pd.read_csv(tmp_path / "out" / TABLE).empty
    assert times_of(tmp_path) == {}
    assert f"No times were taken. To take them: {take}" in done.stdout
    assert (
        f"No times were taken. To take them: {take}"
        in (tmp_path / "out" / "report.html").read_text()
    )


def test_scenes_that_need_different_things_are_timed_else_the_first_played():
    others = [name for name in SCENARIOS if name not in SCENES]

    assert set(SCENES) <= set(SCENARIOS)
    assert timed_scenes([*others, *SCENES]) == list(SCENES)
    assert timed_scenes(["mine.toml", "asteroids"]) == ["asteroids", "mine.toml"]
    assert timed_scenes(others) == others[: len(SCENES)]


def test_the_pass_ends_in_time_and_leaves_out_a_round_that_is_not_whole(
    monkeypatch: pytest.MonkeyPatch,
):
    clock = 0.0

    def run() -> Spent:
        nonlocal clock
        clock += 1.0
        return Spent(1.0)

    monkeypatch.setattr("crosscheck2d.reports.run.timing.perf_counter", lambda: clock)
    what = [Timed(key, run, 1.0) for key in "abcd"]
    samples = interleaved(what, 9, 99.0, 0, limit=10.5)
    took = clock

    assert took == 11.0  # what has begun ends
    assert [sample.round for sample in samples] == [WARM_UP] * 4 + [0] * 4
    assert interleaved(what, 9, 99.0, 0, limit=2.5) == []
    assert len(interleaved(what, 9, 99.0, 0)) == 40


def test_of_a_long_scene_only_the_first_part_is_timed_and_the_same_of_every_engine():
    parts = {
        name: {
            CellToTime("key", engine, ENGINES[engine], scenario(name), substeps, 0).part.duration
            for engine in ("pymunk:matched", "reference:ordered")
            for substeps in scenario(name).substeps
        }
        for name in ("oblique_e09", "gas_of_100")
    }
    short, gas = scenario("oblique_e09"), scenario("gas_of_100")
    [part] = parts["gas_of_100"]

    assert parts["oblique_e09"] == {short.duration}
    assert gas.scene.n * gas.intervals * sum(gas.substeps) == 15 * WORK
    assert part == pytest.approx(gas.duration / 16, abs=gas.sample_interval)


def test_what_takes_long_has_three_rounds_and_leaves_the_others_to_the_rest(
    monkeypatch: pytest.MonkeyPatch,
):
    what = [
        Timed(key, partial(Spent, seconds), 1.0)
        for key, seconds in {"long": 2 * SHARE, "short": SHARE / 100}.items()
    ]
    monkeypatch.setattr(timing_pass, "overheads_of", lambda _: what)
    monkeypatch.setattr(timing_pass, "ROUNDS", 9)  # which is 1 in all other tests
    overheads = timing_pass.time_cells([], 5.0, 0)["overheads"]

    assert {key: len(cost) for key, cost in overheads.items()} == {"long": 3, "short": 9}


def test_what_is_slow_has_the_cost_of_when_it_was_played():
    scene = scenario("near_miss")
    quick, slow = (
        CellToTime(key, "pymunk:matched", ENGINES["pymunk:matched"], scene, 1, seconds)
        for key, seconds in (("quick", 0.0), ("slow", 3 * SLOW))
    )
    times = timing_pass.time_cells([quick, slow], 5.0, 0)["cells"]
    costs = {key: timed["cost"] for key, timed in times.items()}

    assert costs["slow"] == [3 * SLOW / scene.duration]
    assert max(costs["quick"]) < costs["slow"][0] / 10


def test_a_call_counts_once_for_many_steps_and_for_each_step_with_a_force():
    free, thrusted = scenario("near_miss"), scenario("body_frame_thrust")
    steps = free.intervals * 2
    on = sum(thrust.stop - thrust.start for thrust in thrusted.thrusts) / thrusted.dt(1)

    assert binding_of(1.0, 5.0, free, 2) * free.duration == pytest.approx(steps + 4)
    found = binding_of(1.0, 5.0, thrusted, 1) * thrusted.duration
    # besides, a call for each stretch without a force: two at most
    assert thrusted.intervals + 4 * on <= found + 1e-9 <= thrusted.intervals + 4 * (on + 2) + 1e-6


def test_a_clock_that_reads_an_engine_otherwise_the_second_time_is_busy():
    def with_pairs(*ratios: float) -> RunResults:
        times = {str(k): {"cost": [1.0], "again": [ratio]} for k, ratio in enumerate(ratios)}
        return RunResults(None, {}, [], {}, [], {}, {"cells": times}, True)

    assert is_busy(with_pairs(0.88, 1.0, 1.12, 1.12))
    assert not is_busy(with_pairs(0.92, 1.0, 1.08, 1.08))
    assert is_busy(with_pairs())
    assert noise_of([1.0, 1.0, 3.0, 1.0, 1.0]).floor < BUSY  # one outlier is none


def test_what_an_engine_refuses_is_left_out_and_not_the_rest(monkeypatch: pytest.MonkeyPatch):
    refusing = timing_pass.CellToTime(
        "key", "pymunk:matched", ENGINES["pymunk:matched"], scenario("near_miss"), 1, 0.0
    )
    monkeypatch.setattr("crosscheck2d.reports.run.stepping.empty_world", partial(int, "no world"))
    times = timing_pass.time_cells([refusing], 5.0, 0)

    assert list(times["cells"]) == ["key"]
    assert list(times["overheads"]) == ["read of pymunk:matched in near_miss"]
