"""Every hostile input ends in time, with a sentence or a result, and takes nothing of the user's
away.

The outcomes are kept in outcomes.csv: `uv run python -m tests.hostile.test_hostile` plays all and
writes it anew; or the families and inputs that are named, as `scenes`, and writes their rows.
"""

from __future__ import annotations

import csv
import multiprocessing
import os
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import pytest

from tests.hostile import played
from tests.hostile.command_lines import LINES
from tests.hostile.folders import FOLDERS
from tests.hostile.places import PLACES
from tests.hostile.played import (
    BAD,
    HANG,
    LEFT,
    LOST,
    SENTENCE,
    STRAY,
    TRACEBACK,
    WRONG,
    Input,
    Outcome,
    outcome_of,
)
from tests.hostile.scenes import SCENES
from tests.hostile.servers import SERVERS
from tests.hostile.small_run import finished_run
from tests.hostile.solvers import SOLVERS

FILE = Path(__file__).with_name("outcomes.csv")
SHOWN = 2000  # characters of what a bad one printed
FAMILIES: dict[str, tuple[Input, ...]] = {
    "scenes": SCENES,
    "folders": FOLDERS,
    "places": PLACES,
    "command lines": LINES,
    "solvers": SOLVERS,
    "servers": SERVERS,
}
ALL = {(family, tried.name): tried for family, inputs in FAMILIES.items() for tried in inputs}
Key = tuple[str, str]  # family and name of an input


def play(key: Key) -> tuple[Key, Outcome, float]:
    began = perf_counter()
    with TemporaryDirectory() as folder:
        return key, outcome_of(ALL[key], Path(folder) / "input"), perf_counter() - began


def play_all(keys: Iterable[Key]) -> Iterator[tuple[Key, Outcome, float]]:
    finished_run()  # once, before the processes of the pool look for it
    with ProcessPoolExecutor(os.cpu_count(), multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(play, keys)


@pytest.fixture(scope="module")
def found(request: pytest.FixtureRequest) -> dict[Key, Outcome]:
    calls = [getattr(item, "callspec", None) for item in request.session.items]
    keys = [call.params["key"] for call in calls if call is not None and "key" in call.params]
    return {key: outcome for key, outcome, _ in play_all(keys)}


# Every 80th is for the gate: some of each family.
@pytest.mark.slow
@pytest.mark.parametrize(
    "key",
    [
        pytest.param(key, marks=[pytest.mark.long] if k % 80 else [], id=": ".join(key))
        for k, key in enumerate(ALL)
    ],
)
def test_an_input_ends_as_it_should(found: dict[Key, Outcome], key: Key):
    word, code, printed = found[key]

    assert word not in BAD, f"{word}, exit {code}:\n{printed}"
    assert (word, code) == outcomes()[key]


def test_every_input_has_its_outcome_kept_and_none_of_them_is_bad():
    assert list(outcomes()) == list(ALL)
    assert len(ALL) == sum(map(len, FAMILIES.values())) >= 300
    assert not any(word in BAD for word, _ in outcomes().values())


@pytest.mark.parametrize(
    ("shell", "word"),
    [
        ("python3 -c 'raise KeyError(1)'", TRACEBACK),
        ("python3 -c 'import warnings; warnings.warn(chr(97))'; exit 2", TRACEBACK),
        ("echo 'ValueError: no' >&2; exit 2", TRACEBACK),
        ("kill -SEGV $$", TRACEBACK),
        ("sleep 60", HANG),
        ("rm mine.txt; echo no >&2; exit 2", LOST),
        ("rmdir empty; echo no >&2; exit 2", LOST),
        ("echo more >> mine.txt; echo no >&2; exit 2", LOST),
        ("touch new.txt; echo no >&2; exit 2", STRAY),
        ("touch ../new.txt; echo no >&2; exit 2", STRAY),
        ("setsid sleep 60 & echo no >&2; exit 2", LEFT),
        ("exit 2", WRONG),
        ("echo no >&2; exit 1", WRONG),
        ("printf 'no \\033[31m' >&2; exit 2", WRONG),
        ("echo yes >&2; exit 2", WRONG),
        ("yes no | head -102 >&2; exit 2", WRONG),
        ("echo no >&2; exit 2", SENTENCE),
        ("touch asked.txt; echo no >&2; exit 2", SENTENCE),
    ],
)
def test_a_program_that_ends_otherwise_is_noticed(
    shell: str, word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(played, "SECONDS", 1.0)
    monkeypatch.setattr(played, "GRACE", 0.3)
    tried = Input(
        "control",
        files={"mine.txt": "mine"},
        prepare=lambda here: (here / "empty").mkdir(),
        writes=("asked.txt",),
        says="" if word == TRACEBACK else "no",
        shell=shell,
    )

    assert outcome_of(tried, tmp_path / "input").word == word


def outcomes() -> dict[Key, tuple[str, int | None]]:
    """What is kept: family and name -> the outcome and its exit code."""
    with FILE.open(newline="", encoding="utf-8") as file:
        rows = [
            (row["family"], row["input"], row["outcome"], row["exit"])
            for row in csv.DictReader(file)
        ]
    return {
        (family, name): (word, int(code) if code else None) for family, name, word, code in rows
    }


def main(named: list[str]) -> None:
    rows, began, seconds_of = {}, perf_counter(), {}
    for key, outcome, seconds in play_all(key for key in ALL if not named or {*key} & {*named}):
        rows[key], seconds_of[key] = (outcome.word, outcome.code), seconds
        if outcome.word in BAD:
            print(
                f"{': '.join(key)}: {outcome.word}, exit"
                f" {outcome.code}\n{outcome.printed[:SHOWN]}\n",
                flush=True,
            )
    slowest = sorted(seconds_of, key=seconds_of.__getitem__)[-12:]
    print(f"{len(seconds_of)} in {perf_counter() - began:.0f} s; the slowest (s):")
    print(*(f"{seconds_of[key]:.1f} {': '.join(key)}" for key in slowest), sep="\n")
    rows = {key: row for key, row in (outcomes() | rows).items() if key in ALL}
    print(
        *sorted(Counter((family, word) for (family, _), (word, _) in rows.items()).items()),
        sep="\n",
    )
    with FILE.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("family", "input", "exit", "outcome"))
        writer.writerows((*key, *rows[key][::-1]) for key in ALL if key in rows)


if __name__ == "__main__":
    main(sys.argv[1:])
