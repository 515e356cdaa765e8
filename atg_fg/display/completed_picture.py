"""A picture of a completed ATG: what was observed drawn strong, what the structure predicts pale and dashed."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.display.aspect_picture import INCHES_PER_UNIT, Images, Look, action_color, draw_arrow, draw_aspect
from atg_fg.display.figures import GREY, INK, figure_class, plot_style
from atg_fg.display.plot_parts import named_legend
from atg_fg.display.ring_layout import Node, ring_layout
from atg_fg.learning.completion import OBSERVED, PREDICTED, UNKNOWN, CompletedGraph, statuses

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_DASHED: Final = (0, (4, 2))

_LOOKS: Final = {
    OBSERVED: Look(),
    PREDICTED: Look(ink="#4a4a4a", linestyle="dashed", strength=0.6, side="#f0f0f0"),
    UNKNOWN: Look(ink="#9a9a9a", linestyle="dotted", strength=0.45, side="#f7f7f7"),
}

_OBSERVED_ARROW: Final = {"linewidth": 2.6}
_PREDICTED_ARROW: Final = {"linewidth": 1.0, "alpha": 0.5, "linestyle": _DASHED}
#: Predicted arrows that cross the picture are paler, so that what was observed stands out.
_LONG: Final = 3.0
_PREDICTED_LONG_ARROW: Final = {**_PREDICTED_ARROW, "linewidth": 0.8, "alpha": 0.28}
#: Inches above the picture for title and legend.
_HEAD: Final = 0.85


def draw_completed_atg(
    graph: CompletedGraph, assumptions: Assumptions, *, symbol_images: Images | None = None
) -> Figure:
    """Draw a completed ATG: observed aspects and transitions strong, predicted ones pale, dashed, with probability.

    Args:
        graph: From ``completed_atg``; 24 aspects with 72 transitions are readable.
        assumptions: Of the memory; names slots and actions.
        symbol_images: Grey image of each symbol, shape [pixels, pixels]; its number is written where there is none.

    Raises:
        InvalidInputError: The graph has no aspect.
        MissingDependencyError: matplotlib is not installed.
    """
    if not len(graph):
        raise InvalidInputError("completed ATG: no aspect; expected at least one")
    places = ring_layout(graph, assumptions.actions)
    spots = np.array(list(places.values()))
    low, high = spots.min(axis=0) - 0.9, spots.max(axis=0) + 0.9
    extra = np.maximum(np.array([9.0, 2.0]) - (high - low), 0.0) / 2  # room for the legend
    low, high = low - extra, high + extra
    with plot_style():
        width, height = ((high - low) * INCHES_PER_UNIT).tolist()
        figure = figure_class()(figsize=(width, height + _HEAD))
        axes = figure.add_axes((0, 0, 1, height / (height + _HEAD)))
        axes.axis("off")
        _draw_edges(axes, graph, assumptions, places)
        usual = _usual_probability(graph)
        for node, data in graph.nodes(data=True):
            _draw_node(axes, data, places[node], assumptions.alphabet, symbol_images or {}, usual)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        _draw_head(figure, graph, assumptions)
    return figure


def _draw_edges(axes: Axes, graph: CompletedGraph, assumptions: Assumptions, places: dict[Node, FloatArray]) -> None:
    between: Counter[tuple[Node, Node]] = Counter()
    for source, target, data in graph.edges(data=True):
        number = between[source, target]
        between[source, target] += 1
        color = action_color(assumptions.actions.index(data["action"]))
        is_long = bool(np.linalg.norm(places[target] - places[source]) > _LONG)
        predicted = _PREDICTED_LONG_ARROW if is_long else _PREDICTED_ARROW
        style: dict[str, Any] = {**(_OBSERVED_ARROW if data["observed"] else predicted), "color": color}
        if source == target:
            _draw_loop(axes, places[source], number, style)
        else:
            is_one_of_two = number > 0 or graph.has_edge(target, source)
            bend = 0.13 + 0.13 * number if is_one_of_two else 0.07
            draw_arrow(axes, places[source], places[target], bend, 0.66, **style)


def _draw_loop(axes: Axes, place: FloatArray, number: int, style: dict[str, Any]) -> None:
    """Draw an arrow from an aspect to itself, above it."""
    from matplotlib.patches import FancyArrowPatch

    start, end = place + np.array([-0.2, 0.56]), place + np.array([0.2, 0.56])
    bend = -1.3 - 0.5 * number
    axes.add_patch(
        FancyArrowPatch(
            tuple(start), tuple(end), connectionstyle=f"arc3,rad={bend}",
            arrowstyle="-|>,head_length=4,head_width=2", shrinkA=0, shrinkB=0, zorder=1, **style,
        )
    )  # fmt: skip


def _usual_probability(graph: CompletedGraph) -> str | None:
    """Return the probability that most predicted aspects have, which is said once, in the legend."""
    texts = Counter(
        probability_text(data["probability"]) for _, data in graph.nodes(data=True) if data["status"] == PREDICTED
    )
    return texts.most_common(1)[0][0] if texts else None


def _draw_node(
    axes: Axes, data: dict[str, Any], place: FloatArray, alphabet: PatternAlphabet, images: Images, usual: str | None
) -> None:
    status = data["status"]
    draw_aspect(axes, alphabet, data["symbols"], place, images, _LOOKS[status])
    probability = probability_text(data["probability"])
    if status == PREDICTED and probability != usual:
        axes.annotate(
            f"p {probability}", (place[0] - 0.16, place[1] - 0.7), ha="center", va="center",
            fontsize=6.5, color=GREY, zorder=6,
            bbox={"boxstyle": "round,pad=0.08", "facecolor": "white", "edgecolor": "none", "alpha": 0.85},
        )  # fmt: skip


def probability_text(probability: float) -> str:
    """Return a probability to two decimals, where 1.00 is never said of what is not certain."""
    if 0.995 <= probability < 1:
        return "> 0.99"
    return f"{probability:.2f}"


def _draw_head(figure: Figure, graph: CompletedGraph, assumptions: Assumptions) -> None:
    """Say above the picture which object it is, how much of it was seen, and what the lines mean."""
    from matplotlib.lines import Line2D

    numbers = statuses(graph)
    counts = ", ".join(f"{number} {status}" for status, number in numbers.items() if number)
    title = f"{graph.graph['name']}: {counts}"
    if graph.graph["poses"]:
        title += f"; follows the structure with p {probability_text(graph.graph['follows'])}"
    names = [*assumptions.actions, "observed"]
    handles = [Line2D([], [], color=action_color(index), linewidth=2) for index in range(len(names) - 1)]
    handles.append(Line2D([], [], color=INK, linewidth=2.0))
    certainties = [data["probability"] for _, _, data in graph.edges(data=True) if not data["observed"]]
    usual = _usual_probability(graph)
    if numbers[PREDICTED] or numbers[UNKNOWN] or certainties:
        told = [f"aspects p {usual}"] if usual else []
        told += [f"transitions p {probability_text(min(certainties))}"] if certainties else []
        names.append(f"predicted ({', '.join(told)})" if told else "predicted")
        handles.append(Line2D([], [], color=GREY, linewidth=1.0, linestyle=_DASHED))
    legend = named_legend(figure, names, handles, loc="upper center", ncols=len(names), title=title, fontsize=9)
    legend.get_title().set_fontweight("bold")
