"""The figures of a page, judged by plotly's own description of what a figure may hold."""

from __future__ import annotations

import base64
import json
import re
import zlib
from typing import Any, NoReturn

import plotly.graph_objects as go

PACKED = re.compile(r'<script type="text/plain" id="charts:([^"]*)">([^<]*)</script>')


def figures_of(html: str) -> list[dict[str, Any]]:
    """All figures of a page, as a browser reads them: JSON has no nan."""
    return [
        figure
        for _, packed in PACKED.findall(html)
        for figure in json.loads(
            zlib.decompress(base64.b64decode(packed)), parse_constant=no_number
        ).values()
    ]


def no_number(name: str) -> NoReturn:
    """Raise `ValueError`."""
    raise ValueError(f"JSON has no {name}")


def check_figures(html: str) -> int:
    """How many figures a page has; raises `ValueError` if one has a property or a value that
    plotly does not know."""
    figures = figures_of(html)
    for figure in figures:
        go.Figure(figure)
    return len(figures)
