"""The modules that a solver.py imports from its own folder: found and read together with the file,
and imported from these texts.

A neighbour is a module that an import statement names, in the file or in another neighbour, and
that is not installed: it never hides a library. Files that it opens or imports by other means at
run time are not covered.
"""

from __future__ import annotations

import ast
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from importlib.machinery import PathFinder
from pathlib import Path
from threading import Lock

from crosscheck2d.adapters.safe_path import PACKAGE


def modules_beside(
    folder: Path, text: str, read: Callable[[Path], str]
) -> Iterator[tuple[str, str]]:
    """File, relative to `folder`, and text of every neighbour that `text` imports."""
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


OURS = (PACKAGE, "reference_impl")
REFERENCE = Path(__file__).parents[2] / "reference_impl"


USES_REFERENCE = re.compile(
    r"^\s*(?:from|import)\s+(?:(?:crosscheck2d\.)?reference_impl\b|\.(?:state|compiled)\b)",
    re.MULTILINE,
)


def reference_modules(text: str) -> dict[str, str]:
    """The two modules that a copy of the exercise's solver imports, by both of their names."""
    if not USES_REFERENCE.search(text):
        return {}
    files = ("__init__.py", "state.py", "compiled.py")
    texts = {file: (REFERENCE / file).read_text(encoding="utf-8") for file in files[1:]}
    folders = ("reference_impl", "crosscheck2d/reference_impl")
    return {f"{folder}/{file}": texts.get(file, "") for folder in folders for file in files}


# One text at a time: Python before 3.11.8 counts the depth of its parser over all threads together
# (gh-106905).
PARSING = Lock()


def module_of(text: str) -> ast.Module | None:
    """None if it is not Python, which is reported when it is run."""
    try:
        with PARSING, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about the text, meant for its author
            return ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def imported_by(text: str) -> set[str]:
    module = module_of(text)
    nodes = list(ast.walk(module)) if module else []
    named = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    named += [
        node.module
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module and not node.level
    ]
    return {name.partition(".")[0] for name in named}


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
