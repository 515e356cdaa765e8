"""Settings of the documentation site; `make docs` builds it."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import atg_fg

sys.path.insert(0, str(Path(__file__).parent))  # for the extensions that lie here

project = "atg-fg"
author = "The atg-fg developers"
copyright = author
release = version = atg_fg.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # equations show without network
    "sphinx_design",
    "code_links",
    "public_names",
]
html_theme = "furo"
html_title = "atg-fg"
html_static_path = ["_static"]
html_css_files = ["site.css"]
exclude_patterns = ["_build", "notebooks/*.py", "**.ipynb_checkpoints"]
templates_path = ["_templates"]

# Notebooks are stored with their outputs, and executed by the tests.
nb_execution_mode = "off"
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3

# Two classes may have one name, such as Chain; which one an annotation means is not known to Sphinx.
suppress_warnings = ["ref.python"]

autosummary_generate = True
autodoc_mock_imports = ["ap_gym"]  # an extra by which one class is made
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_numpy_docstring = False
napoleon_use_ivar = True  # autodoc describes attributes itself


def _plain_docstring(app: Any, what: str, name: str, target: Any, options: Any, lines: list[str]) -> None:
    """Keep Sphinx from taking |𝒵| for a substitution, and a name that ends in an underscore for a link.

    The command in a line ``Example: atg-fg …``, as help pages show it, is code.
    """
    lines[:] = [re.sub(r"(?<!`)(\||\w_(?=\W|$))(?!`)", _escaped, line) for line in lines]
    lines[:] = [re.sub(r"^Example: (atg-fg .*)$", r"Example: ``\1``", line) for line in lines]


def _whole_attribute(app: Any, what: str, name: str, target: Any, options: Any, lines: list[str]) -> None:
    """Join what napoleon takes apart: to it, what stands before a colon in an attribute's docstring is a type."""
    if what in ("attribute", "data", "property") and lines and lines[-1].startswith(":type: "):
        beginning = lines.pop().removeprefix(":type: ")
        lines[0] = f"{beginning}: {lines[0]}"


def _escaped(found: re.Match[str]) -> str:
    text = found.group(0)
    return "\\|" if text == "|" else text[:-1] + "\\_"


def _only_this_branch(app: Any, page: str, template: str, context: dict[str, Any], document: Any) -> None:
    """Unfold the table of contents in the margin where the page is; all of it on each of 500 pages takes minutes."""
    table = context.get("toctree")
    if table is not None:
        context["toctree"] = lambda **options: table(**{**options, "collapse": True})


def setup(app: Any) -> None:
    """Add what is of this site alone."""
    app.connect("autodoc-process-docstring", _plain_docstring, priority=100)
    app.connect("autodoc-process-docstring", _whole_attribute, priority=900)
    app.connect("html-page-context", _only_this_branch, priority=100)
