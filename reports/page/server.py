"""Serves pages to browsers on this machine only."""

from __future__ import annotations

import logging
import socket
import sys
import webbrowser
from asyncio import CancelledError, get_running_loop
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.routing import BaseRoute

from crosscheck2d.reports.terminal.exits import TERMINATED, refuse, signal_status

T = TypeVar("T")
HOST, NAMES = "127.0.0.1", ("127.0.0.1", "localhost")
PORTS = 20  # ports tried in a row
MOST_TABS = 16
MOST_BYTES = 4096  # bytes of a message from a page
# one per tab, and some for pages; not those of the loop, which waits for its threads
THREADS = ThreadPoolExecutor(MOST_TABS + 8)
config_of = partial(
    uvicorn.Config,
    log_level="warning",
    ws="websockets-sansio",
    ws_max_size=MOST_BYTES,
    ws_ping_interval=10,
    ws_ping_timeout=10,
    timeout_graceful_shutdown=1,
    lifespan="off",
)


async def in_thread(do: Callable[..., T], *arguments: Any) -> T:
    """The result of `do`, run in a thread; a stopping server does not wait for it."""
    return await get_running_loop().run_in_executor(THREADS, partial(do, *arguments))


def application(routes: Sequence[BaseRoute]) -> Starlette:
    hosts = Middleware(TrustedHostMiddleware, allowed_hosts=list(NAMES), www_redirect=False)
    return Starlette(routes=list(routes), middleware=[hosts])


def taken_socket(port: int) -> socket.socket:
    """A socket on the loopback address at the first free port from `port` on.

    Raises:
        OSError: none of the next few is free, or access is denied.
    """
    last = min(port + PORTS, 65536) - 1
    for number in range(port, last + 1):
        try:
            return socket.create_server((HOST, number), backlog=64)
        except PermissionError:
            raise OSError(
                "the system keeps it for administrators, as it does ports below 1024"
            ) from None
        except OSError:
            continue
    raise OSError(f"none of the ports {port} to {last} is free")


def serve(app: Starlette, port: int, path: str, opens: bool) -> None:
    """Serve until Ctrl-C; print the address, and open a browser if `opens`; exits 2 if there is no
    port, 143 on SIGTERM."""
    try:
        listening = taken_socket(port)
    except OSError as fault:
        refuse([f"--port {port}: {fault}; name another"])
    bound = listening.getsockname()[1]
    if bound != port:
        print(f"Port {port} is taken: this is on {bound}.", file=sys.stderr)
    url = f"http://localhost:{bound}{path}"
    print(f"{url}  (Ctrl-C stops it)", flush=True)
    if opens and not webbrowser.open(url):
        print(f"--open: no browser was found here; open {url} yourself.", file=sys.stderr)
    server = uvicorn.Server(config_of(app))
    logging.getLogger("uvicorn.error").addFilter(is_unexpected)
    try:
        server.run(sockets=[listening])
    except KeyboardInterrupt:  # raised when it has ended; Ctrl-C is its normal end
        if signal_status() == TERMINATED:
            raise
    finally:
        print("Stopped.")


def is_unexpected(record: logging.LogRecord) -> bool:
    """Whether a message of the server is about more than work cut off because the server stops."""
    cut_off = record.exc_info and isinstance(record.exc_info[1], CancelledError)
    return not (cut_off or record.getMessage().startswith("Cancel "))
