"""Imports point down only, in every folder and the folders inside it; the judge shares no code with
an engine; a class has a name of its own."""

import ast
import sys
from collections import Counter
from collections.abc import Iterable
from functools import cache
from importlib.util import module_from_spec, resolve_name, spec_from_file_location
from pathlib import Path
from types import ModuleType

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
    "scenarios": [
        "regular faults rows",
        "model",
        "no_truth",
        "truth",
        "families",
        "files",
        "catalogue",
    ],
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
        "advance engine_row float32 friction library_versions run",
        "play",
        f"{' '.join({name.partition(':')[0] for name in ENGINES})} library_at_version",
        "npm_packages",
        "host",
        "engines",
        "mechanisms conformance snippets",
    ],
    "reports": [
        "terminal compare",
        "run",
        "page",
        "check speed stability game tune",
        "lessons",
        "commands notebook",
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
PACKAGE = "crosscheck2d."
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in FILES
}


@cache
def imports_of(path: Path) -> frozenset[str]:
    """The modules a file imports, wherever the import stands, ours without `crosscheck2d.`; a name
    of a package counts as its module."""
    found = set()
    folder = PACKAGE + ".".join(path.relative_to(ROOT).parent.parts)
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.removeprefix(PACKAGE) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = resolve_name("." * node.level + (node.module or ""), folder)
            module = module.removeprefix(PACKAGE)
            names = {f"{module}.{alias.name}" for alias in node.names}
            found |= names & set(MODULES) or {module}
    return frozenset(found)


def of_folder(folder: str, names: Iterable[str]) -> set[str]:
    """What of a folder is named: of scenarios/truth/exact.py it is `truth`."""
    start = folder.replace("/", ".") + "."
    return {name.removeprefix(start).split(".")[0] for name in names if name.startswith(start)}


def test_a_file_imports_only_from_layers_below():
    upwards = []
    for path in FILES:
        ours = {name.split(".")[0] for name in imports_of(path)} & set(MAY_IMPORT)
        if not ours <= MAY_IMPORT[path.relative_to(ROOT).parts[0]]:
            upwards.append(f"{path.relative_to(ROOT)} imports {sorted(ours)}")

    assert upwards == []


@pytest.mark.parametrize("folder", LAYERS)
def test_inside_a_folder_imports_point_down(folder: str):
    height = {part: k for k, line in enumerate(LAYERS[folder]) for part in line.split()}
    upwards = []
    for name, path in MODULES.items():
        for mine in of_folder(folder, {name}) - {""}:
            for other in of_folder(folder, imports_of(path)) - {mine, ""}:
                if height[other] >= height[mine] and (mine, other) not in MAY_ALSO:
                    upwards.append(f"{path.relative_to(ROOT)} imports {other}")

    assert upwards == []


def test_imports_are_absolute_but_in_the_solvers_which_can_be_copied_alone():
    for path in FILES:
        own = path.relative_to(ROOT).parts[0] == "reference_impl"
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                name = "." * node.level + (node.module or "")
                assert own == name.startswith(".") or "crosscheck2d" not in name, f"{path}: {name}"
                assert own or not node.level, f"{path}: {name}"


def loaded_twice(modules: Iterable[ModuleType]) -> dict[Path, set[str]]:
    names: dict[Path, set[str]] = {}
    for module in modules:
        file = getattr(module, "__file__", None)
        # not those of libraries in the environment of a clone: toolz of dask has two names
        if file and ROOT in (path := Path(file).resolve()).parents and ".venv" not in path.parts:
            names.setdefault(path, set()).add(getattr(module, "__name__", ""))
    return {path: spellings for path, spellings in names.items() if len(spellings) > 1}


def test_no_file_is_loaded_under_two_names():
    # As `crosscheck2d.reports` and as `reports`: a class would then be two classes. All that the
    # tests import is loaded here; the control loads a file under its old name.
    assert loaded_twice([*sys.modules.values()]) == {}
    assert not {*MAY_IMPORT} & {name.partition(".")[0] for name in sys.modules}
    old = ".".join(("adapters", "matched"))
    spec = spec_from_file_location(old, ROOT / "adapters" / "matched.py")
    assert spec
    twice = loaded_twice([*sys.modules.values(), module_from_spec(spec)])
    assert [*twice.values()] == [{old, f"crosscheck2d.{old}"}]


def test_no_application_imports_another():
    both = [
        f"{path.relative_to(ROOT)} imports {other}"
        for name, path in MODULES.items()
        for mine in of_folder("reports", {name}) & APPLICATIONS
        for other in (of_folder("reports", imports_of(path)) & APPLICATIONS) - {mine}
        if (mine, other) not in MAY_ALSO
    ]

    assert both == []


def test_no_file_imports_itself_through_others():
    graph = {name: imports_of(path) & set(MODULES) - {name} for name, path in MODULES.items()}
    while leaves := [name for name, others in graph.items() if not others]:
        graph = {name: others - set(leaves) for name, others in graph.items() if name not in leaves}

    assert graph == {}


def test_what_compares_opens_no_file_starts_no_process_and_asks_no_clock():
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
    names = Counter(
        node.name
        for path in FILES
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.ClassDef)
    )

    assert len(names) > 200
    assert [name for name, count in names.items() if count > 1] == []
