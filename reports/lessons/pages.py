"""The pages of the lessons: served live, or one by one as files that need no server."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from threading import Lock
from typing import Any, NamedTuple

from markupsafe import Markup, escape
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route

from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.conventions import Convention, table
from crosscheck2d.reports.lessons.friction.bounce import CONE as EDGES
from crosscheck2d.reports.lessons.horizon import ROUNDED
from crosscheck2d.reports.lessons.lesson import Lesson, unbroken
from crosscheck2d.reports.lessons.mechanisms.ablation import ABLATED
from crosscheck2d.reports.lessons.mechanisms.float32 import BETWEEN
from crosscheck2d.reports.lessons.mechanisms.javascript_bounces import CHANGED
from crosscheck2d.reports.page.documents import ENGINE, deflated, fragment, render
from crosscheck2d.reports.page.server import in_thread
from crosscheck2d.reports.page.style import Look, look
from crosscheck2d.reports.run.cells import versions

GENERATOR = "crosscheck lesson"
STYLES = ["page/live.css", "lessons/lesson.css"]
GROUPS = {
    "A solver, piece by piece": "12345",
    "How engines differ": "6",
    "What can be compared, and how far": "78",
    "Spin and friction": "9",
}
MEASURING = Lock()  # two pages that ask at once get one measurement
GREY = look("reference")._replace(light="#8a8f98", dark="#7f8690", dash=(3, 3))
OWN = {  # who plays in lessons only
    ABLATED: look("reference")._replace(light="#b3123f", dark="#ff7a93", dash=(7, 5)),
    EDGES: GREY,
    BETWEEN: GREY,
    CHANGED: look("matter", "shipped")._replace(dash=(3, 3)),
    ROUNDED: GREY,
}


def looks_of(lesson: Lesson) -> dict[str, Look]:
    """How each name of a lesson is drawn."""
    return {name: OWN.get(name) or look(*name.split(":", 1)) for name in lesson.names}


class Links(NamedTuple):
    """Where the pages are, `lesson` with {} for a name; "" for what is not there."""

    lesson: str
    shelf: str
    game: str


LIVE, FILES, ALONE = (
    Links("/lesson/{}", "/lesson", "/"),
    Links("{}.html", "index.html", ""),
    Links("", "", ""),
)


def about() -> dict[str, str]:
    """When and with what the numbers were made."""
    return {
        "made": datetime.now(UTC).isoformat(timespec="seconds")[:16].replace("T", " ") + " UTC"
    } | versions()


def answer_json(name: str, places: Sequence[int]) -> dict[str, Any]:
    """What the lesson of that name shows with its sliders at these indices, for JSON; as what a
    worker does."""
    return LESSONS[name].at(places).to_json()


def lesson_page(
    lesson: Lesson, first: Mapping[str, Any], links: Links = LIVE, grid: str = ""
) -> str:
    """The page, which shows `first`; `grid`: every setting's answer, packed, for a page without a
    server."""
    names = list(LESSONS)
    k = names.index(lesson.name)
    around = [LESSONS[names[each]] if 0 <= each < len(names) else None for each in (k - 1, k + 1)]
    return render(
        "lessons/lesson.html.j2",
        generator=GENERATOR,
        scripts=[*ENGINE, "lessons/save.js", "lessons/chart.js", "lessons/lesson.js"],
        styles=STYLES,
        looks=looks_of(lesson),
        connects=not grid,
        lesson=lesson,
        text=[linked(paragraph, links) for paragraph in lesson.paragraphs],
        grid=grid,
        around=around,
        links=links,
        about=about(),
        first=first,
        javascript=any(name in FETCHED for name in lesson.names),
    )


def linked(paragraph: str, links: Links) -> Markup:
    """The paragraph with every `[name]` of a lesson as a link to it; by number and title alone
    where there is no other page.

    Raises:
        KeyError: if there is no such lesson.
    """

    def link(found: re.Match[str]) -> str:
        lesson = LESSONS[found[1]]
        title = escape(f"Lesson {lesson.number} ({lesson.title})")
        return (
            f'<a href="{links.lesson.format(lesson.name)}">{title}</a>' if links.lesson else title
        )

    return Markup(re.sub(r"\[(\w+)\]", link, unbroken(paragraph)))


def offline(lesson: Lesson, answers: Mapping[tuple[int, ...], Any], links: Links = ALONE) -> str:
    """One page with the answer, as of `answer_json`, to every setting of the sliders."""
    grid = {",".join(map(str, places)): answers[places] for places in lesson.grid}
    return lesson_page(
        lesson, answers[lesson.start], links, deflated(json.dumps(grid, separators=(",", ":")))
    )


def index_page(links: Links = LIVE, rows: Sequence[Convention] = ()) -> str:
    """The list of lessons; below it the conventions of the engines: `rows`; a live page asks for
    them later."""
    live = links is LIVE
    groups = {
        heading: [LESSONS[name] for name in LESSONS if LESSONS[name].number[0] in numbers]
        for heading, numbers in GROUPS.items()
    }
    return render(
        "lessons/index.html.j2",
        generator=GENERATOR,
        scripts=["lessons/index.js"] if live else [],
        styles=STYLES,
        connects=live,
        groups=groups,
        links=links,
        table=None if live else Markup(conventions_page(rows, about())),
    )


def conventions_table() -> str:
    """What the probes find in every engine, when and with which versions: measured once, when it is
    first asked for."""
    with MEASURING:
        return conventions_page(*measured())


def conventions_page(rows: Sequence[Convention], when: Mapping[str, str]) -> str:
    """The table for a page; `when` and with what it was measured."""
    return fragment("lessons/conventions.html.j2", rows=rows, about=when)


@cache
def measured() -> tuple[list[Convention], dict[str, str]]:
    """The table, and when and with what it was made."""
    return table(ENGINES), about()


async def index(_: Request) -> Response:
    """/lesson."""
    return HTMLResponse(await in_thread(index_page))


async def conventions(_: Request) -> Response:
    """/lesson/conventions: the table alone."""
    return HTMLResponse(await in_thread(conventions_table))


async def page(request: Request) -> Response:
    """/lesson/NAME."""
    lesson = LESSONS.get(request.path_params["name"])
    if lesson is None:
        return PlainTextResponse(f"There is no such lesson; there are {', '.join(LESSONS)}.", 404)
    return HTMLResponse(
        await in_thread(lambda: lesson_page(lesson, answer_json(lesson.name, lesson.start)))
    )


async def shown(request: Request) -> Response:
    """/lesson/NAME/shown?at=1,0: what is shown with the sliders there."""
    lesson = LESSONS.get(request.path_params["name"])
    try:
        if lesson is None:
            raise ValueError("there is no such lesson")
        places = [int(place) for place in request.query_params.get("at", "")[:99].split(",")]
        found = await in_thread(lesson.at, places)
    except ValueError as fault:
        return JSONResponse({"fault": str(fault)}, 400)
    return JSONResponse(found.to_json())


ROUTES: list[BaseRoute] = [
    Route("/lesson", index),
    Route("/lesson/conventions", conventions),
    Route("/lesson/{name}", page),
    Route("/lesson/{name}/shown", shown),
]
