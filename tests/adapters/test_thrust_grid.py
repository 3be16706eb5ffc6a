"""A thrust that starts or stops inside a step displaces a disk in every engine, by as much as is
said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.adapters.advance import off_grid, off_grid_note
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.scenarios.files.scene_file import scene_text
from crosscheck2d.scenarios.model import Scenario, Scene, Thrust
from crosscheck2d.scenarios.truth.exact import with_oracle
from tests.reports.terminal.command_line import crosscheck

EXACT = ("reference:ordered", "event_driven:float64")  # they are right to rounding but for this


def thrown(start: float, stop: float, torque: float = 0.0) -> Scenario:
    scene = Scene(position=[[0, 0]], velocity=[[1, 0]], radius=[0.25], mass=[2], restitution=1)
    one = Scenario(
        "thrown",
        "Where is it?",
        "here",
        scene,
        1.0,
        0.1,
        (1, 2),
        [Thrust(0, start, stop, [3, -4], torque)],
    )
    return replace(one, truth=with_oracle(one).truth)


def largest_off(one: Scenario, name: str, dt: float) -> float:
    """Radii, of a position or of the rim that turned, in any sample."""
    played = play(ENGINES[name].make(), name, one, dt).trajectory
    assert played is not None
    assert one.truth is not None
    true = one.truth(one.times)
    away = np.linalg.norm(played.position - true.position, axis=2) / one.scene.radius
    return float(max(away.max(), np.abs(played.angle - true.angle).max()))


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize(
    ("start", "stop"), [(0.23, 0.6), (0.2, 0.57), (0.2, 2.0), (0.23, 0.57), (0.21, 0.24)]
)
def test_an_exact_engine_is_off_by_no_more_than_is_said(name: str, start: float, stop: float):
    one = thrown(start, stop)
    for dt in map(one.dt, one.substeps):
        measured, said = largest_off(one, name, dt), off_grid(one, dt)

        assert measured < said + 1e-12  # a thousand roundings of a coordinate of 2 m, in radii
        inside = [at for at in (start, stop) if at < 1 and abs(at / dt - round(at / dt)) > 1e-6]
        if len(inside) < 2:
            assert measured == pytest.approx(said, abs=1e-12)
        assert bool(said) == bool(inside)


def test_a_torque_turns_the_rim_likewise():
    with_torque, without = thrown(0.23, 0.6, torque=0.5), thrown(0.23, 0.6)
    twice = 0.5 / with_torque.scene.inertia[0] * 0.1**2 * 0.3 * 0.7 / 2

    assert off_grid(with_torque, 0.1) - off_grid(without, 0.1) == pytest.approx(twice)
    assert largest_off(with_torque, EXACT[0], 0.1) < off_grid(with_torque, 0.1)


def test_the_note_names_the_steps_at_which_it_happens():
    note = off_grid_note(thrown(0.2, 0.55))

    assert note.startswith("a thrust starts or stops inside a step: every engine is off by up to ")
    assert "at dt = 0.1 s" in note
    assert "0.05 s" not in note
    assert off_grid_note(thrown(0.2, 0.6)) == ""


@pytest.mark.parametrize(
    ("stop", "noted"), [(0.55, True), pytest.param(0.6, False, marks=pytest.mark.slow)]
)
def test_the_page_and_the_terminal_say_so(tmp_path: Path, stop: float, noted: bool):
    (tmp_path / "thrown.toml").write_text(scene_text(thrown(0.2, stop)))
    done = crosscheck(
        "run", "thrown.toml", "--engine", "reference:ordered", "--out", "mine", cwd=tmp_path
    )
    page = (tmp_path / "mine" / "report.html").read_text("utf-8")

    assert done.returncode == 0, done.stderr
    assert ("thrust starts or stops inside a step" in " ".join(done.stdout.split())) == noted
    assert ("thrust starts or stops inside a step" in page) == noted
