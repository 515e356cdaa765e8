"""A picture of an Aspect Transition Graph like the paper's Figure 1.

Known aspects stand on a circle, each as a small view of the object; solid arrows are observed transitions, dotted ones
have not been tried and lead to the collection node in the middle.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.errors import InvalidInputError
from atg_fg.figures import GREY, INK, PALETTE, figure_class, plot_style
from atg_fg.graph import AspectTransitionGraph, Edge
from atg_fg.patterns import FloatArray, Pattern

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Images = Mapping[int, NDArray[np.uint8]]

#: Slots that are drawn as two faces of a cube; others are drawn as tiles in a row.
CUBE_SLOTS: Final = ("front", "top")
#: How far the top of a cube is sheared to the right and up, as a part of its side.
_SHEAR: Final = 0.42
_HIGHLIGHT: Final = "#E69F00"
_INCHES_PER_UNIT: Final = 0.78
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
        symbol_images: Grey image of each symbol, shape [pixels, pixels]; its number is written where there is none.
        highlight: Index of an aspect to frame, such as the current one.
        path: Counted transitions to draw strong, such as the way to a goal, while the others are pale.

    Raises:
        InvalidInputError: There is no aspect ``highlight``, or a transition of ``path`` was never counted.
        MissingDependencyError: matplotlib is not installed.
    """
    if highlight is not None and not 0 <= highlight < graph.n_known:
        raise InvalidInputError(f"highlight: aspect {highlight}; expected one of the {graph.n_known} known aspects")
    for edge in path:
        if edge not in graph.counts:
            raise InvalidInputError(f"path: transition {edge}; expected one that {graph.name!r} has counted")
    places, radius = _places(graph.n_known)
    extent = radius + 1.0
    with plot_style():
        side = 2 * extent * _INCHES_PER_UNIT
        figure = figure_class()(figsize=(side, side + 0.6))
        axes = figure.add_axes((0, 0, 1, side / (side + 0.6)))
        axes.set(xlim=(-extent, extent), ylim=(-extent, extent), aspect="equal")
        axes.axis("off")
        _draw_unknown(axes, graph, places)
        _draw_observed(axes, graph, places, path)
        _draw_collection(axes, graph)
        for aspect, pattern in enumerate(graph.aspects):
            _draw_aspect(axes, graph, pattern, places[aspect], symbol_images or {}, framed=aspect == highlight)
        axes.set(xlim=(-extent, extent), ylim=(-extent, extent))  # images move the limits
        _draw_legend(figure, graph)
    return figure


def _places(n_aspects: int) -> tuple[FloatArray, float]:
    """Return the middle of each aspect, shape [n, 2], on a circle that is wide enough, and its radius."""
    radius = max(2.2, 1.75 * n_aspects / (2 * np.pi))
    angles = np.pi / 2 - 2 * np.pi * np.arange(n_aspects) / max(n_aspects, 1)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)]), radius


def _color(action: int) -> str:
    return PALETTE[action % len(PALETTE)]


def _arrow(axes: Axes, start: FloatArray, end: FloatArray, bend: float, shrink: float, **style: Any) -> None:
    from matplotlib.patches import FancyArrowPatch

    points = 72 * _INCHES_PER_UNIT
    patch = FancyArrowPatch(
        tuple(start),
        tuple(end),
        connectionstyle=f"arc3,rad={bend}",
        arrowstyle="-|>,head_length=5,head_width=2.5",
        shrinkA=0.66 * points,
        shrinkB=shrink * points,
        zorder=1,
        **style,
    )
    axes.add_patch(patch)


def _draw_unknown(axes: Axes, graph: AspectTransitionGraph, places: FloatArray) -> None:
    """Draw a dotted arrow to the collection node for each action that was not tried."""
    if not graph.n_unobserved:
        return
    middle = (len(graph.assumptions.actions) - 1) / 2
    for aspect, action in graph.unknown_transitions():
        style = {"linestyle": (0, (1, 2)), "color": _color(action), "linewidth": 1.1, "alpha": 0.75}
        # The arrow ends at the border of the node's box rather than in its middle.
        border = places[aspect] * (_COLLECTION_BOX / np.maximum(np.abs(places[aspect]), 1e-9)).min()
        _arrow(axes, places[aspect], border, 0.13 * (action - middle), 0.05, **style)


def _draw_observed(axes: Axes, graph: AspectTransitionGraph, places: FloatArray, path: Collection[Edge]) -> None:
    """Draw a solid arrow for each counted transition, the more bent the more there are between two aspects."""
    between: Counter[tuple[int, int]] = Counter()
    for (source, action, target), count in sorted(graph.counts.items()):
        number = between[source, target]
        between[source, target] += 1
        strength = _strength((source, action, target), path)
        if source == target:
            label = _draw_loop(axes, places[source], number, color=_color(action), **strength)
        else:
            # A straight way through the middle would be hidden by the collection node.
            through_middle = np.linalg.norm(places[source] + places[target]) < 1.0
            bend = 0.16 + 0.13 * number + 0.4 * bool(through_middle and graph.n_unobserved)
            _arrow(axes, places[source], places[target], bend, 0.66, color=_color(action), **strength)
            span = places[target] - places[source]
            label = (places[source] + places[target]) / 2 + bend / 2 * np.array([span[1], -span[0]])
        if count > 1:
            axes.annotate(
                f"×{count}", tuple(label), ha="center", va="center", fontsize=7.5, color=_color(action),
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


def _draw_aspect(
    axes: Axes, graph: AspectTransitionGraph, pattern: Pattern, place: FloatArray, images: Images, *, framed: bool
) -> None:
    slots = graph.assumptions.alphabet.slots
    if slots == CUBE_SLOTS:
        outline = _draw_cube(axes, pattern, place, images)
    else:
        outline = _draw_tiles(axes, pattern, slots, place, images)
    if framed:
        low, high = outline
        from matplotlib.patches import FancyBboxPatch

        width, height = (high - low).tolist()
        style = f"round,pad={0.09},rounding_size=0.1"
        axes.add_patch(
            FancyBboxPatch(tuple(low), width, height, style, fill=False, edgecolor=_HIGHLIGHT, linewidth=3, zorder=6)
        )


def _draw_cube(axes: Axes, pattern: Pattern, place: FloatArray, images: Images) -> tuple[FloatArray, FloatArray]:
    """Draw the front and the top of a cube with their symbols, and a blank side; return its outline."""
    side = 0.78
    low = place - side * (1 + _SHEAR) / 2
    right, up, back = np.array([side, 0.0]), np.array([0.0, side]), np.full(2, side * _SHEAR)
    front, top = pattern
    _draw_face(axes, low + right, back, up, None, images, "#d8d8d8")
    _draw_face(axes, low, right, up, front, images, "white")
    _draw_face(axes, low + up, right, back, top, images, "white")
    return low, low + right + up + back


def _draw_tiles(
    axes: Axes, pattern: Pattern, slots: tuple[str, ...], place: FloatArray, images: Images
) -> tuple[FloatArray, FloatArray]:
    """Draw one tile a slot in a row, with the slot's name above; return the outline."""
    side = min(0.6, 1.3 / len(pattern))
    low = place - np.array([side * len(pattern), side]) / 2
    for number, (symbol, slot) in enumerate(zip(pattern, slots, strict=True)):
        corner = low + np.array([number * side, 0.0])
        _draw_face(axes, corner, np.array([side, 0.0]), np.array([0.0, side]), symbol, images, "white")
        axes.annotate(slot, (corner[0] + side / 2, corner[1] + side + 0.05), ha="center", fontsize=6.5, color=GREY)
    return low, low + np.array([side * len(pattern), side])


def _draw_face(
    axes: Axes,
    corner: FloatArray,
    right: FloatArray,
    up: FloatArray,
    symbol: int | None,
    images: Images,
    color: str,
) -> None:
    """Draw a parallelogram with its lower left ``corner``, and a symbol in the middle three quarters of it."""
    from matplotlib.patches import Polygon
    from matplotlib.transforms import Affine2D

    outline = [corner, corner + right, corner + right + up, corner + up]
    axes.add_patch(Polygon(outline, facecolor=color, edgecolor=INK, linewidth=0.9, zorder=4))
    if symbol is None:
        return
    face_to_data = Affine2D(np.array([[right[0], up[0], corner[0]], [right[1], up[1], corner[1]], [0, 0, 1]]))
    if symbol in images:
        picture = axes.imshow(
            images[symbol], cmap="gray", vmin=0, vmax=255, extent=(1 / 8, 7 / 8, 1 / 8, 7 / 8),
            interpolation="nearest", zorder=5,
        )  # fmt: skip
        picture.set_transform(face_to_data + axes.transData)
    else:
        middle = corner + (right + up) / 2
        axes.annotate(str(symbol), tuple(middle), ha="center", va="center", fontsize=11, zorder=5)


def _draw_legend(figure: Figure, graph: AspectTransitionGraph) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=_color(i), linewidth=2, label=name) for i, name in enumerate(graph.assumptions.actions)
    ]
    handles.append(Line2D([], [], color=GREY, linewidth=1.3, linestyle=(0, (1, 2)), label="not yet tried"))
    legend = figure.legend(handles=handles, loc="upper center", ncols=len(handles), title=graph.name, fontsize=9)
    legend.get_title().set_fontweight("bold")
