"""``atg-fg report``: a trial, a test or a result as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from atg_fg.report.page import environment, write_report
from atg_fg.report.reading import read_report
from atg_fg.storage import plain_files
from atg_fg.storage.memory_files import load_memory


def report(
    file: Annotated[
        Path,
        typer.Argument(
            help="A trial's record (.jsonl), the trials of a test (.jsonl.gz), a run of the goal experiment "
            "(.json.gz), a robot memory with its trials (.db) or without (.json, .npz), or the result of an "
            "experiment (.json).",
            show_default=False,
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", writable=True, help="HTML file to write.")] = Path(
        "report.html"
    ),
    memory: Annotated[
        Path | None, typer.Option(help="Memory that the trial began with, for the ATGs of what it remembered.")
    ] = None,
) -> None:
    """Make one HTML page: a trial, to be looked at step by step, a memory's ATGs, or an experiment's tables and plots.

    The page needs no network and no other file.

    Example: atg-fg report trial.jsonl -o report.html
    """
    plain_files.check_writable(output)
    environment()  # fails now rather than at the end, if Jinja2 is not installed
    remembered = load_memory(memory) if memory is not None else None
    made = read_report(file, remembered)
    write_report(made, output)
    typer.echo(f"saved: {output}")
