"""What leaves by standard output for people: text from data is shown as it is, and steers no terminal."""

from __future__ import annotations

import sys
from typing import Any

import typer
from rich.console import Console
from rich.text import Text

from atg_fg.core.visible_text import visible


class PlainConsole(Console):
    """A console to which all text is data: brackets and colons mean nothing, control characters are written out."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, highlight=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return what rich makes of any text that it is to print: of a line, a title, a cell of a table."""
        return super().render_str(visible(text, keep="\n"), **options)


def say(*lines: str, err: bool = False) -> None:
    """Print lines, on standard error if ``err``; none of them can become two."""
    typer.echo("\n".join(map(visible, lines)), err=err)


def say_document(text: str) -> None:
    """Print a document for other programs as it is, but on a terminal so that it does not steer it."""
    typer.echo(visible(text, keep="\n\t") if sys.stdout.isatty() else text, nl=False)
