"""Makes a self-contained page: its style, its scripts, and a policy that allows only these
scripts."""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from crosscheck2d.reports.page import style
from crosscheck2d.reports.terminal.foreign_text import encoded

REPORTS = Path(__file__).parents[1]
ENGINE = ("page/player.js",)  # the replay


def render(
    template: str,
    *,
    generator: str,
    scripts: Sequence[str] = (),
    styles: Sequence[str] = (),
    looks: Mapping[str, style.Look] = MappingProxyType({}),
    connects: bool = False,
    **fields: Any,
) -> str:
    """The page of `template`, which extends base.html.j2, as text; templates, scripts, styles:
    paths below `reports`.

    Args:
        generator: the command that makes it; it marks the file as one that may be overwritten.
        looks: name -> how it is drawn.
        connects: whether its scripts may connect to the server of the page.
        fields: the other names of the template; a missing one raises `jinja2.UndefinedError`.
    """
    sources = [(REPORTS / script).read_text(encoding="utf-8") for script in scripts]
    sheets = [(REPORTS / name).read_text(encoding="utf-8") for name in ("page/kit.css", *styles)]
    light, dark = style.css_variables(dark=False), style.css_variables(dark=True)
    colours = f":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n"
    digests = (hashlib.sha256(source.encode()).digest() for source in sources)
    hashes = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    policy = f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'"
    policy += "; img-src data: blob:" + "; connect-src 'self'" * connects
    return fragment(
        template,
        generator=generator,
        policy=policy,
        css=Markup("".join([colours, *sheets])),
        looks=looks,
        looks_json=for_script(
            {name: look._asdict() | {"path": look.path} for name, look in looks.items()}
        ),
        scripts=[Markup(source) for source in sources],
        **fields,
    )


def fragment(template: str, **fields: Any) -> str:
    """A template as text, filled with `fields`: a page, or a part of one."""
    return environment().get_template(template).render(**fields)


@cache
def environment() -> Environment:
    templates = Environment(
        loader=FileSystemLoader(REPORTS),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    templates.filters.update(number=style.number, for_script=for_script)
    return templates


def for_script(value: Any) -> Markup:
    return Markup(json.dumps(value).replace("<", "\\u003c"))


def deflated(text: str) -> str:
    """Text, deflated, as base64: what `inflate` of player.js reads."""
    return base64.b64encode(zlib.compress(encoded(text))).decode()
