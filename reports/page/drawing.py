"""Charts for pages and the README, drawn by matplotlib as SVG: text stays text, an engine has its
colour and marker everywhere, and a dark page changes the colours."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike

from crosscheck2d.reports.page import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ENDS = 0.75  # of the width: labels of lines that all end right of it stand below each other
INK, SOFT, RULE, PAPER = "#16191d", "#57626e", "#dfe3e0", "#fefefe"
VARIABLES = {SOFT: "--soft", RULE: "--line", PAPER: "--page"}
SETTINGS: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "crosscheck",
    "font.size": 9,
    "text.color": SOFT,
    "axes.labelcolor": SOFT,
    "axes.labelsize": 9,
    "axes.edgecolor": RULE,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": RULE,
    "grid.linewidth": 0.7,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.minor.visible": False,
    "lines.linewidth": 1.5,
    "lines.markersize": 5.5,
}


class Line(NamedTuple):
    """A line of a chart.

    Attributes:
        name: `engine:profile`, which has the look.
        x, y: what is not finite is left out.
        label: stands at an end of the line; "" for none.
        filled: the point with a filled marker; -1 for none.
        faint: drawn thin, without markers.
    """

    name: str
    x: ArrayLike
    y: ArrayLike
    label: str = ""
    filled: int = -1
    faint: bool = False

    @property
    def look(self) -> style.Look:
        """How it is drawn."""
        return style.look(*self.name.partition(":")[::2])


def new_figure(width: float = 5.8, height: float = 3.6, **grid: Any) -> tuple[Figure, Any]:
    """An empty figure of this size in inches (100 pixels of a page), and its axes; `grid` goes to
    `Figure.subplots`."""
    from matplotlib import rc_context  # 0.3 s: only pages with charts pay
    from matplotlib.figure import Figure

    with rc_context(SETTINGS):
        figure = Figure((width, height), layout="constrained")
        return figure, figure.subplots(**grid)


def draw_lines(
    axes: Axes,
    lines: Sequence[Line],
    x_title: str = "",
    y_title: str = "",
    logarithmic: str = "xy",
    x_unit: str = "",
    y_unit: str = "",
) -> None:
    """Draw `lines` with their labels; `logarithmic`: "x", "y", "xy" or ""; the ticks of a
    logarithmic axis in µs (`x_unit`, `y_unit`) are written as µs, ms and s."""
    for line in lines:
        draw_line(axes, line)
    for axis, is_log in ((axes.xaxis, "x" in logarithmic), (axes.yaxis, "y" in logarithmic)):
        if is_log:
            (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
            label_decades(axis, x_unit if axis is axes.xaxis else y_unit)
    axes.set_xlabel(x_title)
    if y_title:  # across the top: nobody turns the head
        axes.set_title(y_title, loc="left", fontsize=9, color=SOFT)
    label_lines(axes, [line for line in lines if line.label])


def draw_line(axes: Axes, line: Line) -> None:
    """One line in the look of its engine."""
    look = line.look
    x, y = (np.asarray(values, float) for values in (line.x, line.y))
    seen = np.isfinite(x) & np.isfinite(y)
    filled = [k for k in (line.filled,) if 0 <= k < len(x) and seen[k]]
    dash: Any = (0, look.dash) if look.dash else "-"
    common = {"color": look.light, "linestyle": dash, "gid": line.name}
    if line.faint:
        axes.plot(x[seen], y[seen], linewidth=0.8, alpha=0.4, **common)
        return
    face = look.light if look.filled and line.filled < 0 else PAPER
    axes.plot(x[seen], y[seen], marker=marker(look), markerfacecolor=face, **common)
    axes.plot(x[filled], y[filled], marker=marker(look), color=look.light, linestyle="")


def marker(look: style.Look) -> Any:
    """The shape of a look as a marker of matplotlib."""
    from matplotlib.path import Path

    if look.shape == "circle":
        return "o"
    points: list[tuple[float, float]] = []
    for letter, numbers in re.findall(r"([MLHV])([^A-Z]*)", look.path):
        values = [float(text) for text in re.findall(r"-?[\d.]+", numbers)]
        if letter in "HV":
            last = points[-1]
            points.append((values[0], last[1]) if letter == "H" else (last[0], values[0]))
        else:
            points += zip(values[::2], values[1::2])
    turned = [(x, -y) for x, y in [*points, points[0]]]  # y of SVG points down
    return Path(turned, closed=True)


def label_decades(axis: Any, unit: str = "") -> None:
    """Ticks of a logarithmic axis at powers of ten, and at 3 between them if these are few."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    low, high = axis.get_view_interval()
    few = np.log10(high / low) < 4
    axis.set_major_locator(LogLocator(subs=(1.0, 3.0) if few else (1.0,), numticks=9))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: tick_text(value, unit)))


def tick_text(value: float, unit: str = "") -> str:
    """A value on an axis; with the unit µs as µs, ms or s."""
    if unit == "µs":
        for size, name in ((1e6, "s"), (1e3, "ms"), (1.0, "µs")):
            if value >= 0.9 * size:
                return f"{style.number(value / size, 2)} {name}"
        return f"{style.number(value, 2)} µs"
    return style.number(value, 2) + (f" {unit}" if unit else "")


def label_lines(axes: Axes, lines: Sequence[Line]) -> None:
    """Write each label at an end of its line, where it covers least.

    Where all lines end at the right, the labels stand below each other there, with a thin line from
    each end.
    """
    ends = [finite_ends(line) for line in lines]
    lines = [line for line, end in zip(lines, ends) if end]
    ends = [end for end in ends if end]
    if not lines:
        return
    figure: Any = axes.figure
    axes.autoscale_view()
    figure.draw_without_rendering()  # settles the layout, in which labels then find their places
    figure.set_layout_engine("none")
    height = 11.0 * figure.dpi / 72
    longest = 0.58 * height * max(len(line.label) for line in lines)
    left, bottom, width, tall = axes.get_position().bounds
    right = min(
        axes.transAxes.inverted().transform(axes.transData.transform(e[-1]))[0] for e in ends
    )
    stacked = len(lines) > 1 and right > ENDS
    room = (longest + 30 if stacked else 0.5 * longest) / figure.bbox.width
    axes.set_position((left, bottom, width - room, tall))
    to_pixels = axes.transData.transform
    if stacked:
        order = sorted(range(len(lines)), key=lambda k: ends[k][-1][1])
        heights = [to_pixels(ends[k][-1])[1] for k in order]
        for k in range(1, len(heights)):
            heights[k] = max(heights[k], heights[k - 1] + 1.1 * height)
        for k, y in zip(order, heights):
            x = axes.bbox.x1 + 8 - to_pixels(ends[k][-1])[0]
            offset = (x * 72 / figure.dpi, (y - to_pixels(ends[k][-1])[1]) * 72 / figure.dpi)
            write_label(axes, lines[k], ends[k][-1], offset, lead=True)
        return
    drawn = [to_pixels(np.array(end)) for end in ends]
    taken = np.vstack([dense(points) for points in drawn])
    (left, bottom), (_, top) = to_pixels(
        [(axes.get_xlim()[0], axes.get_ylim()[0]), (axes.get_xlim()[1], axes.get_ylim()[1])]
    )
    for line, end, points in zip(lines, ends, drawn):
        width = 0.55 * height * len(line.label)
        choices: list[Any] = []
        for point, anchor in ((points[-1], end[-1]), (points[0], end[0])):
            for dx, dy in (
                (9, -4),
                (9, 5),
                (9, -13),
                (-9 - width, -4),
                (-width / 2, 9),
                (-width / 2, -19),
            ):
                x, y = point[0] + dx, point[1] + dy
                covers = (
                    (taken[:, 0] > x - 8)
                    & (taken[:, 0] < x + width + 8)
                    & (taken[:, 1] > y - 3)
                    & (taken[:, 1] < y + height)
                ).sum()
                outside = (
                    x < left or x + width > figure.bbox.width or y < bottom or y + height > top + 9
                )
                choices.append((covers + 99 * outside + 0.01 * len(choices), dx, dy, anchor, x, y))
        _, dx, dy, anchor, x, y = min(choices, key=lambda choice: choice[0])
        write_label(axes, line, anchor, (dx * 72 / figure.dpi, dy * 72 / figure.dpi))
        box = [
            (x + width * u, y + height * v) for u in np.linspace(0, 1, 9) for v in (0.1, 0.5, 0.9)
        ]
        taken = np.vstack([taken, box])


def finite_ends(line: Line) -> list[tuple[float, float]]:
    """The points of a line that are drawn."""
    points = zip(np.asarray(line.x, float), np.asarray(line.y, float))
    return [(x, y) for x, y in points if np.isfinite(x) and np.isfinite(y)]


def dense(points: Any) -> Any:
    """Points along a line through these, in pixels."""
    parts = [points]
    for start, end in pairwise(points):
        parts.append(start + np.linspace(0, 1, 12)[:, None] * (end - start))
    return np.vstack(parts)


def write_label(
    axes: Axes,
    line: Line,
    end: tuple[float, float],
    offset: tuple[float, float],
    lead: bool = False,
) -> None:
    """The label of a line, this far from its end in points, in its colour."""
    colour = line.look.light
    arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 4}
    axes.annotate(
        line.label, end, offset, textcoords="offset points", color=colour, weight="bold",
        va="center" if lead else "baseline", arrowprops=arrow if lead else None,
        annotation_clip=False,
    )  # fmt: skip


def svg_of(figure: Figure, label: str, alone: bool = False) -> Markup:
    """The figure as SVG for a page; `label`: what it shows, for who cannot see it; `alone`: as a
    file of its own, on white."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    FigureCanvasSVG(figure)
    file = io.StringIO()
    with rc_context(SETTINGS):
        figure.savefig(file, format="svg", transparent=not alone, metadata={"Date": None})
    text = file.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.DOTALL)
    used = set(re.findall(r"[#(]#?([\w-]+)[)\"]", text))
    text = re.sub(r' id="([^"]*)"', lambda m: m[0] if m[1] in used else "", text)
    # in attributes only: a label 0.003 stays
    text = re.sub(r'"[^"]*"', lambda m: re.sub(r"(\d+\.\d\d)\d+", r"\1", m[0]), text)
    text = re.sub(r"\n\s*", "\n", text)
    text = text.replace("font: ", "font-family:inherit;font: ") if not alone else text
    text = re.sub(r' width="[\d.]+pt"| height="[\d.]+pt"', "", text, count=2) if not alone else text
    role = f'<svg role="img" aria-label="{Markup.escape(label)}"'
    return Markup(text.replace("<svg", role, 1) if alone else themed(text.replace("<svg", role, 1)))


def themed(text: str) -> str:
    """SVG with each colour as a variable of the page, which a dark page changes."""
    found = set(re.findall(r"#[0-9a-f]{6}", text))
    for colour in found & {*VARIABLES, *colours()}:
        name = VARIABLES.get(colour) or variable(colour)
        text = text.replace(colour, f"var({name},{colour})")
    return text


def colours() -> Mapping[str, str]:
    """The light colour of every mark -> the dark one."""
    return {mark.light: mark.dark for mark in style.marks()}


def variable(colour: str) -> str:
    """The variable of a page with the colour that is this one on a light page."""
    return f"--{colour.removeprefix('#')}"
