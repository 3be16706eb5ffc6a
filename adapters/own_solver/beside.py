"""The modules that a solver.py imports from its own folder: found and read together with the file,
and imported from these texts.

A neighbour is a module that an import statement names, in the file or in another neighbour, and
that is not installed: it never hides a library. Files that it opens or imports by other means at
run time are not covered.
"""

from __future__ import annotations

import ast
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.abc import MetaPathFinder, SourceLoader
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import spec_from_file_location
from pathlib import Path
from types import CodeType
from typing import Any

from crosscheck2d.adapters.safe_path import PACKAGE


def modules_beside(
    folder: Path, text: str, read: Callable[[Path], str]
) -> Iterator[tuple[str, str]]:
    """File, relative to `folder`, and text of every neighbour that `text` imports directly or
    indirectly."""
    seen: set[str] = set()
    names = imported_by(text)
    while names:
        name = names.pop()
        if name in seen or is_library(name, folder):
            continue
        seen.add(name)
        for file in files_of(folder, name):
            module = read(file)
            names |= imported_by(module)
            yield file.relative_to(folder).as_posix(), module


def imported_by(text: str) -> set[str]:
    """The top-level names of all modules in the import statements of a text; none if it is not
    Python."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about the text, meant for its author
            nodes = list(ast.walk(ast.parse(text)))
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # reported when it is run
        return set()
    named = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    named += [
        node.module
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module and not node.level
    ]
    return {name.partition(".")[0] for name in named}


def is_library(name: str, folder: Path) -> bool:
    """Whether a module is found outside `folder`."""
    if name in sys.builtin_module_names or name in sys.stdlib_module_names or name == PACKAGE:
        return True
    spec = PathFinder.find_spec(name, [path for path in sys.path if Path(path).resolve() != folder])
    # a folder without __init__.py is found last
    return spec is not None and spec.origin is not None


def files_of(folder: Path, name: str) -> Sequence[Path]:
    """The files of a module in `folder`, all files for a package; none if there is no such
    module."""
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


class Neighbours(SourceLoader, MetaPathFinder):
    """Imports the neighbours of a solver from their texts, whether or not the files still exist."""

    def __init__(self, folder: Path, texts: Mapping[str, str], copies: Path) -> None:
        """`texts`: from `modules_beside` of `folder`; their code objects name files in `copies`."""
        self.folder, self.texts, self.copies = folder, texts, copies

    def find_spec(self, fullname: str, *_: Any) -> ModuleSpec | None:
        """As Python finds it in the folder: a package, a module, or a namespace package."""
        place = fullname.replace(".", "/")
        for file, within in (
            (f"{place}/__init__.py", [str(self.folder / place)]),
            (f"{place}.py", None),
        ):
            if file in self.texts:
                return spec_from_file_location(
                    fullname, self.folder / file, loader=self, submodule_search_locations=within
                )
        inside = any(file.startswith(f"{place}/") for file in self.texts)
        return ModuleSpec(fullname, None, is_package=True) if inside else None

    def get_filename(self, fullname: str) -> str:
        """The path of a module's file."""
        spec = self.find_spec(fullname)
        if spec is None or spec.origin is None:
            raise ImportError(f"{fullname} is no module beside the solver", name=fullname)
        return spec.origin

    def get_data(self, path: str | bytes) -> bytes:
        """The text of a file; raises `OSError` for other files, such as compiled code."""
        file = Path(os.fsdecode(path)).relative_to(self.folder).as_posix()
        if file not in self.texts:
            raise OSError(f"{file} was not read with the solver")
        return self.texts[file].encode()

    def source_to_code(self, data: Any, path: Any = "<string>") -> CodeType:  # type: ignore[override]
        """The code of a module; compiled from decoded text, to which the encoding in its first line
        no longer applies."""
        return compile(
            data.decode(),
            str(self.copies / Path(path).relative_to(self.folder)),
            "exec",
            dont_inherit=True,
        )
