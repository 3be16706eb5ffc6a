"""Somebody's own solver in the game: one that cannot fly is reported before; one that dies in
flight leaves the others."""

from __future__ import annotations

import re
import signal
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page
from websockets.sync.client import connect

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.host.engine import TEMPLATES, row_of_file
from crosscheck2d.adapters.host.process import SolverProcess
from crosscheck2d.reports.check.verdict import check_file
from crosscheck2d.reports.commands.own_solvers import checked
from crosscheck2d.reports.commands.serve import application
from crosscheck2d.reports.game.command import PATIENCE, game_of, own_rows
from crosscheck2d.reports.game.flight import FRAME, Flight, field_scenario
from crosscheck2d.reports.game.server import Game, labels
from crosscheck2d.reports.game.session import Session
from crosscheck2d.reports.page.kit import with_lines
from tests.bench.game import measure
from tests.reports.game.test_page import fly, paused
from tests.reports.page.browsing import opened, served
from tests.reports.terminal.command_line import CROSSCHECK
from tests.solvers.mutants import MUTANTS

pytestmark = pytest.mark.slow  # each starts solvers that fail

SOLVER = Path(__file__).parents[3] / "tests" / "solvers" / "correct" / "plain.js"
# Appended to a right solver: from the given call of `integrate` on it does this. A frame of 21
# disks has 336 calls.
AFTER = (
    "\ncalls = 0; good = integrate; integrate = function (s, dt) {{ if (++calls > {calls}) {act};"
    " good(s, dt); }};\n"
)
FOREVER = "while (true) {}"


def solver(folder: Path, more: str = "") -> Path:
    path = folder / "Exercise.js"
    path.write_text(SOLVER.read_text() + more)
    return path


@contextmanager
def page_of(browser: Browser, path: Path) -> Iterator[Page]:
    """The game with this solver solid and the reference as its ghost."""
    rows, _ = own_rows([f"{path}:own"])
    ENGINES.update(rows)
    app = application(Game([*rows, "reference:exercise"]))
    with served(app) as url, paused(browser, url, 400, 800) as page:
        yield page


def test_a_right_solver_flies_as_the_reference_does(browser: Browser, tmp_path: Path):
    with page_of(browser, solver(tmp_path)) as page:
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
    assert who == "Exercise.js"
    assert wide <= 0


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        ("throw new Error('out of fuel')", "out of fuel"),
        (FOREVER, "does not come back"),
    ],
)
def test_a_solver_that_dies_in_flight_leaves_and_the_others_fly_on(
    browser: Browser, tmp_path: Path, act: str, reason: str
):
    path = solver(tmp_path, AFTER.format(calls=3000, act=act))
    with page_of(browser, path) as page:
        began = monotonic()
        fly(page, 30)
        took = monotonic() - began
        banner = page.locator("#banner").inner_text()
        row = page.locator("tr[data-engine$=':own'] [data-cell=diverged]").inner_text()
        solid, frame = page.evaluate("[game.field.engines[game.now.solid], game.now.frame]")
        chosen = page.locator("[name=solid]:checked").get_attribute("value")
        then = page.locator("tr.solid [data-cell=diverged]").inner_text()
        page.wait_for_function("() => game.sky.last[3].length")
        [mark] = page.evaluate("game.sky.last[3].map((mark) => mark.text)")
        page.evaluate("game.field.seen = true")
        page.keyboard.press("n")
        page.wait_for_function("() => !game.field.seen")
        again = page.locator("[name=solid]:checked").get_attribute("value")

    assert (chosen, again) == ("reference:exercise", f"{path}:own")
    assert re.fullmatch(r"solid since 0\.\d\d s, when Exercise.js left", then)
    assert mark == "Exercise.js left"
    assert banner.endswith("; reference:exercise is solid from here on")
    assert frame == 30
    assert solid == "reference:exercise"
    assert row.startswith("left at 0.")
    assert reason in row
    assert banner.startswith("Exercise.js left at 0.")
    assert reason in banner
    assert took < 10 * PATIENCE


def test_the_page_says_that_it_waits(browser: Browser, tmp_path: Path):
    path = solver(tmp_path, AFTER.format(calls=400, act=FOREVER))
    with page_of(browser, path) as page:
        page.evaluate("game.ask(4)")
        page.wait_for_function(
            "() => document.getElementById('banner').textContent.startsWith('Waiting')"
        )
        page.wait_for_function("() => !game.waiting", timeout=10_000 * PATIENCE)
        banner = page.locator("#banner").inner_text()

    assert banner.startswith("Exercise.js left at 0.")


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        ("throw new TypeError('of what?')", "TypeError: of what?"),
        ("s.position.x = NaN", "position of disk 0 is not finite"),
    ],
)
def test_a_file_that_fails_in_its_first_step_starts_and_leaves(
    tmp_path: Path, act: str, reason: str
):
    path = solver(tmp_path, AFTER.format(calls=0, act=act))
    rows, _ = own_rows([f"{path}:own"])
    ENGINES.update(rows)
    flight = Flight(field_scenario(), [*rows, "reference:exercise"])
    flight.advance(2)
    left, right = flight.flyers
    flight.close()

    assert left.left.startswith(reason)
    assert left.left_at == FRAME
    assert (right.left, flight.solid, flight.frame) == ("", right, 2)


def test_a_solver_that_hangs_keeps_no_other_tab_waiting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = solver(tmp_path, AFTER.format(calls=400, act=FOREVER))
    for name, row in own_rows([f"{path}:own"])[0].items():
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
    solver(tmp_path, AFTER.format(calls=3000, act=FOREVER))
    words = [CROSSCHECK, "play", "--port", "8300", "--engine", "Exercise.js"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    ) as started:
        assert started.stdout is not None
        url = started.stdout.readline().split()[0].rstrip("/")
        with connect(url.replace("http", "ws") + "/fly", origin=url) as tab:  # type: ignore[arg-type]
            tab.recv(timeout=20)
            for _ in range(3):  # 12 frames, 16 steps of 21 disks each
                tab.send('{"do": "frames", "count": 4}')
            sleep(0.3)
            began = monotonic()
            started.send_signal(signal.SIGINT)
            out, complaints = started.communicate(timeout=60)
            took = monotonic() - began

    assert (started.returncode, out) == (0, "Stopped.\n")
    known = ("is taken", "by crosscheck check", "It was not checked within", "does not come back")
    assert [
        line for line in complaints.splitlines() if not any(words in line for words in known)
    ] == []
    assert took < 10 * PATIENCE


def test_any_name_of_a_folder_will_do(browser: Browser, tmp_path: Path):
    folder = tmp_path / 'Übung "zwei" <b>]'
    folder.mkdir()
    with page_of(browser, solver(folder)) as page:
        page.locator("[name=solid][value='reference:exercise']").check()
        page.wait_for_function("() => game.field.engines[0] === 'reference:exercise'")
        page.locator("tr[data-engine$=':own'] [name=flies]").uncheck()
        page.wait_for_function("() => game.field.engines.length === 1")


def test_a_faulty_solver_is_the_solid_ship_and_named(browser: Browser, tmp_path: Path):
    [faulty] = [mutant for mutant in MUTANTS if mutant.name == "normal_long.js"]
    files = [faulty.write(tmp_path), solver(tmp_path)]
    game = game_of(None, ["pymunk:shipped", "box2d:shipped", *map(str, files)])
    game.said = {f"{file}:own": with_lines(*checked(file)[1:3]) for file in files}
    with served(application(game)) as url:
        page, heard = opened(
            browser, url, viewport={"width": 1280, "height": 900}, reduced_motion="reduce"
        )
        page.wait_for_function("() => game.field")
        fly(page, 60)
        solid = page.evaluate("game.field.engines[game.now.solid]")
        label = page.evaluate("game.sky.last[0][game.sky.last[1]].label")
        said = page.locator(".said").all_inner_texts()
        inside = page.locator(".said details").first.evaluate("(box) => box.textContent")
        bottom = page.evaluate("document.querySelector('.engines').getBoundingClientRect().bottom")
        left = page.evaluate("game.now.flyers.map((flyer) => flyer.left)")
        page.context.close()

    assert heard == []
    assert (solid, label) == (f"{files[0]}:own", "normal_long.js")
    assert left == [""] * 4
    assert check_file(files[0]).sentences[0] in said[0]
    assert faulty.cause in said[0]
    assert "No fault found" in said[1]
    assert f"crosscheck check {files[0]}" in inside
    assert "exercise: " in inside
    assert bottom <= 900


def test_files_of_one_name_are_told_apart():
    names = ["/a/anna/Exercise.js:own", "/a/ben/Exercise.js:own", "/a/solver.py:own", "x:matched"]

    assert list(labels(names).values()) == [
        "anna/Exercise.js",
        "ben/Exercise.js",
        "solver.py",
        "x:matched",
    ]


def test_the_field_begins_with_the_restitution_of_the_file(tmp_path: Path):
    path = solver(tmp_path)
    path.write_text(path.read_text().replace("restitution = 0.9", "restitution = 0.5"))
    game = game_of(None, [str(path)])
    flight = Session(game.engines, restitution=game.restitution).flight
    flight.advance(4)
    left = [flyer.left for flyer in flight.flyers]
    flight.close()

    assert game.restitution == 0.5
    assert game.engines == [f"{path}:own", "reference:exercise", "event_driven:float64"]
    assert left == [""] * 3


@pytest.mark.parametrize(("collected", "exchanges"), [(True, 1), (False, 17)])
def test_a_frame_under_thrust_is_one_exchange_with_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, collected: bool, exchanges: int
):
    # Each goes through four threads of two processes: 17 of them, one a step and one to look, are
    # what slowed two files to two thirds of the clock.
    count = Counter[str]()

    def counted(self: SolverProcess, *arguments: Any) -> Any:
        count["exchanges"] += 1
        return exchange(self, *arguments)

    exchange = SolverProcess.exchange
    monkeypatch.setattr(SolverProcess, "exchange", counted)
    monkeypatch.setitem(ENGINES, "x:own", row_of_file(solver(tmp_path), collected=collected))
    flight = Flight(field_scenario(), ["x:own"])
    flight.key("w", True)
    before = count["exchanges"]
    flight.advance(20)
    flight.close()

    assert count["exchanges"] - before == 20 * exchanges


@pytest.mark.long
def test_two_files_and_two_engines_keep_the_clock(browser: Browser, tmp_path: Path):
    (tmp_path / "anna").mkdir()
    files = [str(solver(tmp_path)), str(solver(tmp_path / "anna"))]
    times, _, _ = measure(browser, 6.0, [*files, "reference:exercise", "pymunk:shipped"])
    engines, picture = (min(times[k]) for k in ("engines, for a frame", "to draw a picture"))

    assert engines + picture < 1e3 * FRAME


def test_an_engine_in_a_file_flies(tmp_path: Path):
    text = TEMPLATES["javascript"].read_text()
    path = tmp_path / "mine.js"
    path.write_text(text)
    rows, restitution = own_rows([f"{path}:own"])
    ENGINES.update(rows)
    flight = Flight(field_scenario(0, 5), [f"{path}:own", "reference:coulomb"])
    flight.key("w", True)
    flight.advance(20)
    mine, reference = flight.flyers
    flight.close()

    assert restitution == 0.9
    assert not mine.left
    assert np.abs(mine.state.position - reference.state.position).max() < 1e-12
    assert mine.state.velocity[0, 0] != field_scenario(0, 5).scene.velocity[0, 0]  # it was thrust
