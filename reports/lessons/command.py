"""What `crosscheck lesson` does: serves the lessons, or writes one as a file, or all into a folder."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile

from reports.commands import unknown
from reports.exits import refuse
from reports.folders import FolderTaken, may_write
from reports.game.command import FIRST
from reports.game.server import Game, application, serve
from reports.lessons.catalogue import LESSONS
from reports.lessons.lesson import Lesson
from reports.lessons.pages import ALONE, FILES, ROUTES, Links, index_page, offline
from reports.terminal import Progress

# What a page of ours has among its first HEAD bytes, and nothing else has: it may be written over.
MARK, HEAD = b'<meta name="generator" content="crosscheck lesson">', 4096


def open_lesson(name: str, port: int, opens: bool, export: Path | None) -> None:
    """Serve the lessons, opened at `name` or their list, or write them to `export`; exits 2 on bad input."""
    if name and name not in LESSONS:
        refuse([unknown("lesson", name, LESSONS).replace("see: crosscheck list", f"there are {', '.join(LESSONS)}")])
    if export is not None:
        write_one(name, export) if name else write_all(export)
        return
    serve(application(Game(list(FIRST)), ROUTES), port, f"/lesson/{name}".rstrip("/"), opens)


def write_one(name: str, path: Path) -> None:
    """One self-contained page."""
    if path.is_dir():
        refuse([f"--export {path}: is a folder; name a file, or leave out {name} to write all lessons there"])
    if path.exists() and not ours(path):
        refuse([f"--export {path}: is there and no page of a lesson; name another file"])
    must_be_writable(path.parent, path)
    write_pages({path: LESSONS[name]}, ALONE)
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB, opens without a server")


def write_all(folder: Path) -> None:
    """All lessons and their list, a page each, with links between them."""
    try:
        may_write(folder, lambda name: ours(folder / name), "is no page of a lesson", "--export")
        folder.mkdir(parents=True, exist_ok=True)
    except FolderTaken as fault:
        refuse([str(fault)])
    except OSError as fault:
        refuse([f"--export {folder}: {fault.strerror or fault}; name another folder"])
    must_be_writable(folder, folder)
    pages = {folder / f"{name}.html": lesson for name, lesson in LESSONS.items()}
    write_pages(pages, FILES)
    put(folder / "index.html", index_page(FILES))
    size = sum(path.stat().st_size for path in pages)
    print(f"{folder / 'index.html'}: {len(pages)} lessons, {size / 1e6:.1f} MB, opens without a server")


def ours(path: Path) -> bool:
    """Whether an earlier export wrote this file."""
    return path.is_file() and MARK in path.read_bytes()[:HEAD]


def must_be_writable(folder: Path, asked: Path) -> None:
    """Exit 2, before any run, if nothing can be written in `folder`."""
    try:
        with TemporaryFile(dir=folder):
            pass
    except OSError as fault:
        refuse([f"--export {asked}: {fault.strerror or fault}; name another place"])


def write_pages(pages: Mapping[Path, Lesson], links: Links) -> None:
    """Each page as soon as all its runs have ended, of which there is one for every setting of the sliders."""
    runs = sum(len(lesson.grid) for lesson in pages.values())
    with Progress() as progress:
        progress.start(runs, runs, "starting")
        with stoppable(progress.done) as done:
            for path, lesson in pages.items():
                put(path, offline(lesson, partial(done, f"{lesson.number} {lesson.title}"), links))


@contextmanager
def stoppable(done: Callable[[str], None]) -> Iterator[Callable[[str], None]]:
    """`done`, which ends all on Ctrl-C: raised within an engine's callback it would be lost, so it waits for a run."""
    asked: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: asked.append(number))

    def checked(what: str) -> None:
        if asked:
            raise KeyboardInterrupt
        done(what)

    try:
        yield checked
    finally:
        signal.signal(signal.SIGINT, before)


def put(path: Path, text: str) -> None:
    """A whole page or, if it cannot be written, the one that was there, and exit 2."""
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as fault:
        refuse([f"--export {path}: {fault.strerror or fault}"])
