"""`crosscheck check`: one file or a folder of them, as a table, a page, JSON or JUnit."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Hashable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adapters.own_solver.file import KINDS, SolverFailed, SolverText, dangling, printable
from adapters.own_solver.gl_matrix import HANDED_OUT
from adapters.own_solver.process import SolverProcess
from reports.check.functions import keeps_state
from reports.check.machine import as_json, as_junit
from reports.check.rows import CheckRow
from reports.check.terminal import print_class, print_file, print_scene
from reports.check.verdict import FileCheck, check_file, nothing_in
from reports.run.made import may_overwrite, sealed
from reports.run.runner import run_all
from reports.run.worker_process import Failure
from reports.terminal.exits import BAD_INPUT, DONE, FAILED, FolderTaken, refuse, say
from reports.terminal.foreign_text import put_text
from reports.terminal.progress import Progress

if TYPE_CHECKING:
    from reports.check.smallest import Smallest

# What an earlier file of ours begins with, and nothing else does: it may be written over.
PAGE, JUNIT = (
    b'<meta name="generator" content="crosscheck check">',
    b'<testsuites name="crosscheck check"',
)
CHECKING = 600.0  # s that a file may take: what each of its calls may take adds up to less
# how the names of files and folders begin that no student wrote
NOBODYS = (".", "__", "node_modules")


def check(path: Path, json_wanted: bool, junit: Path | None, page: Path | None) -> None:
    """Check what is at `path` and say it; exits 0, 1 (a fault was found) or 2 (there is nothing to
    check)."""
    files = files_of(path)
    if page is not None and path.is_dir():
        refuse([f"--page {page}: shows one file; {path} is a folder"])
    if page is None and not path.is_dir() and not json_wanted:
        page = Path("check.html")
    places_for(page, junit)
    checks = checked(files)
    if not path.is_dir() and checks[0].refused:
        refuse([checks[0].refused])
    if json_wanted:
        print(json.dumps(as_json(checks), indent=2, allow_nan=False))
    else:
        print_class(path, checks, others_in(path)) if path.is_dir() else print_file(checks[0])
    if junit is not None:
        write(junit, as_junit(checks))
    if page is not None:
        scenes = scenes_of(checks[0])
        if scenes and not json_wanted:
            print_scene(scenes, page)
        make_page(page, checks[0], scenes)
    sys.exit(DONE if all(one.passed for one in checks) else FAILED)


def files_of(path: Path) -> list[Path]:
    """The file, or all solvers below a folder, links to nothing too, in order of their names; exits
    2 without any.

    Where most solvers have a folder of their own, a folder without one stands among them.
    """
    try:
        there = path.exists()
    except OSError as fault:  # a name of 300 letters, say
        refuse([f"{path}: {fault.strerror or fault}; name a file or a folder"])
    if not there:
        refuse([f"{path}: is not there; name an Exercise.js, a solver.py or a folder of them"])
    if not path.is_dir():
        return [path]
    theirs = [
        one
        for one in path.rglob("*")
        if not any(p.startswith(NOBODYS) for p in one.relative_to(path).parts)
    ]
    found = sorted(
        file
        for file in theirs
        if file.suffix.lower() in KINDS
        and (file.is_file() or dangling(file))
        and not is_handed_out(file)
    )
    if not found:
        refuse([f"{path}: {nothing_in(path)}"])
    owners = {file.relative_to(path).parts[0] for file in found}
    empty = [
        one for one in theirs if one.parent == path and one.is_dir() and one.name not in owners
    ]
    loose = sum(file.parent == path for file in found)
    return found if 2 * loose >= len(found) else sorted(found + empty)


def others_in(folder: Path) -> list[str]:
    """The names of what lies in the folder itself and can be no solver, such as an archive."""
    return sorted(
        one.name
        for one in folder.iterdir()
        if one.is_file() and one.suffix.lower() not in KINDS and not one.name.startswith(NOBODYS)
    )


def places_for(page: Path | None, junit: Path | None) -> None:
    """Exit 2, before anything is checked, if what is to be written has no place or would take
    somebody else's."""
    if page is not None and junit is not None and os.path.realpath(page) == os.path.realpath(junit):
        refuse([f"--junit {junit}: is where the page goes; name another file"])
    marks = (
        ("--page", page, PAGE, "page of a check"),
        ("--junit", junit, JUNIT, "JUnit file of a check"),
    )
    for option, path, mark, what in marks:
        if path is None:
            continue
        try:
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            may_overwrite(path, mark, what, option)
        except FolderTaken as fault:
            refuse([str(fault)])
        except OSError as fault:
            refuse([f"{option} {path}: {fault.strerror or fault}; name another file"])


def is_handed_out(file: Path) -> bool:
    """Whether the exercise's page loads it beside a student's file."""
    return file.match(HANDED_OUT) or file.name == "mainScript.js"


def checked(files: Sequence[Path]) -> list[FileCheck]:
    """The checks in order, as many at once as there are cores, in workers: those can be stopped
    whatever they do."""
    tasks: dict[Hashable, Any] = {file: partial(check_file, file) for file in files}
    done: dict[Path, FileCheck] = {}
    results = run_all(tasks, min(os.cpu_count() or 1, len(files)), CHECKING)
    with closing(results), Progress() as progress:
        progress.start(len(files), len(files), f"checking {printable(files[0].name)}")
        for file, one in results:
            done[file] = not_checked(file, one) if isinstance(one, Failure) else one
            progress.done(f"checked {printable(str(file.relative_to(file.parent.parent)))}")
    return [done[file] for file in files]


def not_checked(file: Path, failure: Failure) -> FileCheck:
    """What is said of a file whose check did not come to its end."""
    return FileCheck(file, [], f"{file}: could not be checked: {failure.status}: {failure.reason}")


def scenes_of(one: FileCheck) -> list[Smallest]:
    """Of each fault that has a sentence the smallest scene that shows it, if one is found."""
    if not one.faults or one.restitution is None or one.solver is None:
        return []
    search = partial(scenes_here, one.solver, one.restitution, one.findings, keeps_state(one.rows))
    with closing(run_all({one.path: search}, 1, CHECKING)) as results, Progress() as progress:
        progress.say("looking for the smallest scene that shows each fault")
        [(_, found)] = results
    return [] if isinstance(found, Failure) else found  # the rows say how it failed


def make_page(path: Path, one: FileCheck, scenes: Sequence[Smallest]) -> None:
    """Write the page."""
    from reports.check.page import write_page

    try:
        write_page(path, one, scenes)
    except OSError as fault:
        say(f"--page {path}: {fault.strerror or fault}; name another file")
        sys.exit(BAD_INPUT)
    say(f"{path.resolve()}")


def scenes_here(
    solver: SolverText, restitution: float, findings: Sequence[CheckRow], afresh: bool
) -> list[Smallest]:
    """In a worker: the smallest scenes that show these faults of a solver; none if it fails."""
    from reports.check.smallest import smallest_scenes

    try:
        with SolverProcess(solver) as process:
            return smallest_scenes(process, restitution, findings, afresh)
    except SolverFailed:
        return []


def write(path: Path, text: str) -> None:
    """Write a file that was asked for; exits 2 if that is not possible."""
    try:
        put_text(path, sealed(text))
    except OSError as fault:
        refuse([f"--junit {path}: {fault.strerror or fault}; name a file that can be written"])
