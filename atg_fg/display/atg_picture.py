"""A picture of an Aspect Transition Graph like the paper's Figure 1.

Known aspects stand on a circle, each as a small view of the object; solid arrows are observed transitions, dotted ones
have not been tried and lead to the collection node in the middle.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph, Edge
from atg_fg.core.checks import brief, instance, sequence, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.display.aspect_picture import (
    INCHES_PER_UNIT,
    Images,
    action_color,
    check_images,
    draw_arrow,
    draw_aspect,
    draw_frame,
)
from atg_fg.display.figures import GREY, figure_class, plot_style
from atg_fg.display.plot_parts import named_legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: Half the width and height of the collection node's box.
_COLLECTION_BOX: Final = np.array([1.05, 0.34])


def draw_atg(
    graph: AspectTransitionGraph,
    *,
    symbol_images: Images | None = None,
    highlight: int | None = None,
    path: Collection[Edge] = (),
) -> Figure:
    """Draw an ATG.

    Args:
        graph: The graph; 1 to about 24 aspects are readable.
        symbol_images: Of each symbol, grey of shape [pixels, pixels] or RGB, such as thumbnails of classes
            (``AppearanceSense.thumbnails``); its number is written where there is none.
        highlight: Index of an aspect to frame, such as the current one.
        path: Counted transitions to draw strong, such as the way to a goal, while the others are pale.

    Raises:
        InvalidInputError: There is no aspect ``highlight``, a transition of ``path`` was never counted, or an image is
            none.
        MissingDependencyError: matplotlib is not installed.
    """
    instance(graph, "ATG", AspectTransitionGraph)
    if highlight is not None:
        whole_number(highlight, "highlight, a known aspect", 0, graph.n_known - 1)
    for edge in sequence(path, "path"):
        if not isinstance(edge, tuple) or edge not in graph.counts:
            raise InvalidInputError(f"path: transition {brief(edge)}; expected one that {graph.name!r} has counted")
    check_images(symbol_images)
    places, radius = _places(graph.n_known)
    extent = radius + 1.0
    with plot_style():
        side = 2 * extent * INCHES_PER_UNIT
        figure = figure_class()(figsize=(side, side + 0.6))
        axes = figure.add_axes((0, 0, 1, side / (side + 0.6)))
        axes.set(xlim=(-extent, extent), ylim=(-extent, extent), aspect="equal")
        axes.axis("off")
        _draw_unknown(axes, graph, places)
        _draw_observed(axes, graph, places, path)
        _draw_collection(axes, graph)
        for aspect, pattern in enumerate(graph.aspects):
            outline = draw_aspect(axes, graph.assumptions.alphabet, pattern, places[aspect], symbol_images or {})
            if aspect == highlight:
                draw_frame(axes, outline)
        axes.set(xlim=(-extent, extent), ylim=(-extent, extent))  # images move the limits
        _draw_legend(figure, graph)
    return figure


def _places(n_aspects: int) -> tuple[FloatArray, float]:
    """Return the middle of each aspect, shape [n, 2], on a circle that is wide enough, and its radius."""
    radius = max(2.2, 1.75 * n_aspects / (2 * np.pi))
    angles = np.pi / 2 - 2 * np.pi * np.arange(n_aspects) / max(n_aspects, 1)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)]), radius


def _draw_unknown(axes: Axes, graph: AspectTransitionGraph, places: FloatArray) -> None:
    """Draw a dotted arrow to the collection node for each action that was not tried."""
    if not graph.n_unobserved:
        return
    middle = (len(graph.assumptions.actions) - 1) / 2
    for aspect, action in graph.unknown_transitions():
        style = {"linestyle": (0, (1, 2)), "color": action_color(action), "linewidth": 1.1, "alpha": 0.75}
        # The arrow ends at the border of the node's box rather than in its middle.
        border = places[aspect] * (_COLLECTION_BOX / np.maximum(np.abs(places[aspect]), 1e-9)).min()
        draw_arrow(axes, places[aspect], border, 0.13 * (action - middle), 0.05, **style)


def _draw_observed(axes: Axes, graph: AspectTransitionGraph, places: FloatArray, path: Collection[Edge]) -> None:
    """Draw a solid arrow for each counted transition, the more bent the more there are between two aspects."""
    between: Counter[tuple[int, int]] = Counter()
    for (source, action, target), count in sorted(graph.counts.items()):
        number = between[source, target]
        between[source, target] += 1
        strength = _strength((source, action, target), path)
        if source == target:
            label = _draw_loop(axes, places[source], number, color=action_color(action), **strength)
        else:
            # A straight way through the middle would be hidden by the collection node.
            through_middle = np.linalg.norm(places[source] + places[target]) < 1.0
            bend = 0.16 + 0.13 * number + 0.4 * bool(through_middle and graph.n_unobserved)
            draw_arrow(axes, places[source], places[target], bend, 0.66, color=action_color(action), **strength)
            span = places[target] - places[source]
            label = (places[source] + places[target]) / 2 + bend / 2 * np.array([span[1], -span[0]])
        if count > 1:
            axes.annotate(
                f"×{count}", tuple(label), ha="center", va="center", fontsize=7.5, color=action_color(action),
                bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none"}, zorder=2,
            )  # fmt: skip


def _strength(edge: Edge, path: Collection[Edge]) -> dict[str, float]:
    if not path:
        return {"linewidth": 1.6}
    return {"linewidth": 4.0} if edge in path else {"linewidth": 1.2, "alpha": 0.4}


def _draw_loop(axes: Axes, place: FloatArray, number: int, **style: Any) -> FloatArray:
    """Draw an arrow from an aspect to itself, on its outer side; return where its label goes."""
    outward = place / np.linalg.norm(place)
    sideways = np.array([-outward[1], outward[0]])
    foot = place + 0.55 * outward
    reach = 0.30 + 0.14 * number
    start, end = foot + 0.22 * sideways, foot - 0.22 * sideways
    axes.annotate(
        "", tuple(end), tuple(start), zorder=1,
        arrowprops={"arrowstyle": "-|>", **style,
                    "connectionstyle": f"arc3,rad={-4 * reach}", "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    return np.asarray(foot + 2 * reach * 0.44 * outward)


def _draw_collection(axes: Axes, graph: AspectTransitionGraph) -> None:
    if not graph.n_unobserved:
        return
    noun = "aspect" if graph.n_unobserved == 1 else "aspects"
    axes.annotate(
        f"collection node\n{graph.n_unobserved} unobserved {noun}", (0, 0), ha="center", va="center", fontsize=9,
        bbox={"boxstyle": "round,pad=0.6", "facecolor": "#f4f4f4", "edgecolor": GREY, "linestyle": "--"}, zorder=3,
    )  # fmt: skip


def _draw_legend(figure: Figure, graph: AspectTransitionGraph) -> None:
    from matplotlib.lines import Line2D

    names = [*graph.assumptions.actions, "not yet tried"]
    handles = [Line2D([], [], color=action_color(i), linewidth=2) for i in range(len(names) - 1)]
    handles.append(Line2D([], [], color=GREY, linewidth=1.3, linestyle=(0, (1, 2))))
    legend = named_legend(figure, names, handles, loc="upper center", ncols=len(names), title=graph.name, fontsize=9)
    legend.get_title().set_fontweight("bold")
