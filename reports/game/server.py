"""Serves the game and the lessons to browsers on this machine, and to nobody else."""

from __future__ import annotations

import logging
import socket
import sys
import webbrowser
from asyncio import CancelledError, get_running_loop
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from secrets import token_hex
from time import monotonic
from typing import Any, TypeVar
from urllib.parse import urlsplit

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from reports.exits import TERMINATED, Stopped, refuse
from reports.game.messages import MOST_BYTES
from reports.game.page import game_page
from reports.game.session import Session, as_json
from scenarios.model import Scenario

T = TypeVar("T")
HOST, NAMES = "127.0.0.1", ("127.0.0.1", "localhost")
PORTS = 20  # tried in a row
MOST_TABS = 16
MOST_A_SECOND, MOST_FAULTS = 240, 50  # messages: a page sends 60 a second and the keys; and faulty ones in all
THREADS = ThreadPoolExecutor(MOST_TABS + 8)  # one a tab, and some for the pages; not the loop's, for which it waits
POLICY, LATER = 1008, 1013  # WebSocket close codes: it breaks the rules; try again later


@dataclass
class Allowance:
    """So many messages a second, and as many at once."""

    rate: float
    left: float = 0.0
    since: float = field(default_factory=monotonic)

    def __post_init__(self) -> None:
        self.left = self.rate

    def spend(self) -> bool:
        """Whether one more is allowed now."""
        now = monotonic()
        self.left = min(self.rate, self.left + (now - self.since) * self.rate) - 1
        self.since = now
        return self.left >= 0


@dataclass
class Game:
    """What every tab begins with, how many are open, and by what a page knows its own server from a later one."""

    engines: Sequence[str]
    file: Scenario | None = None
    tabs: int = 0
    mark: str = field(default_factory=lambda: token_hex(8))

    async def page(self, _: Request) -> HTMLResponse:
        """The page."""
        return HTMLResponse(game_page(self.engines, self.file, self.mark))

    async def fly(self, socket: WebSocket) -> None:
        """A tab, as long as it keeps the rules."""
        if not same_origin(socket):
            await socket.close(POLICY)  # before it is accepted: the browser is told 403
            return
        await socket.accept()
        if self.tabs >= MOST_TABS:
            await socket.close(LATER, f"{MOST_TABS} pages are open already: close one")
            return
        self.tabs += 1
        session = None
        try:
            session = await in_thread(Session, self.engines, self.file)
            with suppress(WebSocketDisconnect):
                await socket.send_text(as_json(session.field() | {"server": self.mark}))
                await converse(socket, session)
        finally:
            if session is not None and not session.given_up:
                session.close()
            self.tabs -= 1


def same_origin(socket: WebSocket) -> bool:
    """Whether the page that opens the socket comes from this very server: no other may drive it."""
    host = socket.headers.get("host", "")
    return urlsplit(f"//{host}").hostname in NAMES and socket.headers.get("origin") == f"http://{host}"


async def converse(socket: WebSocket, session: Session) -> None:
    """Answer message by message; the page asks for every frame, so that a slow one is never ahead of itself.

    The engines of a tab work in a thread, one message at a time: a solver that hangs, or is compiled for the first
    time, keeps its own tab waiting and no other.
    """
    allowance, faults = Allowance(MOST_A_SECOND), 0
    while True:
        event = await socket.receive()
        if event["type"] == "websocket.disconnect":
            return
        if not allowance.spend():
            await socket.close(POLICY, f"more than {MOST_A_SECOND} messages a second")
            return
        try:
            answer = await in_thread(session.answer, event.get("text") or event.get("bytes") or "")
        except ValueError as fault:
            faults += 1
            answer = {"kind": "fault", "text": str(fault)}
        except CancelledError:
            session.given_up = True  # its thread is not done with its engines
            raise
        if faults > MOST_FAULTS:
            await socket.close(POLICY, f"more than {MOST_FAULTS} faulty messages")
            return
        if answer is not None:
            await socket.send_text(as_json(answer))


async def in_thread(do: Callable[..., T], *arguments: Any) -> T:
    """What `do` gives, in a thread; a server that stops does not wait for it."""
    return await get_running_loop().run_in_executor(THREADS, partial(do, *arguments))


def application(game: Game, lessons: Sequence[BaseRoute] = ()) -> Starlette:
    """The web application: the game at /, the lessons below /lesson."""
    routes = [Route("/", game.page), WebSocketRoute("/fly", game.fly), *lessons]
    hosts = Middleware(TrustedHostMiddleware, allowed_hosts=list(NAMES), www_redirect=False)
    return Starlette(routes=routes, middleware=[hosts])


def taken_socket(port: int) -> socket.socket:
    """A socket on the loopback address at the first free port from `port` on.

    Raises:
        OSError: if none of the next few is free, or one may not be had.
    """
    for each in range(port, min(port + PORTS, 65536)):
        try:
            taken = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            taken.bind((HOST, each))
            taken.listen(64)
            return taken
        except OSError as fault:
            taken.close()
            if isinstance(fault, PermissionError):
                raise OSError("the system keeps it for administrators, as it does ports below 1024") from None
    raise OSError(f"none of the ports {port} to {min(port + PORTS, 65536) - 1} is free")


def serve(app: Starlette, port: int, path: str, opens: bool) -> None:
    """Serve until Ctrl-C; say where, and open a browser there if asked; exits 2 if there is no port, 143 on SIGTERM."""
    try:
        listening = taken_socket(port)
    except OSError as fault:
        refuse([f"--port {port}: {fault}; name another"])
    found = listening.getsockname()[1]
    if found != port:
        print(f"Port {port} is taken: this is on {found}.", file=sys.stderr)
    url = f"http://localhost:{found}{path}"
    print(f"{url}  (Ctrl-C stops it)", flush=True)
    if opens and not webbrowser.open(url):
        print(f"--open: no browser was found here; open {url} yourself.", file=sys.stderr)
    server = uvicorn.Server(config_of(app))
    logging.getLogger("uvicorn.error").addFilter(is_news)
    try:
        server.run(sockets=[listening])
    except KeyboardInterrupt as stopped:  # which the server hands on when it has ended; Ctrl-C is how it ought to end
        if isinstance(stopped, Stopped) and stopped.status == TERMINATED:
            raise
    finally:
        print("Stopped.")


def is_news(record: logging.LogRecord) -> bool:
    """Whether the server's complaint is about more than work that was cut off because the server stops."""
    cut_off = record.exc_info and isinstance(record.exc_info[1], CancelledError)
    return not (cut_off or record.getMessage().startswith("Cancel "))


config_of = partial(
    uvicorn.Config, log_level="warning", ws="websockets-sansio", ws_max_size=MOST_BYTES,
    ws_ping_interval=10, ws_ping_timeout=10, timeout_graceful_shutdown=1, lifespan="off",
)  # fmt: skip
