"""A page is a list of sections; a section has a title, a sentence and parts: tables, charts,
replays, texts. `render_page` makes it a file that loads nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import pandas as pd
from markupsafe import Markup

from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.documents import ENGINE, deflated, environment, render

SCRIPTS = (*ENGINE, "page/kit.js")


@dataclass(frozen=True)
class TableCell:
    value: Any = ""  # a number is formatted by `style.number`; text stands as it is
    title: str = ""  # what is shown where the mouse points at it
    link: str = ""  # an address; `#id` opens the row, the section or the fold of that id
    css: str = ""  # classes of kit.css: best, bad, soft, ...
    side: str = ""  # small, at the right of the value
    notes: tuple[TableCell, ...] = ()  # small, a line each, below the value
    span: int = 1  # columns that it covers

    @property
    def text(self) -> str | Markup:
        return self.value if isinstance(self.value, str) else style.number(self.value)


def as_cell(value: Any) -> TableCell:
    return value if isinstance(value, TableCell) else TableCell(value)


@dataclass(frozen=True, eq=False)
class Table:
    """A pandas frame as a table: its index is the heading of each row, its columns the headings;
    both and what it holds may be `TableCell`."""

    frame: pd.DataFrame
    groups: Sequence[str | TableCell] = ()  # the title of the group of each row
    spans: Sequence[tuple[str | TableCell, int]] = ()  # (title, number of columns) above
    # text of a row's heading -> the parts that its click, or the link `#text` (a blank is `_`
    # there), shows below the row; they are packed, and drawn when they are opened
    opens: Mapping[str, Sequence[Part]] = field(default_factory=dict)
    sortable: bool = False  # whether a heading sorts, and a field filters the rows
    # main (fixed columns), map (small marks), stack (on a phone each row is a block), text (cells
    # break), plain
    css: str = ""
    corner: str = ""  # the heading of the column of row headings
    caption: str = ""  # a sentence below
    kind: ClassVar[str] = "table"

    @property
    def over(self) -> list[tuple[TableCell, int]]:
        return [(as_cell(title), columns) for title, columns in self.spans]

    @property
    def heads(self) -> list[TableCell]:
        return [as_cell(name) for name in self.frame.columns]

    @property
    def rows(self) -> list[tuple[TableCell | None, TableCell, list[TableCell]]]:
        """(title of a group that begins here, heading, cells) of each row."""
        rows, before = [], None
        groups = self.groups or [""] * len(self.frame)
        columns = [list(self.frame.iloc[:, k]) for k in range(self.frame.shape[1])]
        for k, (label, group) in enumerate(zip(self.frame.index, groups)):
            cells, column = [], 0
            while column < len(columns):
                cells.append(as_cell(columns[column][k]))
                column += cells[-1].span
            title = as_cell(group) if group and group != before else None
            rows.append((title, as_cell(label), cells))
            before = group
        return rows

    def packed(self, label: str) -> str:
        macros: Any = environment().get_template("page/kit_parts.html.j2").module
        return deflated(str(macros.parts(self.opens[label])))


@dataclass(frozen=True, eq=False)
class Chart:
    svg: str
    title: str = ""
    caption: str = ""
    kind: ClassVar[str] = "chart"


@dataclass(frozen=True, eq=False)
class Playback:
    """Trajectories that play."""

    pack: str  # `replay.pack_layers`
    ratio: float = 0.5  # height over width of the view, `replay.ratio_of`
    label: str = "Replay"  # what it shows, in words
    caption: str = ""  # a sentence below
    speeds: Sequence[float] = (0.1, 0.25, 0.5, 1, 2, 4)  # to choose from
    speed: float = 1  # the first
    kind: ClassVar[str] = "replay"


@dataclass(frozen=True, eq=False)
class Text:
    """Paragraphs, then a list; `Markup` stands as it is, all else is escaped."""

    paragraphs: Sequence[str | Markup] = ()
    items: Sequence[str | Markup] = ()
    css: str = ""
    ordered: bool = False
    kind: ClassVar[str] = "text"


@dataclass(frozen=True, eq=False)
class Code:
    source: str
    kind: ClassVar[str] = "code"


@dataclass(frozen=True, eq=False)
class Section:
    """A title, a sentence, and parts; a section may be part of another, or of a row that opens."""

    title: str = ""
    says: str | Markup = ""
    parts: Sequence[Part] = ()
    folded: bool = False  # only title and sentence are shown until a click
    id: str = ""  # of the link `#id`
    css: str = ""  # `pair` puts it beside the next section that has it
    kind: ClassVar[str] = "section"


Part = Table | Chart | Playback | Text | Code | Section


class Neighbour(NamedTuple):
    """A page; `href`: in `PAGES` below the folder of all results, in a page relative to it, "" if
    it does not exist."""

    title: str
    says: str
    command: str
    href: str


PAGES = {
    "report": Neighbour(
        "Report", "every scene, engine by engine", "crosscheck", "latest/report.html"
    ),
    "speed": Neighbour(
        "Speed",
        "the cost of an accuracy, and what each error is made of",
        "crosscheck speed",
        "speed/speed.html",
    ),
    "stability": Neighbour(
        "Limits",
        "the speed, density or distance at which an engine fails",
        "crosscheck stability",
        "stability/stability.html",
    ),
    "lessons": Neighbour(
        "Lessons",
        "why engines differ, with scenes that run",
        "crosscheck lesson",
        "lessons/index.html",
    ),
}


def neighbours(page: Path, own: str) -> list[Neighbour]:
    """The pages of `PAGES` besides `own`, as seen from the file `page`: each is looked for at its
    default path, beside the folder of `page`."""
    # a folder that is being written is beside its final place, so links found from it are right
    beside = page.absolute().parent.parent
    return [
        page._replace(href=f"../{page.href}" if (beside / page.href).is_file() else "")
        for key, page in PAGES.items()
        if key != own
    ]


@dataclass(frozen=True, eq=False)
class Page:
    title: str  # of the window and of the first heading
    sections: Sequence[Section]  # in reading order
    generator: str  # the command that makes it; it marks the file as one that may be overwritten
    lead: Sequence[str | Markup] = ()  # what stands below the title, a paragraph each
    names: Sequence[str] = ()  # `engine:profile` of all that is drawn in replays
    looks: Mapping[str, style.Look] = field(default_factory=dict)  # if not by `style.look`
    links: Sequence[Neighbour] = ()  # to other pages, `neighbours`
    footer: str = ""  # the last sentence; the default names the command


def render_page(page: Page) -> str:
    return render(
        "page/kit.html.j2",
        generator=page.generator,
        scripts=SCRIPTS,
        looks={**style.looks_of(page.names), **page.looks},
        page=page,
        version=version("crosscheck2d"),
    )


def run_section(about: Mapping[str, Any]) -> Section:
    facts = {
        "Command": about.get("command", ""),
        "Seed": about.get("seed", ""),
        "Started": str(about.get("started", ""))[:16].replace("T", " "),
        "Machine": "; ".join(f"{key}: {value}" for key, value in about["machine"].items()),
        "Engines": "; ".join(about.get("engines", ())),
        "Versions": ", ".join(f"{key} {value}" for key, value in about["versions"].items()),
    }
    facts = {key: str(value) for key, value in facts.items() if value != ""}
    frame = pd.DataFrame({"": list(facts.values())}, index=list(facts), dtype=object)
    return Section("This run", "command, machine, versions", [Table(frame, css="text plain")], True)


Said = tuple[str, Sequence[str]]
"""A sentence of the check, and the lines of the file and the exercise's formula behind it."""


def sourced(sentence: str, lines: Sequence[str]) -> Markup:
    small = Markup("<br><small>{} <code>{}</code></small>")
    return Markup("").join([sentence, *(small.format(*line.split(": ", 1)) for line in lines)])


def with_lines(says: Sequence[str], shown: Sequence[Sequence[str]]) -> list[Said]:
    """Each sentence with its lines; a sentence that is no fault has none."""
    none: list[Sequence[str]] = [[]] * len(says)
    return list(zip(says, [*shown, *none]))
