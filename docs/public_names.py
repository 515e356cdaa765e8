"""The directive ``public-names``: what the top level of ``atg_fg`` offers of one package, with a line on each."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.ext import autosummary
from sphinx.util.docutils import SphinxDirective

import atg_fg

# Otherwise a summary ends where it names an equation.
autosummary.WELL_KNOWN_ABBREVIATIONS += ("eq.", "sec.", "Fig.")


class PublicNames(SphinxDirective):
    """A table of the public names of a package; nothing if it has none."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        places = [_place(name) for name in atg_fg.__all__]
        names = [place for place in places if place.startswith(f"{self.arguments[0]}.")]
        if not names:
            return []
        lines = [".. autosummary::", "   :nosignatures:", "", *(f"   ~{name}" for name in names)]
        return self.parse_text_to_nodes("\n".join(lines))


def _place(name: str) -> str:
    """Return the full name of a public object, in the module that defines it."""
    module = getattr(getattr(atg_fg, name), "__module__", None)
    if not isinstance(module, str) or not module.startswith("atg_fg."):
        # A table by name, such as ENGINES, does not know where it is from.
        defined = re.compile(rf"^{name}\b.*=", re.MULTILINE)
        loaded = [each for each in sys.modules.values() if each.__name__.startswith("atg_fg.")]
        (module,) = (each.__name__ for each in loaded if defined.search(Path(str(each.__file__)).read_text()))
    return f"{module}.{name}"


def setup(app: Any) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("public-names", PublicNames)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
