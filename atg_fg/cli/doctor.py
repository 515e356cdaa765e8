"""``atg-fg doctor``: what works on this machine."""

from __future__ import annotations

from dataclasses import asdict
from typing import Final

import typer
from rich.markup import escape
from rich.table import Table

from atg_fg.cli import options
from atg_fg.doctor import Finding, diagnose

_STYLES: Final = {"works": "green", "missing": "yellow", "broken": "red"}


def doctor(json_file: options.JsonFile = None) -> None:
    """Check versions, inference, and what is installed of the rest; leave with 1 if the core does not work.

    Example: atg-fg doctor
    """
    findings = diagnose()
    options.write_json({"command": "doctor", "findings": [asdict(finding) for finding in findings]}, json_file)
    if json_file != "-":
        options.console().print(_table(findings))
    if any(finding.required and finding.status != "works" for finding in findings):
        raise typer.Exit(1)


def _table(findings: list[Finding]) -> Table:
    table = Table("", "", "found, or what to do", title="What works here", title_justify="left")
    for finding in findings:
        status = f"[{_STYLES[finding.status]}]{finding.status}[/]"
        table.add_row(finding.subject, status, escape(finding.detail))
    return table
