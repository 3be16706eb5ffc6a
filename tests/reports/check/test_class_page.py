"""The page of a class, of checks that are made up here."""

from __future__ import annotations

import csv
from dataclasses import replace
from io import StringIO
from pathlib import Path
from time import perf_counter

import pytest
from playwright.sync_api import Browser

from crosscheck2d.adapters.own_solver.file import SolverText
from crosscheck2d.reports.check.class_page import (
    NOTHING,
    bars,
    causes,
    distribution,
    write_class_page,
)
from crosscheck2d.reports.check.formats import csv_text
from crosscheck2d.reports.check.marks import Marked
from crosscheck2d.reports.check.page import write_page as write_file_page
from crosscheck2d.reports.check.terminal import print_tasks
from crosscheck2d.reports.check.verdict import Tally
from crosscheck2d.reports.terminal.console import Console
from tests.reports.check.test_marks import HOSTILE, marked, row, students
from tests.reports.page.browsing import opened, overhang

SIGN = row("2d", "velocity of B", "fault", "the impulse on B has the sign of that on A")


def test_each_cause_counts_a_student_once_and_each_student_has_one_bar():
    """Also if the cause shows in several questions, and whatever cannot be loaded."""
    twice = marked(SIGN, replace(SIGN, name="momentum"))

    assert causes([twice, marked(SIGN), marked()]) == {
        "Task 2d velocities: the impulse on B has the sign of that on A.": 2
    }
    assert sum(distribution(students()).values()) == len(students())
    assert distribution([marked()])["18 to 20"] == 1
    assert "nothing judged" not in distribution([marked()])
    assert causes(students())[NOTHING] == 1
    throws = row("1", "implemented", "fault", "x is not defined (line 6, column 7)")
    assert list(causes([marked(throws)])) == ["Task 1 integrate: x is not defined."]
    drawn = [cells[1].text for _, _, cells in bars({"a": 4, "b": 1, "c": 0}).rows]
    assert [text.partition("width:")[2][:3] for text in drawn] == ["100", "25.", "0.0"]


def test_terminal_page_and_csv_have_the_same_columns(
    tmp_path: Path, browser: Browser, capsys: pytest.CaptureFixture[str]
):
    """Of a class and of one file: asked and wrong count the same questions everywhere; total, tasks
    and what to begin with have the same headings and the same order."""
    group = students()
    one = group[1].check
    write_class_page(tmp_path / "class.html", group)
    write_file_page(tmp_path / "check.html", group[1])
    print_tasks(Console(), group[1])
    page, _ = opened(browser, (tmp_path / "class.html").as_uri())
    heads = page.locator(".students thead th").all_inner_texts()
    rows = [row.locator("td").all_inner_texts() for row in page.locator(".students tbody tr").all()]
    page.context.close()
    page, _ = opened(browser, (tmp_path / "check.html").as_uri())
    of_file = [row.inner_text().split("\t") for row in page.locator(".tasks tr").all()]
    page.context.close()
    printed = [line.split("  ") for line in capsys.readouterr().out.splitlines()][:-2]
    written = list(csv.DictReader(StringIO(csv_text(group))))

    assert [word.split()[-1] for word in written[0] if word not in ("of", "seconds", "file")] == [
        "id",
        *(head.split()[-1] for head in heads[1:]),
    ]
    assert one.tally() == (len(one.rows) - 1, 2)
    for k, name in enumerate(heads[1:]):
        if name in Tally._fields:
            assert [row[k] or "0" for row in rows] == [line[name] for line in written]
    assert {"asked", "wrong"} <= {*heads}
    assert [[word.strip() for word in line if word.strip()] for line in printed] == [
        [word for word in row if word] for row in of_file if "".join(row[3:])
    ]


def of_text(name: str, text: str) -> Marked:
    """A right file of that text."""
    one = marked(name=name)
    solver = SolverText(one.check.path, "javascript", text, "0" * 16)
    return replace(one, check=replace(one.check, solver=solver))


def test_a_class_is_sorted_filtered_and_opens_offline(browser: Browser, tmp_path: Path):
    """At two widths nothing overflows; no error, no request; what a student wrote is inert."""
    script = marked(row("1", "velocity", "fault", "<script>alert(1)</script>"), name="<b>eve</b>")
    group = [*students(), marked(SIGN, name="zoe"), script]
    copies = [of_text("kim", "x = 1"), of_text("lou", "x  = 1"), of_text("max", "x = 2")]
    write_class_page(tmp_path / "class.html", [*group, *copies])
    page, heard = opened(
        browser, (tmp_path / "class.html").as_uri(), viewport={"width": 1280, "height": 900}
    )
    ids = page.locator(".students tbody th:visible")
    everybody = ids.count()
    page.get_by_role("button", name="total").click()
    place = page.locator(".students thead th").all_inner_texts().index("total") + 1
    cells = page.locator(f".students tbody td:nth-child({place})").all_inner_texts()
    totals = [float(x) for x in cells]
    page.locator(".filter input").fill("sign of that on a")
    filtered = ids.all_inner_texts()
    page.locator(".students .open:visible").click()
    page.locator(".students .opened li").first.wait_for()
    opened_text = page.locator(".students .opened").inner_text()
    page.locator(".filter input").fill("Task 2d velocities: ")  # the title of every row's task, too
    titled = ids.all_inner_texts()
    page.locator(".filter input").fill("")
    closed = page.locator(".students tbody tr:not(.opens)").count()
    same = page.locator("#copies li").all_inner_texts()
    wide = overhang(page)
    page.set_viewport_size({"width": 400, "height": 800})
    narrow = overhang(page)
    page.context.close()

    assert heard == []
    assert everybody == len(group) + len(copies)
    assert totals == sorted(totals)
    assert filtered == titled == ["zoe"]
    assert closed == 0, "every row opens"
    assert "Task 2d velocities: " in opened_text
    assert "Got: 1 m. Expected: 2 m." in opened_text
    assert same == ["kim/Exercise.js, lou/Exercise.js"]
    assert (wide <= 0, narrow <= 0) == (True, True)
    assert "<script>alert" not in (tmp_path / "class.html").read_text()


def test_a_page_of_two_hundred_is_small_and_quick(tmp_path: Path):
    """8 MB and a second: of the 40 s that a class may take the checks need nearly all."""
    loud = [marked(SIGN, row("1", "spin", "fault", HOSTILE), name=f"s{k}") for k in range(200)]
    began = perf_counter()
    write_class_page(tmp_path / "class.html", loud)

    assert perf_counter() - began < 5.0  # some 0.2 s; a busy machine takes longer
    assert (tmp_path / "class.html").stat().st_size < 8e6


def test_on_paper_the_header_is_repeated_and_on_a_phone_every_cell_has_its_name(
    browser: Browser, tmp_path: Path
):
    """Chromium repeats no header with a box that cannot break, as a button is, and none in a box
    that scrolls. At 400 px what is not judged, and what opens a row, are in view."""
    write_class_page(tmp_path / "class.html", [marked(row("2c", "restitution", "not asked"))])
    page, _ = opened(browser, (tmp_path / "class.html").as_uri())
    page.emulate_media(media="print")
    button = page.locator(".students button").first.evaluate("b => getComputedStyle(b).display")
    box = page.locator("#students .scroll").evaluate("b => getComputedStyle(b).overflow")
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": 400, "height": 800})
    cells = page.locator(".students tbody td").all()
    right = [cell.evaluate("c => c.getBoundingClientRect().right") for cell in cells]
    names = [cell.evaluate("c => getComputedStyle(c, '::before').content") for cell in cells]
    page.context.close()

    assert (button, box) == ("contents", "visible")
    assert max(right) <= 400
    assert '"not judged: "' in names
