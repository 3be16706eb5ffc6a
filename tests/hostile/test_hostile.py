"""Every hostile input ends in time, with a sentence or a result and its exit code, and takes
nothing of the user's away."""

from __future__ import annotations

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

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


def play(key: Key) -> Outcome:
    with TemporaryDirectory() as folder:
        return outcome_of(ALL[key], Path(folder) / "input")


@pytest.fixture(scope="module")
def found(request: pytest.FixtureRequest) -> dict[Key, Outcome]:
    calls = [getattr(item, "callspec", None) for item in request.session.items]
    keys = [call.params["key"] for call in calls if call is not None and "key" in call.params]
    finished_run()  # once, before the processes of the pool look for it
    with ProcessPoolExecutor(os.cpu_count(), multiprocessing.get_context("spawn")) as pool:
        return dict(zip(keys, pool.map(play, keys)))


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


def test_inputs_of_a_family_have_different_names():
    assert len(ALL) == sum(map(len, FAMILIES.values())) >= 300


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
