"""All pages are made in one way: one base template, one render, one set of macros."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import pytest
from jinja2 import Environment, UndefinedError

from crosscheck2d.reports.page.documents import REPORTS, environment, fragment, render
from crosscheck2d.reports.page.style import look

TEMPLATES = sorted(REPORTS.glob("*/*.j2"))
BASE, MACROS = "page/base.html.j2", "page/macros.html.j2"
# no pages: they stand inside of one
PARTS = {
    BASE,
    MACROS,
    "lessons/conventions.html.j2",
    "page/error_cost.html.j2",
    "page/own_solvers.html.j2",
    "page/panels.html.j2",
    "speed/budget.html.j2",
}

LINKS = {"game": "", "lesson": ""}


def short(path: Path) -> str:
    """Its name below `reports`, as templates name each other."""
    return path.relative_to(REPORTS).as_posix()


@pytest.mark.parametrize("path", TEMPLATES, ids=short)
def test_every_page_extends_the_base_and_only_the_base_has_a_head(path: Path):
    """So that charset, policy, colours and scripts are written once."""
    text = path.read_text(encoding="utf-8")

    assert text.startswith(f'{{% extends "{BASE}" %}}') == (short(path) not in PARTS)
    assert ("<head>" in text) == (short(path) == BASE)


def test_no_macro_is_defined_twice():
    """What two pages need is in macros.html.j2."""
    defined = [
        name
        for path in TEMPLATES
        for name in re.findall(r"{% macro (\w+)", path.read_text(encoding="utf-8"))
    ]

    assert sorted(set(defined)) == sorted(defined)


def test_templates_are_read_in_one_place():
    """jinja2 is imported by documents.py and by no other file of the reports."""
    users = []
    for path in REPORTS.rglob("*.py"):
        imports = [
            node
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.ImportFrom)
        ]
        users += [short(path)] * any(node.module == "jinja2" for node in imports)

    assert users == ["page/documents.py"]


def test_the_plotly_library_is_in_a_page_that_asks_for_it_and_may_run_there():
    """Its hash is one more in the policy; the library stands in the page deflated, in a third of
    its size."""
    fields = {"links": LINKS, "groups": {}, "table": "", "generator": "test"}
    plain, charted = (
        render("lessons/index.html.j2", plotly=plotly, **fields) for plotly in (False, True)
    )
    policies = [re.search(r"script-src ([^;]*);", unescape(page))[1] for page in (plain, charted)]  # type: ignore[index]

    assert [policy.count("sha256-") for policy in policies] == [0, 1]
    assert 'id="library"' not in plain
    assert 1e6 < len(charted) - len(plain) < 2e6


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The names of the templates that are compiled from now on."""
    names: list[str] = []
    whole = Environment.compile

    def noted(self: Environment, source: str, name: str, *rest: object, **named: object) -> object:
        names.append(name)
        return whole(self, source, name, *rest, **named)

    monkeypatch.setattr(Environment, "compile", noted)
    yield names
    environment.cache_clear()


def conventions() -> str:
    """A small part of a page, made as in a new process."""
    environment.cache_clear()
    row = {"asked": "?", "expected": "0", "got": {}}
    return fragment("lessons/conventions.html.j2", about={"made": "today"}, rows=[row])


def test_a_template_is_compiled_once_for_all_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiled: list[str]
):
    """And again, to the same text, if what was kept is not readable as such."""
    monkeypatch.setenv("CROSSCHECK_CACHE", str(tmp_path))
    first, once = conventions(), len(compiled)

    assert once
    assert conventions() == first
    assert len(compiled) == once
    for kept in (tmp_path / "templates").rglob("*.cache"):
        kept.write_bytes(b"no bytecode")
    assert conventions() == first
    assert len(compiled) == 2 * once


@pytest.mark.parametrize("place", ["", "templates"])
def test_where_nothing_can_be_kept_a_page_is_made_all_the_same(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiled: list[str]
):
    """A file stands where the folder should, which stops root, too."""
    home = tmp_path / "cache"
    (home / place).parent.mkdir(exist_ok=True)
    (home / place).write_text("in the way")
    monkeypatch.setenv("CROSSCHECK_CACHE", str(home))
    first, once = conventions(), len(compiled)

    assert conventions() == first
    assert len(compiled) == 2 * once > 0


def test_text_is_escaped_and_a_name_that_nobody_gave_is_an_error():
    """Both hold for pages and for parts of them."""
    name = "<b>engine</b>:shipped"
    page = render(
        "lessons/index.html.j2",
        generator="<i>",
        looks={name: look(name)},
        links=LINKS,
        groups={},
        table="<u>",
    )

    assert "<u>" not in page
    assert "<i>" not in page
    assert "<b>" not in page
    with pytest.raises(UndefinedError):
        fragment("lessons/conventions.html.j2", rows=[])
