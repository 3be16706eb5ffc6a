"""`crosscheck bits`: which engines have other bits than those that are kept, and from where on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from adapters.engines import ENGINES, UNASKED, told_apart
from adapters.play import play_once
from reports.commands import bits as command
from reports.run import bits
from reports.run.cells import Cell
from reports.run.scenes import open_scene
from scenarios.catalogue import SCENARIOS
from tests.measured import MEASURED, TABLE
from tests.reports.terminal.command_line import crosscheck


def row(name: str, scene: str = "head_on_equal_e09") -> dict[str, str]:
    """Of one engine, played here."""
    scenario = open_scene(scene, 0)
    return bits.bits_here(Cell(scene, 0, name, 2), ENGINES[name], scenario)


def compared(kept: Sequence[dict[str, str]], now: Sequence[dict[str, str]]):
    """Of two tables with these rows."""
    tables = [bits.read(bits.written(list(rows), {})) for rows in (kept, now)]
    return bits.differences(*tables)


def test_the_same_engine_has_the_same_bits_and_another_has_not():
    """Also where both are right: the last place tells them apart."""
    one, again, other = row("pymunk:matched"), row("pymunk:matched"), row("reference:exercise")

    assert compared([one], [again])[0] == []
    assert one["bits"] == again["bits"] != other["bits"]


@pytest.mark.parametrize(("at", "said"), [(0, (-1, 0)), (3, (2, 4)), (5, (4, 8))])
def test_it_is_said_from_which_sample_on_they_differ(at: int, said: tuple[int, int]):
    """One last place in one sample, and so in all hashes after it; hashed are 0, 1, 2, 4, 8 ..."""
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
    """At its middle step size, with hashes where it was played to its end."""
    names = set(zip(TABLE.scenario, TABLE.engine + ":" + TABLE.profile))

    assert names == {
        (scene, name)
        for scene in SCENARIOS
        for name in told_apart(UNASKED, open_scene(scene, 0).scene)
        if name in MEASURED
    }
    assert (TABLE.bits[TABLE.status == "ok"].str.len() == 16).all()


def test_the_command_names_what_differs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """One hash of the kept table is changed: exit status 1, and the engine is named; else 0. An
    engine of which no bits are kept is named, too."""
    monkeypatch.setattr(command, "SCENARIOS", {"head_on_equal_e09": None})
    monkeypatch.setattr(command, "UNASKED", {"pymunk:matched": ENGINES["pymunk:matched"]})
    kept = tmp_path / "kept.csv"
    monkeypatch.setattr(command, "KEPT", kept)
    kept.write_text(bits.written([], {"system": "Linux"}))
    empty = crosscheck("bits", "--out", "here.csv", cwd=tmp_path)
    kept.write_bytes((tmp_path / "here.csv").read_bytes())
    same = crosscheck("bits", cwd=tmp_path)
    *about, line = (tmp_path / "here.csv").read_text().splitlines()
    hashes = line.rsplit(" ", 3)
    kept.write_text(
        "\n".join([*about, " ".join([hashes[0], "0000 0000 0000"])]).replace(
            line.split(",")[5], "0" * 16
        )
        + "\n"
    )
    other = crosscheck("bits", cwd=tmp_path)
    unwritable = crosscheck("bits", "--out", "nowhere/here.csv", cwd=tmp_path)

    assert (empty.returncode, same.returncode, other.returncode) == (1, 0, 1)
    assert "No bits are kept of pymunk:matched." in empty.stdout
    assert "No bits are kept" not in same.stdout
    assert "pymunk:matched in head_on_equal_e09: the same bits up to sample" in other.stdout
    assert (unwritable.returncode, unwritable.stderr.count("\n")) == (2, 1)


@pytest.mark.long
def test_this_machine_has_the_kept_bits(tmp_path: Path):
    """Here; elsewhere an engine may have others, which is what the command is for."""
    assert crosscheck("bits", cwd=tmp_path).returncode == 0
