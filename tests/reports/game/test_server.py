"""The game's server serves this machine only, and is left well by whatever a page does."""

from __future__ import annotations

import http.client
import json
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import uvicorn
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from crosscheck2d.adapters.box2d_v3 import Box2DV3
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.commands.serve import application, play
from crosscheck2d.reports.game.flight import field_scenario
from crosscheck2d.reports.game.server import MOST_A_SECOND, MOST_FAULTS, Game
from crosscheck2d.reports.page.server import MOST_TABS, config_of, serve, taken_socket
from tests.reports.game.test_flight import bits, flown

FLOWN = ["reference:exercise", "pymunk:shipped"]
FRAME = json.dumps({"do": "frames", "count": 1})


class Served:
    def __init__(self) -> None:
        self.game = Game(FLOWN)
        listening = taken_socket(0)
        self.port = listening.getsockname()[1]
        self.origin = f"http://localhost:{self.port}"
        self.server = uvicorn.Server(config_of(application(self.game)))
        self.thread = threading.Thread(
            target=self.server.run, kwargs={"sockets": [listening]}, daemon=True
        )
        self.thread.start()

    def open(self, origin: str | None = "", **options: object) -> ClientConnection:
        origin = self.origin if origin == "" else origin
        return connect(f"ws://localhost:{self.port}/fly", origin=origin, **options)  # type: ignore[arg-type]

    def get(self, path: str, host: str) -> tuple[int, str]:
        asked = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        asked.request("GET", path, headers={"Host": host})
        answer = asked.getresponse()
        return answer.status, answer.read().decode()


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    served = Served()
    yield served
    served.server.should_exit = True
    served.thread.join()


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
    assert served.get("/", f"localhost:{served.port}")[0] == 200
    assert served.get("/", "evil.example")[0] == 400


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
    program = Path(sys.executable).parent / "crosscheck"
    arguments = [program, "play", "--port", str(served.port), "--engine", "reference"]
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
    ("flight", "engines", "said"),
    [
        ("nowhere.toml", [], "nowhere.toml: no such file"),
        ("bad.toml", [], "bad.toml: restitution = 2.0"),
        ("crowd.toml", [], "201 disks; the page shows at most 200"),
        (None, ["boxed2d"], "did you mean box2d"),
    ],
)
def test_bad_input_is_reported_and_nothing_is_served(
    flight: str | None,
    engines: list[str],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
):
    top = 'name = "a"\nduration = 1.0\nsample_interval = 0.5\nrestitution = {}\n'
    disk = "[[disk]]\nposition = [{}, 0.0]\nvelocity = [0.0, 0.0]\nradius = 0.1\nmass = 1.0\n"
    (tmp_path / "bad.toml").write_text(top.format(2.0) + disk.format(0.0))
    (tmp_path / "crowd.toml").write_text(
        top.format(1.0) + "".join(disk.format(x) for x in range(201))
    )
    with pytest.raises(SystemExit) as exit:
        play(tmp_path / flight if flight else None, engines, 8000, False)

    assert exit.value.code == 2
    assert said in capsys.readouterr().err


def test_a_port_that_nobody_may_have_is_not_called_taken(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    class Kept(socket.socket):
        def bind(self, _: object) -> None:
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket, "socket", Kept)
    with pytest.raises(SystemExit) as exit:
        serve(application(Game(FLOWN)), 80, "/", False)

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
    serve(application(Game(FLOWN)), 8700, "/", True)

    assert "--open: no browser was found here; open http://localhost:87" in capsys.readouterr().err
    assert len(served_on) == 1
