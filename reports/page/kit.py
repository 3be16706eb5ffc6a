"""A page is a list of sections; a section has a title, a sentence and parts: tables, charts,
replays, texts. `render_page` makes it a file that loads nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any, ClassVar

import pandas as pd
from markupsafe import Markup

from crosscheck2d.reports.page import style
from crosscheck2d.reports.page.documents import ENGINE, deflated, environment, render
from crosscheck2d.reports.page.links import Neighbour

SCRIPTS = (*ENGINE, "page/kit.js")


@dataclass(frozen=True)
class TableCell:
    """A cell of a table.

    Attributes:
        value: a number is formatted by `style.number`; text stands as it is.
        title: what is shown where the mouse points at it.
        link: an address; `#id` opens the row, the section or the fold of that id.
        css: classes of kit.css: best, bad, soft, ...
        side: small, at the right of the value.
        notes: small, a line each, below the value.
        span: columns that it covers.
    """

    value: Any = ""
    title: str = ""
    link: str = ""
    css: str = ""
    side: str = ""
    notes: tuple[TableCell, ...] = ()
    span: int = 1

    @property
    def text(self) -> str | Markup:
        return self.value if isinstance(self.value, str) else style.number(self.value)


def as_cell(value: Any) -> TableCell:
    return value if isinstance(value, TableCell) else TableCell(value)


@dataclass(frozen=True, eq=False)
class Table:
    """A pandas frame as a table: its index is the heading of each row, its columns the headings;
    both and what it holds may be `TableCell`.

    Attributes:
        groups: the title of the group of each row, aligned with the frame.
        spans: (title, number of columns) above the columns.
        opens: text of a row's heading -> the parts that its click, or the link `#text` (a blank is
            `_` there), shows below the row; they are packed, and drawn when they are opened.
        sortable: whether a heading sorts, and a field filters the rows.
        css: classes of kit.css: main (fixed columns), map (small marks), stack (on a phone each
            row is a block), text (cells break), plain.
        corner: the heading of the column of row headings.
        caption: a sentence below.
    """

    frame: pd.DataFrame
    groups: Sequence[str | TableCell] = ()
    spans: Sequence[tuple[str | TableCell, int]] = ()
    opens: Mapping[str, Sequence[Part]] = field(default_factory=dict)
    sortable: bool = False
    css: str = ""
    corner: str = ""
    caption: str = ""
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
    """Trajectories that play.

    Attributes:
        pack: the packed layers, `replay.pack_layers`.
        ratio: height over width of the view, `replay.ratio_of`.
        label: what it shows, in words.
        caption: a sentence below.
        speeds, speed: those to choose from, and the first.
    """

    pack: str
    ratio: float = 0.5
    label: str = "Replay"
    caption: str = ""
    speeds: Sequence[float] = (0.1, 0.25, 0.5, 1, 2, 4)
    speed: float = 1
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
    """A title, a sentence, and parts; a section may be part of another, or of a row that opens.

    Attributes:
        folded: whether only the title is shown until it is clicked; the sentence stands beside it.
        id: of the link `#id`.
        css: `pair` puts it beside the next section that has it.
    """

    title: str = ""
    says: str | Markup = ""
    parts: Sequence[Part] = ()
    folded: bool = False
    id: str = ""
    css: str = ""
    kind: ClassVar[str] = "section"


Part = Table | Chart | Playback | Text | Code | Section


@dataclass(frozen=True, eq=False)
class Page:
    """All of a page.

    Attributes:
        title: of the window and of the first heading.
        sections: in reading order.
        generator: the command that makes it; it marks the file as one that may be overwritten.
        lead: what stands below the title, a paragraph each.
        names: `engine:profile` of all that is drawn in replays.
        looks: name -> how it is drawn, if not by `style.look`.
        links: to other pages, `links.neighbours`.
        footer: the last sentence; the default names the command.
    """

    title: str
    sections: Sequence[Section]
    generator: str
    lead: Sequence[str | Markup] = ()
    names: Sequence[str] = ()
    looks: Mapping[str, style.Look] = field(default_factory=dict)
    links: Sequence[Neighbour] = ()
    footer: str = ""


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
