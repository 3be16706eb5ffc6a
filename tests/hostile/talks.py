"""What a hostile page, or no page at all, says to a server on this machine, and what is heard of
it."""

from __future__ import annotations

import http.client
import os
import signal
import socket
import time
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from pathlib import Path

from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import connect

Talk = Callable[[int], str]
STARTS, ANSWERS = 60.0, 20.0  # s in which a server is there, and has answered, on a busy machine
NOT_ANY_MORE = "it does not serve any more"


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def hear(talk: Talk, server: BaseProcess, stdout: Path) -> str:
    """Wait until it serves, talk to it, ask whether it still serves, and tell it to stop; "" if it
    never serves."""
    assert server.pid is not None
    end = time.monotonic() + STARTS
    while not (served := stdout.read_text() if stdout.exists() else "").count("\n"):
        if server.exitcode is not None or time.monotonic() > end:
            return ""
        time.sleep(0.02)
    port = int(served.split()[0].split(":")[2].split("/")[0])
    try:
        heard = talk(port)
    except OSError as fault:  # a connection that is cut is an answer, too
        heard = f"cut: {fault}"
    try:
        heard += "" if asked(port, "GET", "/").startswith("200") else NOT_ANY_MORE
    except OSError:
        heard += NOT_ANY_MORE
    os.kill(server.pid, signal.SIGTERM)
    return heard


def asked(port: int, method: str, path: str, body: bytes = b"", **headers: str) -> str:
    """Status and text; in the names of headers a `_` stands for `-`."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=ANSWERS)
    try:
        connection.request(
            method,
            path,
            body or None,
            {name.replace("_", "-"): text for name, text in headers.items()},
        )
        answer = connection.getresponse()
        return f"{answer.status} {answer.read().decode('utf-8', 'backslashreplace')}"
    finally:
        connection.close()


def asks(method: str, path: str, body: bytes = b"", **headers: str) -> Talk:
    return lambda port: asked(port, method, path, body, **headers)


def sends(*what: bytes, times: int = 1) -> Talk:
    """Bytes as they are, `times` times; what comes back until the other end closes, or says nothing
    for a second."""

    def talk(port: int) -> str:
        heard = b""
        with socket.create_connection(("127.0.0.1", port), ANSWERS) as connection:
            for piece in what * times:
                connection.sendall(piece.replace(b"PORT", str(port).encode()))
            connection.settimeout(1.0)
            try:
                while more := connection.recv(65536):
                    heard += more
            except TimeoutError:
                heard += b" (silence)"
        return heard.decode("utf-8", "backslashreplace")

    return talk


def says(
    *messages: str | bytes,
    path: str = "/fly",
    origin: str = "http://localhost:PORT",
    wait: bool = True,
) -> Talk:

    def talk(port: int) -> str:
        heard = []
        try:
            with connect(
                f"ws://localhost:{port}{path}",
                origin=origin.replace("PORT", str(port)) or None,  # type: ignore[arg-type]
                open_timeout=ANSWERS,
                max_size=None,
            ) as tab:
                heard.append(str(tab.recv(timeout=STARTS)))
                for message in messages:
                    tab.send(message)
                    if wait:
                        heard.append(str(tab.recv(timeout=ANSWERS)))
                tab.close()
        except (ConnectionClosed, InvalidHandshake) as closed:
            heard.append(str(closed))
        return "\n".join(heard)

    return talk
