"""Imports point down only, in every folder and the folders inside it; the judge shares no code with
an engine; a class has a name of its own."""

import ast
from collections import Counter
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pytest

from crosscheck2d.adapters.engines import ENGINES

ROOT = Path(__file__).parent.parent
MAY_IMPORT = {
    "reference_impl": {"reference_impl"},
    "scenarios": {"scenarios"},
    "adapters": {"adapters", "scenarios", "reference_impl"},
    "reports": {"reports", "adapters", "scenarios"},
}
# From the bottom up; what stands in one line does not import each other. A folder's own files are
# its layer "".
LAYERS = {
    "scenarios": ["regular faults", "model", "no_truth", "truth", "families", "files", "catalogue"],
    "scenarios/truth": [
        "oracle",
        "closed_forms cache",
        "horizon lines sliding",
        "order",
        "record",
        "exact",
    ],
    "adapters": [
        "matched safe_path system",
        "engine",
        "advance engine_row first_collisions float32 friction library_versions run runaway",
        "play",
        f"{' '.join({name.partition(':')[0] for name in ENGINES})} npm_packages",
        "own_solver",
        "javascript own_engine",
        "engines",
        "mechanisms conformance",
    ],
    "reports": [
        "terminal compare",
        "run",
        "page",
        "check speed stability game tune",
        "lessons",
        "commands",
        "cli",
        "__main__",
    ],
}
MAY_ALSO = {("lessons", "stability")}  # a lesson shows a limit; no other application knows another
APPLICATIONS = {"check", "speed", "stability", "game", "tune", "lessons"}
FILES = [
    path
    for folder in MAY_IMPORT
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "out" not in path.parts
]
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in FILES
}


@cache
def imports_of(path: Path) -> frozenset[str]:
    """The modules a file imports, wherever the import stands; a name of a package counts as its
    module."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= names & set(MODULES) or {node.module or ""}
    return frozenset(found)


def of_folder(folder: str, names: Iterable[str]) -> set[str]:
    """What of a folder is named: `scenarios`, crosscheck2d.scenarios.truth.exact -> truth."""
    start = folder.replace("/", ".") + "."
    return {name.removeprefix(start).split(".")[0] for name in names if name.startswith(start)}


def test_a_file_imports_only_from_layers_below():
    """An engine never sees the judge, the solver never sees the harness."""
    upwards = []
    for path in FILES:
        ours = {name.split(".")[0] for name in imports_of(path)} & set(MAY_IMPORT)
        if not ours <= MAY_IMPORT[path.relative_to(ROOT).parts[0]]:
            upwards.append(f"{path.relative_to(ROOT)} imports {sorted(ours)}")

    assert upwards == []


@pytest.mark.parametrize("folder", LAYERS)
def test_inside_a_folder_imports_point_down(folder: str):
    """Between the parts of a folder, files and folders alike."""
    height = {part: k for k, line in enumerate(LAYERS[folder]) for part in line.split()}
    upwards = []
    for name, path in MODULES.items():
        for mine in of_folder(folder, {name}) - {""}:
            for other in of_folder(folder, imports_of(path)) - {mine, ""}:
                if height[other] >= height[mine] and (mine, other) not in MAY_ALSO:
                    upwards.append(f"{path.relative_to(ROOT)} imports {other}")

    assert upwards == []


def test_no_application_imports_another():
    """But lessons may ask stability for a limit."""
    both = [
        f"{path.relative_to(ROOT)} imports {other}"
        for name, path in MODULES.items()
        for mine in of_folder("reports", {name}) & APPLICATIONS
        for other in (of_folder("reports", imports_of(path)) & APPLICATIONS) - {mine}
        if (mine, other) not in MAY_ALSO
    ]

    assert both == []


def test_no_file_imports_itself_through_others():
    """No circle anywhere, imports inside functions included."""
    graph = {name: imports_of(path) & set(MODULES) - {name} for name, path in MODULES.items()}
    while leaves := [name for name, others in graph.items() if not others]:
        graph = {name: others - set(leaves) for name, others in graph.items() if name not in leaves}

    assert graph == {}


def test_what_compares_opens_no_file_starts_no_process_and_asks_no_clock():
    """`reports/compare` is pure: trajectories in, tables out."""
    unclean = {
        "os",
        "io",
        "pathlib",
        "subprocess",
        "multiprocessing",
        "threading",
        "time",
        "datetime",
        "shutil",
    }
    for path in (ROOT / "reports" / "compare").rglob("*.py"):
        assert not unclean & {name.split(".")[0] for name in imports_of(path)}, path
        called = {
            node.func.id
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert not called & {"open", "print", "input"}, path


def test_only_the_engine_table_names_engines():
    """An engine's library is imported by its own adapter and nowhere else."""
    libraries = {"pymunk", "Box2D", "pyb2d3"}
    users = {
        str(path.relative_to(ROOT)): {name.split(".")[0] for name in imports_of(path)} & libraries
        for path in FILES
    }

    assert {name: used for name, used in users.items() if used} == {
        "adapters/pymunk.py": {"pymunk"},
        "adapters/box2d.py": {"Box2D"},
        "adapters/box2d_v3.py": {"pyb2d3"},
    }


def test_no_two_classes_have_one_name():
    """One name stands for one idea, wherever it is imported."""
    names = Counter(
        node.name
        for path in FILES
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.ClassDef)
    )

    assert len(names) > 200
    assert [name for name, count in names.items() if count > 1] == []
