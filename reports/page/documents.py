"""Makes a self-contained page: its style, its scripts, and a policy that lets the browser run these only."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from reports.page import style

REPORTS = Path(__file__).parents[1]


def render(template: str, scripts: Sequence[str], styles: Sequence[str], connects: bool = False, **fields: Any) -> str:
    """The page of `template` as text; templates, scripts and styles are paths below `reports`.

    connects: whether its scripts may talk to the server the page comes from.
    """
    environment = Environment(
        loader=FileSystemLoader(REPORTS),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters["number"] = style.number
    environment.filters["for_script"] = for_script
    sources = [(REPORTS / script).read_text(encoding="utf-8") for script in scripts]
    sheet = css() + "".join((REPORTS / sheet).read_text(encoding="utf-8") for sheet in styles)
    policy = content_policy(sources) + ("; connect-src 'self'" if connects else "")
    return environment.get_template(template).render(
        policy=policy, css=Markup(sheet), scripts=[Markup(source) for source in sources], **fields
    )


def css() -> str:
    """The style sheet of all pages with the colours of style.py in front, for light and for dark."""
    light, dark = style.css_variables(dark=False), style.css_variables(dark=True)
    return f":root{{{light}}}@media(prefers-color-scheme:dark){{:root{{{dark}}}}}\n" + (
        REPORTS / "page" / "page.css"
    ).read_text(encoding="utf-8")


def looks_as_json(looks: Mapping[str, style.Look]) -> Markup:
    """The looks for the scripts, with no `<` that could end the block they stand in."""
    return for_script({name: look._asdict() | {"path": look.path} for name, look in looks.items()})


def for_script(value: Any) -> Markup:
    """`value` as JSON that may stand in a script block."""
    return Markup(json.dumps(value).replace("<", "\\u003c"))


def content_policy(scripts: Sequence[str]) -> str:
    """A Content-Security-Policy by which the browser runs these scripts only and fetches nothing."""
    hashes = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in hashes)
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:"
