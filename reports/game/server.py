"""The game's server side: a page, and a socket a tab through which it flies."""

from __future__ import annotations

import json
from asyncio import CancelledError
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from secrets import token_hex
from time import monotonic
from typing import Any
from urllib.parse import urlsplit

from starlette.requests import Request
from starlette.responses import HTMLResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from crosscheck2d.adapters.engines import ENGINES, OWN
from crosscheck2d.reports.game.divergence import DIVERGED, WAIT
from crosscheck2d.reports.game.flight import FRAME, SUBSTEPS
from crosscheck2d.reports.game.session import Session
from crosscheck2d.reports.page.documents import render
from crosscheck2d.reports.page.kit import Said
from crosscheck2d.reports.page.server import MOST_TABS, NAMES, in_thread
from crosscheck2d.reports.page.style import looks_of
from crosscheck2d.scenarios.model import Scenario

# messages: a page sends 60 a second and the keys; and faulty ones in all
MOST_A_SECOND, MOST_FAULTS = 240, 50
POLICY, LATER = 1008, 1013  # WebSocket close codes: it breaks the rules; try again later


@dataclass
class Game:
    """What every tab begins with, how many are open, and by what a page knows its own server from a
    later one.

    Attributes:
        engines: that fly, the solid one first.
        file: the flight that is shown again; None: keys steer.
        restitution: of the first field.
        said: engine -> what `check` says of its file.
    """

    engines: Sequence[str]
    file: Scenario | None = None
    restitution: float = 0.9
    said: Mapping[str, Sequence[Said]] = field(default_factory=dict)
    tabs: int = 0
    mark: str = field(default_factory=lambda: token_hex(8))

    async def page(self, _: Request) -> HTMLResponse:
        # in space there is no friction, and who adds it gives the bits of another engine
        offered = [name for name, row in ENGINES.items() if not row.adds_friction]
        rows = {name: ENGINES[name] for name in dict.fromkeys([*self.engines, *offered])}
        page = render(
            "game/game.html.j2",
            generator="crosscheck play",
            scripts=["game/field.js", "game/game.js"],
            styles=["page/live.css", "game/game.css"],
            looks=looks_of(rows),
            connects=True,
            rows=rows,
            labels=labels(list(rows)),
            flown=list(self.engines),
            steps={k: FRAME / k for k in SUBSTEPS},
            file=self.file,
            mark=self.mark,
            diverged=DIVERGED,
            wait=WAIT,
            restitution=self.restitution,
            said=self.said,
        )
        return HTMLResponse(page)

    async def fly(self, socket: WebSocket) -> None:
        """A tab, as long as it keeps the rules. Only a page of this server may open it."""
        host = socket.headers.get("host", "")
        own = urlsplit(f"//{host}").hostname in NAMES
        if not own or socket.headers.get("origin") != f"http://{host}":
            await socket.close(POLICY)  # before it is accepted: the browser gets 403
            return
        await socket.accept()
        if self.tabs >= MOST_TABS:
            await socket.close(LATER, f"{MOST_TABS} pages are open already: close one")
            return
        self.tabs += 1
        session = None
        try:
            session = await in_thread(Session, self.engines, self.file, self.restitution)
            with suppress(WebSocketDisconnect):
                await send(socket, session.field() | {"server": self.mark})
                await converse(socket, session)
        finally:
            if session is not None and not session.given_up:
                session.close()
            self.tabs -= 1


def labels(names: Sequence[str]) -> dict[str, str]:
    """How the field calls each engine: a solver's file by as much of the end of its path as tells
    it from the others, all else by its name."""
    paths = {name: Path(name.removesuffix(OWN)).parts for name in names if name.endswith(OWN)}
    ends = {name: name for name in names}
    for name, parts in paths.items():
        others = [path for key, path in paths.items() if key != name]
        tails = (parts[-k:] for k in range(1, len(parts) + 1))
        unique = (tail for tail in tails if all(path[-len(tail) :] != tail for path in others))
        ends[name] = "/".join(next(unique, parts))
    return ends


async def send(socket: WebSocket, answer: dict[str, Any]) -> None:
    await socket.send_text(json.dumps(answer, separators=(",", ":")))


async def converse(socket: WebSocket, session: Session) -> None:
    """Answer message by message; the page asks for every frame, so that a slow one is never ahead
    of itself.

    The engines of a tab work in a thread, one message at a time: a solver that hangs, or is
    compiled for the first time, keeps its own tab waiting and no other.
    """
    # so many messages a second, and as many at once
    allowed, before, faults = float(MOST_A_SECOND), monotonic(), 0
    while True:
        event = await socket.receive()
        if event["type"] == "websocket.disconnect":
            return
        now = monotonic()
        allowed = min(MOST_A_SECOND, allowed + (now - before) * MOST_A_SECOND) - 1
        before = now
        if allowed < 0:
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
            await send(socket, answer)


def routes(game: Game) -> list[BaseRoute]:
    return [Route("/", game.page), WebSocketRoute("/fly", game.fly)]
