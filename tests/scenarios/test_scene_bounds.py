"""What is read of a scene file is bounded, and a number that Python itself refuses is named by line
and key."""

from __future__ import annotations

from pathlib import Path

import pytest

from crosscheck2d.scenarios.files import tables
from crosscheck2d.scenarios.files.scene_file import SceneFileError, read_scene_file
from crosscheck2d.scenarios.files.tables import MOST_WALLS

HEAD = "name = 'many'\nduration = 1.0\nsample_interval = 0.1\nrestitution = 1.0\n"
DISK = "[[disk]]\nposition = [0.0, {y}]\nradius = 0.1\nmass = 1.0\nvelocity = [0.0, 0.0]\n"
WALL = "[[wall]]\nstart = [-1.0, -{y}]\nend = [1.0, -{y}]\n"


def faults(path: Path, text: str) -> list[str]:
    """What is said of a scene file of that text."""
    path.write_text(text)
    with pytest.raises(SceneFileError) as refused:
        read_scene_file(path)
    return refused.value.faults


def test_more_walls_than_can_be_measured_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """By their number, and by how many disks each is to be measured against."""
    path = tmp_path / "many.toml"
    disks = "".join(DISK.format(y=k + 1) for k in range(3))
    said = faults(path, HEAD + disks + WALL.format(y=1) * (MOST_WALLS + 1))
    assert any(f"must be at most {MOST_WALLS}" in fault for fault in said), said

    monkeypatch.setattr(tables, "MOST_PAIRS", 10)
    assert any(
        "must be at most 3" in fault for fault in faults(path, HEAD + disks + WALL.format(y=1) * 4)
    )
    path.write_text(HEAD + disks + WALL.format(y=1) * 3)
    assert len(read_scene_file(path).scene.walls) == 3


@pytest.mark.parametrize("digits", [4301, 5000])
def test_a_number_of_too_many_digits_is_named_by_line_and_key(tmp_path: Path, digits: int):
    """Python reads none of more than 4300."""
    text = HEAD.replace("duration = 1.0", f"# 1\nduration = {'9' * digits}") + DISK.format(y=0)
    [said] = faults(tmp_path / "long.toml", text)

    assert said.endswith(
        f'long.toml: line 3: "duration": an integer of {digits} digits; must be a number of at most'
        " 4300"
    ), said
