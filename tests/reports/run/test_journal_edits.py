"""A journal that somebody edited is refused by line or used, by every command that reads one: never
a traceback."""

import copy
import json
import random
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from reports.run.archive import Archive
from reports.run.journal import JOURNAL
from reports.run.journal_lines import kind_of
from reports.run.run_lines import KINDS
from tests.reports.run.small_runs import make
from tests.reports.terminal.command_line import Done, crosscheck

GONE = object()
DEEP = json.loads("[" * 60 + "]" * 60)
WRONG: dict[str, Any] = {
    "null": None,
    "true": True,
    "negative": -1,
    "zero": 0,
    "half": 0.5,
    "huge": 1e308,
    "400 digits": 10**400,
    "not a number": float("nan"),
    "infinite": float("inf"),
    "nan as text": "nan",
    "empty": "",
    "path": "../../../x",
    "another name": "other",
    "long": "x" * 5000,
    "escape codes": "a\x1b[31mb\r",
    "surrogate": "\udcff",
    "null byte": "a\0b",
    "markup": "[/nope]",
    "colon": "a:b",
    "list": ["x"],
    "empty list": [],
    "deep": DEEP,
    "empty table": {},
    "table": {"a": {"b": [1]}},
    "missing": GONE,
}
SAMPLE = 30  # edits that are taken, and are put to all commands in the long test


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run in which nothing is wrong."""
    place = tmp_path_factory.mktemp("edits")
    scene = Path(
        shutil.copy(
            Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml", place / "two.toml"
        )
    )
    return with_check(make(place / "made", scene))


def with_check(folder: Path) -> Path:
    """A run in whose journal the check of a solver's file stands, too, which none of these takes
    part in."""
    lines = (folder / JOURNAL).read_text().splitlines()
    check = {"checked": {"passed": False, "says": ["No."]}, "of": "mine.js:own", "key": "0" * 16}
    (folder / JOURNAL).write_text("\n".join([*lines[:-1], json.dumps(check), lines[-1], ""]))
    return folder


def places(value: Any, at: tuple = ()) -> Iterator[tuple]:
    """Where a line may be edited: every key of every table in it, and the first two items of every
    list."""
    if at:
        yield at
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value[:2])
        if isinstance(value, list)
        else ()
    )
    for key, item in items:
        yield from places(item, (*at, key))


def edited(line: dict[str, Any], at: tuple, value: Any) -> dict[str, Any]:
    """A copy of the line with another value there, or none."""
    new = copy.deepcopy(line)
    inner = new
    for key in at[:-1]:
        inner = inner[key]
    if value is GONE:
        del inner[at[-1]]
    else:
        inner[at[-1]] = value
    return new


def edits(folder: Path) -> Iterator[tuple[int, dict[str, Any], str]]:
    """(Number of a line, the line edited, what was done), for every field of every kind of line, to
    all of `WRONG`."""
    lines = [json.loads(line) for line in (folder / JOURNAL).read_text().splitlines()]
    first = {kind_of(line, KINDS.models): number for number, line in reversed([*enumerate(lines)])}
    assert set(first) == set(KINDS.models)
    for kind, number in first.items():
        for at in places(lines[number]):
            for what, value in WRONG.items():
                yield number, edited(lines[number], at, value), f"{kind} {at} {what}"


def put(folder: Path, number: int, line: dict[str, Any]) -> None:
    """Set a line of a journal in the place of another."""
    lines = (folder / JOURNAL).read_text().splitlines()
    lines[number] = json.dumps(line)
    (folder / JOURNAL).write_text("\n".join(lines) + "\n")


def put_to_all(
    made: Path, number: int, line: dict[str, Any], place: Path, resumes: bool
) -> list[Done]:
    """What all commands that read a journal make of a copy of a run with such a line."""
    key = next(record["cell"] for record in Archive.read(made).records)
    commands = [["report", "out"], ["diff", made, "out"], ["replay", key, "--out", "out"]]
    done = []
    for command in (
        [*commands, ["run", "--resume", "out", "--workers", "1"]] if resumes else commands
    ):
        for folder in ("out", "out.part"):
            shutil.rmtree(place / folder, ignore_errors=True)
        shutil.copytree(made, place / "out")
        put(place / "out", number, line)
        done.append(crosscheck(*command, cwd=place))
    return done


def fault_of(folder: Path) -> str:
    """Why the run there cannot be used; "" if it can."""
    try:
        Archive.read(folder)
    except ValueError as fault:
        return str(fault)
    return ""


def assert_quiet(done: Done, what: str) -> None:
    """Nothing that acts on a terminal was printed."""
    assert not set("\x1b\r\0\x07") & set(done.stdout + done.stderr), what


def test_every_edit_of_every_field_is_taken_or_refused(made: Path):
    """2600 edits, most of which no journal may hold: nothing but `ValueError` says so."""
    refused = taken = 0
    for _, line, _ in edits(made):
        try:
            kind_of(line, KINDS.models)
            taken += 1
        except ValueError:
            refused += 1

    assert refused > 2 * taken > 0


def test_what_is_refused_names_its_line(made: Path, tmp_path: Path):
    """Journal, number, and what to do, of a sample of the edits."""
    copied = Path(shutil.copytree(made, tmp_path / "copied"))
    for number, line, what in random.Random(15).sample([*edits(made)], 100):
        shutil.copy(made / JOURNAL, copied / JOURNAL)
        put(copied, number, line)
        named = f"{JOURNAL}: line {number + 1}: ", "of the header; delete", "has no header"
        said = fault_of(copied)
        assert not said or any(words in said for words in named), what


@pytest.mark.parametrize(
    ("kind", "at", "value", "said"),
    [
        ("cell", ("scenario",), "../../../x", "scenario = '../../../x': must match pattern"),
        ("cell", ("status",), "fine", "status = 'fine': must be 'ok', 'unsupported'"),
        ("cell", ("dt_s",), -1.0, "dt_s = -1.0: must be greater than 0"),
        ("cell", ("settings", "friction"), [1], "settings.friction = [1]: "),
        ("cell", ("cell",), "../x", "cell = '../x': must match pattern"),
        ("cell", ("scene",), "near_miss", "must be one of the scenes of the header"),
        ("cell", ("seed",), 10**400, "must be that of the header"),
        ("header", ("header", "machine"), DEEP, "header.machine = [["),
        (
            "header",
            ("header", "timings"),
            10**12,
            "header.timings = 1000000000000: must be less than",
        ),
        ("header", ("header", "seed"), GONE, "header.seed: missing"),
        ("conformance", ("of",), "pymunk:other", "must be of one engine"),
        ("timing", ("cost", 0), float("nan"), "cost[0] = nan: must be a finite number"),
    ],
)
def test_what_does_not_fit_is_named(
    made: Path, tmp_path: Path, kind: str, at: tuple, value: Any, said: str
):
    """By line, key, value and what is allowed; exit 2 of all four commands, of which none writes
    outside of the run."""
    lines = [json.loads(line) for line in (made / JOURNAL).read_text().splitlines()]
    number = next(k for k, line in enumerate(lines) if kind in line)
    before = sorted(path.name for path in tmp_path.parent.iterdir())
    for done in put_to_all(made, number, edited(lines[number], at, value), tmp_path, resumes=True):
        assert done.returncode == 2
        assert said in done.stderr
        assert_quiet(done, said)
    assert sorted(path.name for path in tmp_path.parent.iterdir()) == before


@pytest.mark.parametrize(
    "line", ["[" * 100_000, "{" * 100_000, "NaN", '"\\ud800"', "1e999", "\x00", "\udcff"]
)
def test_a_line_that_is_no_table_is_named(made: Path, tmp_path: Path, line: str):
    """Brackets in brackets without end, a number, a text, bytes that are none."""
    copied = Path(shutil.copytree(made, tmp_path / "copied"))
    text = (made / JOURNAL).read_bytes()
    (copied / JOURNAL).write_bytes(text + line.encode(errors="surrogateescape") + b"\n")
    number = text.count(b"\n") + 1

    with pytest.raises(ValueError, match=f"line {number}"):
        Archive.read(copied)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "at", "value"), [("cell", ("dt_s",), 0.5), ("cell", ("scenario",), "other")]
)
def test_a_line_that_does_not_fit_its_scene_is_named(
    made: Path, tmp_path: Path, kind: str, at: tuple, value: Any
):
    """It is as its schema has it, but a scene has its own name and its own steps: exit 2 of what
    reads the scene."""
    lines = [json.loads(line) for line in (made / JOURNAL).read_text().splitlines()]
    number = next(k for k, line in enumerate(lines) if kind in line)
    report, _, replay, resumed = put_to_all(
        made, number, edited(lines[number], at, value), tmp_path, resumes=True
    )
    cell = lines[number]["cell"]

    for done in (report, resumed) if replay.returncode == 0 else (report, replay, resumed):
        assert done.returncode == 2
        assert f"the line of the cell {cell}: {at[0]} = {value!r}" in done.stderr


@pytest.mark.long
def test_what_is_taken_ends_no_command_with_a_traceback(made: Path, tmp_path: Path):
    """Of the edits that the schema lets pass, a sample goes to every command; an exception would
    fail this test."""
    # so that the copies need not compare again
    assert crosscheck("report", made, cwd=tmp_path).returncode == 0
    taken = []
    copied = Path(shutil.copytree(made, tmp_path / "copied"))
    for number, line, what in edits(made):
        shutil.copy(made / JOURNAL, copied / JOURNAL)
        put(copied, number, line)
        if not fault_of(copied):
            taken.append((number, line, what))
    for number, line, what in random.Random(15).sample(taken, SAMPLE):
        for done in put_to_all(made, number, line, tmp_path, resumes=True):
            assert done.returncode in (0, 1, 2), what
            assert_quiet(done, what)
