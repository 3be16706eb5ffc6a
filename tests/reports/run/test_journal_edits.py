"""A journal that somebody edited, that was torn or that another version has written is refused by
line, by every command that reads one: never a traceback."""

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crosscheck2d.adapters.engines import row_of
from crosscheck2d.reports.run.archive import LINES, Archive
from crosscheck2d.reports.run.journal import JOURNAL, Journal, end_of, written
from crosscheck2d.reports.run.machine import about
from crosscheck2d.reports.run.made import digest_of, read_made
from crosscheck2d.reports.speed import budget, cheapest
from crosscheck2d.reports.speed.kept import TEXT, Kept
from crosscheck2d.reports.speed.measure import in_turns, scene_rows
from crosscheck2d.reports.speed.plan import PLAIN, SCENE, Measurement
from crosscheck2d.reports.stability.limits import Limit
from crosscheck2d.reports.stability.maps import MAPS, MapOf
from crosscheck2d.reports.stability.results import Task, found_limit, journalled
from crosscheck2d.reports.stability.touching import law_of
from crosscheck2d.reports.terminal.exits import FolderTaken
from tests.reports.run.journals import contents, put
from tests.reports.run.small_runs import make
from tests.reports.terminal.command_line import crosscheck

NAME = "reference:exercise"
HEADER = {
    "scenes": ["slow_collision"],
    "files": {},
    "engines": [NAME],
    "effort": {"rounds": 1},
    "whole": False,
} | {key: value for key, value in about("", 0).items() if key in ("seed", "versions", "machine")}
DAMAGED, OTHER = "is not what was written", "was written by another version of crosscheck"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run in which nothing is wrong, with a line of every kind."""
    place = tmp_path_factory.mktemp("edits")
    scene = Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml"
    made = make(place / "made", Path(shutil.copy(scene, place / "two.toml")))
    check = {"passed": False, "says": ["No."], "shown": [[]]}
    *lines, footer = contents(made)
    return put(made, [*lines, {"checked": check, "of": "mine.js:own", "key": ""}, footer])


@pytest.fixture(scope="module")
def speed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The journal of a measurement: a ladder, what its error is made of, times and a closed
    form."""
    place = tmp_path_factory.mktemp("speed")
    engine = Measurement(SCENE, "slow_collision", 0, NAME, PLAIN, row_of(NAME).make, (1, 2, 4))
    with Journal(place) as journal:
        kept = Kept(journal, HEADER, False)
        kept.add(engine.task, engine.errors())
        kept.add(("budget", "slow_collision", NAME), budget.budget_of("slow_collision", 0, NAME, 2))
        often = {"rounds": 1, "budget": 0.0}
        kept.add(
            ("time", SCENE, "slow_collision"),
            scene_rows(SCENE, "slow_collision", 0, in_turns([engine]), often),
        )
        kept.add(("time", "truth", "slow_collision"), cheapest.closed_form("slow_collision", 0))
    return place


@pytest.fixture(scope="module")
def stability(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The journal of a search: a limit, a law, and a map whose readings are all alike."""
    place = tmp_path_factory.mktemp("stability")
    one = MAPS["dt_and_speed"]
    tasks = [
        Task(kind, name, "pymunk:matched", "quick")
        for kind, name in (("limit", "spin"), ("law", "touching_break"), ("map", one.name))
    ]
    cells = tuple((x, y, 0.1, False, "", "") for x, y in product(one.x, one.y))
    found = [
        found_limit(tasks[0]),
        law_of(tasks[1].name, tasks[1].engine),
        MapOf(one.name, tasks[2].engine, cells),
    ]
    with Journal(place) as journal:
        journal.append({"header": about("", 0) | {"form": "quick", "files": {}}})
        for task, result in zip(tasks, found):
            journal.append({"task": asdict(task), task.kind: asdict(result)})
        journal.append({"footer": {"tasks": 3, "seconds": 1.0}})
    return place


def resumed(folder: Path) -> Kept:
    """What `speed --resume` makes of a journal before it measures."""
    with Journal(folder) as journal:
        return Kept(journal, HEADER, True)


READ: dict[str, Callable[[Path], Any]] = {
    "run": Archive.read,
    "speed": resumed,
    "stability": journalled,
}


@pytest.fixture(scope="module", params=list(READ))
def journal(request: pytest.FixtureRequest) -> tuple[Path, Callable[[Path], Any]]:
    """The folder of a journal, and what reads it."""
    return request.getfixturevalue(request.param), READ[request.param]


def fault_of(read: Callable[[Path], Any], folder: Path) -> str:
    """Why the journal there cannot be used; "" if it can."""
    try:
        read(folder)
    except (ValueError, FolderTaken) as fault:
        return str(fault)
    return ""


def test_a_journal_as_it_was_written_is_taken(journal: tuple, tmp_path: Path):
    """The control: nothing is refused that a command writes, though it ends within a line."""
    folder, read = journal
    shutil.copy(folder / JOURNAL, tmp_path)
    assert fault_of(read, tmp_path) == ""
    with (tmp_path / JOURNAL).open("a") as file:
        file.write('{"task": ["err')
    assert fault_of(read, tmp_path) == ""


def test_a_journal_is_json_lines_whose_last_key_is_the_sum(journal: tuple):
    """For pandas and jq."""
    table = pd.read_json(journal[0] / JOURNAL, lines=True)
    lines = [json.loads(line) for line in (journal[0] / JOURNAL).read_text().splitlines()]

    assert table["sum"].notna().all()
    assert all([*line][-1] == "sum" for line in lines)


@given(st.data())
def test_any_byte_that_is_another_is_noticed(
    journal: tuple, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
):
    """Replaced, left out or put in; but the end of the last line, which then counts as torn."""
    folder, read = journal
    whole = (folder / JOURNAL).read_bytes()
    at = data.draw(st.integers(0, len(whole) - 2))
    new = data.draw(st.binary(max_size=1))
    edited = whole[:at] + new + whole[at + data.draw(st.integers(0, 1)) :]
    place = tmp_path_factory.mktemp("edited")
    (place / JOURNAL).write_bytes(edited)

    assert (DAMAGED in fault_of(read, place)) == (edited != whole)


@pytest.mark.parametrize("number", [1, 4])
def test_what_was_edited_is_refused_by_every_command(run: Path, tmp_path: Path, number: int):
    """One sentence with the line's number and what to do; exit 2; the run is left as it is."""
    lines = (run / JOURNAL).read_text().splitlines(keepends=True)
    lines[number - 1] = lines[number - 1].replace('"pymunk', '"box2d', 1)
    shutil.copytree(run, tmp_path / "out")
    (tmp_path / "out" / JOURNAL).write_text("".join(lines))
    for command in (
        ("report", "out"),
        ("diff", run, "out"),
        ("run", "--resume", "out"),
    ):
        done = crosscheck(*command, cwd=tmp_path)

        assert done.returncode == 2
        assert f"{JOURNAL}: line {number}: {DAMAGED}; " in done.stderr
        assert ("run it again" if number == 1 else "delete that line, and --resume") in done.stderr
        assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_journal_without_sums_is_of_another_version(journal: tuple, tmp_path: Path):
    """As earlier versions wrote it."""
    folder, read = journal
    text = "".join(json.dumps(line) + "\n" for line in contents(folder))
    (tmp_path / JOURNAL).write_text(text)

    assert f"line 1: {OTHER}; run it again" in fault_of(read, tmp_path)


@pytest.mark.parametrize(
    "line",
    [b'{"what": 1', b'{"cell": "0"', b'{"task": {"kind": "limit"}', b"{", b"[" * 100_000, b"\xff"],
)
def test_a_line_with_its_sum_that_cannot_be_read_is_of_another_version(
    journal: tuple, tmp_path: Path, line: bytes
):
    """Of a kind that is not known, or without what it should have."""
    folder, read = journal
    whole = (folder / JOURNAL).read_bytes()
    (tmp_path / JOURNAL).write_bytes(whole + line + end_of(line))

    number = len(contents(folder)) + 1
    assert f"line {number}: {OTHER}; run it again" in fault_of(read, tmp_path)


def test_the_header_comes_first(journal: tuple, tmp_path: Path):
    """Without it the plan is not known."""
    folder, read = journal
    (tmp_path / JOURNAL).write_bytes(b"".join(map(written, contents(folder)[1:])))

    assert f"line 1: {DAMAGED}; without it the plan is not known" in fault_of(read, tmp_path)


def test_a_line_that_is_there_twice_counts_once(journal: tuple, tmp_path: Path):
    """The later holds."""
    folder, read = journal
    lines = contents(folder)
    put(tmp_path, [*lines, lines[1]])
    assert fault_of(read, tmp_path) == ""


def test_the_lines_of_a_run_have_what_is_said_of_them(run: Path):
    """Neither more nor less, of every kind."""
    kinds = {next(iter(line)): line for line in contents(run)}

    assert {*kinds} == {*LINES}
    for kind, line in kinds.items():
        inside = line[kind] if isinstance(line[kind], dict) else {}
        assert {*line, *inside} - {kind} == {*LINES[kind]}


def test_journals_that_were_joined_are_noticed(run: Path, speed: Path, tmp_path: Path):
    """Every line has its sum, but it is not of this run."""
    lines = contents(run)
    foreign = next(line for line in lines if "cell" in line) | {"seed": 7}
    assert f"line {len(lines) + 1}: is of another run; delete" in fault_of(
        Archive.read, put(tmp_path, [*lines, foreign])
    )
    other = {"header": HEADER | {"seed": 1}}
    assert "of something else" in fault_of(resumed, put(tmp_path, [*contents(speed), other]))


def test_a_limit_of_an_engines_file_that_is_not_asked_for_is_named(stability: Path, tmp_path: Path):
    """It could not be shown among the others."""
    lines = contents(stability)
    for whose in (lines[1]["task"], lines[1]["limit"]):
        whose["engine"] = "mine.py:own"

    assert "line 2: is of mine.py:own, which is not asked for; delete" in fault_of(
        journalled, put(tmp_path, lines)
    )


def test_a_text_that_reads_nan_stays_a_text(speed: Path, stability: Path, tmp_path: Path):
    """It became a number when it was read back, and a traceback where it was taken for text."""
    lines = contents(speed)
    lines[1]["result"][0]["reason"] = "nan"
    again = resumed(put(tmp_path, lines))
    assert again[tuple(lines[1]["task"])][0]["reason"] == "nan"
    lines = contents(stability)
    lines[1]["limit"]["settings"] = "nan"
    _, results = journalled(put(tmp_path, lines))
    assert [one.settings for one in results.values() if isinstance(one, Limit)] == ["nan"]


def test_every_column_of_text_is_known_and_no_other(speed: Path):
    """Of the rows of a measurement, in which numbers that are not finite are text, too."""
    found = set()
    for line in contents(speed)[1:]:
        result = line["result"]
        for row in result if isinstance(result, list) else [result]:
            found |= {name for name, value in row.items() if isinstance(value, str)}
            assert all(isinstance(row[name], str) for name in TEXT & row.keys())

    # of the sizes; and numbers
    assert TEXT - found == {"stopped"}
    assert {*found} - TEXT <= {"change_radii", "error_radii", "dt_s", "share"}


@pytest.mark.parametrize(
    "text",
    [
        "[" * 10**6,
        "{}",
        "[]",
        "1",
        '{"command": 1, "finished": true, "files": {}}',
        "\0",
        '{"command": "x", "finished": "y", "files": {}}',
    ],
)
def test_a_record_of_what_was_made_that_is_none_is_as_good_as_none(tmp_path: Path, text: str):
    """made.json: what is in the folder then is nobody's."""
    (tmp_path / "made.json").write_text(text)
    assert read_made(tmp_path) is None


def test_a_file_that_never_ends_has_no_digest(tmp_path: Path):
    """A journal may name any path."""
    assert digest_of("/dev/zero") == digest_of(tmp_path) == digest_of("a\0b") == ""
