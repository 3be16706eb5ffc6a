"""`crosscheck lesson --export`: writes one lesson as a file, or all into a folder."""

from __future__ import annotations

import sys
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.conventions import table
from crosscheck2d.reports.lessons.lesson import Lesson
from crosscheck2d.reports.lessons.pages import ALONE, FILES, Links, answer_json, index_page, offline
from crosscheck2d.reports.run.arguments import unknown
from crosscheck2d.reports.run.made import may_overwrite, sealed
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.store import place_of
from crosscheck2d.reports.terminal.exits import FAILED, FolderTaken, refuse, say
from crosscheck2d.reports.terminal.foreign_text import legible, put_text
from crosscheck2d.reports.terminal.progress import Progress

# What a page of ours begins with, and nothing else does: it may be written over.
MARK = b'<meta name="generator" content="crosscheck lesson">'

# s that one setting of the sliders may take: the slowest needs some 5, once its engines are
# compiled
SHOWING = 300.0
INDEX, CONVENTIONS = "index.html", "the conventions of the engines"


def checked_lesson(name: str) -> str:
    """The name of the lesson with this name or number; exits 2 if there is none."""
    numbers = {lesson.number: each for each, lesson in LESSONS.items()}
    if name and name not in LESSONS and name not in numbers:
        there = ", ".join(f"{number} {each}" for number, each in numbers.items())
        refuse(
            [unknown("lesson", name, LESSONS).replace("see: crosscheck list", f"there are {there}")]
        )
    return numbers.get(name, name)


def write_lessons(name: str, place: Path) -> None:
    """Write the lesson of that name to a file, or with "" all of them to a folder; exits 2 if that
    cannot be."""
    name = checked_lesson(name)
    if name:
        write_one(name, place)
    else:
        write_all(place)


def write_one(name: str, path: Path) -> None:
    """One self-contained page."""
    if path.is_dir():
        refuse(
            [
                f"--export {path}: is a folder; name a file, or leave out {name} to write all"
                " lessons there"
            ]
        )
    with exporting(path):
        may_overwrite(path, MARK, "page of a lesson", "--export")
        # so that it is known before any run whether it can be written
        with TemporaryFile(dir=path.parent):
            pass
        write_pages({path: LESSONS[name]}, ALONE, {})
    print(legible(f"{path}: {path.stat().st_size / 1e6:.1f} MB; needs no server"))


def write_all(folder: Path) -> None:
    """All lessons and their list, a page each, with links between them."""
    with exporting(folder):
        folder = place_of(folder, "--export ")
        pages = {folder / f"{name}.html": lesson for name, lesson in LESSONS.items()}
        for path in (*pages, folder / INDEX):
            if path.parent.exists():
                may_overwrite(path, MARK, "page of a lesson", "--export")
        folder.mkdir(parents=True, exist_ok=True)
        settings = sum(len(lesson.grid) for lesson in LESSONS.values())
        say(f"{len(pages)} lessons with {settings} settings of their sliders: takes minutes")
        rows = write_pages(pages, FILES, {CONVENTIONS: partial(table, ENGINES)})[CONVENTIONS]
        put_text(folder / INDEX, sealed(index_page(FILES, rows)))
    size = sum(path.stat().st_size for path in folder.glob("*.html"))
    print(legible(f"{folder / INDEX}: {len(pages)} lessons, {size / 1e6:.1f} MB; needs no server"))


@contextmanager
def exporting(asked: Path) -> Iterator[None]:
    """What writes to the place that is asked for: exits 2 if it may not, or cannot."""
    try:
        yield
    except FolderTaken as fault:
        refuse([str(fault)])
    except OSError as fault:
        refuse([f"--export {asked}: {fault.strerror or fault}; name another place"])


def write_pages(
    pages: Mapping[Path, Lesson], links: Links, besides: dict[str, Callable[[], Any]]
) -> dict[str, Any]:
    """Each page as soon as all its runs have ended, one for every setting of the sliders; returns
    what `besides` gave.

    They run in a worker, which can be stopped whatever it does, one after the other, as one lesson
    takes times; exits 1 if one of them fails.
    """
    tasks: dict[Hashable, Callable[[], Any]] = {
        (path, places): partial(answer_json, lesson.name, places)
        for path, lesson in pages.items()
        for places in lesson.grid
    }
    tasks.update(besides)
    answers: dict[Path, dict[tuple[int, ...], Any]] = {path: {} for path in pages}
    found: dict[str, Any] = {}
    with Progress() as progress:
        progress.start(len(tasks), len(tasks))
        with closing(run_all(tasks, 1, SHOWING)) as results:
            for task, result in results:
                if isinstance(result, Failure):
                    what = (
                        task
                        if isinstance(task, str)
                        else f"{pages[task[0]].title}, sliders at {task[1]}"
                    )
                    say(f"{what}: {result.status}: {result.reason}")
                    sys.exit(FAILED)
                if isinstance(task, str):
                    found[task] = result
                    progress.done(task)
                    continue
                path, lesson = task[0], pages[task[0]]
                answers[path][task[1]] = result
                progress.done(f"{lesson.number} {lesson.title}")
                if len(answers[path]) == len(lesson.grid):
                    put_text(path, sealed(offline(lesson, answers.pop(path), links)))
    return found
