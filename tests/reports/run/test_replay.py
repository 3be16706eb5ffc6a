"""`crosscheck replay`: a cell again, from its last good state, found by the beginning of its
key."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from adapters.engines import ENGINES as EVERY
from reports.commands.replay import continued, replay
from reports.run.archive import Archive
from reports.run.cells import Cell
from reports.run.journal import Journal
from reports.run.playing import play_cell
from reports.run.suite import carry_out
from reports.run.tasks import Means, RunPlan
from reports.terminal.progress import Progress
from scenarios.catalogue import scenario
from tests.reports.run.control_engines import CONTROLS, FATAL, Controlled, row

ENGINES = {name: CONTROLS[name] for name in ("aborts:control", "turnstonan:control")} | {
    "good:control": row(Controlled)
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of one good engine and two bad ones, at one step."""
    folder = tmp_path_factory.mktemp("run")
    plan = RunPlan(
        ["slow_collision"], ENGINES, seed=0, dts=[1 / 60], full=False, timings=0, command="test"
    )
    with Journal(folder) as journal, Progress() as progress:
        carry_out(plan, Means(workers=2), journal, progress)
    return folder


@pytest.fixture
def replayed(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> Callable[[str], tuple[object, str, str]]:
    """Exit status and what was printed."""

    def run(name: str) -> tuple[object, str, str]:
        with pytest.raises(SystemExit) as left:
            replay(name, folder, timeout=20.0, engines=ENGINES)
        said = capfd.readouterr()
        return left.value.code, said.out, said.err

    return run


def key_of(folder: Path, engine: str) -> str:
    """The key of the cell of one of `ENGINES`."""
    return next(
        r["cell"] for r in Archive.read(folder).records if f"{r['engine']}:{r['profile']}" == engine
    )


def test_the_journal_says_how_far_a_cell_came(folder: Path):
    """Step and time of the last good state: of the abort, of the divergence, of the whole."""
    far = {
        record["engine"]: (record["status"], record["step"], record["until_s"])
        for record in Archive.read(folder).records
    }

    assert far["good"] == ("ok", 240, 4.0)
    for engine, status in (("aborts", "crashed"), ("turnstonan", "diverged")):
        assert far[engine] == (status, FATAL - 1, pytest.approx((FATAL - 1) / 60))


def test_a_crash_is_replayed_from_its_last_good_state(folder: Path, replayed):
    """It begins at step 99; the engine, which counts from there, now crashes 100 steps later: exit
    1."""
    code, said, printed = replayed(key_of(folder, "aborts:control")[:8])

    assert code == 1
    assert f"from:    step {FATAL - 1}, 1.65 s, the last good state" in said
    assert "now:     crashed: worker died: SIGABRT in misbehave" in said
    assert f"reached: step {2 * (FATAL - 1)} of 240" in said
    assert "assertion failed: mass > 0" in printed  # what an engine prints is shown


def test_a_good_cell_is_replayed_from_the_start_to_the_same_bits(folder: Path, replayed):
    """Exit 0."""
    code, said, _ = replayed(key_of(folder, "good:control"))

    assert code == 0
    assert "bits:    as recorded" in said


def test_a_cell_that_is_not_there_is_bad_input_with_what_is_near(folder: Path, replayed):
    """A slip in the key, or a key of nothing: exit 2 and the cells that may be meant."""
    key = key_of(folder, "aborts:control")
    slip = key[:-2] + ("00" if key[-2:] != "00" else "11")
    for name, near in ((slip, key), ("zzz", key)):
        code, _, said = replayed(name)

        assert code == 2
        assert near in said


@pytest.mark.parametrize("name", ["spin_under_torque", "body_frame_thrust"])
def test_the_rest_of_a_scenario_is_its_rest(name: str):
    """From the middle state on, under what is left of its thrusts, the reference plays what it
    played before."""
    whole, row = scenario(name), EVERY["reference:exercise"]
    first = play_cell(Cell(name, 0, "reference:exercise", 1), row, whole).trajectory
    k = whole.intervals // 2
    rest = continued(whole, 1, first, k)
    second = play_cell(Cell(name, 0, "reference:exercise", 1), row, rest).trajectory

    assert any(thrust.stop > whole.times[k] for thrust in whole.thrusts)
    # Shifting the thrusts by the middle time rounds their share of a step, some 1e-13 of it.
    for part in ("position", "velocity", "angle", "angular_velocity"):
        np.testing.assert_allclose(
            getattr(second, part), getattr(first, part)[k:], rtol=1e-11, atol=1e-12
        )
