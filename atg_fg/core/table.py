"""Small tables that show themselves in a notebook, and are plain text elsewhere.

No colour of text or ground is set, and lines and bars are of colours that stand out from both, so that a table is
readable in light and dark themes. Everything that is shown is escaped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final, TypeAlias

_LINE: Final = "1px solid rgba(127, 127, 127, 0.35)"
_CELL: Final = "text-align: left; padding: 0.15em 0.8em 0.15em 0; white-space: nowrap"


@dataclass(frozen=True)
class Bar:
    """A number that is also drawn.

    Attributes:
        share: From 0 to 1, the length of the bar.
        text: What is written beside it.
    """

    share: float
    text: str

    def __str__(self) -> str:
        return self.text


Cell: TypeAlias = str | Bar


@dataclass(frozen=True)
class Table:
    """A table with a title above and a note below.

    Attributes:
        title: What it is about.
        headings: Of the columns.
        rows: Cells, as many in each row as there are headings.
        note: What else is to be said; may be empty.
    """

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""

    def _repr_html_(self) -> str:
        head = "".join(f'<th style="{_CELL}; border-bottom: {_LINE}">{escape(text)}</th>' for text in self.headings)
        body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in self.rows)
        note = f'<div style="opacity: 0.75">{escape(self.note)}</div>' if self.note else ""
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>" if self.headings else ""
        return f"<div><div><b>{escape(self.title)}</b></div>{table}{note}</div>"

    def __str__(self) -> str:
        lines = [[str(cell) for cell in row] for row in (self.headings, *self.rows)]
        widths = [max(len(line[column]) for line in lines) for column in range(len(self.headings))]
        table = ["  ".join(map(str.ljust, line, widths)).rstrip() for line in lines if line]
        return "\n".join([self.title, *table, *([self.note] if self.note else [])])

    __repr__ = __str__


def shortened(rows: Sequence[tuple[Cell, ...]], most: int, kind: str) -> tuple[tuple[Cell, ...], ...]:
    """Return the first ``most`` rows, and one that says how many others of this kind there are."""
    if len(rows) <= most:
        return tuple(rows)
    rest: tuple[Cell, ...] = (f"… and {len(rows) - most} other {kind}", *[""] * (len(rows[0]) - 1))
    return (*rows[:most], rest)


def _cell(cell: Cell) -> str:
    if isinstance(cell, str):
        return f'<td style="{_CELL}">{escape(cell)}</td>'
    length = f"{100 * min(max(cell.share, 0.0), 1.0):.1f}%"
    return (
        f'<td style="{_CELL}"><span style="display: inline-block; width: 6em; height: 0.65em; margin-right: 0.5em; '
        f'background: rgba(127, 127, 127, 0.25)"><span style="display: block; width: {length}; height: 100%; '
        f'background: #2f8fce"></span></span>{escape(cell.text)}</td>'
    )


#: Rows that are shown of a long table of results.
ROWS: Final = 40
