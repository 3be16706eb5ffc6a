"""Somebody's own solver in the game: one that cannot fly is reported before; one that dies in
flight leaves the others."""

from __future__ import annotations

import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep

import pytest
from playwright.sync_api import Browser, Page
from websockets.sync.client import connect

from adapters.engines import ENGINES
from reports.commands.serve import application
from reports.game.command import PATIENCE, own_rows
from reports.game.server import Game
from reports.page import server
from tests.reports.game.test_page import fly
from tests.reports.page.browsing import opened, served
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck

SOLVER = Path(__file__).parents[3] / "tests" / "solvers" / "correct" / "plain.js"
# Appended to a right solver: from the given call of `integrate` on it does this. A frame of 21
# disks has 336 calls.
AFTER = (
    "\ncalls = 0; good = integrate; integrate = function (s, dt) {{ if (++calls > {calls}) {act};"
    " good(s, dt); }};\n"
)
FOREVER = "while (true) {}"


def solver(folder: Path, more: str = "") -> Path:
    """A solver's file that is right but for `more` at its end."""
    path = folder / "Exercise.js"
    path.write_text(SOLVER.read_text() + more)
    return path


@contextmanager
def page_of(browser: Browser, path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    """The game, paused at its first frame, with this solver solid and the reference as its
    ghost."""
    rows = own_rows([f"{path}:own"])
    for name, row in rows.items():
        monkeypatch.setitem(ENGINES, name, row)
    with served(application(Game([*rows, "reference:exercise"]))) as url:
        page, heard = opened(
            browser, url, viewport={"width": 400, "height": 800}, reduced_motion="reduce"
        )
        page.wait_for_function("() => game.field")
        yield page
        page.context.close()
    assert heard == []


def test_a_right_solver_flies_as_the_reference_does(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Under its file's name, the ship under thrust in both."""
    with page_of(browser, solver(tmp_path), monkeypatch) as page:
        page.keyboard.down("w")
        fly(page, 20)
        reported = page.evaluate(
            "game.now.flyers.map((flyer) => [flyer.left, flyer.ship_deviation])"
        )
        who = page.locator("tr.solid .who").inner_text()
        wide = page.evaluate(
            "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        )

    assert reported[0] == ["", 0.0]
    assert reported[1][0] == ""
    assert reported[1][1] < 1e-9
    assert who == "Exercise.js:own"
    assert wide <= 0


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        ("throw new Error('out of fuel')", "out of fuel"),
        pytest.param(FOREVER, "does not come back", marks=pytest.mark.slow),
    ],
)
def test_a_solver_that_dies_in_flight_leaves_and_the_others_fly_on(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, act: str, reason: str
):
    """Whether it throws or hangs: the page says so in the field and in its row, and the ghost
    becomes solid."""
    path = solver(tmp_path, AFTER.format(calls=3000, act=act))
    with page_of(browser, path, monkeypatch) as page:
        began = monotonic()
        fly(page, 30)
        took = monotonic() - began
        banner = page.locator("#banner").inner_text()
        row = page.locator("tr[data-engine$=':own'] [data-cell=diverged]").inner_text()
        solid, frame = page.evaluate("[game.field.engines[game.now.solid], game.now.frame]")

    assert frame == 30
    assert solid == "reference:exercise"
    assert row.startswith("left: ")
    assert reason in row
    assert banner.startswith("Exercise.js left: ")
    assert reason in banner
    assert took < 10 * PATIENCE


def test_the_page_says_that_it_waits(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """While an answer takes longer than a second; then why."""
    path = solver(tmp_path, AFTER.format(calls=400, act=FOREVER))
    with page_of(browser, path, monkeypatch) as page:
        page.evaluate("game.ask(4)")
        page.wait_for_function(
            "() => document.getElementById('banner').textContent.startsWith('Waiting')"
        )
        page.wait_for_function("() => !game.waiting", timeout=10_000 * PATIENCE)
        banner = page.locator("#banner").inner_text()

    assert banner.startswith("Exercise.js left: ")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("function integrate(sphere, dt) {", "SyntaxError"),
        ("var nothing = 0;", "has no function integrate"),
        ("throw new Error('not today')", "not today"),
        (
            SOLVER.read_text() + "\nintegrate = function () { throw new TypeError('of what?'); };",
            "of what?",
        ),
        (
            SOLVER.read_text() + "\nintegrate = function (s) { s.position.x = NaN; };",
            "position of disk 0 is not finite",
        ),
        ("\0\1\2", "is not text"),
    ],
)
def test_a_file_that_cannot_fly_is_reported_before_anything_is_served(
    text: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """One line that names the file, exit 2."""
    (tmp_path / "Exercise.js").write_text(text)
    monkeypatch.setattr(server, "serve", lambda *_: pytest.fail("it was served"))
    done = crosscheck("play", "--engine", "Exercise.js", "--engine", "reference", cwd=tmp_path)

    assert done.returncode == 2
    assert done.stderr.startswith("Exercise.js: ")
    assert done.stderr.count("Exercise.js") == 1
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_every_file_that_cannot_fly_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A line each; the good one is not named, and none of them is left among the engines."""
    monkeypatch.setattr(server, "serve", lambda *_: pytest.fail("it was served"))
    shutil.copy(SOLVER, tmp_path / "good.js")
    (tmp_path / "a.js").write_text("(")
    (tmp_path / "b.js").write_text("var nothing = 0;")
    before = list(ENGINES)
    words = [word for name in ("a.js", "good.js", "b.js") for word in ("--engine", name)]
    done = crosscheck("play", *words, cwd=tmp_path)

    assert done.returncode == 2
    assert [line.split(":")[0] for line in done.stderr.splitlines()] == ["a.js", "b.js"]
    assert list(ENGINES) == before


def test_a_solver_that_hangs_keeps_no_other_tab_waiting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The engines of each tab work in a thread of their own."""
    path = solver(tmp_path, AFTER.format(calls=400, act=FOREVER))
    for name, row in own_rows([f"{path}:own"]).items():
        monkeypatch.setitem(ENGINES, name, row)
    with served(application(Game(["reference:exercise"]))) as url:
        address = url.replace("http", "ws") + "/fly"
        with connect(address, origin=url) as stuck, connect(address, origin=url) as other:  # type: ignore[arg-type]
            stuck.recv(timeout=20), other.recv(timeout=20)
            stuck.send(f'{{"do": "fly", "engines": ["{path}:own"]}}')
            stuck.recv(timeout=20)
            stuck.send('{"do": "frames", "count": 4}')
            began = monotonic()
            for _ in range(20):
                other.send('{"do": "frames", "count": 1}')
                other.recv(timeout=20)
            took = monotonic() - began
            late = monotonic()
            answer = stuck.recv(timeout=60)
            waited = monotonic() - late + took

    assert took < 0.8 * waited
    assert waited > PATIENCE
    assert "does not come back" in answer


def test_ctrl_c_while_a_solver_hangs_stops_it_cleanly(tmp_path: Path):
    """As soon as the patience with it is at its end: exit 0, and nothing but where it was and that
    it has stopped."""
    solver(tmp_path, AFTER.format(calls=400, act=FOREVER))
    words = [CROSSCHECK, "play", "--port", "8300", "--engine", "Exercise.js"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    ) as started:
        assert started.stdout is not None
        url = started.stdout.readline().split()[0].rstrip("/")
        with connect(url.replace("http", "ws") + "/fly", origin=url) as tab:  # type: ignore[arg-type]
            tab.recv(timeout=20)
            for _ in range(2):
                tab.send('{"do": "frames", "count": 4}')
            sleep(0.3)
            began = monotonic()
            started.send_signal(signal.SIGINT)
            out, complaints = started.communicate(timeout=60)
            took = monotonic() - began

    assert (started.returncode, out) == (0, "Stopped.\n")
    assert [line for line in complaints.splitlines() if "is taken" not in line] == []
    assert took < 10 * PATIENCE


@pytest.mark.slow
def test_any_name_of_a_folder_will_do(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Spaces, umlauts, quotes, brackets: the solver flies, and can be left out and made solid
    again."""
    folder = tmp_path / 'Übung "zwei" <b>]'
    folder.mkdir()
    with page_of(browser, solver(folder), monkeypatch) as page:
        page.locator("[name=solid][value='reference:exercise']").check()
        page.wait_for_function("() => game.field.engines[0] === 'reference:exercise'")
        page.locator("tr[data-engine$=':own'] [name=flies]").uncheck()
        page.wait_for_function("() => game.field.engines.length === 1")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["Exercise.js"], "Exercise.js: is a solver and no flight; fly it by --engine Exercise.js"),
        ([""], '"": is not there; name a file'),
        (
            [word for k in range(17) for word in ("--engine", f"{k}.js")],
            "--engine: 17 engines; at most 16 fly at once",
        ),
    ],
)
def test_what_is_asked_wrongly_is_reported(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """One line, exit 2, before anything is served: not a page that cannot begin."""
    monkeypatch.setattr(server, "serve", lambda *_: pytest.fail("it was served"))
    solver(tmp_path)
    for k in range(17):
        shutil.copy(SOLVER, tmp_path / f"{k}.js")
    done = crosscheck("play", *words, cwd=tmp_path)

    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert said in done.stderr
