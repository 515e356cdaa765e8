"""Links from code named in the text to its entry in the API reference: `RecognitionModel.prior` leads to its docstring.

Only names that are those of exactly one public object of the project become links.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from docutils import nodes
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util.nodes import make_refnode


class CodeLinks(SphinxPostTransform):
    """Turns inline code into a link where it names an object."""

    default_priority = 400

    def run(self, **kwargs: Any) -> None:
        """Go through one page."""
        if self.env.docname.startswith("api/"):
            return
        targets = _targets(self.env)
        for literal in list(self.document.findall(nodes.literal)):
            found = targets.get(literal.astext(), ())
            if len(found) != 1 or isinstance(literal.parent, nodes.reference):
                continue
            (entry,) = found
            reference = make_refnode(
                self.app.builder, self.env.docname, entry.docname, entry.node_id, literal.deepcopy()
            )
            literal.replace_self(reference)


def _targets(env: Any) -> dict[str, set[Any]]:
    """Return the objects of the API reference by each way to name them: `a.b.C.d` is also `C.d`, and `C` alone."""
    targets: dict[str, set[Any]] = defaultdict(set)
    for name, entry in env.domains["py"].objects.items():
        parts = name.split(".")
        if entry.aliased:
            continue
        for length in (1, 2, len(parts)):
            if len(parts) >= length and not (
                length == 1 and entry.objtype in ("attribute", "method", "module", "property")
            ):
                targets[".".join(parts[-length:])].add(entry)
    return targets


def setup(app: Any) -> dict[str, Any]:
    """Register the transform."""
    app.add_post_transform(CodeLinks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
