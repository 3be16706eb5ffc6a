"""Nothing that is somebody else's is replaced, moved or written over: whatever it is called,
wherever it lies."""

from __future__ import annotations

import json
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from reports.run.folders import RUN, begun, made_anew, replace_folder

from reports.commands import run as run_command
from reports.run.made import (
    MADE,
    FolderKind,
    Made,
    foreign_file_in,
    may_overwrite,
    put_made,
    read_made,
    writing,
)
from reports.terminal.exits import FolderTaken
from reports.terminal.foreign_text import put_text, whole
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck

pytestmark = pytest.mark.slow  # each is a command with a folder of its own

SCENE = (Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml").read_text()
ONE = ("--engine", "reference:exercise", "--dt", "0.02")
AGAIN = ("run", "my.toml", *ONE, "--out", "out")
# Not every pair in the fast suite, but each member of every pair.
THOROUGH = pytest.mark.long
# A command line of each that makes a folder.
COMMANDS = {
    "run": AGAIN,
    "speed": ("speed", "free_fall", "--engine", "reference:exercise", "--out", "out"),
    "stability": ("stability", "slow_collision", "--out", "out"),
    "tune": ("tune", "pymunk", "--out", "out"),
    "lesson": ("lesson", "--export", "out"),
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished run of a scene file."""
    base = tmp_path_factory.mktemp("finished")
    (base / "my.toml").write_text(SCENE)
    done = crosscheck(*AGAIN, cwd=base)
    assert done.returncode == 0, done.stderr
    return base / "out"


@pytest.fixture
def here(finished: Path, tmp_path: Path) -> Path:
    """Where a copy of that run is, and its scene."""
    shutil.copytree(finished, tmp_path / "out")
    (tmp_path / "my.toml").write_text(SCENE)
    return tmp_path


def all_of(folder: Path) -> dict[str, object]:
    """Every path below a folder, with its bytes, where it leads, or of what kind it is."""
    found: dict[str, object] = {}
    for path in sorted(folder.rglob("*")):
        mode = path.lstat().st_mode
        plain = path.read_bytes() if stat.S_ISREG(mode) else stat.S_IFMT(mode)
        found[str(path.relative_to(folder))] = os.readlink(path) if path.is_symlink() else plain
    return found


def moved_and_linked(path: Path) -> None:
    """A link to where it has been moved: what people do when a disk is full."""
    path.rename(path.parent.parent / "elsewhere")
    path.symlink_to(path.parent.parent / "elsewhere")


def written(path: Path) -> None:
    """Somebody's own words."""
    path.parent.mkdir(exist_ok=True)
    path.write_text("years of work")


# What somebody may do to the folder of a run: path in it, how, and what is said of it.
MEDDLING: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "a file": ("notes.txt", written, "holds notes.txt, which crosscheck run did not make"),
    "a hidden file": (".notes", written, "holds .notes"),
    "a scene": (
        "scenes/mine.toml",
        written,
        "holds scenes/mine.toml, which crosscheck run did not make",
    ),
    "a trajectory": ("trajectories/mine.npz", written, "holds trajectories/mine.npz"),
    "a table": ("compared/mine.csv", written, "holds compared/mine.csv"),
    "a folder": ("mine", Path.mkdir, "holds mine, which"),
    "a folder in a folder": ("trajectories/mine/a.npz", written, "holds trajectories/mine, which"),
    "a folder named as a file": (
        "trajectories/0123456789abcdef.npz",
        Path.mkdir,
        "holds trajectories/0123456789abc",
    ),
    "a pipe": ("pipe", os.mkfifo, "holds pipe, which"),
    "a link": ("link", lambda path: path.symlink_to("/"), "holds link, which"),
    "a folder that was moved": ("trajectories", moved_and_linked, "holds trajectories, which"),
    "a page that was moved": ("report.html", moved_and_linked, "holds report.html, which"),
    "another page": (
        "report.html",
        written,
        "holds report.html, which is not as crosscheck run left it",
    ),
    "an edited table": ("deviations.csv", written, "holds deviations.csv, which is not as"),
    "an edited scene": (
        "scenes/two-disks.toml",
        written,
        "holds scenes/two-disks.toml, which is not as",
    ),
}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        pytest.param("out", AGAIN, id="finished-again"),
        pytest.param("out", ("run", "--resume", "out"), id="finished-resume", marks=THOROUGH),
        pytest.param("out.part", AGAIN, id="interrupted-again", marks=THOROUGH),
        pytest.param("out.part", ("run", "--resume", "out"), id="interrupted-resume"),
    ],
)
@pytest.mark.parametrize("what", MEDDLING)
def test_a_folder_in_which_somebody_has_put_something_stays_as_it_is(
    here: Path, what: str, name: str, words: tuple[str, ...]
):
    """Finished or interrupted, to be made again or to be gone on with: exit 2, one line that names
    it, no byte less."""
    if name != "out":
        (here / "out").rename(here / name)
    path, meddle, said = MEDDLING[what]
    meddle(here / name / path)
    before = all_of(here)
    done = crosscheck(*words, cwd=here)

    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert all_of(here) == before


def test_the_folder_of_a_run_is_known_for_what_it_is(finished: Path):
    """The control of the test above: where nobody has put anything, nothing is found; a run is no
    measurement."""
    assert foreign_file_in(finished, RUN) == ""
    assert {"machine.json", "scenes/two-disks.toml", "report.html"} <= set(
        read_made(finished).files
    )  # type: ignore[union-attr]
    assert (
        foreign_file_in(finished, FolderKind("crosscheck speed"))
        == "was made by crosscheck run, not by crosscheck speed"
    )


# What somebody's own folder may hold.
FOREIGN: dict[str, dict[str, str]] = {
    "scenes": {"scenes/a.toml": SCENE},
    "trajectories": {"trajectories/a.npz": "mine"},
    "a page": {"report.html": "<html>mine</html>"},
    "tables": {
        "matched.csv": "mine",
        "speed.csv": "mine",
        "limits.csv": "mine",
        "index.html": "mine",
    },
    "an empty journal and scenes": {"journal.jsonl": "", "scenes/a.toml": SCENE},
    "another journal": {"journal.jsonl": '{"dear": "diary"}\n{"header": "no"}'},
    "a journal as ours": {
        "journal.jsonl": '{"header": {"versions": {"crosscheck2d": "1"}}}\n',
        "scenes/a.toml": SCENE,
    },
    "another made.json": {"made.json": "[1, 2]", "report.html": "mine"},
    "a made.json that is torn": {"made.json": '{"command": "crosscheck r'},
    "a made.json of other types": {
        "made.json": '{"command": 1, "finished": 2, "files": 3}',
        "scenes/a.toml": SCENE,
    },
    "a made.json for what is no name": {
        "made.json": '{"command": "crosscheck run", "finished": true, "files": {}, "out": 5}',
        "scenes/a.toml": SCENE,
    },
    "a made.json of another command": {
        "made.json": '{"command": "make", "finished": true, "files": {}}'
    },
}


@pytest.mark.parametrize(
    ("command", "what"),
    [
        pytest.param(command, what, marks=() if command == "run" or what == "a page" else THOROUGH)
        for command in COMMANDS
        for what in FOREIGN
    ],
)
@pytest.mark.parametrize("name", ["out", "out.part"])
def test_no_command_writes_into_somebody_elses_folder(
    tmp_path: Path, command: str, what: str, name: str
):
    """Whatever its files are called; the first that is in the way is named. Only some commands
    write to OUT.part."""
    (tmp_path / "my.toml").write_text(SCENE)
    for path, text in FOREIGN[what].items():
        (tmp_path / name / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name / path).write_text(text)
    if name != "out" and command in ("tune", "lesson"):
        pytest.skip("makes a folder that is there for nobody else")
    before = all_of(tmp_path)
    done = crosscheck(*COMMANDS[command], cwd=tmp_path)

    assert done.returncode == 2
    assert " holds " in done.stderr or " was made by make, not by crosscheck " in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert all_of(tmp_path) == before


@pytest.mark.parametrize("name", ["out", "out.part"])
def test_a_scene_is_not_lost_to_the_run_that_plays_it(tmp_path: Path, name: str):
    """`run proj/scenes/a.toml --out proj`, and OUT inside the scenes' folder, and the scenes'
    folder itself."""
    (tmp_path / "out" / "scenes").mkdir(parents=True)
    (tmp_path / "out" / "scenes" / "a.toml").write_text(SCENE)
    if name != "out":
        (tmp_path / "out").rename(tmp_path / name)
    before = all_of(tmp_path)
    for out in ("out", "out.part/scenes" if name != "out" else "out/scenes"):
        done = crosscheck("run", f"{name}/scenes/a.toml", *ONE, "--out", out, cwd=tmp_path)
        assert done.returncode == 2
    assert all_of(tmp_path) == before


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("to", ["nowhere", "out"])
def test_a_link_to_nothing_is_refused(tmp_path: Path, command: str, to: str):
    """It may lead to a disk that is not there now; a link to itself leads nowhere either."""
    (tmp_path / "my.toml").write_text(SCENE)
    (tmp_path / "out").symlink_to(to)
    done = crosscheck(*COMMANDS[command], cwd=tmp_path)

    assert done.returncode == 2
    assert "out: is a link to nothing" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my.toml", "out"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [pytest.param(name, marks=[pytest.mark.long] * (name != "run")) for name in COMMANDS],
)
def test_where_there_is_no_current_folder_any_more_it_is_said(tmp_path: Path, command: str):
    """It was deleted under the feet of the command: exit 2, one line, nothing is made."""
    gone = (
        "import os, sys; os.mkdir('gone'); os.chdir('gone'); os.rmdir('../gone');"
        " os.execv(sys.argv[1], sys.argv[1:])"
    )
    words = [
        word if word != "my.toml" else "slow_collision"
        for word in COMMANDS[command]
        if word not in ("--dt", "0.02")
    ]
    done = subprocess.run(
        [sys.executable, "-c", gone, CROSSCHECK, *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )

    assert done.returncode == 2
    assert "No such file or directory" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_where_a_link_leads_is_replaced_there(here: Path):
    """The link stays, and a link in the place of OUT.part is somebody's."""
    (here / "out").rename(here / "far")
    (here / "out").symlink_to("far")
    (here / "far.part").symlink_to(here)
    refused = crosscheck(*AGAIN, cwd=here)
    (here / "far.part").unlink()
    done = crosscheck(*AGAIN, cwd=here)

    assert (refused.returncode, done.returncode) == (2, 0)
    assert "far.part: is a link" in refused.stderr
    assert os.readlink(here / "out") == "far"
    assert sorted(path.name for path in here.iterdir()) == ["far", "my.toml", "out"]


@pytest.mark.parametrize(
    "words", [(*AGAIN[:-1], "out.part"), ("run", "--resume", "out.part")], ids=["again", "resume"]
)
def test_an_interrupted_run_is_not_replaced_under_its_own_name(here: Path, words: tuple[str, ...]):
    """`--out OUT.part` would bury what has ended in it."""
    (here / "out").rename(here / "out.part")
    begun(here / "out.part", RUN, here / "out")
    before = all_of(here)
    done = crosscheck(*words, cwd=here)

    assert done.returncode == 2
    assert f"to go on with it, name {here / 'out'} to --resume" in done.stderr
    assert all_of(here) == before


def test_what_comes_during_a_run_is_kept_and_so_is_the_run(
    here: Path, monkeypatch: pytest.MonkeyPatch
):
    """Exit 1: both stay; when it is gone --resume puts the run in its place, and nothing is played
    again."""
    make_report = run_command.make_report

    def meddling(*words: object) -> object:
        (here / "out" / "notes.txt").write_text("mine")
        return make_report(*words)  # type: ignore[arg-type]

    monkeypatch.setattr(run_command, "make_report", meddling)
    before = all_of(here / "out")
    first = crosscheck(*AGAIN, cwd=here)
    after = all_of(here / "out")
    monkeypatch.undo()
    (here / "out" / "notes.txt").rename(here / "notes.txt")
    second = crosscheck("run", "--resume", "out", cwd=here)
    last = json.loads((here / "out" / "journal.jsonl").read_text().splitlines()[-1])

    assert first.returncode == 1
    assert "out: holds notes.txt, which crosscheck run did not make" in first.stderr
    assert f"crosscheck run --resume {here / 'out'}" in first.stderr
    assert after == before | {"notes.txt": b"mine"}
    assert second.returncode == 0, second.stderr
    assert last["footer"]["played"] == 0
    assert sorted(path.name for path in here.iterdir()) == ["my.toml", "notes.txt", "out"]


@pytest.mark.parametrize("name", ["report.html", "deviations.csv", "runs.csv"])
def test_a_report_is_not_written_over_somebody_elses(here: Path, name: str):
    """Exit 2; notes beside it are no hindrance, and stay, wherever they are."""
    for notes in ("notes.txt", "compared/notes.csv", "scenes/mine.toml"):
        written(here / "out" / notes)
    assert crosscheck("report", "out", cwd=here).returncode == 0
    written(here / "out" / name)
    before = all_of(here)
    done = crosscheck("report", "out", cwd=here)

    assert done.returncode == 2
    assert f"holds {name}, which is not as crosscheck run left it" in done.stderr
    assert all_of(here) == before
    assert "compared/notes.csv" in all_of(here / "out")


def folder(path: Path, finished: bool, text: str) -> Path:
    """A folder of a run that holds one file."""
    path.mkdir()
    put_made(path, Made(RUN.command, finished, {}))
    with writing(path, ["runs.csv"]):
        (path / "runs.csv").write_text(text)
    return path


@pytest.mark.parametrize("name", ["out", "o" * 250])
def test_what_is_replaced_is_there_again_if_that_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    """The second rename fails: both folders are as they were. A name as long as `.part` allows is
    no hindrance."""
    made, target = (
        folder(tmp_path / f"{name}.part", False, "new"),
        folder(tmp_path / name, True, "old"),
    )
    (tmp_path / f"{name[:250]}.old").write_text("somebody's own")
    rename = Path.rename

    def failing(path: Path, to: Path) -> Path:
        if path == made:
            raise OSError(28, "No space left on device")
        return rename(path, to)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", failing)
        with pytest.raises(OSError, match="No space left"):
            replace_folder(made, target, RUN)
    before = (made / "runs.csv").read_text(), (target / "runs.csv").read_text()
    replace_folder(made, target, RUN)

    assert before == ("new", "old")
    assert (target / "runs.csv").read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == [name, f"{name}.old"]


def test_what_was_killed_between_two_renames_is_gone_on_with(here: Path):
    """The old run stays aside, the new one is put in its place by --resume."""
    (here / "out").rename(here / "out.old")
    shutil.copytree(here / "out.old", here / "out.part")
    made = read_made(here / "out.part")
    assert made is not None
    put_made(here / "out.part", made._replace(out="out"))
    done = crosscheck("run", "--resume", "out", cwd=here)

    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in here.iterdir()) == ["my.toml", "out", "out.old"]


def test_what_was_being_written_when_it_was_killed_is_ours(tmp_path: Path):
    """A torn table, and the rest of a file that was not renamed, do not keep a run from being gone
    on with."""
    part = tmp_path / "out.part"
    part.mkdir()
    begun(part, RUN, tmp_path / "out")
    killed = writing(part, ["runs.csv"])
    killed.__enter__()  # and it never comes out of it
    (part / "runs.csv").write_text("scenario,eng")
    (part / ".crosscheck-4711.part").write_text("{")

    assert foreign_file_in(part, RUN) == ""
    (part / "report.html").write_text("not ours: nobody was writing it")
    assert "holds report.html" in foreign_file_in(part, RUN)


def test_what_is_refused_before_it_is_written_leaves_the_record_as_it_was(tmp_path: Path):
    """So that a table that somebody edits after that is still seen not to be ours."""
    begun(tmp_path, RUN, tmp_path)
    with writing(tmp_path, ["runs.csv"]):
        (tmp_path / "runs.csv").write_text("as it was played")
    before = (tmp_path / MADE).read_bytes()
    with pytest.raises(ZeroDivisionError), writing(tmp_path, ["runs.csv", "report.html"]):
        raise ZeroDivisionError
    assert (tmp_path / MADE).read_bytes() == before
    (tmp_path / "runs.csv").write_text("as I would have it")
    assert "holds runs.csv, which is not as" in foreign_file_in(tmp_path, RUN)


def test_what_is_made_anew_takes_its_place_whole_or_not_at_all(tmp_path: Path):
    """The folder of lessons, and of settings: the old one stays if it fails, or if somebody has put
    something there."""
    kind, target = FolderKind("crosscheck lesson"), tmp_path / "all"

    def make(text: str, fails: bool = False) -> None:
        with made_anew(target, kind, "--export") as part, writing(part, ["index.html"]):
            (part / "index.html").write_text(text)
            if fails:
                raise ZeroDivisionError

    make("first")
    with pytest.raises(ZeroDivisionError):
        make("torn", fails=True)
    assert all_of(tmp_path).keys() == {"all", "all/index.html", f"all/{MADE}"}
    assert (target / "index.html").read_text() == "first"
    make("second")
    assert (target / "index.html").read_text() == "second"
    (target / "notes.txt").write_text("mine")
    with pytest.raises(FolderTaken, match=r"holds notes\.txt"):
        make("third")
    assert all_of(tmp_path).keys() == {"all", "all/index.html", f"all/{MADE}", "all/notes.txt"}


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path):
    """The old one stays, no rest is left, a link stays a link, and what is no file is written
    to."""
    path, link = tmp_path / "page.html", tmp_path / "link.html"
    put_text(path, "old")
    link.symlink_to("page.html")
    with suppress(ZeroDivisionError), whole(path) as file:
        file.write(b"new")
        file.write(bytes(1 // 0))
    assert path.read_text() == "old"
    put_text(link, "new")
    put_text(Path(os.devnull), "nothing")

    assert path.read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.html", "page.html"]
    assert link.is_symlink()
    assert path.stat().st_mode == (tmp_path / "page.html").stat().st_mode & ~0o111


@pytest.mark.parametrize("option", ["--page", "--junit"])
def test_a_file_that_a_check_did_not_write_is_not_written_over(tmp_path: Path, option: str):
    """Neither somebody's page nor one behind a link; a link to nothing is no place."""
    (tmp_path / "solver.py").write_text("def integrate(sphere, dt):\n    pass\n")
    (tmp_path / "mine.html").write_text("years of work")
    (tmp_path / "link.html").symlink_to("mine.html")
    (tmp_path / "gone.html").symlink_to("nowhere/gone.html")
    before = all_of(tmp_path)
    for name in ("mine.html", "link.html", "gone.html", "nowhere/new.html", "."):
        done = crosscheck("check", "solver.py", option, name, cwd=tmp_path)
        assert done.returncode == 2
        assert f"{option} {name}: " in done.stderr
    may_overwrite(Path(os.devnull), b"mark", "page", option)

    assert all_of(tmp_path) == before


@pytest.mark.slow
def test_two_runs_at_once_are_one(finished: Path, here: Path):
    """The one that is second is refused, whichever that is; the folder is one of the two."""
    both = [
        subprocess.Popen([CROSSCHECK, *AGAIN], cwd=here, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    ended = [(one.communicate()[1], one.returncode) for one in both]

    assert sorted(code for _, code in ended) in ([0, 0], [0, 2])
    assert not [said for said, _ in ended if "Traceback" in said]
    assert (here / "out" / "deviations.csv").read_bytes() == (
        finished / "deviations.csv"
    ).read_bytes()
    assert sorted(path.name for path in here.iterdir()) == ["my.toml", "out"]
