"""`crosscheck check`: one file or a folder of them, as a table, a page, JSON or JUnit."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from adapters.solver_file import KINDS, SolverFailed, dangling
from adapters.solver_process import SolverProcess
from reports.check.machine import as_json, as_junit
from reports.check.terminal import print_class, print_file
from reports.check.verdict import NONE, FileCheck, check_file
from reports.exits import BAD_INPUT, DONE, FAILED, refuse, say

# What an earlier file of ours has among its first HEAD bytes, and nothing else has: it may be written over.
PAGE, JUNIT, HEAD = b'<meta name="generator" content="crosscheck check">', b'<testsuites name="crosscheck check"', 4096
NOBODYS = (".", "__", "node_modules")  # how the names of files and folders begin that no student wrote
HANDED_OUT = ("gl-matrix.js", "gl-matrix-min.js", "mainScript.js")  # lie beside a student's file


def check(path: Path, json_wanted: bool, junit: Path | None, page: Path | None) -> None:
    """Check what is at `path` and say it; exits 0, 1 (a fault was found) or 2 (there is nothing to check)."""
    files = files_of(path)
    if page is not None and path.is_dir():
        refuse([f"--page {page}: shows one file; {path} is a folder"])
    if page is None and not path.is_dir() and not json_wanted:
        page = Path("check.html")
    places_for(page, junit)
    checks = list(checked(files, path.is_dir() and not json_wanted))
    if not path.is_dir() and checks[0].refused:
        refuse([checks[0].refused])
    if json_wanted:
        print(json.dumps(as_json(checks), indent=2, allow_nan=False))
    else:
        print_class(path, checks) if path.is_dir() else print_file(checks[0])
    if junit is not None:
        write(junit, as_junit(checks))
    if page is not None:
        make_page(page, checks[0])
    sys.exit(DONE if all(one.passed for one in checks) else FAILED)


def files_of(path: Path) -> list[Path]:
    """The file, or all solvers below a folder, links to nothing too, in order of their names; exits 2 without any.

    Where every solver has a folder of its own, a folder without one stands among them.
    """
    if not path.exists():
        refuse([f"{path}: is not there; name an Exercise.js, a solver.py or a folder of them"])
    if not path.is_dir():
        return [path]
    theirs = [one for one in path.rglob("*") if not any(p.startswith(NOBODYS) for p in one.relative_to(path).parts)]
    found = sorted(
        file for file in theirs
        if file.suffix.lower() in KINDS and (file.is_file() or dangling(file)) and file.name not in HANDED_OUT
    )  # fmt: skip
    if not found:
        refuse([f"{path}: {NONE}"])
    owners = {file.relative_to(path).parts[0] for file in found}
    empty = [one for one in theirs if one.parent == path and one.is_dir() and one.name not in owners]
    return found if any(file.parent == path for file in found) else sorted(found + empty)


def places_for(page: Path | None, junit: Path | None) -> None:
    """Exit 2, before anything is checked, if what is to be written has no place or would take somebody else's."""
    if page is not None and junit is not None and page.resolve() == junit.resolve():
        refuse([f"--junit {junit}: is where the page goes; name another file"])
    for option, path, mark, what in (("--page", page, PAGE, "page"), ("--junit", junit, JUNIT, "JUnit file")):
        if path is None:
            continue
        try:
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if path.is_file() and mark not in path.read_bytes()[:HEAD]:
                refuse([f"{option} {path}: is there and no {what} of a check; name another file"])
            path.parent.stat()
        except OSError as fault:
            refuse([f"{option} {path}: {fault.strerror or fault}; name another file"])


def checked(files: Sequence[Path], progress: bool) -> Iterator[FileCheck]:
    """The checks in order, as many at once as there are cores: each file runs in a process of its own."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for k, one in enumerate(pool.map(check_file, files)):
            if progress and sys.stderr.isatty():
                print(f"\r{k + 1} of {len(files)}", end="\n" if k + 1 == len(files) else "", file=sys.stderr)
            yield one


def make_page(path: Path, one: FileCheck) -> None:
    """Look for the smallest scene that shows a fault, and write the page."""
    from reports.check.page import write_page
    from reports.check.smallest import Smallest, smallest_scene

    smallest: Smallest | None = None
    if one.faults and one.restitution is not None:
        try:
            with SolverProcess(one.path) as process:
                smallest = smallest_scene(process, one.restitution)
        except SolverFailed:
            smallest = None  # the rows say how it failed
    try:
        write_page(path, one, smallest)
    except OSError as fault:
        say(f"--page {path}: {fault.strerror or fault}; name another file")
        sys.exit(BAD_INPUT)
    say(f"{path.resolve()}")


def write(path: Path, text: str) -> None:
    """Write a file that was asked for; exits 2 if that is not possible."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as fault:
        refuse([f"--junit {path}: {fault.strerror or fault}; name a file that can be written"])
