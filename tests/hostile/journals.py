"""The folder of a real run in which one thing is not as it was written."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from tests.reports.run.journals import contents, put

from tests.hostile.played import Input
from tests.hostile.small_run import CELL, copied, edited, torn

REPORT, DIFF = ("report", "out"), ("diff", "before", "out")
RESUME = ("run", "--resume", "out", "--workers", "1")
ALL = (REPORT, DIFF, RESUME)
NEXT = cycle(ALL)  # what is faulty is refused alike by all: each input asks the next
JOURNAL = "journal.jsonl"

# What is set in the place of a field of the header: what no journal holds.
HEADER: dict[str, tuple[tuple[str, ...], Any]] = {
    "no table": ((), "header"),
    "a command that is a number": (("command",), 1),
    "a seed that is text": (("seed",), "0"),
    "a negative seed": (("seed",), -1),
    "a start in a list": (("started",), ["yesterday"]),
    "versions that are none": (("versions",), None),
    "a version that is a number": (("versions", "numpy"), 2.4),
    "a machine that is text": (("machine",), "mine"),
    "cores without number": (("machine", "cores"), float("nan")),
    "scenes that are no list": (("scenes",), "two.toml"),
    "a scene that is a table": (("scenes", 0), {"name": "two"}),
    "a scene with a null byte": (("scenes", 0), "two\0.toml"),
    "a scene that is not there": (("scenes", 0), "../../../etc/passwd.toml"),
    "a scene that acts on a terminal": (("scenes", 0), "\x1b[31m\r[/nope].toml"),
    "a scene that is half a letter": (("scenes", 0), "\udcff.toml"),
    "an engine without a profile": (("engines", 0), "pymunk"),
    "an engine that nobody knows": (("engines", 0), "bullet:shipped"),
    "an engine that is a file elsewhere": (("engines", 0), "/etc/passwd.py:own"),
    "a step backwards": (("dts",), [-0.02]),
    "a step that is text": (("dts",), ["0.02"]),
    "full of what": (("full",), "yes"),
    "timings without end": (("timings",), 10**15),
    "tasks of 400 digits": (("tasks",), 10**400),
    "a folder that is a number": (("folder",), 7),
}
CELLS: dict[str, tuple[tuple[str, ...], Any]] = {
    "a key that climbs": (("cell",), "../../../../x"),
    "a key in capitals": (("cell",), "0123456789ABCDEF"),
    "a key that is null": (("cell",), None),
    "a hash that is short": (("scene_hash",), "12"),
    "a scene of another run": (("scene",), "near_miss"),
    "another seed": (("seed",), 99),
    "half a substep": (("substeps",), 0.5),
    "no substep": (("substeps",), 0),
    "a name that climbs": (("scenario",), "../../../x"),
    "a name that acts on a terminal": (("scenario",), "\x1b[2J"),
    "an engine that was not asked for": (("engine",), "box2d"),
    "an engine that is a list": (("engine",), ["pymunk"]),
    "a profile that climbs": (("profile",), "../x"),
    "a step of no length": (("dt_s",), 0.0),
    "a step that is not a number": (("dt_s",), float("nan")),
    "a status of its own": (("status",), "splendid"),
    "a reason that is a table": (("reason",), {"why": "not"}),
    "a step before the first": (("step",), -7),
    "a step that is infinite": (("step",), float("inf")),
    "a time that is a list": (("until_s",), []),
    "seconds that are text": (("seconds",), "long"),
    "a time-out of an age": (("timeout_s",), 1e300),
    "a file elsewhere": (("file",), "../../x"),
    "a file with another sum": (("file",), "0123456789abcdef"),
    "settings in a list": (("settings",), [1, 2]),
    "a setting of three": (("settings", "iterations"), [1, 2, 3]),
    "versions of depth": (("versions",), {"a": {"b": {"c": 1}}}),
}
OTHERS: dict[str, tuple[str, tuple[Any, ...], Any]] = {
    "probes in no list": ("conformance", ("conformance",), "all well"),
    "a probe without a verdict": ("conformance", ("conformance", 0, "verdict"), "perhaps"),
    "a probe of another engine": ("conformance", ("of",), "box2d:shipped"),
    "a bound that is a table": ("conformance", ("conformance", 0, "bound"), {}),
    "a footer that is text": ("footer", ("footer",), "the end"),
    "seconds before the beginning": ("footer", ("footer", "seconds"), -1.0),
}
WRITES = ("out", "out.part")


def refused() -> list[Input]:
    """An edit each, and the next command."""
    edits = [
        (f"header: {what}", "header", ("header", *at), value)
        for what, (at, value) in HEADER.items()
    ]
    edits += [(f"cell: {what}", "cell", at, value) for what, (at, value) in CELLS.items()]
    edits += [(what, *edit) for what, edit in OTHERS.items()]
    return [
        Input(
            f"{what}, {words[0]}",
            words,
            prepare=edited(*edit),
            says="" if "a scene" in what else JOURNAL,
        )
        for (what, *edit), words in zip(edits, NEXT)
    ]


def appended(line: bytes) -> Callable[[bytes], bytes]:
    """A journal with one line more."""
    return partial(_appended, line)


def _appended(line: bytes, journal: bytes) -> bytes:
    return journal + line + b"\n"


# Lines that are none, after all others.
LINES: dict[str, bytes] = {
    "a line that is no JSON": b"{ this is none }",
    "a line that is a number": b"42",
    "a line that is null": b"null",
    "a line that is a list": b"[1, 2]",
    "a line that is an empty table": b"{}",
    "a line that is two things": b'{"header": {}, "footer": {}}',
    "a line of brackets": b"[" * 100_000,
    "a line that is not UTF-8": b'"\xff\xfe"',
    "a line of null bytes": bytes(50),
    "a line of a page": b"<html>",
    "a line of 5 million letters": b'"' + b"x" * 5_000_000 + b'"',
    "a line that acts on a terminal": b"\x1b[31m\x07",
}
NO_LINES = [
    Input(f"{what}, {words[0]}", words, prepare=torn(appended(line)), says="line ")
    for (what, line), words in zip(LINES.items(), NEXT)
]
# A line that was torn when the power went is left out, in whatever way it was torn; the run is gone
# on with.
TORN = [
    Input(
        f"a last line that is torn, {words[0]}",
        words,
        prepare=torn(lambda journal: journal[:-40]),
        codes=codes,
        writes=WRITES,
    )
    for words, codes in zip(ALL, ((0,), (0, 1), (0,)))
]


def shorter(data: bytes) -> bytes:
    """The first half."""
    return data[: len(data) // 2]


def nothing(_: bytes) -> bytes:
    """Not a byte."""
    return b""


def other_bits(data: bytes) -> bytes:
    """A byte in the middle is another."""
    middle = len(data) // 2
    return data[:middle] + bytes([data[middle] ^ 0xFF]) + data[middle + 1 :]


def other_shape(data: bytes) -> bytes:
    """All arrays are one sample shorter, but for the times."""
    with np.load(io.BytesIO(data)) as saved:
        arrays = {name: saved[name] if name == "t" else saved[name][1:] for name in saved}
    return zipped(arrays)


def a_program(_: bytes) -> bytes:
    """An array of objects, which numpy would have to unpickle."""
    return zipped({"t": np.array([print], dtype=object)})


def zipped(arrays: dict[str, np.ndarray]) -> bytes:
    """An .npz."""
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]
    return file.getvalue()


TRAJECTORY = f"trajectories/{CELL}.npz"
BYTES: dict[str, Callable[[bytes], bytes]] = {
    "an empty trajectory": nothing,
    "half a trajectory": shorter,
    "a trajectory with another byte": other_bits,
    "a trajectory of another shape": other_shape,
    "a trajectory that is a program": a_program,
    "a trajectory that is a text": lambda _: b"mine",
}
SPOILT = [
    Input(
        f"{what}, {words[0]}",
        words,
        prepare=torn(change, TRAJECTORY),
        codes=codes,
        writes=WRITES,
        says=says,
    )
    for what, change in BYTES.items()
    for words, codes, says in (
        (REPORT, (1,), "1 error"),
        (DIFF, (1,), "is not what was written"),
        (RESUME, (0,), "2 cells ended: 2 ok"),
    )
]


def gone(name: str, here: Path) -> None:
    """A file of the run is not there any more."""
    for path in (here / "out").glob(name):
        path.unlink()


def twice(here: Path) -> None:
    """Every line is there two times."""
    put(here / "out", [line for line in contents(here / "out") for _ in (1, 2)])


def backwards(here: Path) -> None:
    """The last line is the first."""
    put(here / "out", contents(here / "out")[::-1])


def older(here: Path) -> None:
    """Another version has written it."""
    lines = contents(here / "out")
    lines[0]["header"]["versions"]["crosscheck2d"] = "0.0.1"
    put(here / "out", lines)


def indented(here: Path) -> None:
    """Somebody's editor has made it beautiful."""
    lines = contents(here / "out")
    (here / "out" / JOURNAL).write_text("\n".join(json.dumps(line, indent=2) for line in lines))


def without_sums(here: Path) -> None:
    """A version before there were sums has written it."""
    lines = contents(here / "out")
    (here / "out" / JOURNAL).write_text("".join(f"{json.dumps(line)}\n" for line in lines))


def of_a_kind_to_come(here: Path) -> None:
    """A version after this one has written it."""
    put(here / "out", [*contents(here / "out"), {"friction": 1}])


WHOLE: dict[str, tuple[Callable[[Path], None], tuple[str, ...], tuple[int, ...]]] = {
    "all trajectories are gone, report": (partial(gone, "trajectories/*.npz"), REPORT, (1,)),
    "all trajectories are gone, diff": (partial(gone, "trajectories/*.npz"), DIFF, (1,)),
    "all trajectories are gone, resume": (partial(gone, "trajectories/*.npz"), RESUME, (0,)),
    "the tables are gone, diff": (partial(gone, "*.csv"), DIFF, (0, 2)),
    "the tables are gone, report": (partial(gone, "*.csv"), REPORT, (0,)),
    "the exact answers are gone, report": (partial(gone, "compared/*.npz"), REPORT, (0,)),
    "the copies of scenes are gone, report": (partial(gone, "scenes/*"), REPORT, (0, 2)),
    "every line twice, report": (twice, REPORT, (0,)),
    "every line twice, resume": (twice, RESUME, (0,)),
    "the last line first, report": (backwards, REPORT, (2,)),
    "lines that an editor has broken, diff": (indented, DIFF, (2,)),
    "another version, resume": (older, RESUME, (0, 1, 2)),
    "another version, diff": (older, DIFF, (0,)),
    "an earlier version, report": (without_sums, REPORT, (2,)),
    "an earlier version, resume": (without_sums, RESUME, (2,)),
    "a later version, diff": (of_a_kind_to_come, DIFF, (2,)),
    "a later version, report": (of_a_kind_to_come, REPORT, (2,)),
}
TABLES = [
    Input(
        f"{path} {what}, {words[0]}", words, prepare=torn(change, path), codes=codes, writes=WRITES
    )
    for path, what, change, words, codes in (
        ("deviations.csv", "is empty", nothing, DIFF, (0, 1, 2)),
        ("deviations.csv", "is torn", shorter, DIFF, (0, 1, 2)),
        ("deviations.csv", "is not UTF-8", lambda _: b"\xff\xfe\x00", DIFF, (0, 1, 2)),
        ("runs.csv", "is empty", nothing, REPORT, (0, 2)),
        ("compared/*.npz", "is empty", nothing, REPORT, (0,)),
        ("compared/*.npz", "has another byte", other_bits, REPORT, (0,)),
        ("compared/*.csv", "is torn", shorter, REPORT, (0,)),
        ("compared/*.csv", "is a page", lambda _: b"<html>", REPORT, (0,)),
        ("machine.json", "is torn", shorter, REPORT, (0, 2)),
        ("made.json", "is torn", shorter, RESUME, (2,)),
        ("made.json", "is empty", nothing, REPORT, (0, 2)),
        ("scenes/*.toml", "is empty", nothing, REPORT, (0, 1, 2)),
    )
]
JOURNALS = (
    *refused(),
    *NO_LINES,
    *TORN,
    *SPOILT,
    *TABLES,
    *(
        Input(what, words, prepare=copied("before", "out", then=do), codes=codes, writes=WRITES)
        for what, (do, words, codes) in WHOLE.items()
    ),
    Input("diff: a run with itself", ("diff", "out", "out"), prepare=copied("out"), codes=(0,)),
)
