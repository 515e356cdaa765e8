"""An ATG for other tools: GraphML (yEd, Gephi, Cytoscape, networkx) and DOT (Graphviz)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import networkx

from atg_fg.core.aspect_graph import COLLECTION_NODE

if TYPE_CHECKING:
    from collections.abc import Sequence


#: Characters that no XML 1.0 file can hold, not even escaped; Graphviz stops at the first of them, NUL.
_NOT_XML: Final = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def pattern_text(slots: Sequence[str], pattern: Sequence[int | None]) -> str:
    """Return a pattern in words, such as "front 3, top 5", from slots and symbols of the same length."""
    return ", ".join(f"{slot} {'?' if symbol is None else symbol}" for slot, symbol in zip(slots, pattern, strict=True))


def view_to_graphml(view: networkx.MultiDiGraph[Any], slots: Sequence[str]) -> str:
    """Return a view of an ATG as GraphML text, with the attributes that it has; those that are ``None`` are left out.

    Nodes are "0", "1", … with ``pattern`` ("front 3, top 5"), and "collection" with ``size`` while aspects are
    unobserved. Characters of a name that XML cannot hold become U+FFFD. Read it back with
    ``networkx.parse_graphml(text, force_multigraph=True)``.

    Args:
        view: From ``graph.to_networkx()``, or a completed ATG (``atg_fg/learning/completion.py``).
        slots: Names of the alphabet's slots.
    """
    plain: networkx.MultiDiGraph[str] = networkx.MultiDiGraph(name=_printable(view.graph["name"]))
    slots = [_printable(slot) for slot in slots]
    for node, data in view.nodes(data=True):
        plain.add_node(str(node), **_simple(data, slots))
    # networkx writes the key as the edge's id, and action names repeat: number the edges instead.
    for number, (source, target, data) in enumerate(view.edges(data=True)):
        plain.add_edge(str(source), str(target), key=f"e{number}", **_simple(data, slots))
    return "\n".join(networkx.generate_graphml(plain)) + "\n"


def view_to_dot(view: networkx.MultiDiGraph[Any], slots: Sequence[str]) -> str:
    """Return a view of an ATG as DOT text for Graphviz; arguments are those of ``view_to_graphml``.

    Observed edges are solid and labelled with action and count, unknown ones dotted; the collection node is a
    double-bordered box with its size. What a structure predicts is dashed, with its probability; a pose whose pattern
    is not known is dotted.
    """
    name = _quoted(view.graph["name"])
    lines = [
        f"digraph {name} {{",
        f"  label={name}; labelloc=t;",
        '  node [shape=box, style=rounded, fontname="sans-serif"];',
        '  edge [fontname="sans-serif", fontsize=11];',
    ]
    lines += [f"  {_identifier(node)} [{_node_attributes(node, data, slots)}];" for node, data in view.nodes(data=True)]
    lines += [
        f"  {_identifier(source)} -> {_identifier(target)} [{_edge_attributes(data)}];"
        for source, target, data in view.edges(data=True)
    ]
    return "\n".join([*lines, "}"]) + "\n"


def _simple(data: dict[str, Any], slots: Sequence[str]) -> dict[str, Any]:
    """Return node or edge attributes with every value a text, a number or a truth value."""
    simple: dict[str, Any] = {}
    for key, value in data.items():
        if value is None:
            continue
        if key in ("pattern", "symbols"):
            simple[key] = pattern_text(slots, value)
        elif key == "poses":
            simple[key] = " ".join(map(str, value))
        else:
            simple[key] = _printable(value) if isinstance(value, str) else value
    return simple


def _node_attributes(node: object, data: dict[str, Any], slots: Sequence[str]) -> str:
    if node == COLLECTION_NODE:
        size = data["size"]
        label = f"collection node\n{size} unobserved aspect{'s' if size > 1 else ''}"
        return f"label={_quoted(label)}, style=solid, peripheries=2"
    status = data.get("status", "observed")
    label = f"{node}\n{pattern_text(slots, data.get('symbols', data['pattern']))}"
    if status == "observed":
        return f"label={_quoted(label)}"
    line = "dashed" if status == "predicted" else "dotted"
    probable = f"{label}\n{status}, p {data['probability']:.2f}"
    return f'label={_quoted(probable)}, style="rounded,{line}", color=gray50, fontcolor=gray40'


def _edge_attributes(data: dict[str, Any]) -> str:
    if data["observed"]:
        label = f"{data['action']} ×{data['count']}"
        return f"label={_quoted(label)}, style=solid"
    line = "dashed" if "probability" in data else "dotted"  # an edge that a structure predicts, or one not yet tried
    return f"label={_quoted(data['action'])}, style={line}, color=gray50, fontcolor=gray40"


def _identifier(node: object) -> str:
    """Return a node's name in DOT, which takes a hyphen for an operator unless the name is quoted."""
    text = str(node)
    return _quoted(text) if "-" in text else text


def _printable(text: str) -> str:
    return _NOT_XML.sub("\ufffd", text)


def _quoted(text: str) -> str:
    r"""Return a DOT string that Graphviz draws as ``text``: it reads \N and &lt; in labels, quoted or not."""
    escaped = _printable(text).replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"')
    return '"' + escaped.replace("\r", "").replace("\n", "\\n") + '"'
