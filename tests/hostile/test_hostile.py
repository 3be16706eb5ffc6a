"""Every hostile input ends in time, with a sentence or a result, and takes nothing of the user's away.

The outcomes are kept in outcomes.csv: `uv run python -m tests.hostile.test_hostile` plays all and writes it anew.
"""

from __future__ import annotations

import csv
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.hostile import played
from tests.hostile.command_lines import LINES
from tests.hostile.played import BAD, HANG, LOST, SENTENCE, TRACEBACK, WRONG, Input, Outcome, outcome_of

FILE = Path(__file__).with_name("outcomes.csv")
FAMILIES = {"command lines": LINES}
ALL = [(family, tried) for family, inputs in FAMILIES.items() for tried in inputs]


@pytest.mark.slow
@pytest.mark.parametrize(("family", "tried"), ALL, ids=lambda value: value.name if isinstance(value, Input) else value)
def test_an_input_ends_as_it_should(family: str, tried: Input, tmp_path: Path):
    """With the outcome that is kept, which is none of the bad ones."""
    found = outcome_of(tried, tmp_path / "input")

    assert found.word not in BAD, f"{found.word}, exit {found.code}:\n{found.printed}"
    assert (found.word, found.code) == outcomes()[family, tried.name]


def test_every_input_has_its_outcome_kept_and_none_of_them_is_bad():
    """At least 300, each once."""
    assert set(outcomes()) == {(family, tried.name) for family, tried in ALL}
    assert len(ALL) == len(outcomes())
    assert not any(word in BAD for word, _ in outcomes().values())


@pytest.mark.parametrize(
    ("shell", "word"),
    [
        ("python3 -c 'raise KeyError(1)'", TRACEBACK),
        ("python3 -c 'import warnings; warnings.warn(chr(97))'; exit 2", TRACEBACK),
        ("kill -SEGV $$", TRACEBACK),
        ("sleep 60", HANG),
        ("rm mine.txt; echo no >&2; exit 2", LOST),
        ("echo more >> mine.txt; echo no >&2; exit 2", LOST),
        ("exit 2", WRONG),
        ("echo no >&2; exit 1", WRONG),
        ("printf 'no \\033[31m' >&2; exit 2", WRONG),
        ("echo yes >&2; exit 2", WRONG),
        ("echo no >&2; exit 2", SENTENCE),
    ],
)
def test_a_program_that_ends_otherwise_is_noticed(
    shell: str, word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The negative controls, of every bad outcome; and one good one."""
    monkeypatch.setattr(played, "SECONDS", 2.0)
    tried = Input("control", files={"mine.txt": "mine"}, says="no" if word != TRACEBACK else "", shell=shell)

    assert outcome_of(tried, tmp_path / "input").word == word


def outcomes() -> dict[tuple[str, str], tuple[str, int]]:
    """What is kept: (family, name) -> the outcome and its exit code."""
    with FILE.open(newline="", encoding="utf-8") as file:
        return {(row["family"], row["input"]): (row["outcome"], int(row["exit"])) for row in csv.DictReader(file)}


def play_all(families: list[str]) -> None:
    """Play every input of these families, all if none is named; print the bad ones, and write the table."""
    rows: list[tuple[str, str, Outcome]] = []
    for family, tried in ALL:
        if families and family not in families:
            continue
        with TemporaryDirectory() as folder:
            found = outcome_of(tried, Path(folder) / "input")
        rows.append((family, tried.name, found))
        if found.word in BAD:
            print(f"{family}: {tried.name}: {found.word}, exit {found.code}\n{found.printed}\n", flush=True)
    print(*sorted(Counter((family, found.word) for family, _, found in rows).items()), sep="\n")
    if not families:
        with FILE.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(("family", "input", "exit", "outcome"))
            writer.writerows((family, name, found.code, found.word) for family, name, found in rows)


if __name__ == "__main__":
    play_all(sys.argv[1:])
