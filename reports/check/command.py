"""`crosscheck check`: checks a file or a folder of them, and writes a table, a page, or one of the
formats."""

from __future__ import annotations

import errno
import os
import re
import secrets
import sys
from collections import Counter
from collections.abc import Hashable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, replace
from functools import partial
from importlib.metadata import packages_distributions, version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn
from unicodedata import combining, normalize

from crosscheck2d.adapters.host.file import (
    KINDS,
    NotASolver,
    SolverFailed,
    SolverText,
    dangling,
    printable,
    read_solver,
)
from crosscheck2d.adapters.host.gl_matrix import HANDED_OUT
from crosscheck2d.adapters.host.process import SolverProcess, protection
from crosscheck2d.adapters.host.sandbox import Level
from crosscheck2d.adapters.host.sandbox import files_of as files_of_packages
from crosscheck2d.reports.check.formats import FORMATS, show
from crosscheck2d.reports.check.functions import keeps_state
from crosscheck2d.reports.check.marks import Marked, id_of, matched, place_of
from crosscheck2d.reports.check.points import DEFAULT, BadPoints, Points, read_points
from crosscheck2d.reports.check.rows import CheckRow
from crosscheck2d.reports.check.terminal import print_scene, print_total, sentence_on
from crosscheck2d.reports.check.verdict import FileCheck, check_file, named, nothing_in
from crosscheck2d.reports.run.arguments import opening
from crosscheck2d.reports.run.cells import CHECK_SOURCE, content_key, source_hash
from crosscheck2d.reports.run.made import may_overwrite
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.store import Store
from crosscheck2d.reports.terminal.counts import counted
from crosscheck2d.reports.terminal.exits import (
    BAD_INPUT,
    DONE,
    FAILED,
    FolderTaken,
    keeping,
    refuse,
    say,
)
from crosscheck2d.reports.terminal.foreign_text import put_text
from crosscheck2d.reports.terminal.progress import Progress

if TYPE_CHECKING:
    from crosscheck2d.reports.check.smallest_scene import Smallest

# Only pages written by this command start with this; they may be overwritten.
PAGE = b'<meta name="generator" content="crosscheck check">'
CHECKING = 600.0  # s that a file may take: more than the sum of the limits of its calls
COMMAND, MARKS, CLASS_PAGE = "crosscheck check", "marks.csv", "class.html"
# prefixes of files and folders that no student wrote
NOBODYS = (".", "__", "node_modules")


# the file names of the exercise and of this project
EXPECTED = ("exercise.js", "solver.py")
# Suffixes of what students hand in instead of a solver.
HANDED_IN = (
    *(".zip", ".rar", ".7z", ".tar", ".gz", ".tgz", ".bz2", ".xz"),
    *(".pdf", ".doc", ".docx", ".odt", ".rtf", ".ipynb", ".ts"),
)


class Output(NamedTuple):
    """An output: its option, its format, and its file; None if it is printed."""

    option: str
    format: str
    path: Path | None


class Grading(NamedTuple):
    """How a check becomes marks: points, pattern of ids, whether causes are left out."""

    points: Points
    id_pattern: re.Pattern[str] | None
    low: bool


class Asking(NamedTuple):
    """How files are asked.

    Attributes:
        seed: of the numbers of the questions; None: 0 for a file, a random one for a class.
        packages: what a solver.py may import beside numpy.
        unprotected: check a folder with Python files even where nothing protects the machine.
        folder: of the results of a class, each of which is kept as it ends; None: none are kept.
        fresh: whether those that it has are ignored.
    """

    seed: int | None = None
    packages: Sequence[str] = ()
    unprotected: bool = False
    folder: Path | None = None
    fresh: bool = False


def check(
    path: Path,
    page: Path | None,
    outputs: Sequence[Output],
    grading: Grading,
    asking: Asking = Asking(),  # noqa: B008 - a tuple
) -> NoReturn:
    """Check the file or folder `path` and print the result; exits 0, 1 (a fault was found) or 2
    (nothing to check)."""
    if asking.folder is None:
        check_into(None, path, page, outputs, grading, asking)
    if asking.folder.resolve().is_relative_to(path.resolve()):
        refuse(f"--out {asking.folder}: is in the class; name a folder elsewhere")
    written = {"--page": page} | {one.option: one.path for one in outputs}
    for option, file in written.items():
        if file is not None and file.resolve().is_relative_to(asking.folder.resolve()):
            refuse(f"{option} {file}: is in the folder of --out; name a place elsewhere")
    files_of(path)  # which refuses what is no class, before a folder is made
    with opening(asking.folder, COMMAND, asking.fresh) as store, keeping(store.folder, kept):
        check_into(store, path, page, outputs, grading, asking)


def kept() -> str:
    return "What was checked is kept; the same command goes on."


def check_into(
    store: Store | None,
    path: Path,
    page: Path | None,
    outputs: Sequence[Output],
    grading: Grading,
    asking: Asking,
) -> NoReturn:
    single = any(FORMATS[one.format].single for one in outputs)
    files = submission_of(path) if single else files_of(path)
    several = path.is_dir() and not single
    if page is None and not path.is_dir() and all(one.option == "--junit" for one in outputs):
        page = Path("check.html")
    places_for(page, outputs)
    say_protection(files, several, asking)
    seed = seed_of(asking.seed, several, store)
    homes = {file: path if single else student_of(file, path) for file in files}
    checks = checked(files, seed, asking.packages, homes if several else {}, store)
    if not path.is_dir() and checks[0].refused and not single:
        refuse([checks[0].refused])
    if single and files[0].is_dir() and len(solvers_below(path)) > 1:
        say(f"{path}: holds several solvers; for a class: --format csv, or --scaffold")
    beside = {file: passed_over(file, home) for file, home in homes.items()}
    places = [f"{homes[file].name}/{one}" for file, others in beside.items() for one in others]
    not_read = [*others_in(path, files), *places] if several else []
    scenes = scenes_of(checks[0]) if page is not None and not several else []
    marked = marks_of(path, checks, grading, not_read, beside, scenes)
    marked = [replace(one, seed=seed) for one in marked]
    printed = next((one.format for one in outputs if one.path is None), "")
    if printed:
        sys.stdout.write(FORMATS[printed].text(marked))
        if not_read:
            say(sentence_on(not_read))
    elif several and any(one.option == "--out" for one in outputs):
        print_total(marked)
    else:
        show(marked)
    for one in outputs:
        if one.path is not None:
            write(one, FORMATS[one.format].text(marked))
    if page is not None:
        if scenes and not several and not printed:
            print_scene(scenes, page)
        make_page(page, marked, several)
    if store is not None:
        from crosscheck2d.reports.check.class_page import write_class_page

        store.export(MARKS, FORMATS["csv"].text(marked))
        with store.exporting(CLASS_PAGE) as part:
            write_class_page(part, marked)
        say(f"{store.folder / MARKS}\n{store.folder / CLASS_PAGE}")
    sys.exit(DONE if all(one.passed for one in checks) else FAILED)


def seed_of(seed: int | None, several: bool, store: Store | None) -> int:
    """The one that was asked for, or that of the results which are there, or a new one."""
    if seed is None and store is not None and (row := store.get("class", "seed")):
        seed = int(row.value)
    if seed is None:
        seed = secrets.randbelow(10**6) + 1 if several else 0
    if store is not None:
        store.put("class", "seed", seed)
    return seed


def outputs_of(
    as_json: bool, junit: Path | None, formats: Sequence[str], outs: Sequence[Path]
) -> list[Output]:
    """The outputs to write. Each --format belongs to the --out at the same position; a single one
    without --out is printed. Exits 2 if they do not match."""
    for name in formats:
        if name not in FORMATS:
            refuse([f"--format {name}: is none of {', '.join(FORMATS)}"])
    if len(outs) != len(formats) and (outs or len(formats) > 1):
        given = f"{counted(len(formats), 'time')}, --out {counted(len(outs), 'time')}"
        refuse([f"--format is given {given}; give each --format an --out"])
    places: list[Path | None] = [*outs] or [None] * len(formats)
    found = [Output("--json", "json", None)] * as_json
    found += [Output("--junit", "junit", junit)] * (junit is not None)
    found += [Output("--out", name, place) for name, place in zip(formats, places)]
    if sum(one.path is None for one in found) > 1:
        refuse(["--json and --format: one of them can be printed; give --format an --out"])
    return found


def grading_of(points: Path | None, id_pattern: str, hints: str) -> Grading:
    """The `Grading` of these options; exits 2 if one is invalid."""
    if hints not in HINTS:
        refuse([f"--hints {hints}: is none of {', '.join(HINTS)}"])
    try:
        pattern = re.compile(id_pattern) if id_pattern else None
        given = read_points(points or DEFAULT)
        if without := [task for task in read_points() if task not in given]:
            say(f"--points {points}: gives no points for task {', '.join(without)}")
        return Grading(given, pattern, hints == "low")
    except BadPoints as fault:
        refuse([f"--points {fault}"])
    except re.error as fault:
        refuse([f"--id-pattern {id_pattern}: is no regular expression: {fault}"])


HINTS = ("full", "low")


def marks_of(
    path: Path,
    checks: Sequence[FileCheck],
    grading: Grading,
    not_read: Sequence[str],
    beside: Mapping[Path, Sequence[str]],
    scenes: Sequence[Smallest],
) -> list[Marked]:
    """The marks of each file; warns on standard error about doubtful ids.

    beside: the solvers that are `passed_over` for each file; scenes: for a single file, those that
    show its faults.
    """
    pattern, within = grading.id_pattern, [one.path for one in checks]
    ids = [id_of(file, path, pattern) for file in within]
    if pattern is not None:
        odd = [str(file) for file in within if not matched(file, path, pattern)]
        if odd:
            say(f"--id-pattern does not match {named(odd)}: its folder or file name is the id")
    if twice := [name for name, times in Counter(ids).items() if times > 1]:
        say(f"the same id for several files: {named(twice)}")
    return [
        Marked(
            name,
            one,
            path,
            grading.points,
            grading.low,
            not_read,
            scenes,
            beside[one.path],
            matched(one.path, path, pattern),
        )
        for name, one in zip(ids, checks)
    ]


def submission_of(path: Path) -> list[Path]:
    """The solver of one student: the file `path`, or `chosen_of` that folder. A folder of one
    student with older versions in it looks like a class, so that no folder is refused."""
    if not path.is_dir():
        return files_of(path)
    return chosen_of(path, solvers_below(path))


def chosen_of(folder: Path, found: Sequence[Path]) -> list[Path]:
    """The solver of the student whose folder this is, of those found in it: one with a name of the
    exercise, if there are some, and of several the one whose folder holds all others, such as
    older versions. The folder itself if none or two fit."""
    fitting = [file for file in found if file.name.lower() in EXPECTED] or found
    above = [one for one in fitting if all(file.is_relative_to(one.parent) for file in fitting)]
    return above if len(above) == 1 else [folder]


def student_of(file: Path, folder: Path) -> Path:
    """The student's folder in a class, or the file if it lies in the class itself."""
    return folder / file.relative_to(folder).parts[0] if file != folder else file


def passed_over(file: Path, folder: Path) -> list[str]:
    """The other solvers in a student's folder, of which `file` is judged; none if none is."""
    if not file.is_file():
        return []
    return [place_of(other, folder) for other in solvers_below(folder) if other != file]


def refused_folder(folder: Path) -> FileCheck:
    """The message on a submission without a solver, or with several."""
    files = [place_of(file, folder) for file in solvers_below(folder)]
    if not files:
        return check_file(folder)
    why = f"holds {len(files)} solvers: {named(files)}; hand in one, named Exercise.js or solver.py"
    return FileCheck(folder, [], f"{folder}: {why}")


def files_of(path: Path) -> list[Path]:
    """The file, or the solver of each student of a class, sorted by name; exits 2 if there are
    none.

    A folder stands for a student whose solver cannot be told (`chosen_of`). Dangling links are
    included, and so are entries of students without a solver: an archive, a PDF, or a folder that
    `is_missing`.
    """
    try:
        there = path.exists()
    except OSError as fault:  # for example a name of 300 letters
        refuse([f"{path}: {fault.strerror or fault}; name a file or a folder"])
    if not there:
        refuse([f"{path}: is not there; name an Exercise.js, a solver.py or a folder of them"])
    if not path.is_dir():
        return [path]
    found = solvers_below(path)
    if not found:
        refuse([f"{path}: {nothing_in(path)}"])
    owners: dict[str, list[Path]] = {}
    for file in found:
        owners.setdefault(file.relative_to(path).parts[0], []).append(file)
    loose = sum(file.parent == path for file in found)
    foldered = 2 * loose < len(found)
    missing = [
        one
        for one in visible(path.iterdir())
        if one.name not in owners
        and (one.suffix.lower() in HANDED_IN if one.is_file() else is_missing(one, foldered))
    ]
    chosen = [one for name, mine in owners.items() for one in chosen_of(path / name, mine)]
    return sorted(chosen + missing, key=alphabetical)


def solvers_below(folder: Path) -> list[Path]:
    """The files that may be solvers, and dangling links, sorted by name."""
    return sorted(
        file
        for file in folder.rglob("*")
        if not any(part.startswith(NOBODYS) for part in file.relative_to(folder).parts)
        and file.suffix.lower() in KINDS
        and (file.is_file() or dangling(file))
        # what the exercise's page loads beside a student's file
        and not (file.match(HANDED_OUT) or file.name == "mainScript.js")
    )


def alphabetical(path: Path) -> tuple[str, Path]:
    """A key for the order of a list of names: a letter with an accent is at the letter."""
    letters = normalize("NFKD", path.as_posix())
    return "".join(one for one in letters if not combining(one)).casefold(), path


def visible(paths: Iterable[Path]) -> list[Path]:
    """The paths that a person, not a program, may have put there."""
    return [path for path in paths if not path.name.startswith(NOBODYS)]


def is_missing(path: Path, foldered: bool) -> bool:
    """Whether a folder without a solver stands for a student: if most students have a folder
    (`foldered`), if it is empty, or if it holds what students hand in instead of a solver."""
    if not path.is_dir():
        return False
    inside = visible(path.rglob("*"))
    return foldered or not inside or any(one.suffix.lower() in HANDED_IN for one in inside)


def others_in(folder: Path, files: Sequence[Path]) -> list[str]:
    """The names of entries of the folder without a row: files that cannot be solvers, and folders
    without one, which end in a slash."""
    with_row = {file.relative_to(folder).parts[0] for file in files}
    return sorted(
        f"{one.name}/" if one.is_dir() else one.name
        for one in visible(folder.iterdir())
        if one.name not in with_row and (one.is_dir() or one.suffix.lower() not in KINDS)
    )


def places_for(page: Path | None, outputs: Sequence[Output]) -> None:
    """Exit 2, before anything is checked, if an output cannot be written, or would replace a file
    of another origin."""
    taken = {} if page is None else {os.path.realpath(page): "is where the page goes"}
    if page is not None:
        place_for("--page", page, PAGE, "page of a check")
    for option, name, path in outputs:
        if path is None:
            continue
        if why := taken.get(os.path.realpath(path)):
            refuse([f"{option} {path}: {why}; name another file"])
        taken[os.path.realpath(path)] = "is named twice"
        kind = FORMATS[name]
        what = "JUnit file of a check" if name == "junit" else f"{name} file of a check"
        place_for(option, path, kind.mark, what, kind.sealed)


def place_for(option: str, path: Path, mark: bytes, what: str, seals: bool = True) -> None:
    """Exit 2 unless a file may be written there."""
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        may_overwrite(path, mark, what, option, seals)
    except FolderTaken as fault:
        refuse([str(fault)])
    except OSError as fault:
        refuse([f"{option} {path}: {fault.strerror or fault}; name another file"])


def say_protection(files: Sequence[Path], several: bool, asking: Asking) -> None:
    """Say what keeps Python files from the machine; exits 2 if nothing does, for a folder."""
    for name in asking.packages:
        if name not in files_of_packages((name,)):
            refuse([f"--package {name}: is not installed, or is a part of this program"])
    if not any(file.suffix.lower() == ".py" for file in files):
        return
    level = protection()
    if several and level == Level.NONE and not asking.unprotected:
        refuse([f"{UNPROTECTED}; --unprotected checks them with all your permissions"])
    say(PROTECTED[level])


UNPROTECTED = "nothing here keeps the Python files of others from this machine"
PROTECTED = {
    Level.BUBBLEWRAP: "Python files run in a sandbox (bubblewrap)",
    Level.USER: "Python files run as another user, without a sandbox: they can read what all may",
    Level.NONE: f"{UNPROTECTED}: they run with all your permissions",
}


def checked(
    files: Sequence[Path],
    seed: int = 0,
    packages: Sequence[str] = (),
    homes: Mapping[Path, Path] = MappingProxyType({}),
    store: Store | None = None,
) -> list[FileCheck]:
    """The checks in order, one worker per core, which can always be stopped. Files with the same
    text are judged once. Those of which the clock has ended a call are asked once more at the end,
    each alone: marks do not depend on how busy the machine is.

    homes: in a class file -> its student's folder, or the file itself. store: has a row for each
    text that was checked.
    """
    alike: dict[Hashable, list[Path]] = {}
    for file in files:
        alike.setdefault(identity_of(file, homes.get(file)), []).append(file)
    firsts = [same[0] for same in alike.values()]
    keys, done = {}, dict[Path, FileCheck]()
    if store is not None:
        within = packages_distributions() if packages else {}
        installed = [version(of) for name in packages for of in within.get(name, ())]
        asked = seed, *packages, *installed, source_hash(CHECK_SOURCE)
        # a file that is no solver has no text by which it is known
        keys = {
            same[0]: content_key(text, *asked)
            for text, same in alike.items()
            if isinstance(text, tuple)
        }
        for file, key in keys.items():
            if row := store.get("check", key):
                done[file] = from_row(row.value, file, homes.get(file))
    missing = [file for file in firsts if file not in done]
    done |= ask_all(missing, os.cpu_count() or 1, seed, packages, homes, store, keys)
    if late := [file for file in firsts if done[file].waited]:
        done |= ask_all(late, 1, seed, packages, homes, store, keys)
    for first, *others in alike.values():
        done |= {file: named_for(file, done[first], homes.get(file)) for file in others}
    if len(files) > 1:
        once = f", with {counted(len(firsts), 'different text')}: the same text is judged once"
        say(f"checked {counted(len(files), 'submission')}{once * (len(firsts) < len(files))}")
    return [done[file] for file in files]


def ask_all(
    files: Sequence[Path],
    workers: int,
    seed: int,
    packages: Sequence[str],
    homes: Mapping[Path, Path],
    store: Store | None,
    keys: Mapping[Path, str],
) -> dict[Path, FileCheck]:
    """The check of each file, `workers` at once; those with a key become rows as they end."""
    if not files:
        return {}
    tasks: dict[Hashable, Any] = {
        file: partial(check_here, file, seed, tuple(packages), homes.get(file)) for file in files
    }
    done: dict[Path, FileCheck] = {}
    results = run_all(tasks, min(workers, len(tasks)), CHECKING)
    with closing(results), Progress() as progress:
        progress.start(len(tasks), len(tasks), f"checking {printable(files[0].name)}")
        for key, one in results:
            file = Path(str(key))
            done[file] = not_checked(file, one) if isinstance(one, Failure) else one
            if store is not None and file in keys and not isinstance(one, Failure):
                store.put("check", keys[file], as_row(one))
            progress.done(f"checked {printable(str(file.relative_to(file.parent.parent)))}")
    return done


def check_here(
    file: Path, seed: int, packages: Sequence[str], within: Path | None = None
) -> FileCheck:
    """In a worker: the check of a file."""
    return refused_folder(file) if file.is_dir() else check_file(file, seed, packages, within)


def identity_of(file: Path, within: Path | None = None) -> Hashable:
    """A key that is equal for two files only if their checks must agree; for a file that is no
    solver, its path. A Python file can read its own name."""
    try:
        solver = read_solver(file, within)
    except NotASolver:
        return file
    name = file.name if solver.kind == "python" else ""
    return solver.kind, solver.text, solver.imported, name


def named_for(file: Path, one: FileCheck, within: Path | None = None) -> FileCheck:
    """The check of a file with the same text, as that of this file."""
    solver = None if one.solver is None else read_solver(file, within)
    refused = one.refused.replace(printable(str(one.path)), printable(str(file)))
    return replace(one, path=file, solver=solver, refused=refused)


def as_row(one: FileCheck) -> dict[str, Any]:
    values = {name: getattr(one, name) for name in ("refused", "restitution", "seconds", "waited")}
    is_solver, rows = one.solver is not None, [asdict(row) for row in one.rows]
    return values | {"path": str(one.path), "is_solver": is_solver, "rows": rows}


def from_row(value: Mapping[str, Any], file: Path, within: Path | None) -> FileCheck:
    """The check that a row keeps of a file with this text."""
    rest = dict(value)
    path, is_solver, rows = (rest.pop(name) for name in ("path", "is_solver", "rows"))
    solver = read_solver(file, within) if is_solver else None
    checked_rows = [CheckRow(**row | {"lines": [*map(tuple, row["lines"])]}) for row in rows]
    return named_for(file, FileCheck(Path(path), checked_rows, solver=solver, **rest), within)


def not_checked(file: Path, failure: Failure) -> FileCheck:
    """The check of a file whose check was not completed."""
    return FileCheck(file, [], f"{file}: could not be checked: {failure.status}: {failure.reason}")


def scenes_of(one: FileCheck) -> list[Smallest]:
    """The smallest scene that shows each fault with a sentence, if one is found."""
    if not one.faults or one.restitution is None or one.solver is None:
        return []
    search = partial(scenes_here, one.solver, one.restitution, one.findings, keeps_state(one.rows))
    with closing(run_all({one.path: search}, 1, CHECKING)) as results, Progress() as progress:
        progress.say("looking for the smallest scene that shows each fault")
        [(_, found)] = results
    return [] if isinstance(found, Failure) else found  # the rows say how it failed


def make_page(path: Path, marked: Sequence[Marked], several: bool) -> None:
    """Write the page of a file, or that of a class, and print its path; exits 2 if that fails."""
    # not needed without a page, and slow to import
    from crosscheck2d.reports.check.class_page import write_class_page
    from crosscheck2d.reports.check.page import write_page

    try:
        write_class_page(path, marked) if several else write_page(path, marked[0])
    except OSError as fault:
        say(f"--page {path}: {fault.strerror or fault}; name another file")
        sys.exit(BAD_INPUT)
    say(f"{path.resolve()}")


def scenes_here(
    solver: SolverText, restitution: float, findings: Sequence[CheckRow], afresh: bool
) -> list[Smallest]:
    """In a worker: the smallest scenes that show these faults of a solver; none if the solver
    fails."""
    from crosscheck2d.reports.check.smallest import smallest_scenes

    try:
        with SolverProcess(solver) as process:
            return smallest_scenes(process, restitution, findings, afresh)
    except SolverFailed:
        return []


def write(output: Output, text: str) -> None:
    """Write a requested file; exits 2 if that fails."""
    assert output.path is not None
    try:
        put_text(output.path, text)
    except OSError as fault:
        why = fault.strerror or fault
        refuse([f"{output.option} {output.path}: {why}; name a file that can be written"])
    say(f"{output.path.resolve()}")
