"""A class of generated submissions: what students hand in, with the names that they give it."""

from __future__ import annotations

import random
import zipfile
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

from tests.solvers.mutants import CORRECT, GL_MATRIX, MUTANTS

NAMES = (
    "Jörg Müller",
    "Anne-Lise O'Neil",
    "Nguyễn Văn An",
    "Łukasz",
    "van der Berg",
    "Zoë",
    "李雷",
)
FILES = ("Exercise", "Exercise (1)", "meine lösung", "final FINAL", r"back\slash")
FILES_OF_NOBODY = (".DS_Store", "Thumbs.db", "~$notes.docx", "._Exercise.js")
# Every so many students hand in the same file as the one before, or no file that can be checked.
COPIES, MISSING = 10, 25


def write_class(folder: Path, students: int, missing: int = MISSING) -> None:
    """Write a folder for each of so many students, the same ones each time; every `missing`-th
    hands in no file that can be checked."""
    rng = random.Random(21)
    texts = solvers(rng)
    nothing = absent()
    suffix, text = next(texts)
    for k in range(1, students + 1):
        home = folder / f"{NAMES[k % len(NAMES)]}_{k:04}_file"
        home.mkdir(parents=True)
        (home / rng.choice(FILES_OF_NOBODY)).write_bytes(b"\x00junk")
        if k % missing == 0:
            next(nothing)(home)
            continue
        if k % COPIES:
            suffix, text = next(texts)
        ends = rng.choice(("\n", "\r\n"))
        (home / f"{rng.choice(FILES)}{suffix}").write_bytes(text.replace("\n", ends).encode())
        (home / GL_MATRIX.name).write_bytes(GL_MATRIX.read_bytes())


def solvers(rng: random.Random) -> Iterator[tuple[str, str]]:
    """Suffix and text of file after file, no two the same: each mutant, each fourth time a right
    solver, then all of them again with other last lines."""
    for turn in count():
        mutants = rng.sample(MUTANTS, len(MUTANTS))
        for k, mutant in enumerate(mutants):
            if k % 4 == 0 and k // 4 < len(CORRECT):
                right = CORRECT[k // 4]
                yield right.suffix, signed(right.suffix, right.read_text(), turn)
            yield Path(mutant.name).suffix, signed(Path(mutant.name).suffix, mutant.text, turn)


def signed(suffix: str, text: str, turn: int) -> str:
    """The text with a line that makes it another."""
    return f"{text}\n{'#' if suffix == '.py' else '//'} turn {turn}\n"


def absent() -> Iterator[Callable[[Path], object]]:
    """What is handed in instead of a solver, again and again: an archive, nothing, a PDF, an empty
    file."""
    while True:
        yield archive
        yield Path.exists  # nothing
        yield lambda home: (home / "Lösung.pdf").write_bytes(b"%PDF-1.4\n")
        yield lambda home: (home / "Exercise.js").write_text("")


def archive(home: Path) -> None:
    """A solver in a zip."""
    with zipfile.ZipFile(home / "abgabe.zip", "w") as packed:
        packed.writestr("Exercise.js", CORRECT[0].read_text())
