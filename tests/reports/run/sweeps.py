"""Runs that are broken off, by whatever, and what must be true of them when they have been
resumed."""

import json
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import pandas as pd

from crosscheck2d.reports.run import folders
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck, wait_for

# 24 cells of ms
SMALL = [
    "run",
    "slow_collision",
    "near_miss",
    "--engine",
    "reference:exercise",
    "--engine",
    "pymunk",
]
LONG = ["run", "asteroids", "--timings", "0"]  # 24 cells of 0.4 s
LONG += [
    word
    for name in ("reference:exercise", "reference:lesson", "pymunk", "box2d")
    for word in ("--engine", name)
]


def undisturbed(words: list[str], cwd: Path) -> Path:
    """The folder of a run that nothing disturbed."""
    assert crosscheck(*words, "--out", "whole", cwd=cwd).returncode == 0
    return cwd / "whole"


def assert_nothing_lost(out: Path, whole: Path) -> None:
    """24 of 24 good cells, none twice in the journal, and the same numbers as if nothing had
    happened."""
    cells = Counter(line["cell"] for line in lines(out) if "cell" in line)

    assert len(cells) == 24
    assert set(cells.values()) == {1}
    assert set(pd.read_csv(out / "runs.csv").status) == {"ok"}
    assert (out / "deviations.csv").read_bytes() == (whole / "deviations.csv").read_bytes()


def lines(out: Path) -> list[dict]:
    """Of a journal, every one whole."""
    return [json.loads(line) for line in (out / "journal.jsonl").read_text().splitlines()]


def broken_off(whole: Path, out: Path, after: int) -> Path:
    """A copy of a run as a power cut leaves it in the middle of a line of its journal: OUT.part.

    Which of two workers is done first is chance, so the lines are put in order: header, probes,
    cells, timings.
    """
    part = out.with_name(f"{out.name}.part")
    shutil.copytree(whole, part)
    journal = (part / "journal.jsonl").read_text().splitlines(keepends=True)
    journal.sort(
        key=lambda line: [
            f'{{"{kind}"' in line
            for kind in ("footer", "overhead", "timing", "cell", "conformance", "header")
        ]
    )
    (part / "journal.jsonl").write_text("".join(journal[:after]) + journal[after][:50])
    for name in ("deviations.csv", "runs.csv", "timings.csv", "report.html"):
        (part / name).unlink()
    folders.begun(part, folders.RUN, out)
    return part


def begun(*words: str | Path, cwd: Path, cells: int) -> subprocess.Popen[str]:
    """`crosscheck ... --out out`, of which so many cells have ended; in a session of its own."""
    command = [CROSSCHECK, *words, "--out", "out"]
    run = subprocess.Popen(
        command, cwd=cwd, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_for(lambda: ended_in(cwd / "out.part") >= cells or run.poll() is not None)
    return run


def ended_in(part: Path) -> int:
    """How many cells have ended, as the journal has it."""
    return (
        (part / "journal.jsonl").read_text().count('"cell"')
        if (part / "journal.jsonl").exists()
        else 0
    )
