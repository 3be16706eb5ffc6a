"""The pages of the lessons: served live, or one by one as files that need no server."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable
from datetime import UTC, datetime
from functools import cache

from markupsafe import Markup
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route

from reports.cells import versions
from reports.documents import looks_as_json, render
from reports.lessons.catalogue import LESSONS
from reports.lessons.conventions import table
from reports.lessons.crowd import EVERY_PAIR
from reports.lessons.lesson import Lesson
from reports.lessons.mechanisms import SWITCHED
from reports.style import Look, look

STYLES = ["lessons/lesson.css"]
OWN = {  # who plays in lessons only
    SWITCHED: look("reference")._replace(light="#b3123f", dark="#ff7a93", dash=(7, 5)),
    EVERY_PAIR: look("reference")._replace(dash=(7, 5)),
}


def looks_of(lesson: Lesson) -> dict[str, Look]:
    """How each name of a lesson is drawn; what lies on another curve is dashed, so that what it covers shows."""
    return {name: OWN.get(name) or look(*name.split(":", 1)) for name in lesson.names}


def about() -> dict[str, str]:
    """When and with what the numbers were made."""
    return {"made": datetime.now(UTC).isoformat(timespec="seconds")[:16].replace("T", " ") + " UTC"} | versions()


def lesson_page(lesson: Lesson, grid: str = "") -> str:
    """The page; `grid`: every setting's answer, packed, for a page without a server."""
    names = list(LESSONS)
    k = names.index(lesson.name)
    around = [LESSONS[names[each]] if 0 <= each < len(names) else None for each in (k - 1, k + 1)]
    return render(
        "lessons/lesson.html.j2",
        ["player.js", "player_canvas.js", "lessons/chart.js", "lessons/lesson.js"], STYLES, connects=not grid,
        lesson=lesson, text=[Markup(paragraph) for paragraph in lesson.text], looks=looks_of(lesson),
        looks_json=looks_as_json(looks_of(lesson)), grid=grid, around=around, about=about(),
        first=lesson.at(lesson.start).told(),
    )  # fmt: skip


def offline(lesson: Lesson, progress: Callable[[int, int], None]) -> str:
    """One page with the answer to every setting of the sliders, from runs made now."""
    answers = {}
    for k, places in enumerate(lesson.grid):
        answers[",".join(map(str, places))] = lesson.at(places).told()
        progress(k + 1, len(lesson.grid))
    packed = zlib.compress(json.dumps(answers, separators=(",", ":")).encode(), 9)
    return lesson_page(lesson, base64.b64encode(packed).decode())


def index_page() -> str:
    """The list of lessons, and the conventions of the engines as the probes find them."""
    return render("lessons/index.html.j2", [], STYLES, lessons=LESSONS, about=about(), table=measured())


measured = cache(table)


async def index(_: Request) -> Response:
    """/lesson."""
    return HTMLResponse(await run_in_threadpool(index_page))


async def page(request: Request) -> Response:
    """/lesson/NAME."""
    lesson = LESSONS.get(request.path_params["name"])
    if lesson is None:
        return PlainTextResponse(f"There is no such lesson; there are {', '.join(LESSONS)}.", 404)
    return HTMLResponse(await run_in_threadpool(lesson_page, lesson))


async def shown(request: Request) -> Response:
    """/lesson/NAME/shown?at=1,0: what is shown with the sliders there."""
    lesson = LESSONS.get(request.path_params["name"])
    try:
        if lesson is None:
            raise ValueError("there is no such lesson")
        places = [int(place) for place in request.query_params.get("at", "")[:99].split(",")]
        found = await run_in_threadpool(lesson.at, places)
    except ValueError as fault:
        return JSONResponse({"fault": str(fault)}, 400)
    return JSONResponse(found.told())


ROUTES: list[BaseRoute] = [
    Route("/lesson", index), Route("/lesson/{name}", page), Route("/lesson/{name}/shown", shown),
]  # fmt: skip
