"""One rule of scale for every number of a scene file, and no file that is none keeps a command
waiting."""

import os
import re
import socket
import warnings
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.reports.run.scenes import with_steps
from crosscheck2d.scenarios.files.scene_file import SceneFileError, read_scene_file
from tests.scenarios.scene_faults import TWO

# Every number that a scene may hold.
FULL = """name = "full"
duration = 2.0
sample_interval = 0.02
substeps = [1, 2]
gravity = [0.0, 0.0]
restitution = 0.9
[[disk]]
position = [-1.0, 0.0]
velocity = [1.0, 0.0]
radius = 0.25
mass = 1.0
inertia = 0.03
angle = 0.0
angular_velocity = 0.0
[[wall]]
start = [-3.0, -1.0]
end = [3.0, -1.0]
[box]
low = [-4.0, -4.0]
high = [4.0, 4.0]
[wrap]
low = [-5.0, -5.0]
high = [5.0, 5.0]
[[thrust]]
disk = 0
start = 0.5
stop = 1.0
force = [0.1, 0.0]
torque = 0.1
"""
KEYS = re.findall(r"^(\w+) = [\[\d-]", FULL, re.MULTILINE)


def said(text: str, folder: Path) -> list[str]:
    path = folder / "scale.toml"
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            read_scene_file(path)
        except SceneFileError as error:
            return [fault.removeprefix(f"{path}: ") for fault in error.faults]
    return []


def replaced(key: str, value: str) -> str:
    text, count = re.subn(
        rf"^{key} = (\[?)[-\d.]+", rf"{key} = \g<1>{value}", FULL, count=1, flags=re.MULTILINE
    )
    assert count
    return text


@pytest.mark.parametrize(
    "key", [key for key in dict.fromkeys(KEYS) if key not in ("disk", "substeps")]
)
@pytest.mark.parametrize("value", ["1e28", "-1e28", "1e154", "1e160", "1.7e308"])
def test_what_is_too_large_is_refused_whatever_it_is_of(
    key: str, value: str, tmp_path: Path
) -> None:
    faults = said(replaced(key, value), tmp_path)
    assert len(faults) == 1
    assert re.search(rf"{key}(\[0\])? = ", faults[0])
    assert "must be" in faults[0]
    if value[0] != "-" and key != "restitution":
        assert "out of scale" in faults[0]


@pytest.mark.parametrize("value", ["1e-10", "1e-160", "5e-324"])
def test_what_has_a_size_must_not_vanish_and_what_has_none_may(value: str, tmp_path: Path) -> None:
    # A coordinate or a speed of 1e-160 is a zero, rounded; a radius is no radius.
    for key in ("duration", "sample_interval", "radius", "mass"):
        (fault,) = said(replaced(key, value), tmp_path)
        assert "out of scale; must be from 1e-09 to 1e+09 (SI)" in fault
    (fault,) = said(replaced("restitution", value), tmp_path)
    assert fault.endswith("out of scale; must be 0, or from 1e-09 to 1")
    for key in ("gravity", "position", "velocity", "angle", "angular_velocity", "force", "torque"):
        assert said(replaced(key, value), tmp_path) == []


def test_walls_and_boxes_have_a_size(tmp_path: Path) -> None:
    wall = FULL.replace("end = [3.0, -1.0]", "end = [-3.0, -0.9999999999]")
    assert said(wall, tmp_path)[0].startswith(
        "wall[0].end = [-3.0, -0.9999999999]: out of scale: a wall of 1e-10 m;"
    )
    for table, low, high in (("box", "-4.0", "4.0"), ("wrap", "-5.0", "5.0")):
        thin = FULL.replace(f"high = [{high}, ", f"high = [{float(low) + 1e-10!r}, ")
        assert said(thin, tmp_path)[0].startswith(f"{table}.high = ")
        assert "out of scale: too near to low" in said(thin, tmp_path)[0]


@given(
    st.sampled_from(KEYS),
    st.floats(allow_nan=True) | st.sampled_from([1e9, 1e-9, 5e-324, 1e154, -1e-300]),
)
def test_any_number_anywhere_is_read_or_refused_in_a_sentence(
    tmp_path_factory: pytest.TempPathFactory, key: str, value: float
) -> None:
    for fault in said(replaced(key, repr(value)), tmp_path_factory.getbasetemp()):
        assert "must " in fault


@pytest.mark.parametrize("count", [10_000_001, 10**9, 10**40, 10**400])
def test_too_many_substeps_are_blamed_for_being_too_many(count: int, tmp_path: Path) -> None:
    (fault,) = said(TWO.replace("= 0.02", f"= 0.02\nsubsteps = [{count}]"), tmp_path)
    assert fault.endswith(": more than 10000000 steps in all; must give at most 10000000")


def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "pipe.toml")
    (zero := tmp_path / "zero.toml").symlink_to("/dev/zero")
    (linked := tmp_path / "linked.toml").symlink_to(pipe)
    (loop := tmp_path / "loop.toml").symlink_to(loop)
    (folder := tmp_path / "folder.toml").mkdir()
    (huge := tmp_path / "huge.toml").touch()
    os.truncate(huge, 2**40)  # of holes: it takes no place
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(bound := tmp_path / "bound.toml"))
        expected = {
            pipe: "is a pipe or a device; must be a readable TOML file",
            zero: "is a pipe or a device; must be a readable TOML file",
            linked: "is a pipe or a device; must be a readable TOML file",
            loop: "too many levels of symbolic links; must be a readable TOML file",
            folder: "is a directory; must be a readable TOML file",
            huge: "larger than 5000000 bytes; must be smaller",
            bound: "no such device or address; must be a readable TOML file",
        }
        for path, line in expected.items():
            with pytest.raises(SceneFileError) as refusal:
                read_scene_file(path)
            assert refusal.value.faults == [f"{path}: {line}"]


@given(
    interval=st.floats(1e-6, 10.0),
    samples=st.integers(1, 100),
    substeps=st.integers(1, 5000),
    asked=st.floats(1e-12, 99),
)
def test_the_step_that_is_suggested_is_accepted(
    tmp_path_factory: pytest.TempPathFactory,
    interval: float,
    samples: int,
    substeps: int,
    asked: float,
) -> None:
    # digits as printed: six of them stood for another step, which was refused as well
    path = tmp_path_factory.getbasetemp() / "steps.toml"
    text = TWO.replace("= 0.02", f"= {interval!r}\nsubsteps = [{substeps}]")
    path.write_text(re.sub(r"(?m)^duration = .*$", f"duration = {interval * samples!r}", text))
    one = read_scene_file(path)
    try:
        with_steps(one, [asked], False)
    except ValueError as refusal:
        suggested = re.findall(r"must be (\S+) s or more|e\.g\. (\S+)$", str(refusal))[0]
        with_steps(one, [float("".join(suggested))], False)
