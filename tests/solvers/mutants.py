"""The catalogue of faulty solvers: mutants.toml, each a patch of a correct file."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).parent
GL_MATRIX = HERE / "correct" / "gl-matrix.js"  # lies beside those that call it, and is no solver
CORRECT = sorted(
    path
    for path in GL_MATRIX.parent.iterdir()
    if path.suffix in (".js", ".py") and path != GL_MATRIX
)


class Mutant(NamedTuple):
    """A patch: in the correct file `base`, `old` becomes `new`; task and a piece of the cause that
    must come first.

    also: further changes, each an old and a new text.
    second: of a file with two faults the task of the other and a piece of its cause.
    """

    name: str
    base: str
    task: str
    cause: str
    old: str
    new: str
    also: Sequence[tuple[str, str]] = ()
    second: tuple[str, str] | None = None

    @property
    def text(self) -> str:
        """The faulty file."""
        text = (HERE / "correct" / self.base).read_text()
        for old, new in [(self.old, self.new), *self.also]:
            assert old in text, f"{self.name}: the patch does not fit {self.base}"
            text = text.replace(old, new)
        return text

    def write(self, folder: Path) -> Path:
        """The faulty file in `folder`."""
        path = folder / self.name
        path.write_text(self.text)
        shutil.copy(GL_MATRIX, folder)
        return path


MUTANTS = [Mutant(**row) for row in tomllib.loads((HERE / "mutants.toml").read_text())["mutant"]]
