"""A scene file is read exactly, refused with every fault named, and written to read back bit for
bit."""

import itertools
import re
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.files import tables
from crosscheck2d.scenarios.files.scene_file import SceneFileError, read_scene_file, scene_text
from crosscheck2d.scenarios.files.tables import MOST_WALLS
from crosscheck2d.scenarios.model import Scenario, Scene, Thrust
from tests.scenarios.scene_faults import DISK, FAULTS, SCENES, THRUST, TWO


def faults_of(text: str | bytes, folder: Path) -> list[str]:
    path = folder / "two.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SceneFileError) as refusal:
        read_scene_file(path)
    faults = refusal.value.faults
    assert str(refusal.value) == "\n".join(faults)
    assert all(fault.startswith(f"{path}: ") and "\n" not in fault for fault in faults)
    return [fault.removeprefix(f"{path}: ") for fault in faults]


@pytest.mark.parametrize(("good", "bad", "line"), FAULTS)
def test_a_fault_is_one_plain_line(good: str, bad: str, line: str, tmp_path: Path) -> None:
    assert good in TWO
    (fault,) = faults_of(TWO.replace(good, bad, 1), tmp_path)
    assert fault.startswith(line)
    assert len(fault) < 200
    assert not re.search(r"Input should|type=|https?:|pydantic", fault)


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (TWO.encode("utf-16"), "line 1: byte 0xff is not text; must be UTF-8"),
        (b"# one\n# \xe4\n", "line 2: byte 0xe4 is not text; must be UTF-8"),
        (b"#" * 5_000_001, "larger than 5000000 bytes; must be smaller"),
    ],
)
def test_bytes_that_are_no_text_are_refused(content: bytes, line: str, tmp_path: Path) -> None:
    assert faults_of(content, tmp_path) == [line]


def test_a_byte_order_mark_and_the_line_ends_of_windows_change_nothing(tmp_path: Path) -> None:
    path = tmp_path / "two.toml"
    path.write_bytes(b"\xef\xbb\xbf" + TWO.replace("\n", "\r\n").encode())
    assert str(read_scene_file(path)) == str(read_scene_file(SCENES / "two.toml"))


def test_a_file_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    for path, line in {
        tmp_path / "gone.toml": "no such file or directory; must be a readable TOML file",
        tmp_path: "is a directory; must be a readable TOML file",
        Path("a\0b"): "embedded null byte; must be a readable TOML file",
    }.items():
        with pytest.raises(SceneFileError) as refusal:
            read_scene_file(path)
        assert refusal.value.faults == [f"{path}: {line}"]


def test_every_fault_is_reported_at_once(tmp_path: Path) -> None:
    text = (
        TWO.replace("radius = 0.25", "radius = -1").replace("= 0.02", "= 0.03").replace("0.9", "2")
    )
    text += (
        "[[wall]]\nstart = [0, 0]\nend = [0, 0]\n" + THRUST.replace("= 0\n", "= 7\n") + "when = 1\n"
    )
    keys = [fault.split(" = ")[0] for fault in faults_of(text, tmp_path)]
    assert keys == [
        "sample_interval",
        "restitution",
        "disk[0].radius",
        "disk[1].radius",
        "wall[2].end",
        "thrust[0].disk",
        "thrust[0].when",
    ]


def test_no_disk_is_a_fault_whether_left_out_or_empty(tmp_path: Path) -> None:
    head = 'name = "none"\nduration = 1\nsample_interval = 1\nrestitution = 1\n'
    assert faults_of(head, tmp_path) == ["disk: missing; must be 1 to 100000 [[disk]] tables"]
    assert faults_of(head + "disk = []", tmp_path) == [
        "disk = []: 0 items; must be 1 to 100000 [[disk]] tables"
    ]


@pytest.mark.slow
def test_more_disks_than_a_scene_may_have_are_one_fault(tmp_path: Path) -> None:
    head = 'name = "many"\nduration = 1\nsample_interval = 1\nrestitution = 1\n'
    one = "{position = [0, 0], radius = 1, static = 1},"
    (fault,) = faults_of(head + f"disk = [{one * 100_001}]", tmp_path)
    assert fault.endswith("100001 items; must be 1 to 100000 [[disk]] tables")


def test_a_pile_in_one_place_gives_a_bounded_message(tmp_path: Path) -> None:
    faults = faults_of(TWO + DISK * 1000, tmp_path)
    assert len(faults) == 101
    assert faults[-1] == "more than 100 faults; must be none (the rest is not listed)"


def test_so_many_faulty_tables_give_a_bounded_message(tmp_path: Path) -> None:
    faults = faults_of(TWO + DISK.replace("radius", "raduis") * 1000, tmp_path)

    assert len(faults) == 101
    assert faults[0].startswith("disk[2].radius: missing")
    assert faults[-1] == "more than 100 faults; must be none (the rest is not listed)"


def test_more_walls_than_can_be_measured_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wall = "[[wall]]\nstart = [-1.0, -3.0]\nend = [1.0, -3.0]\n"
    said = faults_of(TWO + wall * MOST_WALLS, tmp_path)
    assert any(f"must be at most {MOST_WALLS}" in fault for fault in said), said

    monkeypatch.setattr(tables, "MOST_PAIRS", 7)  # two disks are measured against three walls
    assert any("must be at most 3" in fault for fault in faults_of(TWO + wall * 2, tmp_path))
    path = tmp_path / "two.toml"
    path.write_text(TWO + wall)
    assert len(read_scene_file(path).scene.walls) == 3


def test_touching_disks_are_no_overlap(tmp_path: Path) -> None:
    # a close-packed heap far from the origin overlaps by its rounding
    path = tmp_path / "heap.toml"
    rows = [(i + 0.5 * (j % 2) + 1e3, j * np.sqrt(0.75)) for i in range(12) for j in range(12)]
    position = 0.2 * np.array(rows)
    floor = [[[200.0, -0.1], [210.0, -0.1]]]
    scene = lay_out(position, radius=0.1, restitution=0.5, walls=floor)
    path.write_text(scene_text(Scenario("heap", "?", "here", scene, 1.0, 0.1)), newline="\n")
    assert read_scene_file(path).scene.n == len(rows)


def test_a_file_reads_as_it_is_written() -> None:
    bumper = read_scene_file(SCENES / "bumper.toml")
    assert (bumper.name, bumper.source, bumper.substeps) == ("bumper", "bumper.toml", (2, 6))
    assert bumper.asks == "What do the engines make of bumper?"
    assert bumper.truth is not None
    assert bumper.truth(bumper.times).horizon == np.inf
    assert bumper.scene.mass.tolist() == [np.inf, 1.0]
    assert bumper.scene.inertia.tolist() == [np.inf, 0.0625]
    assert bumper.scene.walls.shape == (5, 2, 2)
    assert bumper.scene.walls[0].tolist() == [[-2, 0], [-1, -1]]
    assert bumper.scene.walls[1:].min(axis=(0, 1)).tolist() == [-2, -1]


coordinate = st.floats(-1e6, 1e6)
positive = st.floats(1e-3, 1e3)


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    n = draw(st.integers(1, 4))

    def column(strategy: st.SearchStrategy, *shape: int) -> np.ndarray:
        size = int(np.prod([n, *shape]))
        return np.reshape(draw(st.lists(strategy, min_size=size, max_size=size)), (n, *shape))

    static = column(st.booleans())
    mass = np.where(static, np.inf, column(positive))
    radius = column(positive)
    place = np.arange(n)[:, None] * [1e4, 0] + column(st.floats(-1e3, 1e3), 2)
    solid, odd = mass * radius**2 / 2, column(positive | st.just(np.inf))
    scene = Scene(
        position=place,
        velocity=np.where(static[:, None], 0.0, column(coordinate, 2)),
        radius=radius,
        mass=mass,
        restitution=draw(st.just(0.0) | st.floats(1e-9, 1)),
        angle=column(coordinate),
        angular_velocity=np.where(static, -0.0, column(coordinate)),
        inertia=np.where(column(st.booleans()), solid, odd),
        walls=np.array([[[-1e5, 1e4], [draw(coordinate), 2e4]]])[: draw(st.integers(0, 1))],
        gravity=np.array([draw(coordinate), draw(coordinate)]),
        wrap=draw(st.none() | st.just(np.array([[-1e6, -1e6], [1e6, 1e6 / 3]]))),
    )
    start, last = draw(st.floats(0, 10)), draw(st.just(np.inf) | st.floats(11, 20))
    frame: Literal["world", "body"] = draw(st.sampled_from(["world", "body"]))
    force = np.array([draw(coordinate), 0.1])
    reach = Thrust(n - 1, start, last, force, draw(coordinate), frame)
    interval, samples = draw(st.floats(1e-3, 1)), draw(st.integers(1, 1000))
    asks, source = draw(st.text(st.characters(codec="utf-8"), min_size=1)), draw(st.text())
    return Scenario("any", asks, source, scene, interval * samples, interval, thrusts=[reach])


@given(scenarios())
def test_what_is_written_reads_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, first: Scenario
) -> None:
    path = tmp_path_factory.getbasetemp() / "round.toml"
    path.write_text(scene_text(first), encoding="utf-8", newline="\n")
    second = read_scene_file(path)
    for key in ("name", "asks", "duration", "sample_interval", "substeps"):
        assert getattr(second, key) == getattr(first, key)
    for one, two in zip(
        [first.scene, *first.thrusts], [second.scene, *second.thrusts], strict=True
    ):
        for key, value in vars(one).items():
            same = np.array(value).tobytes() == np.array(getattr(two, key)).tobytes()
            assert same, f"{key}: {value} became {getattr(two, key)}"


@given(x=st.floats(-0.6, 0.6), y=st.floats(-0.6, 0.6), tilt=st.floats(-1, 1), wall=st.booleans())
# its centre lies behind the wall by less than rounding can tell
@example(x=1.5e-6, y=0.0, tilt=1.5e-6, wall=True)
# the direction from the wall to its centre has few digits
@example(x=0.0, y=1e-11, tilt=0.5, wall=True)
def test_the_shift_that_is_named_removes_the_overlap(
    tmp_path_factory: pytest.TempPathFactory, x: float, y: float, tilt: float, wall: bool
) -> None:
    path = tmp_path_factory.getbasetemp() / "shift.toml"
    head = 'name = "shift"\nduration = 1\nsample_interval = 1\nrestitution = 1\n'
    head += "[[disk]]\nradius = 0.25\nstatic = true\n"
    other = (
        f"[[wall]]\nstart = [-2, {-tilt}]\nend = [2, {tilt}]\n"
        if wall
        else "[[disk]]\nradius = 0.3\nstatic = true\n"
    )
    first = f"position = [{x}, {y}]\n"
    path.write_text(head + first + other + ("" if wall else "position = [0, 0]\n"))
    try:
        read_scene_file(path)
    except SceneFileError as error:
        (fault,) = error.faults
        shift = [float(number) for number in re.findall(r"shifted by \[(.*), (.*)\]", fault)[0]]
        moved = [x + shift[0], y + shift[1]] if wall else shift
        if wall:
            first = f"position = {moved}\n"
        path.write_text(head + first + other + ("" if wall else f"position = {moved}\n"))
        read_scene_file(path)


@given(
    st.lists(st.tuples(st.floats(0, 3), st.floats(0, 9), st.floats(0.1, 2)), min_size=2, max_size=9)
)
def test_every_overlap_is_found(
    tmp_path_factory: pytest.TempPathFactory, disks: list[tuple]
) -> None:
    path = tmp_path_factory.getbasetemp() / "pairs.toml"
    rows = "".join(f"{{position = [{x}, {y}], radius = {r}, static = true}}," for x, y, r in disks)
    path.write_text(
        f'name = "p"\nduration = 1\nsample_interval = 1\nrestitution = 1\ndisk = [{rows}]'
    )
    expected = [
        (i, j)
        for i, j in itertools.combinations(range(len(disks)), 2)
        if disks[i][2] + disks[j][2] - np.hypot(*np.subtract(disks[i], disks[j])[:2]) > 1e-11
    ]
    try:
        read_scene_file(path)
        found = []
    except SceneFileError as error:
        pairs = [re.findall(r"disk\[(\d+)\]", fault) for fault in error.faults]
        found = [(int(i), int(j)) for j, i in pairs]
    assert found == expected
