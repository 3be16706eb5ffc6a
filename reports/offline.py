"""What every page of ours has: the style sheet, the looks for its scripts, and a policy by which it fetches nothing."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from reports import style

HERE = Path(__file__).parent


def css() -> str:
    """The page's style sheet with the colours of style.py in front, for light and for dark."""
    light, dark = style.css_variables(dark=False), style.css_variables(dark=True)
    return f":root{{{light}}}@media(prefers-color-scheme:dark){{:root{{{dark}}}}}\n" + (HERE / "page.css").read_text()


def looks_as_json(looks: Mapping[str, style.Look]) -> str:
    """The looks for the scripts, with no `<` that could end the block they stand in."""
    shown = {name: look._asdict() | {"path": look.path} for name, look in looks.items()}
    return json.dumps(shown).replace("<", "\\u003c")


def content_policy(scripts: Sequence[str]) -> str:
    """A Content-Security-Policy by which the browser runs these scripts only and fetches nothing."""
    hashes = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in hashes)
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:"
