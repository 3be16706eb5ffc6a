"""A lesson as a file needs no server, all of them lead to each other, and what cannot be written is
reported at once."""

from __future__ import annotations

import base64
import csv
import io
import json
import zlib
from pathlib import Path
from xml.etree import ElementTree

import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.lessons import command, pages
from crosscheck2d.reports.lessons.catalogue import LESSONS
from crosscheck2d.reports.lessons.conventions import Convention
from crosscheck2d.reports.lessons.lesson import Shown
from crosscheck2d.reports.lessons.mechanisms.ablation import ABLATED
from crosscheck2d.reports.lessons.pages import (
    ALONE,
    FILES,
    LIVE,
    answer_json,
    index_page,
    linked,
    offline,
)
from crosscheck2d.reports.page.style import TRUTH
from tests.reports.lessons.browsing import opened_lesson, wait_until_drawn
from tests.reports.page.browsing import opened
from tests.reports.terminal.command_line import crosscheck


@pytest.mark.slow
def test_a_lesson_as_a_file_needs_no_server(browser: Browser, tmp_path: Path):
    """It asks nothing of anywhere, its sliders work, and what it holds is what the lesson shows
    live."""
    lesson = LESSONS["order"]
    path = tmp_path / "order.html"
    path.write_text(
        offline(lesson, {places: answer_json("order", places) for places in lesson.grid})
    )
    page, heard = opened(browser, path.as_uri())
    page.on("request", lambda request: heard.append(request.url))
    wait_until_drawn(page)
    curves = (
        "[...document.querySelectorAll('.curve')].map((curve) => curve.getAttribute('d')).join()"
    )
    before = page.evaluate(curves)
    page.locator(".sliders [name=order]").focus()
    page.keyboard.press("End")
    page.evaluate("lesson.ready")
    after = page.evaluate(curves)
    packed = page.locator("#grid").text_content()
    page.context.close()
    held = json.loads(zlib.decompress(base64.b64decode(packed or "")))

    assert before != after
    assert heard == []
    assert len(held) == len(lesson.grid)
    assert held["1,0"]["charts"] == json.loads(json.dumps(lesson.at((1, 0)).to_json()["charts"]))


@pytest.mark.slow
def test_a_chart_of_a_lesson_is_saved_as_picture_and_numbers(browser: Browser, tmp_path: Path):
    """The picture has the title and a legend and needs no style of the page; the numbers are those
    of the curves."""
    lesson, path = LESSONS["order"], tmp_path / "order.html"
    path.write_text(
        offline(lesson, {places: answer_json("order", places) for places in lesson.grid})
    )
    page, heard = opened_lesson(browser, path.as_uri(), accept_downloads=True)
    files = {}
    for kind in ("SVG", "CSV"):
        with page.expect_download() as download:
            page.locator(f".saves button:has-text('{kind}')").first.click()
        assert download.value.suggested_filename.endswith(f"Above the parabola.{kind.lower()}")
        files[kind] = Path(download.value.path()).read_text(encoding="utf-8")
    page.context.close()
    chart = lesson.at(lesson.start).to_json()["charts"][0]
    rows = list(csv.reader(io.StringIO(files["CSV"])))
    picture = ElementTree.fromstring(files["SVG"])
    said = {element.text for element in picture.iter("{http://www.w3.org/2000/svg}text")}

    shown = {TRUTH: "exact answer", ABLATED: "ablated reference"}
    assert rows[0] == ["curve", chart["x"], chart["y"]]
    for curve in chart["curves"]:
        name = shown.get(curve["name"], curve["name"])
        mine = [(float(x), float(y)) for who, x, y in rows[1:] if who == name]
        assert mine == list(zip(curve["x"], curve["y"]))
        assert name in said
    assert {"Above the parabola", chart["x"], chart["y"]} <= said
    assert "class=" not in files["SVG"]
    assert heard == []


@pytest.mark.slow
def test_the_conventions_of_all_engines_fit_on_a_screen_and_on_paper(
    browser: Browser, tmp_path: Path
):
    """A window of 1280 px, and a sheet of A4 sideways, with the longest answers; unbroken in larger
    letters they do not."""
    got = dict.fromkeys(ENGINES, ("not modelled", "keeps"))
    asked = [
        Convention("What friction acts in a bounce with e = 0, where 0.2 is stated?", "0", got)
    ]
    path = tmp_path / "index.html"
    path.write_text(index_page(FILES, asked), encoding="utf-8")
    page, heard = opened(browser, path.as_uri(), viewport={"width": 1280, "height": 800})
    cut = page.locator(".scroll").evaluate("(table) => table.scrollWidth - table.clientWidth")
    page.set_viewport_size({"width": 1032, "height": 703})
    page.emulate_media(media="print")
    end = "document.querySelector('.conventions').getBoundingClientRect().right - innerWidth"
    right = page.evaluate(end)
    page.evaluate(
        "document.querySelectorAll('.conventions, .conventions td')"
        ".forEach((each) => Object.assign(each.style, {fontSize: '1rem', whiteSpace: 'nowrap'}))"
    )
    wide = page.evaluate(end)
    page.context.close()

    assert cut <= 0
    assert right <= 1 < wide
    assert heard == []


@pytest.mark.slow
def test_all_lessons_in_a_folder_lead_to_each_other(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """A page each and their list, with the conventions in it; nothing asks for a server. Two of
    them, for the time."""
    few = {name: LESSONS[name] for name in ("thrust", "order")}
    monkeypatch.setattr(command, "LESSONS", few)
    monkeypatch.setattr(pages, "LESSONS", few)
    monkeypatch.setattr(
        command, "ENGINES", {name: command.ENGINES[name] for name in ("pymunk:shipped",)}
    )
    done = crosscheck("lesson", "--export", tmp_path / "all", cwd=tmp_path)
    again = crosscheck("lesson", "--export", tmp_path / "all", cwd=tmp_path)
    page, heard = opened(browser, (tmp_path / "all" / "index.html").as_uri())
    text = page.locator("#measured").inner_text()
    links = page.locator("a").evaluate_all("all => all.map((a) => a.getAttribute('href'))")
    lesson, more = opened_lesson(browser, (tmp_path / "all" / "order.html").as_uri())
    around = lesson.locator(".crumbs a").evaluate_all(
        "all => all.map((a) => a.getAttribute('href'))"
    )
    spoken_of = lesson.locator("main > p a").evaluate_all(
        "all => all.map((a) => a.getAttribute('href'))"
    )
    page.context.close()
    lesson.context.close()

    settings = sum(len(lesson.grid) for lesson in few.values())
    assert (done.returncode, again.returncode) == (0, 0)
    assert f"2 lessons with {settings} settings of their sliders: takes minutes" in done.stderr
    assert sorted(path.name for path in (tmp_path / "all").iterdir()) == [
        "index.html",
        "order.html",
        "thrust.html",
    ]
    assert sorted(links) == ["order.html", "thrust.html"]
    assert around == ["index.html", "thrust.html"]
    assert "thrust.html" in spoken_of
    assert "pymunk 7.3.1" in text
    assert heard == more == []


def test_a_lesson_links_to_what_it_speaks_of():
    """To other lessons where they are: on the server, in the folder; alone it names them. To the
    engines' own pages always."""
    paragraph = "[thrust] does this with a force."
    page = offline(LESSONS["order"], {places: ANSWER for places in LESSONS["order"].grid})

    assert linked(paragraph, LIVE).startswith(
        '<a href="/lesson/thrust">Lesson 2 (Force and thrust)'
    )
    assert linked(paragraph, FILES).startswith('<a href="thrust.html">Lesson 2 (Force and thrust)')
    assert linked(paragraph, ALONE) == "Lesson 2 (Force and thrust) does this with a force."
    assert 'href="https://www.pymunk.org"' in page
    assert 'href="https://box2d.org"' in page
    with pytest.raises(KeyError):
        linked("[no_such_lesson]", LIVE)


@pytest.mark.parametrize("name", LESSONS)
def test_every_lesson_that_a_text_speaks_of_is_there(name: str):
    """A name that is wrong raises."""
    for paragraph in LESSONS[name].paragraphs:
        assert "[" not in linked(paragraph, LIVE)


ANSWER = Shown([]).to_json()  # of a lesson that shows nothing


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["ordr"], "did you mean order?"),
        (["xyzzy"], "there are 1 particle, 2 thrust"),
        (["order", "--export", "folder"], "--export folder: is a folder; name a file"),
        (["order", "--export", "other.html"], "other.html: exists and is no page of a lesson"),
        (["order", "--export", "nowhere/a.html"], "nowhere/a.html: No such file or directory"),
        (["order", "--export", "/proc/a.html"], "/proc/a.html: No such file or directory"),
        (["order", "--export", ""], "name a file"),
        (["--export", "folder"], "order.html: exists and is no page of a lesson"),
        (["--export", "other.html"], "other.html: is a file"),
        (["--export", "/proc/all"], "/proc/all: "),
    ],
)
def test_what_cannot_be_written_is_reported_before_any_run(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """One line, exit 2, nothing is there that was not, and no engine was asked."""
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "folder" / "order.html", tmp_path / "other.html"):
        path.write_text("somebody's own")
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr(command, "write_pages", lambda *_: pytest.fail("a run was made"))
    done = crosscheck("lesson", *words, cwd=tmp_path)

    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "other.html").read_text() == "somebody's own"


@pytest.mark.slow
def test_a_page_that_cannot_be_made_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The new one takes its place only when it is whole."""
    path = tmp_path / "order.html"
    crosscheck("lesson", "order", "--export", path, cwd=tmp_path)
    whole = path.read_text()

    def interrupted(*_: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "offline", interrupted)
    done = crosscheck("lesson", "order", "--export", path, cwd=tmp_path)

    assert done.returncode == 130
    assert path.read_text() == whole


@pytest.mark.slow
def test_a_run_that_fails_ends_the_export_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Exit 1 with the lesson, where its sliders were, and what was raised; nothing is left
    behind."""
    monkeypatch.setattr(command, "answer_json", fails)
    done = crosscheck("lesson", "order", "--export", tmp_path / "order.html", cwd=tmp_path)

    assert done.returncode == 1
    assert f"{LESSONS['order'].title}, sliders at (0, " in done.stderr
    assert "): error: ZeroDivisionError: of a lesson\n" in done.stderr
    assert list(tmp_path.iterdir()) == []


def fails(*_: object) -> None:
    """What a lesson with a fault does."""
    raise ZeroDivisionError("of a lesson")


def test_a_lesson_is_found_by_its_number_and_help_names_all(tmp_path: Path):
    """As pages and README number them."""
    shown = " ".join(crosscheck("lesson", "--help", cwd=tmp_path).stdout.split())

    for name, lesson in LESSONS.items():
        assert command.checked_lesson(lesson.number) == command.checked_lesson(name) == name
    assert ", ".join(f"{lesson.number} {name}" for name, lesson in LESSONS.items()) in shown
