"""The game's server serves this machine only, and is left well by whatever a page does."""

from __future__ import annotations

import http.client
import json
import re
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

import pytest
import uvicorn
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from crosscheck2d.adapters.box2d_v3 import Box2DV3
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.host.engine import TEMPLATES
from crosscheck2d.reports.commands.serve import application
from crosscheck2d.reports.game.flight import field_scenario
from crosscheck2d.reports.game.server import MOST_A_SECOND, MOST_FAULTS, Game
from crosscheck2d.reports.page import server
from crosscheck2d.reports.page.server import MOST_TABS
from tests.reports.game.test_flight import bits, flown
from tests.reports.page import browsing
from tests.reports.terminal.command_line import CROSSCHECK, crosscheck

FLOWN = ["reference:exercise", "pymunk:shipped"]
FRAME = json.dumps({"do": "frames", "count": 1})
SOLVER = Path(__file__).parents[2] / "solvers" / "correct" / "plain.js"
TOP = 'name = "a"\nduration = 1.0\nsample_interval = 0.5\nrestitution = {}\n'
DISK = "[[disk]]\nposition = [{}, 0.0]\nvelocity = [0.0, 0.0]\nradius = 0.1\nmass = 1.0\n"
TEMPLATE = TEMPLATES["javascript"].read_text()
FILES = {
    "bad.toml": TOP.format(2.0) + DISK.format(0.0),
    "crowd.toml": TOP.format(1.0) + "".join(DISK.format(x) for x in range(201)),
    "cut.js": "function integrate(sphere, dt) {",
    "empty.js": "var nothing = 0;",
    "throws.js": "throw new Error('not today')",
    "bytes.js": "\0\1\2",
    "walls.js": TEMPLATE.replace('models = "disks walls', 'models = "walls'),
    **{f"{k}.js": SOLVER.read_text() for k in range(17)},
}


class Served(NamedTuple):
    game: Game
    port: int

    def open(self, origin: str | None = "", **options: object) -> ClientConnection:
        """A tab; `origin` "": the server's own page."""
        origin = f"http://localhost:{self.port}" if origin == "" else origin
        return connect(f"ws://localhost:{self.port}/fly", origin=origin, **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    game = Game(FLOWN)
    with browsing.served(application(game)) as url:
        yield Served(game, urlsplit(url).port or 0)


def hear(tab: ClientConnection) -> dict:
    return json.loads(tab.recv(timeout=10))


def flood(tab: ClientConnection, text: str, count: int) -> None:
    for _ in range(count):
        tab.send(text)
    while True:
        hear(tab)


def still_flies(served: Served) -> bool:
    with served.open() as tab:
        first = hear(tab)
        tab.send(FRAME)
        return first["kind"] == "field" and hear(tab)["frame"] == 1


def no_tabs(served: Served) -> bool:
    for _ in range(100):
        if served.game.tabs == 0:
            return True
        time.sleep(0.01)
    return False


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "null",
        "http://evil.example",
        "http://localhost:1",
        "http://127.0.0.1.evil.example",
        "file://",
        "https://localhost:{port}",
        "http://localhost:{port}.evil.example",
        "http://127.0.0.1:{port}",
    ],
)
def test_pages_of_other_origins_cannot_drive_it(served: Served, origin: str | None):
    with (
        pytest.raises(InvalidStatus) as refusal,
        served.open(origin and origin.format(port=served.port)),
    ):
        pass

    assert refusal.value.response.status_code == 403
    assert still_flies(served)


def test_the_page_is_given_under_this_machines_names_only(served: Served):
    status = []
    for host in (f"localhost:{served.port}", "evil.example"):
        connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=10)
        connection.request("GET", "/", headers={"Host": host})
        status.append(connection.getresponse().status)

    assert status == [200, 400]


def test_malformed_messages_are_answered_and_then_cut_off(served: Served):
    with served.open() as tab:
        hear(tab)
        for text in ("{", '{"do": "jump"}', b"\xff\x00", '{"do": "frames", "count": 1e9}'):
            tab.send(text)
            assert hear(tab)["kind"] == "fault"
        tab.send(FRAME)
        assert hear(tab)["frame"] == 1
        with pytest.raises(ConnectionClosed, match=f"{MOST_FAULTS} faulty"):
            flood(tab, "{", MOST_FAULTS)

    assert still_flies(served)


def test_a_large_message_closes_its_tab_only(served: Served):
    with served.open() as tab, served.open() as other:
        hear(tab), hear(other)
        with pytest.raises(ConnectionClosed) as closed:
            flood(tab, "x" * 10_000_000, 1)
        other.send(FRAME)

        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1009
        assert hear(other)["frame"] == 1


def test_a_flood_closes_its_tab_only(served: Served):
    with served.open() as tab:
        hear(tab)
        with pytest.raises(ConnectionClosed, match=f"{MOST_A_SECOND} messages a second"):
            flood(tab, json.dumps({"do": "key", "key": "w", "down": True}), 5 * MOST_A_SECOND)

    assert still_flies(served)


def test_a_tab_that_does_not_read_holds_nobody_up(served: Served):
    with served.open(max_queue=1, close_timeout=0.1) as slow:
        for _ in range(100):
            slow.send(FRAME)
        assert still_flies(served)


def test_ten_tabs_fly_their_own_flights_and_give_them_back(served: Served):
    assert no_tabs(served)
    with ExitStack() as stack:
        tabs = [stack.enter_context(served.open()) for _ in range(10)]
        for tab in tabs:
            hear(tab)
        for k, tab in enumerate(tabs):
            for _ in range(k + 1):
                tab.send(FRAME)
        frames = [[hear(tab)["frame"] for _ in range(k + 1)][-1] for k, tab in enumerate(tabs)]
        for _ in range(MOST_TABS - 10):
            stack.enter_context(served.open())
        with served.open() as one_too_many, pytest.raises(ConnectionClosed, match="close one"):
            hear(one_too_many)
        for tab in tabs[5:]:
            tab.socket.shutdown(socket.SHUT_RDWR)  # the network is gone, nobody said goodbye

    assert frames == list(range(1, 11))
    assert no_tabs(served)


def test_a_flight_is_the_same_whatever_another_tab_does_meanwhile(monkeypatch: pytest.MonkeyPatch):
    # Box2D 3.1 has one unit of length for all its worlds: another tab's world is made before or
    # after, not within.
    alone = flown(["box2d_v3:shipped"], 100)
    other, options, tabs = ENGINES["box2d_v3:matched"].make(), Box2DV3._options, []

    def interrupted(engine: Box2DV3) -> dict[str, float]:
        if not tabs:
            tabs.append(
                threading.Thread(target=other.load, args=(field_scenario().scene, alone.dt))
            )
            tabs[0].start()
            tabs[0].join(0.3)
        return options(engine)

    monkeypatch.setattr(Box2DV3, "_options", interrupted)
    together = flown(["box2d_v3:shipped"], 100)
    tabs[0].join()
    other.close()

    assert bits(together) == bits(alone)


@pytest.mark.slow
def test_ctrl_c_stops_it_cleanly_and_a_taken_port_is_reported(served: Served, tmp_path: Path):
    arguments = [CROSSCHECK, "play", "--port", str(served.port), "--engine", "reference"]
    with subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    ) as started:
        assert started.stdout is not None
        url = started.stdout.readline().split()[0]
        port = int(url.split(":")[2].strip("/"))
        with connect(f"ws://localhost:{port}/fly", origin=f"http://localhost:{port}") as tab:  # type: ignore[arg-type]
            hear(tab)
            started.send_signal(signal.SIGINT)
            out, complaints = started.communicate(timeout=20)

    assert started.returncode == 0
    assert complaints.splitlines() == [f"Port {served.port} is taken: this is on {port}."]
    assert out.splitlines()[-1] == "Stopped."


@pytest.mark.parametrize(
    ("words", "lines"),
    [
        ("nowhere.toml", ["nowhere.toml: no such file"]),
        ("bad.toml", ["bad.toml: restitution = 2.0"]),
        ("crowd.toml", ["crowd.toml: 201 disks; the page shows at most 200"]),
        ("0.js", ["0.js: is a solver, not a flight; fly it with --engine 0.js"]),
        ([""], ['"": is not there; name a file']),
        ("--engine boxed2d", ["did you mean box2d"]),
        (
            "".join(f"--engine {k}.js " for k in range(17)),
            ["--engine: 17 engines; at most 16 fly at once"],
        ),
        pytest.param(
            "--engine cut.js --engine reference", ["cut.js: SyntaxError"], marks=pytest.mark.slow
        ),
        pytest.param(
            "--engine bytes.js --engine 0.js --engine empty.js",
            ["bytes.js: is not text", "empty.js: has neither the functions of the exercise"],
            marks=pytest.mark.slow,
        ),
        pytest.param("--engine throws.js", ["^throws.js: .*not today"], marks=pytest.mark.slow),
        pytest.param(
            "--engine walls.js",
            ["walls.js: does not model more than one disk"],
            marks=pytest.mark.slow,
        ),
    ],
)
def test_bad_input_is_a_line_each_and_nothing_is_served(
    words: str | list[str], lines: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(server, "serve", lambda *_: pytest.fail("it was served"))
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    engines = list(ENGINES)
    done = crosscheck("play", *(words.split() if isinstance(words, str) else words), cwd=tmp_path)

    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == len(lines)
    for line, pattern in zip(done.stderr.splitlines(), lines):
        assert re.search(pattern, line)
        assert line.count(".js: ") <= 1
    assert list(ENGINES) == engines


def test_a_port_that_nobody_may_have_is_not_called_taken(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    class Kept(socket.socket):
        def bind(self, _: object) -> None:
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket, "socket", Kept)
    with pytest.raises(SystemExit) as exit:
        server.serve(application(Game(FLOWN)), 80, "/", False)

    assert exit.value.code == 2
    assert "--port 80: the system keeps it for administrators" in capsys.readouterr().err


def test_a_missing_browser_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    served_on: list[int] = []
    monkeypatch.setattr("webbrowser.open", lambda _: False)
    monkeypatch.setattr(
        uvicorn.Server, "run", lambda _, sockets: served_on.append(sockets[0].close())
    )
    server.serve(application(Game(FLOWN)), 8700, "/", True)

    assert "--open: no browser was found here; open http://localhost:87" in capsys.readouterr().err
    assert len(served_on) == 1
