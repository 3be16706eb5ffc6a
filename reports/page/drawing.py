"""Charts for pages and the README, drawn by matplotlib as SVG: text stays text, an engine has its
colour and marker everywhere, and a dark page changes the colours."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike

from crosscheck2d.reports.page import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    name: str  # `engine:profile`, which has the look
    x: ArrayLike  # what is not finite is left out
    y: ArrayLike
    label: str = ""  # in the legend; "" for none
    filled: int = -1  # the point with a filled marker; -1 for none
    faint: bool = False  # drawn thin, without markers

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
    """Draw `lines` with a legend at the right; `logarithmic`: "x", "y", "xy" or ""; the ticks of a
    logarithmic axis in µs (`x_unit`, `y_unit`) are written as µs, ms and s."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    drawn = [(line, draw_line(axes, line)) for line in lines]
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
    named = [(line, artist) for line, artist in drawn if line.label and len(artist.get_ydata())]
    if not named:
        return
    named.sort(key=lambda pair: pair[1].get_ydata()[-1], reverse=True)  # as the lines end
    legend = axes.legend(
        [artist for _, artist in named],
        ["line"] * len(named),  # matplotlib leaves out a label that begins with _
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        frameon=False,
        handlelength=1.3,
        handletextpad=0.5,
    )
    for name, (line, _) in zip(legend.get_texts(), named):
        name.set(text=line.label, color=line.look.light, fontweight="bold")


def draw_line(axes: Axes, line: Line) -> Any:
    look = line.look
    x, y = (np.asarray(values, float) for values in (line.x, line.y))
    finite = np.isfinite(x) & np.isfinite(y)
    dash: Any = (0, look.dash) if look.dash else "-"
    common = {"color": look.light, "linestyle": dash, "gid": line.name}
    if line.faint:
        return axes.plot(x[finite], y[finite], linewidth=0.8, alpha=0.4, **common)[0]
    face = look.light if look.filled and line.filled < 0 else PAPER
    [drawn] = axes.plot(x[finite], y[finite], marker=marker(look), markerfacecolor=face, **common)
    filled = [k for k in (line.filled,) if 0 <= k < len(x) and finite[k]]
    axes.plot(x[filled], y[filled], marker=marker(look), color=look.light, linestyle="")
    return drawn


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
