"""What is said to the server of the game and the lessons by somebody who is not its page."""

from __future__ import annotations

import json
import socket
from functools import partial
from pathlib import Path

from tests.hostile.played import Input
from tests.hostile.small_run import TWO
from tests.hostile.talks import Talk, asks, says, sends

PLAY, LESSON = "play --engine pymunk:shipped --port PORT", "lesson --port PORT"
STOPPED = (143,)
GET = b"GET %s HTTP/1.1\r\nHost: localhost:PORT\r\nConnection: close\r\n%s\r\n"
UPGRADE = b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
FRAME = json.dumps({"do": "frames", "count": 1})


def message(**fields: object) -> str:
    return json.dumps(fields)


# Requests, and what must be heard.
REQUESTS: dict[str, tuple[Talk, str]] = {
    "another host": (asks("GET", "/", Host="evil.example"), "400"),
    "a host that begins alike": (asks("GET", "/", Host="localhost.evil.example"), "400"),
    "an empty host": (asks("GET", "/", Host=""), "400"),
    "a host of 5000 letters": (asks("GET", "/", Host="x" * 5000), "400"),
    "a path that climbs": (asks("GET", "/../../../etc/passwd"), "404"),
    "a path that climbs in code": (asks("GET", "/lesson/%2e%2e%2f%2e%2e%2fetc%2fpasswd"), "404"),
    "a path that is not UTF-8": (asks("GET", "/lesson/%ff%fe"), "404"),
    "a path of a null byte": (asks("GET", "/lesson/%00"), "404"),
    "a path of 60000 letters": (asks("GET", f"/{'x' * 60_000}"), ""),
    "a path in markup": (asks("GET", "/lesson/%3Cscript%3Ealert(1)%3C/script%3E"), "404"),
    "a lesson that does not exist": (asks("GET", "/lesson/nothing"), "There is no such lesson"),
    "sliders in words": (asks("GET", "/lesson/order/shown?at=a,b"), '400 {"fault"'),
    "sliders that are not there": (asks("GET", "/lesson/order/shown?at=99999,7"), '400 {"fault"'),
    "sliders before the first": (asks("GET", "/lesson/order/shown?at=-1"), '400 {"fault"'),
    "sliders of 90 digits": (asks("GET", f"/lesson/order/shown?at={'9' * 90}"), '400 {"fault"'),
    "no sliders": (asks("GET", "/lesson/order/shown"), '400 {"fault"'),
    "sliders of no lesson": (asks("GET", "/lesson/nothing/shown?at=0"), "no such lesson"),
    "a method that is not for it": (asks("POST", "/", b"x"), "405"),
    "deleting a lesson": (asks("DELETE", "/lesson/order"), "405"),
    "a method nobody knows": (asks("JUMP", "/"), "405"),
    "a body of 5 MB": (asks("POST", "/lesson/order/shown?at=0", b"x" * 5_000_000), ""),
    "a body that is shorter than it says": (
        sends(GET.replace(b"GET", b"POST") % (b"/", b"Content-Length: 9999999\r\n") + b"x"),
        "405",
    ),
    "a length that is a word": (sends(GET % (b"/", b"Content-Length: long\r\n")), "400"),
    "a negative length": (sends(GET % (b"/", b"Content-Length: -1\r\n")), "400"),
    "a header of 200 kB": (sends(GET % (b"/", b"X: " + b"x" * 200_000 + b"\r\n")), ""),
    "ten thousand headers": (sends(GET % (b"/", b"X: y\r\n" * 10_000)), ""),
    "no HTTP at all": (sends(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 hello\r\n\r\n"), "400"),
    "half a request": (sends(b"GET / HT"), "silence"),
    "nothing at all": (sends(), "silence"),
    "megabytes without a line end": (sends(b"x" * 65536, times=40), ""),
    "two requests in one": (
        sends(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n" + GET % (b"/nothing", b"")),
        "404",
    ),
    "a version of the future": (sends(b"GET / HTTP/9.9\r\nHost: localhost\r\n\r\n"), ""),
    "an upgrade to what does not exist": (sends(GET % (b"/", b"Upgrade: teapot\r\n")), ""),
    "an upgrade without a key": (
        sends(GET.replace(b"Connection: close\r\n", b"") % (b"/fly", UPGRADE)),
        "",
    ),
    "an upgrade of a page": (says(path="/"), "403"),
    "an upgrade of a lesson": (says(path="/lesson"), ""),
    "another origin": (says(origin="http://evil.example"), "403"),
    "no origin": (says(origin=""), "403"),
    "an origin on another port": (says(origin="http://localhost:1"), "403"),
    "an origin that begins alike": (says(origin="http://localhost:PORT.evil.example"), "403"),
}
# Messages of a tab: the answer must name the fault.
FAULTY: dict[str, str | bytes] = {
    "no JSON": "{",
    "an empty message": "",
    "a number": "1",
    "null": "null",
    "a list": "[1]",
    "an empty table": "{}",
    "bytes": b"\xff\x00\xfe",
    "brackets": "[" * 4000,
    "a number of 4000 digits": "9" * 4000,
    "not a number": '{"do": "frames", "count": NaN}',
    "half a letter": '"\\ud800"',
    "an order that does not exist": message(do="jump"),
    "no frames": message(do="frames", count=0),
    "a thousand million frames": message(do="frames", count=10**9),
    "frames in text": message(do="frames", count="1"),
    "a key that does not exist": message(do="key", key="escape", down=True),
    "a key that is a list": message(do="key", key=["w"], down=True),
    "a flight without engines": message(do="fly", engines=[]),
    "an engine that does not exist": message(do="fly", engines=["bullet:shipped"]),
    "an engine that is a path": message(do="fly", engines=["../../x.py:own"]),
    "a thousand engines": message(do="fly", engines=["pymunk:shipped"] * 100),
    "a million asteroids": message(do="fly", engines=["pymunk:shipped"], asteroids=10**6),
    "a seed backwards": message(do="fly", engines=["pymunk:shipped"], seed=-1),
    "a restitution of two": message(do="fly", engines=["pymunk:shipped"], restitution=2.0),
    "no substeps": message(do="fly", engines=["pymunk:shipped"], substeps=0),
    "a field nobody asked for": message(do="save", path="/etc/passwd"),
}
TABS: dict[str, tuple[Talk, str]] = {
    "a message of 10 MB": (says("x" * 10_000_000), "1009"),
    "a hundred faulty messages": (says(*["{"] * 100), "more than 50 faulty messages"),
    "a thousand messages at once": (
        says(*[message(do="key", key="w", down=True)] * 1000, FRAME, wait=False),
        "",
    ),
    "a fault, and then a frame": (says("{", FRAME), '"frame":1'),
}


def busy(_: Path) -> dict[str, str]:
    TAKEN.append(one := socket.socket())
    one.bind(("127.0.0.1", 0))
    one.listen()
    return {"BUSY": str(one.getsockname()[1])}


TAKEN: list[socket.socket] = []
PORTS: dict[str, str | tuple[str, ...]] = {
    "port zero": "play --port 0",
    "a negative port": "lesson --port -1",
    "a port that is too high": "play --port 65536",
    "a port in text": "lesson --port http",
    "half a port": "play --port 8000.5",
    "an empty port": ("lesson", "order", "--port", ""),
}
served = partial(Input, codes=STOPPED)
SERVERS = (
    *(
        served(f"{words.split()[0]}: {what}", words, says=heard, talk=talk)
        for number, (what, (talk, heard)) in enumerate(REQUESTS.items())
        for words in [(PLAY, LESSON)[number % 2]]
    ),
    *(
        served(f"a tab that sends {what}", PLAY, says='"kind":"fault"', talk=says(text))
        for what, text in FAULTY.items()
    ),
    *(
        served(f"a tab that sends {what}", PLAY, says=heard, talk=talk)
        for what, (talk, heard) in TABS.items()
    ),
    *(Input(name, words, says="--port") for name, words in PORTS.items()),
    served(
        "a port that is taken",
        "play --engine pymunk:shipped --port BUSY",
        prepare=busy,
        says="is taken: this is on",
        talk=asks("GET", "/"),
    ),
    served(
        "a flight of a scene in markup",
        "play two.toml --engine pymunk:shipped --port PORT",
        {"two.toml": TWO.replace("Does a", "</script><script>alert(1)</script> [/nope] Does a")},
        says="200 ",
        talk=asks("GET", "/"),
    ),
    Input(
        "a solver that hangs, in flight",
        "play --engine mine.py",
        {"mine.py": "while True: pass\n"},
        says="does not come back",
    ),
    served(
        "a browser that is not there",
        "lesson --port PORT --open",
        talk=asks("GET", "/"),
        says="200 ",
    ),
)
