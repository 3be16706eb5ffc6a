"""`crosscheck truth --timeout`: an answer that takes longer is given up to where it got, exact so
far, and not kept."""

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from time import process_time
from unittest import mock

import numpy as np
import pytest

from crosscheck2d.reports.commands import truth
from crosscheck2d.reports.run.comparing import compute_record, record_of
from crosscheck2d.reports.run.pool import run_all
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.files.scene_file import scene_text
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth import cache as truth_cache
from crosscheck2d.scenarios.truth import exact as oracle
from crosscheck2d.scenarios.truth.exact import computed, with_oracle
from crosscheck2d.scenarios.truth.oracle import path as oracle_path
from crosscheck2d.scenarios.truth.oracle.events import trace
from crosscheck2d.scenarios.truth.oracle.numbers import Undecided, balls, mpfr
from crosscheck2d.scenarios.truth.oracle.path import TimeLimit
from crosscheck2d.scenarios.truth.record import TruthRecord
from tests.reports.terminal.command_line import crosscheck

REASON, CUT = "the limit of 5 s was reached", 20.0
KINDS = [None, mpfr]
LONG = lay_out([[0, 0]], [-2.19, 2.08], radius=0.3, walls=box([-0.5] * 2, [0.5] * 2))


def boxed(speed: float = 1.1) -> Scenario:
    scene = lay_out(
        [[0.3, 0.4], [0.7, 0.6]],
        [[speed, 0.7], [-0.4, 0.9]],
        radius=0.05,
        walls=box([0.0, 0.0], [1.0, 1.0]),
    )
    return with_oracle(Scenario("boxed", "?", "", scene, 12.0, 0.05))


@pytest.fixture
def ticking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Looked at it gets on by a second, so that the same step is the last on every machine."""
    ticks = count()
    monkeypatch.setattr(oracle_path, "monotonic", lambda: float(next(ticks)))


def begins_as(short: TruthRecord, whole: TruthRecord) -> bool:
    until = short.horizon
    here, there = (record.legs[record.legs[:, 1] <= until] for record in (short, whole))
    events, others = (record.events[record.events[:, 0] <= until] for record in (short, whole))
    return np.array_equal(here, there) and np.array_equal(events, others, equal_nan=True)


@pytest.mark.usefixtures("ticking")
@pytest.mark.parametrize("kind", KINDS)
def test_an_answer_that_time_ends_is_the_beginning_of_the_whole_one(kind: Callable):
    clock = TimeLimit(CUT, REASON)
    short, whole = computed(boxed(), kind, clock), computed(boxed(), kind)

    assert clock.expired
    assert 2.0 < short.horizon < 0.9 * boxed().duration
    assert short.reason.startswith(f"{REASON} at t = ")
    assert whole.reason == ""
    assert len(short.events) > 5
    assert short.method == whole.method
    assert begins_as(short, whole)


@pytest.mark.usefixtures("ticking")
def test_a_last_place_in_the_start_is_another_beginning():
    short = computed(boxed(float(np.nextafter(1.1, 2))), mpfr, TimeLimit(CUT, REASON))

    assert not begins_as(short, computed(boxed(), mpfr))


@pytest.mark.usefixtures("ticking")
@pytest.mark.parametrize("seconds", [3.0, 30.0, 300.0, 3000.0])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_given_of_a_chaotic_motion_is_exact(kind: Callable, seconds: float):
    one = scenario("line_gas")
    short, whole = computed(one, kind, TimeLimit(seconds, REASON)), computed(one, kind)
    until = min(short.horizon, whole.horizon, one.duration)
    t = np.linspace(0.0, max(until - 1e-9, 0.0), 200)
    here, there = (record.sampled(one.scene, one.thrusts, t) for record in (short, whole))
    known = min(len(here), len(there))

    deviation = np.abs(here.position[:known] - there.position[:known]).max()
    assert deviation <= short.error_bound + whole.error_bound
    assert short.error_bound <= 1e-9 * one.scene.radius.min()


@pytest.mark.usefixtures("ticking")
def test_more_time_never_gives_less():
    one = scenario("line_gas")
    reached = [
        min(computed(one, None, TimeLimit(float(s), REASON)).horizon, one.duration)
        for s in range(20, 380, 60)
    ]

    assert reached == sorted(reached)
    assert reached[0] < reached[-1]


def test_an_answer_ends_before_its_balls_are_too_wide():
    one, accuracy = scenario("line_gas"), 1e-12
    with pytest.raises(Undecided) as lost:
        trace(one.scene, [], one.duration, balls(56))
    path = replace(lost.value.path, end=lost.value.t)
    end, error = oracle.exact_until(path, one.duration, accuracy)

    assert 0 < end < lost.value.t
    assert error < accuracy <= oracle.widest(oracle.widths(path), path.end)
    assert oracle.widest(oracle.widths(path), end * (1 + 1e-9)) >= accuracy


@pytest.mark.usefixtures("ticking")
def test_what_depends_on_the_machine_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path))
    one = boxed()
    record_of(one, TimeLimit(CUT, REASON))
    assert truth_cache.look_up(truth_cache.key_of(one)) is None

    whole = record_of(one)
    assert whole.reason == ""
    assert truth_cache.look_up(truth_cache.key_of(one)) is not None
    assert record_of(one, TimeLimit(0.0, REASON)).horizon == whole.horizon  # it is there already


@pytest.mark.usefixtures("ticking")
def test_where_time_ends_before_the_first_sample_there_is_no_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path))
    with pytest.raises(NoTruth, match=REASON):
        record_of(replace(boxed(), sample_interval=0.5), TimeLimit(0.0, REASON))


def by_processor_time(scene: str, seed: int, timeout: float) -> TruthRecord | str:
    """On a clock that stands still while other processes run; fails if it takes longer than
    `timeout`."""
    with mock.patch.object(oracle_path, "monotonic", process_time):
        began = process_time()
        record = compute_record(scene, seed, timeout)
        assert process_time() - began < timeout
    return record


@pytest.mark.slow
def test_an_endless_scene_is_answered_up_to_the_limit_of_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    # A part of the limit is for following it, so short that time ends before the work that is
    # allowed.
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(truth, "compute_record", by_processor_time)
    # on a busy machine 6 s of work take longer than 6 s
    monkeypatch.setattr(truth, "run_all", lambda tasks, workers, _: run_all(tasks, workers, 300.0))
    long = Scenario("long", "?", "", LONG, 1e6, 1.0, (1,))
    (tmp_path / "long.toml").write_text(scene_text(long))
    done = crosscheck("truth", "long.toml", "--timeout", "6", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)

    assert 1.0 < said["horizon_s"] < said["duration_s"]
    assert "the limit of 6 s was reached (a longer --timeout gives more) at t = " in said["reason"]
    assert not (tmp_path / "cache").exists()
