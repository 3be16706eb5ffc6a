"""All pages are made in one way: one base template, one render, one set of macros."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from jinja2 import UndefinedError

from crosscheck2d.reports.page.documents import REPORTS, fragment, render
from crosscheck2d.reports.page.style import look

TEMPLATES = sorted(REPORTS.glob("*/*.j2"))
BASE = "page/base.html.j2"
# no pages: they stand inside of one
INSIDE = ("lessons/conventions", "game/own_solvers", "page/kit_parts")
PARTS = {BASE, *(f"{name}.html.j2" for name in INSIDE)}


def short(path: Path) -> str:
    return path.relative_to(REPORTS).as_posix()


@pytest.mark.parametrize("path", TEMPLATES, ids=short)
def test_every_page_extends_the_base_and_only_the_base_has_a_head(path: Path):
    text = path.read_text(encoding="utf-8")

    assert text.startswith(f'{{% extends "{BASE}" %}}') == (short(path) not in PARTS)
    assert ("<head>" in text) == (short(path) == BASE)


def test_no_macro_is_defined_twice():
    defined = [
        name
        for path in TEMPLATES
        for name in re.findall(r"{% macro (\w+)", path.read_text(encoding="utf-8"))
    ]

    assert sorted(set(defined)) == sorted(defined)


def test_templates_are_read_in_one_place():
    users = [
        short(path)
        for path in REPORTS.rglob("*.py")
        if any(getattr(n, "module", "") == "jinja2" for n in ast.walk(ast.parse(path.read_text())))
    ]

    assert users == ["page/documents.py"]


def test_text_is_escaped_and_a_name_that_nobody_gave_is_an_error():
    name = "<b>engine</b>:shipped"
    fields = {"links": {"game": "", "lesson": ""}, "groups": {}, "table": "<u>"}
    page = render("lessons/index.html.j2", generator="<i>", looks={name: look(name)}, **fields)

    assert "<u>" not in page
    assert "<i>" not in page
    assert "<b>" not in page
    with pytest.raises(UndefinedError):
        fragment("lessons/conventions.html.j2", rows=[])
