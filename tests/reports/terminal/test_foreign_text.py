"""Text that others wrote reaches no terminal as markup or escape codes, and every file is written
in UTF-8."""

import ast
import json
import os
import unicodedata
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.table import Table

from crosscheck2d.reports.run.made import may_overwrite
from crosscheck2d.reports.terminal.console import Console
from crosscheck2d.reports.terminal.exits import say
from crosscheck2d.reports.terminal.foreign_text import legible, put_text
from crosscheck2d.reports.terminal.progress import Progress
from tests.reports.terminal.command_line import crosscheck

ROOT = Path(__file__).parents[3]
FILES = [
    path
    for folder in ("reference_impl", "scenarios", "adapters", "reports", ".ci")
    for path in sorted((ROOT / folder).rglob("*.py"))
    if "out" not in path.parts
]
HOSTILE = "[/nope] [red]x[/red] :warning: a\x1b[31mb\x1b]0;title\x07 c\rd \x9b2J \u202e \udcff"
SHOWN = "[/nope] [red]x[/red] :warning: a\\x1b[31mb\\x1b]0;title\\x07 c\\rd \\x9b2J \\u202e \\udcff"
SCENE = Path(__file__).parents[3] / "tests" / "data" / "scenes" / "two.toml"


@given(st.text(alphabet=st.characters()))
def test_legible_text_holds_nothing_that_acts_on_a_terminal(text: str):
    found = legible(text)

    assert not [c for c in found if unicodedata.category(c) in ("Cc", "Cf", "Cs") and c != "\n"]
    assert legible(found) == found
    assert legible("plain [text] Ü ×") == "plain [text] Ü ×"


def test_the_console_prints_markup_as_it_is(capsys: pytest.CaptureFixture[str]):
    table = Table(HOSTILE, title=HOSTILE)
    table.add_row(HOSTILE)
    console = Console(width=300)
    console.print(HOSTILE, highlight=False)
    console.print(HOSTILE, markup=True)
    console.print(table)
    with Progress() as progress:
        progress.say(HOSTILE)
        progress.note(HOSTILE)
        progress.start(1, 1, HOSTILE)
        progress.done(HOSTILE, "error", HOSTILE)
    say(HOSTILE)
    out, err = capsys.readouterr()

    assert out.count(SHOWN) == 5
    assert err.replace("\n", "").count(SHOWN[:20]) >= 3
    assert not set("\x1b\r\x07\x9b\u202e\udcff") & set(out)


@pytest.mark.parametrize("what", ["[/nope]", "\\u001b[31mred", "\\u0007", ":boom: [bold]"])
def test_the_question_of_a_scene_is_printed_as_it_is(tmp_path: Path, what: str):
    (tmp_path / "x.toml").write_text(
        SCENE.read_text().replace("Does a head-on collision", f"{what} Does a collision")
    )
    done = crosscheck("truth", "x.toml", cwd=tmp_path)
    (tmp_path / "x.toml").write_text(SCENE.read_text().replace('"two-disks"', f'"{what}"'))
    refused = crosscheck("truth", "x.toml", cwd=tmp_path)

    assert done.returncode == 0
    assert legible(json.loads(f'"{what}"')) in done.stdout
    assert refused.returncode == 2
    assert not set("\x1b\x07") & set(done.stdout + refused.stderr)


def test_only_one_console_prints():
    users = {
        str(path.relative_to(ROOT))
        for path in FILES
        if "rich.console" in path.read_text(encoding="utf-8")
    }
    markup = {
        str(path.relative_to(ROOT))
        for path in FILES
        if "rich.markup" in path.read_text(encoding="utf-8")
    }

    assert (users, markup) == ({"reports/terminal/console.py"}, set())


def without_encoding(source: str) -> list[int]:
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        called = (
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        )
        owner = node.func.value if isinstance(node.func, ast.Attribute) else None
        if (
            isinstance(owner, ast.Name)
            and owner.id in ("os", "webbrowser", "Image")
            and called == "open"
        ):
            continue  # a descriptor, a page, a picture
        given = {word.arg: word.value for word in node.keywords}
        modes = [
            mode.value for mode in (*node.args, *given.values()) if isinstance(mode, ast.Constant)
        ]
        binary = any(
            isinstance(mode, str) and "b" in mode and set(mode) <= set("rwaxb+") for mode in modes
        )
        as_text = called in ("read_text", "write_text", "TextIOWrapper") or (
            called in ("open", "fdopen") and not binary
        )
        if (
            as_text or ("text" in given and called in ("run", "Popen"))
        ) and "encoding" not in given:
            found.append(node.lineno)
    return found


def test_every_file_names_its_encoding():
    lines = {
        str(path.relative_to(ROOT)): without_encoding(path.read_text(encoding="utf-8"))
        for path in FILES
    }

    assert len(lines) > 100
    assert {path: found for path, found in lines.items() if found} == {}


def test_a_file_that_names_none_is_found():
    bad = ["p.read_text()", "p.open('w')", "open(p)", "os.fdopen(1, 'w')", "run(c, text=True)"]
    good = ["open(p, 'rb')", "open(p, encoding='utf-8')", "p.read_bytes()", "os.open(p, 1)"]

    assert without_encoding("\n".join([*bad, *good])) == [1, 2, 3, 4, 5]


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path, link = tmp_path / "a", tmp_path / "link"
    put_text(path, "old")
    link.symlink_to("a")

    def full(*_: Path) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(OSError, match="No space"):
            put_text(path, "new")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a", "link"]
    assert path.read_text() == "old"
    put_text(link, "new a\udcffb")  # a path that is not UTF-8 is written in code
    assert (link.is_symlink(), path.read_text()) == (True, "new a\\udcffb")


def test_what_is_written_to_a_pipe_by_its_descriptor_arrives():
    reading, writing = os.pipe()
    with open(reading, "rb") as pipe:
        with open(writing, "wb"):
            # as `--page /dev/stdout` of a command in a pipe: a link to what has no path
            put_text(Path(f"/dev/fd/{writing}"), "all of it")
        assert pipe.read() == b"all of it"


@pytest.mark.slow
@pytest.mark.parametrize("option", ["--page", "--junit"])
def test_a_file_that_a_check_did_not_write_is_not_written_over(tmp_path: Path, option: str):
    (tmp_path / "solver.py").write_text("def integrate(sphere, dt):\n    pass\n")
    (tmp_path / "mine.html").write_text("years of work")
    (tmp_path / "link.html").symlink_to("mine.html")
    (tmp_path / "gone.html").symlink_to("nowhere/gone.html")
    names = sorted(path.name for path in tmp_path.rglob("*"))
    for name in ("mine.html", "link.html", "gone.html", "nowhere/new.html", "."):
        done = crosscheck("check", "solver.py", option, name, cwd=tmp_path)
        assert done.returncode == 2
        assert f"{option} {name}: " in done.stderr
    may_overwrite(Path(os.devnull), b"mark", "page", option)

    assert sorted(path.name for path in tmp_path.rglob("*")) == names
    assert (tmp_path / "mine.html").read_text() == "years of work"
