"""The rows of a folder and its exports: written wholly or not at all, by one process, and no file
of another origin is touched."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

from crosscheck2d.reports.run.store import FILE, reading, writing
from crosscheck2d.reports.terminal.exits import FolderTaken
from crosscheck2d.scenarios.rows import Damaged, Rows

COMMAND = "crosscheck test"


def test_a_row_comes_back_as_it_was_written(tmp_path: Path):
    value = {"inf": float("inf"), "text": "\udcff ü", "list": [1, 2.5, None]}
    with writing(tmp_path / "out", COMMAND) as store:
        store.put("cell", "a", value, b"\0bytes")
        store.put("cell", "a", value, b"\0new")
    with reading(tmp_path / "out", COMMAND) as store:
        row = store.get("cell", "a")

    assert (row.value, row.blob) == (value, b"\0new")


def test_fresh_ignores_earlier_rows_but_not_its_own(tmp_path: Path):
    with writing(tmp_path / "out", COMMAND) as store:
        store.put("cell", "a", 1)
    with writing(tmp_path / "out", COMMAND, fresh=True) as store:
        assert store.get("cell", "a") is None
        store.put("cell", "a", 2)
        assert store.get("cell", "a").value == 2


@pytest.mark.parametrize(
    "change",
    [
        "update results set value = '2' where kind = 'cell'",
        "update results set blob = x'00' where kind = 'cell'",
        "update results set blob = 7 where kind = 'cell'",
        "update results set digest = null where kind = 'cell'",
        "update results set value = 'no JSON' where kind = 'cell'",
    ],
)
def test_an_edited_row_is_named_and_counts_as_missing(tmp_path: Path, capsys, change: str):
    with writing(tmp_path / "out", COMMAND) as store:
        store.put("cell", "a", 1, b"x")
    with sqlite3.connect(tmp_path / "out" / FILE) as file:
        file.execute(change)
    file.close()
    with writing(tmp_path / "out", COMMAND) as store:
        assert store.get("cell", "a") is None
        assert store.get("cell", "a") is None

    said = capsys.readouterr().err.splitlines()
    assert said == [f"{tmp_path / 'out' / FILE}: cell a is not what was written: it is made again"]


@pytest.mark.parametrize("damage", ["torn", "overwritten", "text"])
def test_a_damaged_file_is_one_sentence(tmp_path: Path, damage: str):
    with writing(tmp_path / "out", COMMAND) as store:
        for k in range(200):
            store.put("cell", str(k), k, bytes(3000))
    path = tmp_path / "out" / FILE
    data = path.read_bytes()
    torn = {"torn": data[: len(data) // 2], "overwritten": data[:4096] + b"\x07" * 200_000}
    path.write_bytes(torn.get(damage, b"no database, but a text of some length " * 200))

    with pytest.raises(Damaged, match="delete it, or name another folder"):  # noqa: SIM117
        with writing(tmp_path / "out", COMMAND) as store:
            [store.get("cell", str(k)) for k in range(200)]


def test_a_folder_of_the_old_format_or_of_another_version_is_one_sentence(tmp_path: Path):
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "journal.jsonl").touch()
    with (
        pytest.raises(FolderTaken, match="made by an earlier version"),
        writing(tmp_path / "old", COMMAND),
    ):
        pass
    with (
        pytest.raises(FolderTaken, match="made by an earlier version"),
        reading(tmp_path / "old", COMMAND),
    ):
        pass
    with writing(tmp_path / "out", COMMAND):
        pass
    with sqlite3.connect(tmp_path / "out" / FILE) as file:
        file.execute("pragma user_version=77")
    file.close()
    with pytest.raises(Damaged, match="by another version"), writing(tmp_path / "out", COMMAND):
        pass


def test_a_second_writer_is_refused_and_a_reader_is_not(tmp_path: Path):
    code = (
        "import sys, pathlib; from crosscheck2d.reports.run.store import writing\n"
        "with writing(pathlib.Path(sys.argv[1]), sys.argv[2]) as store:\n"
        "    store.put('cell', 'a', 1); print('writes', flush=True); sys.stdin.read()"
    )
    words = [sys.executable, "-c", code, str(tmp_path / "out"), COMMAND]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(words, cwd=Path(__file__).parents[3], **pipes) as other:
        assert other.stdout.readline() == b"writes\n"
        with (
            pytest.raises(FolderTaken, match="is being written by another crosscheck"),
            writing(tmp_path / "out", COMMAND),
        ):
            pass
        with reading(tmp_path / "out", COMMAND) as store:
            assert store.get("cell", "a").value == 1
        other.kill()
    with writing(tmp_path / "out", COMMAND) as store:  # the lock has ended with its process
        assert store.get("cell", "a").value == 1


@pytest.mark.parametrize("place", ["folder", "export"])
def test_what_is_not_ours_is_never_overwritten(tmp_path: Path, place: str):
    with writing(tmp_path / "out", COMMAND) as store:
        store.export("table.csv", "1\n")
        store.export("table.csv", "2\n")
    name = "mine.txt" if place == "folder" else "table.csv"
    (tmp_path / "out" / name).write_text("mine")
    with pytest.raises(FolderTaken, match=f"{name}"), writing(tmp_path / "out", COMMAND):
        pass

    assert (tmp_path / "out" / name).read_text() == "mine"


def test_a_file_that_appears_meanwhile_is_not_overwritten(tmp_path: Path):
    with writing(tmp_path / "out", COMMAND) as store:
        (tmp_path / "out" / "table.csv").write_text("mine")
        with pytest.raises(FolderTaken, match=r"is not as crosscheck left it"):
            store.export("table.csv", "2\n")
        (tmp_path / "out" / "link.csv").symlink_to(tmp_path / "out" / "table.csv")
        with pytest.raises(FolderTaken, match=r"is a link"):
            store.export("link.csv", "2\n")

    assert (tmp_path / "out" / "table.csv").read_text() == "mine"


def test_other_places_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "nothing")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").touch()
    with writing(tmp_path / "other", "crosscheck else"):
        pass
    for name, why in {
        **dict.fromkeys((".", "..", "/"), "is the current folder, or above it"),
        "file": "is a file",
        "link": "is a link to nothing",
        "full": "holds mine.txt, which crosscheck did not make",
        "other": "was made by crosscheck else",
    }.items():
        with pytest.raises(FolderTaken, match=why), writing(Path(name), COMMAND):
            pass

    assert sorted(path.name for path in (tmp_path / "full").iterdir()) == ["mine.txt"]


def test_exports_of_other_plans_are_deleted_unless_they_were_changed(tmp_path: Path):
    with writing(tmp_path / "out", COMMAND) as store:
        for name in "abc":
            store.export(f"trajectories/{name}", name)
        (tmp_path / "out" / "trajectories" / "b").write_text("mine")
        store.delete_exports("trajectories", {"trajectories/a": 1})

    assert sorted(path.name for path in (tmp_path / "out" / "trajectories").iterdir()) == ["a", "b"]


def test_a_writer_that_is_killed_leaves_whole_rows_and_files(tmp_path: Path):
    code = (
        "import sys, pathlib; from crosscheck2d.reports.run.store import writing\n"
        "with writing(pathlib.Path(sys.argv[1]), sys.argv[2]) as store:\n"
        "    k = len(store.rows.keys('cell')); print(flush=True)\n"
        "    while True:\n"
        "        store.put('cell', str(k), k, bytes([k % 256]) * 300_000); k += 1\n"
        "        store.export('table.csv', str(k) * 100_000)"
    )
    for number in range(20):
        words = [sys.executable, "-c", code, str(tmp_path / "out"), COMMAND]
        with subprocess.Popen(
            words, cwd=Path(__file__).parents[3], stdout=subprocess.PIPE
        ) as process:
            assert process.stdout.readline() == b"\n"
            time.sleep(0.01 * (number % 7))
            process.send_signal(signal.SIGKILL)
    with writing(tmp_path / "out", COMMAND) as store:
        keys = store.rows.keys("cell")
        rows = [store.get("cell", key) for key in keys]

    assert keys == [str(k) for k in range(len(keys))]
    assert [row.value for row in rows] == [*range(len(keys))]
    assert sorted(os.listdir(tmp_path / "out")) == [".crosscheck.lock", FILE, "table.csv"]


def test_many_writers_may_share_a_cache(tmp_path: Path):
    code = (
        "import sys, pathlib; from crosscheck2d.scenarios.rows import Rows\n"
        "for k in range(200):\n"
        "    rows = Rows(pathlib.Path(sys.argv[1])); rows.put('record', str(k), sys.argv[2],"
        " b'x' * 1000, again=False); rows.close()"
    )
    writers = [
        subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path / "cache"), name],
            cwd=Path(__file__).parents[3],
        )
        for name in "abc"
    ]
    assert [writer.wait() for writer in writers] == [0, 0, 0]
    rows = Rows(tmp_path / "cache")

    assert len(rows.keys("record")) == 200
    assert {rows.get("record", str(k)).value for k in range(200)} <= {"a", "b", "c"}
    rows.close()
