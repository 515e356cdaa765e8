"""``atg-fg bench``: what a decision, a trial and Table 1 cost, beside other libraries on the same model."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

import rich.table
import typer

from atg_fg.cli import options
from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import plain_files
from benchmarks import report
from benchmarks.tables import Table, machine_line, tables

BEGIN: Final = "<!-- atg-fg bench: begin -->"
END: Final = "<!-- atg-fg bench: end -->"


def bench(
    quick: Annotated[bool, typer.Option("--quick", help="Only see that everything runs: less than a minute.")] = False,
    sizes: Annotated[str | None, typer.Option(help="Numbers of remembered objects, such as 10,100,1000.")] = None,
    rounds: Annotated[
        int | None, typer.Option(min=1, help="Rounds of all contestants; at most 3 from 10,000 objects on.")
    ] = None,
    tests: Annotated[
        int | None, typer.Option(min=1, help="Tests of Table 1 to time; fewer than 5 are scaled up.")
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(metavar="REVISION", help="Time the code of this revision beside the present, round by round."),
    ] = None,
    given: Annotated[
        Path | None, typer.Option("--from", help="Measure nothing: show what an earlier run wrote with --json.")
    ] = None,
    json_file: options.JsonFile = None,
    markdown: Annotated[
        Path | None, typer.Option(writable=True, help=f"Write the tables into this page, between {BEGIN} and {END}.")
    ] = None,
) -> None:
    """Time engines and other libraries side by side: a filter step, a decision, a trial, Table 1.

    Example: atg-fg bench --sizes 10,100 --json bench.json
    """
    page = None if markdown is None else _page(markdown)
    document = _measured(_plan(quick, sizes, rounds, tests), against) if given is None else _read(given)
    made = _tables(document, given)
    options.write_json(document, json_file)
    if markdown is not None and page is not None:
        before, after = page
        text = f"{before}{BEGIN}\n\n{machine_line(document)}\n\n{_markdown(made)}\n{END}{after}"
        plain_files.write_bytes_atomically(markdown, text.encode())
    if json_file != "-":
        console = options.console()
        console.print(machine_line(document))
        for table in made:
            _print(console, table)


def _plan(quick: bool, sizes: str | None, rounds: int | None, tests: int | None) -> report.Plan:
    plan = report.QUICK if quick else report.Plan()
    if sizes is not None:
        plan = replace(plan, sizes=tuple(_size(text) for text in sizes.split(",")))
    if rounds is not None:
        plan = replace(plan, trial=replace(plan.trial, n_rounds=rounds))
    return plan if tests is None else replace(plan, tests=tests)


def _size(text: str) -> int:
    if not re.fullmatch(r"[1-9][0-9]{0,6}", text.strip()):
        raise InvalidInputError(f"--sizes: {text!r}; expected whole numbers of at least 1, such as 10,100,1000")
    return int(text)


def _measured(plan: report.Plan, against: str | None) -> dict[str, Any]:
    progress = options.console("-")
    return report.run(plan, lambda part: progress.print(f"measuring: {part}", style="dim"), against=against)


def _read(path: Path) -> dict[str, Any]:
    """Return the document of an earlier run."""
    try:
        document = json.loads(plain_files.read_text_file(path))
    except ValueError as error:
        raise InvalidInputError(f"{path}: not JSON: {error}") from error
    version = (document.get("format"), document.get("version")) if isinstance(document, dict) else (None, None)
    if version != (report.FORMAT, 1):
        raise InvalidInputError(f"{path}: not written by atg-fg bench; expected format {report.FORMAT!r}, version 1")
    return dict(document)


def _tables(document: dict[str, Any], given: Path | None) -> list[Table]:
    try:
        return tables(document)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        if given is None:
            raise
        raise InvalidInputError(f"{given}: not as atg-fg bench wrote it: {error!r} is out of place") from error


def _page(path: Path) -> tuple[str, str]:
    """Return what stands before and after the tables of a page, before any work is done."""
    plain_files.check_writable(path)
    text = plain_files.read_text_file(path)
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise InvalidInputError(f"{path}: expected a line {BEGIN} and after it a line {END}")
    return before, after


def _markdown(made: list[Table]) -> str:
    return "\n".join(table.markdown() for table in made if table.rows or table.notes)


def _print(console: Any, table: Table) -> None:
    if not table.rows and not table.notes:
        return
    shown = rich.table.Table(title=table.title, title_justify="left", caption="\n".join(table.notes))
    for number, heading in enumerate(table.headings):
        shown.add_column(heading, justify="right" if number else "left")
    for row in table.rows:
        shown.add_row(*row)
    console.print(shown)
