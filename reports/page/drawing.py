"""Charts for pages and the README, drawn by matplotlib as SVG: text stays text, an engine has its
colour and marker everywhere, and a dark page changes the colours."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from functools import partial
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
        return style.look(*self.name.partition(":")[::2])


def new_figure(width: float = 5.8, height: float = 3.6) -> tuple[Figure, Any]:
    """An empty figure of this size in inches (100 pixels of a page), and its axes."""
    from matplotlib import rc_context  # 0.3 s: only pages with charts pay
    from matplotlib.figure import Figure

    with rc_context(SETTINGS):
        figure = Figure((width, height), layout="constrained")
        return figure, figure.subplots()


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
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    for line in lines:
        draw_line(axes, line)
    for letter, axis, unit in (("x", axes.xaxis, x_unit), ("y", axes.yaxis, y_unit)):
        if letter in logarithmic:
            axes.set(**{f"{letter}scale": "log"})
            low, high = axis.get_view_interval()
            few = np.log10(high / low) < 4  # then there are ticks at 3 between powers of ten
            axis.set_major_locator(LogLocator(subs=(1.0, 3.0) if few else (1.0,), numticks=9))
            axis.set_minor_locator(NullLocator())
            text = format_time if unit else partial(style.number, digits=2)
            axis.set_major_formatter(FuncFormatter(lambda value, _, text=text: text(value)))
    axes.set_xlabel(x_title)
    if y_title:  # across the top: nobody turns the head
        axes.set_title(y_title, loc="left", fontsize=9, color=SOFT)
    label_lines(axes, [line for line in lines if line.label])


def draw_line(axes: Axes, line: Line) -> None:
    look = line.look
    x, y = (np.asarray(values, float) for values in (line.x, line.y))
    finite = np.isfinite(x) & np.isfinite(y)
    dash: Any = (0, look.dash) if look.dash else "-"
    common = {"color": look.light, "linestyle": dash, "gid": line.name}
    if line.faint:
        axes.plot(x[finite], y[finite], linewidth=0.8, alpha=0.4, **common)
        return
    face = look.light if look.filled and line.filled < 0 else PAPER
    axes.plot(x[finite], y[finite], marker=marker(look), markerfacecolor=face, **common)
    filled = [k for k in (line.filled,) if 0 <= k < len(x) and finite[k]]
    axes.plot(x[filled], y[filled], marker=marker(look), color=look.light, linestyle="")


def marker(look: style.Look) -> Any:
    from matplotlib.path import Path

    if look.shape == "circle":
        return "o"
    points: list[tuple[float, float]] = []
    for letter, numbers in re.findall(r"([MLHV])([^A-Z]*)", look.path):
        values = [float(text) for text in re.findall(r"-?[\d.]+", numbers)]
        if letter in "HV":
            x, y = points[-1]
            points.append((values[0], y) if letter == "H" else (x, values[0]))
        else:
            points += zip(values[::2], values[1::2])
    turned = [(x, -y) for x, y in [*points, points[0]]]  # y of SVG points down
    return Path(turned, closed=True)


def format_time(value: float) -> str:
    units = ((1e6, "s"), (1e3, "ms"), (1.0, "µs"))
    size, unit = next((unit for unit in units if value >= 0.9 * unit[0]), units[-1])
    return f"{style.number(value / size, 2)} {unit}"


def label_lines(axes: Axes, lines: Sequence[Line]) -> None:
    """Write each label at an end of its line, where it covers least.

    Where all lines end at the right, the labels stand below each other there, with a thin line from
    each end.
    """
    ends = []  # the points of each line that are drawn
    for line in lines:
        points = np.column_stack([np.asarray(line.x, float), np.asarray(line.y, float)])
        ends.append(points[np.isfinite(points).all(axis=1)])
    lines = [line for line, end in zip(lines, ends) if len(end)]
    ends = [end for end in ends if len(end)]
    if not lines:
        return
    figure: Any = axes.figure
    axes.autoscale_view()
    figure.draw_without_rendering()  # settles the layout, in which labels then find their places
    figure.set_layout_engine("none")
    height = 11.0 * figure.dpi / 72
    longest = 0.58 * height * max(len(line.label) for line in lines)
    left, bottom, width, tall = axes.get_position().bounds
    to_pixels = axes.transData.transform
    right = min(axes.transAxes.inverted().transform(to_pixels(end[-1]))[0] for end in ends)
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
            write_label(axes, lines[k], ends[k][-1], (x, y - to_pixels(ends[k][-1])[1]), lead=True)
        return
    drawn = [to_pixels(end) for end in ends]
    taken = np.vstack([dense(points) for points in drawn])
    (left, bottom), (_, top) = to_pixels(list(zip(axes.get_xlim(), axes.get_ylim())))
    for line, end, points in zip(lines, ends, drawn):
        width = 0.55 * height * len(line.label)
        beside = ((9, -4), (9, 5), (9, -13), (-9 - width, -4), (-width / 2, 9), (-width / 2, -19))
        choices: list[Any] = []
        for (at_x, at_y), anchor in ((points[-1], end[-1]), (points[0], end[0])):
            for dx, dy in beside:
                x, y = at_x + dx, at_y + dy
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
        write_label(axes, line, anchor, (dx, dy))
        box = [
            (x + width * u, y + height * v) for u in np.linspace(0, 1, 9) for v in (0.1, 0.5, 0.9)
        ]
        taken = np.vstack([taken, box])


def dense(points: Any) -> Any:
    steps = np.linspace(0, 1, 12)[:, None]
    return np.vstack([points, *(start + steps * (end - start) for start, end in pairwise(points))])


def write_label(
    axes: Axes, line: Line, end: Any, offset: tuple[float, float], lead: bool = False
) -> None:
    """The label of a line, this far from its end in pixels, in its colour."""
    colour, points = line.look.light, 72 / axes.figure.dpi
    arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 4}
    axes.annotate(
        line.label, end, (offset[0] * points, offset[1] * points), textcoords="offset points",
        color=colour, weight="bold", va="center" if lead else "baseline",
        arrowprops=arrow if lead else None, annotation_clip=False,
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
    role = f'<svg role="img" aria-label="{Markup.escape(label)}"'
    if alone:
        return Markup(text.replace("<svg", role, 1))
    text = text.replace("font: ", "font-family:inherit;font: ")
    text = re.sub(r' width="[\d.]+pt"| height="[\d.]+pt"', "", text, count=2)
    text = text.replace("<svg", role, 1)
    # each colour as a variable of the page, which a dark page changes
    names = {mark.light: f"--{mark.light.removeprefix('#')}" for mark in style.marks()} | VARIABLES
    for colour in set(re.findall(r"#[0-9a-f]{6}", text)) & names.keys():
        text = text.replace(colour, f"var({names[colour]},{colour})")
    return Markup(text)
