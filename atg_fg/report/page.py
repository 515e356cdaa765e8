"""The HTML page: a template, its style and its scripts, all in one file that asks for nothing from elsewhere."""

from __future__ import annotations

import base64
import hashlib
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final

from atg_fg.core.errors import needed_by
from atg_fg.report.content import Report
from atg_fg.report.drawn_plot import WIDTH, drawn
from atg_fg.storage.plain_files import write_bytes_atomically

if TYPE_CHECKING:
    from jinja2 import Environment

#: In the order in which they are run.
_SCRIPTS: Final = ("elements.js", "aspect.js", "graph.js", "entropy.js", "trial.js")
_GALLERY_SCRIPTS: Final = ("elements.js", "aspect.js", "graph.js", "gallery.js")


def write_report(report: Report, path: Path) -> None:
    """Write a page, whole or not at all.

    Raises:
        InvalidInputError: The path cannot be written.
        MissingDependencyError: Jinja2 is not installed.
    """
    write_bytes_atomically(path, page(report).encode())


def page(report: Report) -> str:
    """Return a page as HTML.

    Raises:
        MissingDependencyError: Jinja2 is not installed.
    """
    template = environment().get_template("page.html")
    names = _SCRIPTS if report.trials else _GALLERY_SCRIPTS if report.gallery else ()
    scripts = [_packaged(name) for name in names]
    return template.render(
        report=report,
        data=report.trial_data(),
        plots=[drawn(plot) for plot in report.plots],
        plot_width=WIDTH,
        style=_packaged("page.css"),
        scripts=scripts,
        # The browser runs these scripts and no other, whatever a name in the data may hold.
        script_policy=" ".join(_source_of(script) for script in scripts) or "'none'",
    )


def environment() -> Environment:
    """Return Jinja2 with the templates of this package; all that they insert is escaped.

    Raises:
        MissingDependencyError: Jinja2 is not installed.
    """
    with needed_by("report", "Jinja2", "report"):
        from jinja2 import Environment, PackageLoader, StrictUndefined
    loader = PackageLoader("atg_fg.report", "data")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)


def _packaged(name: str) -> str:
    return files("atg_fg.report").joinpath("data", name).read_text(encoding="utf-8")


def _source_of(script: str) -> str:
    """Return how a content security policy names a script: by its hash."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
