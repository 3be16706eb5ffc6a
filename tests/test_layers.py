"""Imports point down only: reports -> adapters -> scenarios, reference_impl; the judge shares no code with a player."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MAY_IMPORT = {
    "reference_impl": {"reference_impl"},
    "scenarios": {"scenarios"},
    "adapters": {"adapters", "scenarios", "reference_impl"},
    "reports": {"reports", "adapters", "scenarios"},
}
FILES = [path for folder in MAY_IMPORT for path in sorted((ROOT / folder).rglob("*.py"))]


def imports_of(path: Path) -> set[str]:
    """Top-level packages a file imports, wherever the import stands."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found.add((node.module or "").split(".")[0])
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_imports_only_from_layers_below(path: Path):
    """A player never sees the judge, the solver never sees the harness."""
    ours = imports_of(path) & set(MAY_IMPORT)

    assert ours <= MAY_IMPORT[path.relative_to(ROOT).parts[0]]


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_fits_in_one_head(path: Path):
    """No source file is longer than 300 lines."""
    assert len(path.read_text().splitlines()) <= 300


def test_only_the_engine_table_names_engines():
    """An engine's library is imported by its own adapter and nowhere else."""
    libraries = {"pymunk", "Box2D", "pyb2d3"}
    users = {f"{path.parent.name}/{path.name}": imports_of(path) & libraries for path in FILES}

    assert {name: used for name, used in users.items() if used} == {
        "adapters/pymunk.py": {"pymunk"},
        "adapters/box2d.py": {"Box2D"},
        "adapters/box2d_v3.py": {"pyb2d3"},
    }
