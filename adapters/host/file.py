"""Reads a guest's file as text, with the modules that it imports from its own folder, and says in a
sentence why it cannot be one.

A file is read once. This text is played, checked and hashed; what is saved later does not matter.
"""

from __future__ import annotations

import ast
import codecs
import hashlib
import os
import re
import stat
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.machinery import PathFinder
from pathlib import Path
from threading import Lock
from typing import Any

from crosscheck2d.adapters.safe_path import PACKAGE

LARGEST = 2**20  # bytes; the exercise's file has about 5000
# times its limit that a call may take by the clock: on a busy machine it gets a part of a processor
PATIENCE = 3
LONGEST = 300  # characters of a message
# the first bytes of what is handed in under the name of a solver
DOCUMENTS = {b"%PDF-": "a PDF", b"PK\x03\x04": "a zip, or a document of Office", rb"{\rtf": "RTF"}
MARKS = {  # utf-32 first: its mark begins with that of utf-16
    **dict.fromkeys((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE), "utf-32"),
    **dict.fromkeys((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE), "utf-16"),
}
KINDS = {".js": "javascript", ".py": "python"}
DEF = re.compile(r"^[ \t]*def \w+\(.*:", re.MULTILINE)
OURS = (PACKAGE, "reference_impl")
REFERENCE = Path(__file__).parents[2] / "reference_impl"
USES_REFERENCE = re.compile(
    r"^\s*(?:from|import)\s+(?:(?:crosscheck2d\.)?reference_impl\b|\.(?:state|compiled)\b)",
    re.MULTILINE,
)
# One text at a time: Python before 3.11.8 counts the depth of its parser over all threads together
# (gh-106905).
PARSING = Lock()
FUNCTION = re.compile(r"^function \w+\s*\(.*\)\s*\{", re.MULTILINE)


class NotASolver(ValueError):
    """A path is not JavaScript or Python text; the message names it and says what to do."""

    def __init__(self, what: str) -> None:
        super().__init__(printable(what))


class SolverFailed(Exception):
    """A solver cannot be loaded, or did not return from a call.

    Attributes:
        kind: "error" (threw), "timeout", "memory" or "crashed"; "refused" by an engine;
            "unavailable": imports what is not there, or what it may not; "diverged"
            if `read` of an engine returns numbers that are not finite.
        what: the end of the sentence "it ..."; control characters are escaped, and text beyond
            `LONGEST` characters is cut.
        line, column: the place in the solver's file, from 1; 0 if it is not known.
    """

    def __init__(self, kind: str, what: str, line: int = 0, column: int = 0) -> None:
        # cut first: escaping millions of characters would exceed the limit of a call
        what = printable(what[: LONGEST + 1])
        what = what if len(what) <= LONGEST else what[:LONGEST] + " ..."
        super().__init__(what)
        self.kind, self.what, self.line, self.column = kind, what, line, column

    @property
    def status(self) -> str:
        return self.kind if self.kind in ("timeout", "crashed", "diverged") else "error"

    def __str__(self) -> str:
        return f"{self.what} (line {self.line}, column {self.column})" if self.line else self.what


def printable(text: str) -> str:
    # Foreign text on one line, with control characters escaped, because they would act on a
    # terminal.
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


@dataclass(frozen=True)
class SolverText:
    """A guest's file as read, with all that is needed to play it on any machine.

    Attributes:
        text: with \\n at the end of lines.
        digest: 16 hex digits of SHA-256 over the file's bytes, as sha256sum gives them.
        imported: the modules that it imports from its own folder, or the gl-matrix that it calls:
            file, relative to the folder or to the one above with its node_modules, -> text.
        engine: it has create, step and read; else it is a solver of the exercise.
        holder: the class that has them; None if they are functions.
        packages: the installed packages that it may import, beside numpy.
        package: the text of the npm package that it drives, with its `versions`; else None.
    """

    path: Path
    kind: str
    text: str
    digest: str
    imported: tuple[tuple[str, str], ...] = ()
    engine: bool = False
    holder: str | None = None
    packages: tuple[str, ...] = ()
    package: str | None = field(default=None, repr=False)
    versions: Mapping[str, str] = field(default_factory=dict, hash=False)

    @property
    def source(self) -> str:
        """16 hex digits of a hash over every text that affects its behaviour."""
        return hashlib.sha256(repr((self.digest, self.imported)).encode()).hexdigest()[:16]

    @property
    def reference(self) -> dict[str, str]:
        """The two modules that a copy of the exercise's solver imports, by both of their names."""
        if self.kind != "python" or not USES_REFERENCE.search(self.text):
            return {}
        texts = {"__init__.py": ""}
        for file in ("state.py", "compiled.py"):
            texts[file] = (REFERENCE / file).read_text(encoding="utf-8")
        folders = ("reference_impl", "crosscheck2d/reference_impl")
        return {f"{folder}/{file}": text for folder in folders for file, text in texts.items()}

    @property
    def order(self) -> dict[str, Any]:
        # What its process is told, which does not tell where the file is.
        return {
            "kind": self.kind,
            "name": self.path.name,
            "text": self.text,
            "imported": (*self.imported, *self.reference.items()),
            "engine": self.engine,
            "holder": self.holder,
            "package": self.package,
        }


HINTS = {
    **dict.fromkeys((".ts", ".tsx"), "; compile it to JavaScript (tsc), and name the .js"),
    **dict.fromkeys((".html", ".htm"), "; save the text of its script as a .js file"),
    **dict.fromkeys((".mjs", ".cjs"), "; leave out import and export, and name it .js"),
    ".ipynb": "; save its cells as a .py file",
    **dict.fromkeys((".zip", ".gz", ".tgz", ".tar", ".7z", ".rar", ".xz", ".bz2"), "; unpack it"),
}


def read_solver(path: Path, within: Path | None = None) -> SolverText:
    """The text of `path`, and of what it imports from beside it; raises `NotASolver` with one
    sentence.

    within: in a class the student's own folder, out of which nothing is read; or the file itself,
    if it lies beside those of others: then no module is beside it.
    """
    ending = path.suffix.lower()
    kind = KINDS.get(ending)
    if kind is None:
        ends = f"ends in {path.suffix or 'nothing'}; a solver is a .js or a .py file"
        raise NotASolver(f"{path}: {ends}{HINTS.get(ending, '')}")
    data = read_bytes(path, "name an Exercise.js or a solver.py")
    must_be_own(path, within)
    text = decoded(path, data)
    if not text.strip():
        raise NotASolver(f"{path}: is empty; save your solver into it")
    javascript, python = FUNCTION.search(text), DEF.search(text)
    if kind == "javascript" and python and not re.search("function|=>", text):
        raise NotASolver(f"{path}: is written in Python; give it a name that ends in .py")
    if kind == "python" and javascript and not python:
        raise NotASolver(f"{path}: is written in JavaScript; give it a name that ends in .js")
    if kind == "python":
        imported = {} if within == path else read_imported(path, text, within)
    else:
        # it imports numpy, which --help does not need
        from crosscheck2d.adapters.host.gl_matrix import gl_matrix_of, where_to

        library = gl_matrix_of(path, text)
        imported = {name: decoded(at, read_bytes(at, where_to())) for name, at in library.items()}
    digest = hashlib.sha256(data).hexdigest()[:16]
    return SolverText(path, kind, text, digest, tuple(sorted(imported.items())))


def must_be_own(path: Path, within: Path | None) -> None:
    if within is not None:
        home = within.parent.resolve() / within.name
        if not path.resolve().is_relative_to(home):
            raise NotASolver(f"{path}: is a link to a file that was not handed in with it")


def read_imported(path: Path, text: str, within: Path | None = None) -> dict[str, str]:
    """File, relative to that of `path`, and text of each module that an import statement names, in
    the file or in another of these, and that is not installed: none hides a library. What is
    opened or imported by other means at run time is not covered."""
    itself, imported = path.resolve(), dict[str, str]()
    seen, names = set[str](), imported_by(text)
    while names:
        name = names.pop()
        if name in seen or is_library(name, itself.parent):
            continue
        seen.add(name)
        for file in files_of(itself.parent, name):
            must_be_own(file, within)
            wanted = "a module that a solver imports is a file"
            module = text if file == itself else decoded(file, read_bytes(file, wanted))
            names |= imported_by(module)
            imported[file.relative_to(itself.parent).as_posix()] = module
            if sum(map(len, imported.values())) > LARGEST:
                raise NotASolver(
                    f"{path}: imports more than 1 MB from its folder; a solver has a few kilobytes"
                )
    return imported


def module_of(text: str) -> ast.Module | None:
    """None if it is not Python, which is reported when it is run."""
    try:
        with PARSING, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about the text, meant for its author
            return ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def imported_by(text: str) -> set[str]:
    """The top-level names of modules."""
    names = set()
    for node in ast.walk(module_of(text) or ast.Module([], [])):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module)
    return {name.partition(".")[0] for name in names}


def is_library(name: str, folder: Path) -> bool:
    if name in sys.builtin_module_names or name in sys.stdlib_module_names or name in OURS:
        return True
    spec = PathFinder.find_spec(name, [path for path in sys.path if Path(path).resolve() != folder])
    # a folder without __init__.py is found last
    return spec is not None and spec.origin is not None


def files_of(folder: Path, name: str) -> Sequence[Path]:
    package, module = folder / name, folder / f"{name}.py"
    try:
        module.lstat()
    except FileNotFoundError:
        pass
    except OSError:  # the name is too long for a file
        return []
    if module.exists() and not (package / "__init__.py").exists():
        return [module]
    return sorted(package.rglob("*.py"))


def read_bytes(path: Path, wanted: str) -> bytes:
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode):
            raise NotASolver(f"{path}: is no file; {wanted}")  # reading a pipe would block
        size = about.st_size
        if size > LARGEST:
            raise NotASolver(
                f"{path}: has {size / 1e6:.1f} MB; a solver has a few kilobytes, at most 1 MB is"
                " read"
            )
        return path.read_bytes()
    except OSError as fault:
        what = f"{fault.strerror or fault}; name a file that can be read"
        if dangling(path):
            what = f"is a link to {path.readlink()}, which is not there"
        raise NotASolver(f"{path}: {what}") from None


def dangling(path: Path) -> bool:
    return os.path.islink(path) and not os.path.exists(path)


def decoded(path: Path, data: bytes) -> str:
    """Text from UTF-8, from UTF-16 or UTF-32 with its mark, or from Windows' Latin letters; \\n
    ends its lines."""
    encoding = next((name for mark, name in MARKS.items() if data.startswith(mark)), None)
    for begins, what in DOCUMENTS.items():
        if data.startswith(begins):
            raise NotASolver(f"{path}: is {what}; save the text of your solver alone, as UTF-8")
    odd = re.search(rb"[\0-\x08\x0e-\x1f]", data) if encoding is None else None
    if odd is not None:
        raise NotASolver(
            f"{path}: is not text (byte {odd[0][0]} at offset {odd.start()}); save it as UTF-8 text"
        )
    try:
        text = data.decode(encoding or "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode(encoding or "cp1252", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")
