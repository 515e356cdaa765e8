"""The directive ``public-names``: what the top level of ``atg_fg`` offers of one package, with a line on each."""

from __future__ import annotations

import sys
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
    value = getattr(atg_fg, name)
    module = getattr(value, "__module__", None)
    if not isinstance(module, str) or not module.startswith("atg_fg."):
        # A table by name, such as ENGINES: the module nearest to the root that has it.
        owners = [each for each, loaded in sys.modules.items() if each.startswith("atg_fg.") and hasattr(loaded, name)]
        module = min((each for each in owners if getattr(sys.modules[each], name) is value), key=len)
    return f"{module}.{name}"


def setup(app: Any) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("public-names", PublicNames)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
