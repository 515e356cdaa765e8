"""A picture of a structure: its registers, once for each action, with arrows that show where contents go."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import FloatArray
from atg_fg.display.aspect_picture import action_color
from atg_fg.display.figures import GREY, INK, figure_class, plot_style
from atg_fg.display.structure_words import copies, cycles, lost, register_names
from atg_fg.learning.shared_structure import SharedStructure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: Side of a panel in inches, and how many stand in a row.
_PANEL: Final = 3.1
_COLUMNS: Final = 3
#: Up to so many registers all their orders on the circle are tried; more stand as they come.
_MAX_ORDERED: Final = 8
_VISIBLE: Final = "#FFF3D6"
_HIDDEN: Final = "#f1f1f1"


def draw_structure(structure: SharedStructure, assumptions: Assumptions) -> Figure:
    """Draw the registers and what each action makes of their contents.

    Each mode has rows of its own. Registers stand on a circle, those in view framed strong; an arrow goes from the
    register that had a content before the action to the one that has it after. What an action leaves alone is pale; a
    register whose content is lost has a dashed frame.

    Args:
        structure: The structure; about 12 registers are readable.
        assumptions: Names slots and actions.

    Raises:
        MissingDependencyError: matplotlib is not installed.
    """
    names = register_names(structure, assumptions.alphabet.slots)
    places = _places(structure)
    n_columns = min(structure.n_actions, _COLUMNS)
    n_rows_of_mode = -(-structure.n_actions // _COLUMNS)
    n_rows = n_rows_of_mode * structure.n_modes
    in_modes = f" in {structure.n_modes} modes" if structure.n_modes > 1 else ""
    with plot_style():
        figure = figure_class()(figsize=(_PANEL * n_columns, (_PANEL + 0.55) * n_rows + 0.45), layout="constrained")
        figure.suptitle(
            f"{structure.n_registers} registers, {structure.n_slots} of them in view; "
            f"{len(structure.poses().registers)} poses{in_modes}",
            fontsize=11, fontweight="bold",
        )  # fmt: skip
        panels = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
        for axes in panels:
            axes.axis("off")
        for mode, action in itertools.product(range(structure.n_modes), range(structure.n_actions)):
            axes, color = panels[mode * n_rows_of_mode * n_columns + action], action_color(action)
            following, sources = structure.step(mode, action)
            title = assumptions.actions[action]
            if structure.n_modes > 1:
                title += f": mode {mode + 1} → {following + 1}"
            _draw_action(axes, sources, names, places, structure.n_slots, color)
            axes.set_title(title, color=color, parse_math=False)
    return figure


def _places(structure: SharedStructure) -> FloatArray:
    """Return the place of each register on a circle, shape [P, 2], in the order that makes the arrows short."""
    n = structure.n_registers
    angles = np.pi / 2 - 2 * np.pi * np.arange(n) / n
    circle: FloatArray = np.column_stack((np.cos(angles), np.sin(angles)))
    if n > _MAX_ORDERED:
        return circle
    sources, ways = np.array(structure.sources), [way for each in structure.sources for way in cycles(each)]

    def clutter(order: Sequence[int]) -> tuple[float, float]:
        spots = circle[list(order)]
        length = np.hypot(*(spots - spots[sources]).reshape(-1, 2).T).sum()
        # A way that crosses itself encloses less.
        return round(float(length), 9), -round(sum(_enclosed(spots[way]) for way in ways), 9)

    best = min(itertools.permutations(range(1, n)), key=lambda rest: clutter((0, *rest)))
    return circle[[0, *best]]


def _enclosed(corners: FloatArray) -> float:
    """Return the area of a polygon, shape [n, 2]."""
    x, y = corners.T
    return abs(float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())) / 2


def _draw_action(
    axes: Axes, sources: Sequence[int], names: Sequence[str], places: FloatArray, n_slots: int, color: str
) -> None:
    from matplotlib.patches import FancyArrowPatch

    gone = lost(sources)
    for register, source in enumerate(sources):
        if source != register:
            axes.add_patch(
                FancyArrowPatch(
                    tuple(places[source]), tuple(places[register]), connectionstyle="arc3,rad=0.14",
                    arrowstyle="-|>,head_length=7,head_width=3.5", shrinkA=19, shrinkB=19, linewidth=2, color=color,
                )
            )  # fmt: skip
        in_view, moves = register < n_slots, source != register or sources.count(register) != 1
        axes.annotate(
            names[register], tuple(places[register]), ha="center", va="center", zorder=3, parse_math=False,
            fontweight="bold" if in_view else "normal", color=INK if moves else GREY, alpha=1.0 if moves else 0.6,
            bbox={"boxstyle": "round,pad=0.45", "facecolor": _VISIBLE if in_view else _HIDDEN,
                  "edgecolor": INK if in_view else GREY, "linewidth": 1.8 if in_view else 0.9,
                  "linestyle": "dashed" if register in gone else "solid", "alpha": 1.0 if moves else 0.6},
        )  # fmt: skip
    ways = [" → ".join(names[register] for register in (*way, way[0])) for way in cycles(sources)]
    ways += [" → ".join(names[register] for register in pair) for pair in copies(sources)]
    ways += [f"lost: {names[register]}" for register in gone]
    axes.annotate(
        "\n".join(ways) or "nothing moves", (0.5, -0.02), xycoords="axes fraction", ha="center", va="top", fontsize=8,
        color=GREY, parse_math=False,
    )  # fmt: skip
    axes.set(xlim=(-1.4, 1.4), ylim=(-1.3, 1.3), aspect="equal")
