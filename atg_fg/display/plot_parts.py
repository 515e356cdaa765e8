"""What several figures are made of: axes of steps, curves with bands, names at the ends of lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.display.figures import figure_class

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend


class LineEnd(NamedTuple):
    """The end of a line at the right of a plot, and what to write beside it."""

    y: float
    text: str
    color: str
    look: str = "bold"


def figure_with_axes(width: float, height: float) -> tuple[Figure, Axes]:
    """Return a figure of this size in inches and its only axes."""
    figure = figure_class()(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()


def step_axis(axes: Axes, length: int) -> None:
    """Make x the number of actions taken, 0 to ``length`` − 1, in whole numbers."""
    axes.set_xticks(range(0, length, max(1, round(length / 12))))
    axes.set(xlim=(-0.3, max(length - 1, 0.3) + 0.15), xlabel="actions taken")


def plot_curve(axes: Axes, curve: FloatArray, color: str, shape: str) -> None:
    """Draw one policy; columns of ``curve``, shape [points, 4]: actions, then success, low and high in %."""
    actions, success, low, high = curve.T
    axes.fill_between(actions, low, high, color=color, alpha=0.15, linewidth=0)
    bars = np.clip([success - low, high - success], 0, None)
    axes.errorbar(
        actions, success, bars, color=color, marker=shape, markersize=5.5, elinewidth=1, clip_on=False
    )  # fmt: skip


def label_ends(axes: Axes, ends: Sequence[LineEnd]) -> None:
    """Write each line's name to the right of the plot at the height of its end, moved apart where needed."""
    low, high = axes.get_ylim()
    # About 80 % of the figure's height are plot; a line of text takes 13 points of it.
    figure = axes.get_figure(root=True)
    assert figure is not None
    gap = 13 / (0.8 * 72 * figure.get_figheight()) * (high - low)
    for end, y in zip(ends, _apart(np.array([end.y for end in ends]), gap, low, high), strict=True):
        italic, bold = "italic" in end.look, "bold" in end.look
        axes.annotate(
            end.text, (1, y), (6, 0), xycoords=axes.get_yaxis_transform(), textcoords="offset points",
            va="center", color=end.color, annotation_clip=False, parse_math=False,
            fontstyle="italic" if italic else "normal", fontweight="bold" if bold else "normal",
            fontsize=8 if end.look == "small" else 9.5,
        )  # fmt: skip


def _apart(values: FloatArray, gap: float, low: float, high: float) -> FloatArray:
    """Return ``values`` moved apart to at least ``gap``, in the same order, below ``high``."""
    order = np.argsort(values, kind="stable")
    placed = np.clip(values[order], low, high)
    for i in range(1, len(placed)):
        placed[i] = max(placed[i], placed[i - 1] + gap)
    placed[-1] = min(placed[-1], high)
    for i in range(len(placed) - 2, -1, -1):
        placed[i] = min(placed[i], placed[i + 1] - gap)
    result = np.empty_like(placed)
    result[order] = placed
    return result


def legend_above(axes: Axes, names: Sequence[str], handles: Sequence[Artist]) -> None:
    """Put the legend in one row between plot and title."""
    named_legend(
        axes, names, handles, loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=6, borderpad=0.2, handletextpad=0.3,
        columnspacing=1.2, numpoints=1,
    )  # fmt: skip


def named_legend(owner: Axes | Figure, names: Sequence[str], handles: Sequence[Any], **options: Any) -> Legend:
    """Make a legend with names as they are, whatever dollars they hold or underscores they begin with.

    matplotlib takes text between dollars for a formula, and leaves out what begins with an underscore.
    """
    legend: Legend = owner.legend(handles, ["name"] * len(handles), **options)
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(name)
    for text in (legend.get_title(), *legend.get_texts()):
        text.set_parse_math(False)
    return legend
