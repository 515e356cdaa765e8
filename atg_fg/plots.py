"""Figures of a trial and of an experiment: belief, entropy, success (Figure 3 of the paper).

Every figure is a ``matplotlib.figure.Figure`` of its own: nothing here touches ``pyplot`` or leaves a
setting behind. matplotlib is imported by the first figure that is drawn, not with the package.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from atg_fg.errors import InvalidInputError
from atg_fg.figures import GREY, INK, PALETTE, figure_class, plot_style

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from atg_fg.belief import IdentityBelief
    from atg_fg.patterns import FloatArray


class _End(NamedTuple):
    """The end of a line at the right of a plot, and what to write beside it."""

    y: float
    text: str
    color: str
    look: str = "bold"


def plot_belief(beliefs: Sequence[IdentityBelief], names: Sequence[str], *, top: int = 5) -> Figure:
    """Plot who the object may be, action by action.

    Args:
        beliefs: Belief after each observation; the first before any action, length t + 1.
        names: Name of each remembered object, length K.
        top: Draw this many objects at most: those whose final plus peak probability is highest.

    Raises:
        InvalidInputError: No beliefs, a belief over another number of objects, or ``top`` below one.
        MissingDependencyError: matplotlib is not installed.
    """
    _check_beliefs(beliefs, names, top)
    steps = np.arange(len(beliefs))
    objects = np.array([belief.objects for belief in beliefs]).reshape(len(beliefs), len(names))
    unseen = np.array([belief.unseen for belief in beliefs])
    order = np.argsort(-(objects[-1] + objects.max(axis=0)), kind="stable")[:top]
    with plot_style():
        figure, axes = _figure_with_axes(7.2, 3.9)
        axes.axhline(0.5, color=GREY, linewidth=1, linestyle=(0, (2, 2)), zorder=1)
        ends = [
            _End(float(unseen[-1]), f"unseen {unseen[-1]:.2f}", INK, "bold italic"),
            _End(0.5, "novel if unseen is above", GREY, "small"),
        ]
        for rank, index in enumerate(order):
            color = PALETTE[rank % len(PALETTE)]
            dashes = "solid" if rank < len(PALETTE) else "dashed"
            axes.plot(steps, objects[:, index], color=color, linestyle=dashes, marker="o", markersize=3.5)
            ends.append(_End(float(objects[-1, index]), f"{names[index]} {objects[-1, index]:.2f}", color))
        axes.plot(steps, unseen, color=INK, linewidth=2.6, marker="o", markersize=4)
        axes.set(ylim=(-0.02, 1.02), ylabel="probability")
        _step_axis(axes, len(beliefs))
        _label_ends(axes, ends)
        axes.set_title("Belief over identity")
    return figure


def plot_entropy(entropies: Sequence[float], expected: Sequence[Mapping[str, float]], chosen: Sequence[str]) -> Figure:
    """Plot H(O) after each action beside what the planner expected of every action.

    Args:
        entropies: H(O) in nats after each observation; the first before any action, length t + 1.
        expected: Expected entropy in nats of each action before it was taken, by name, length t; a policy
            that does not plan has an empty mapping.
        chosen: Name of the action taken, length t.

    Raises:
        InvalidInputError: Lengths that do not fit, or a chosen action nothing was expected of.
        MissingDependencyError: matplotlib is not installed.
    """
    _check_entropies(entropies, expected, chosen)
    actions = list(dict.fromkeys(action for options in expected for action in options))
    with plot_style():
        figure, axes = _figure_with_axes(7.8, 4.1)
        axes.plot(range(len(entropies)), entropies, color="#555555", marker="o", markersize=4, label="entropy H(O)")
        for rank, action in enumerate(actions):
            _plot_expected(axes, rank, len(actions), action, expected, chosen)
        if actions:
            axes.plot([], [], "o", markersize=7, color=GREY, label="chosen (filled)")
        axes.set(ylabel="entropy (nats)")
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        _step_axis(axes, len(entropies))
        _legend_above(axes)
        axes.set_title("Entropy of identity, and what each action was expected to leave", pad=28)
    return figure


def plot_success(points: Sequence[Mapping[str, Any]], *, title: str = "Success rate by number of actions") -> Figure:
    """Plot the success rate of each policy over the actions per trial, like Figure 3 of the paper.

    Args:
        points: Mappings with "actions" (a number), "policy" (a name), "success" (a fraction of trials) and
            "interval95" (its 95 % confidence interval, two fractions).
        title: Title above the plot.

    Raises:
        InvalidInputError: No points, a key that is missing, or a value that is no fraction.
        MissingDependencyError: matplotlib is not installed.
    """
    curves = _curves(points)
    with plot_style():
        figure, axes = _figure_with_axes(6.4, 4.2)
        ends = []
        for rank, (policy, curve) in enumerate(curves.items()):
            color = PALETTE[rank % len(PALETTE)]
            _plot_curve(axes, 100 * curve * [0.01, 1, 1, 1], color, "os^Dvp"[rank % 6])
            ends.append(_End(100 * float(curve[-1, 1]), policy, color))
        ticks = sorted({float(actions) for curve in curves.values() for actions in curve[:, 0]})
        axes.set(ylim=(0, 100), xlabel="actions per trial", ylabel="success rate (%)")
        axes.set_xticks(ticks if len(ticks) <= 12 else axes.get_xticks())
        axes.margins(x=0.04)
        _label_ends(axes, ends)
        axes.set_title(title, parse_math=False)
        axes.annotate(
            "bands: 95 % confidence", (1, 0), (0, 4), textcoords="offset points", xycoords="axes fraction",
            ha="right", fontsize=8, color=GREY,
        )  # fmt: skip
    return figure


def plot_ablation(entries: Sequence[Mapping[str, Any]]) -> Figure:
    """Plot the success rate of each variant over the actions per trial, a panel for each world and noise.

    Args:
        entries: Mappings with "world", "noise", "variant", "actions", "success" and "interval95", as
            ``summarise_ablation`` returns them.

    Raises:
        InvalidInputError: No entries.
        MissingDependencyError: matplotlib is not installed.
    """
    if not entries:
        raise InvalidInputError("ablation plot: no entries; expected at least one")
    panels = list(dict.fromkeys((entry["world"], entry["noise"]) for entry in entries))
    variants = list(dict.fromkeys(entry["variant"] for entry in entries))
    n_columns = min(2, len(panels))
    n_rows = -(-len(panels) // n_columns)
    with plot_style():
        figure = figure_class()(figsize=(4.6 * n_columns, 3.2 * n_rows), layout="constrained")
        all_axes = figure.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, (world, noise) in zip(all_axes, panels, strict=False):
            for rank, variant in enumerate(variants):
                where = {"world": world, "noise": noise, "variant": variant}
                curve = [entry for entry in entries if where.items() <= dict(entry).items()]
                if curve:
                    points = np.array([[each["actions"], each["success"], *each["interval95"]] for each in curve])
                    points = points[np.argsort(points[:, 0])]
                    _plot_curve(axes, points * [1, 100, 100, 100], PALETTE[rank % len(PALETTE)], "os^Dvp"[rank % 6])
            axes.set_title(noise if len({world for world, _ in panels}) == 1 else f"{world}, {noise}", parse_math=False)
            axes.set(ylim=(0, 101), xlabel="actions per trial", ylabel="success rate (%)")
            axes.set_xticks(sorted({entry["actions"] for entry in entries}))
            axes.label_outer()
        for axes in all_axes[len(panels) :]:
            axes.remove()
        lines = [line for line in all_axes[0].get_lines() if line.get_marker() not in ("", "None", None)]
        figure.legend(lines, variants, loc="outside lower center", ncols=len(variants))
    return figure


def _figure_with_axes(width: float, height: float) -> tuple[Figure, Axes]:
    """Return a figure of this size in inches and its only axes."""
    figure = figure_class()(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()


def _step_axis(axes: Axes, length: int) -> None:
    """Make x the number of actions taken, 0 to ``length`` − 1, in whole numbers."""
    axes.set_xticks(range(0, length, max(1, round(length / 12))))
    axes.set(xlim=(-0.3, max(length - 1, 0.3) + 0.15), xlabel="actions taken")


def _plot_expected(
    axes: Axes,
    rank: int,
    n_actions: int,
    action: str,
    expected: Sequence[Mapping[str, float]],
    chosen: Sequence[str],
) -> None:
    """Mark what one action was expected to leave, just left of its outcome and apart from the others."""
    color, shape = PALETTE[rank % len(PALETTE)], "s^Dvp*"[rank % 6]
    shift = 0.16 + 0.5 * (n_actions - 1 - rank) / max(n_actions, 3)
    for taken in (False, True):
        steps = [t for t, options in enumerate(expected) if action in options and (chosen[t] == action) == taken]
        axes.plot(
            [t + 1 - shift for t in steps], [expected[t][action] for t in steps], shape, zorder=4,
            markersize=7 if taken else 5, markeredgecolor=color, markerfacecolor=color if taken else "white",
            label=None if taken else action,
        )  # fmt: skip


def _plot_curve(axes: Axes, curve: FloatArray, color: str, shape: str) -> None:
    """Draw one policy; columns of ``curve``, shape [points, 4]: actions, then success, low and high in %."""
    actions, success, low, high = curve.T
    axes.fill_between(actions, low, high, color=color, alpha=0.15, linewidth=0)
    bars = np.clip([success - low, high - success], 0, None)
    axes.errorbar(
        actions, success, bars, color=color, marker=shape, markersize=5.5, elinewidth=1, clip_on=False
    )  # fmt: skip


def _label_ends(axes: Axes, ends: Sequence[_End]) -> None:
    """Write each line's name to the right of the plot at the height of its end, moved apart where needed."""
    low, high = axes.get_ylim()
    # About 80 % of the figure's height are plot; a line of text takes 13 points of it.
    gap = 13 / (0.8 * 72 * axes.get_figure(root=True).get_figheight()) * (high - low)  # type: ignore[union-attr]
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


def _legend_above(axes: Axes) -> None:
    legend = axes.legend(
        loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=6, borderpad=0.2, handletextpad=0.3,
        columnspacing=1.2, numpoints=1,
    )  # fmt: skip
    for text in legend.get_texts():
        text.set_parse_math(False)


def _check_beliefs(beliefs: Sequence[IdentityBelief], names: Sequence[str], top: int) -> None:
    if not beliefs:
        raise InvalidInputError("beliefs: none given; expected at least one")
    for step, belief in enumerate(beliefs):
        if len(belief.objects) != len(names):
            raise InvalidInputError(
                f"beliefs[{step}]: {len(belief.objects)} objects; expected one for each of {len(names)} names"
            )
    if isinstance(top, bool) or not isinstance(top, int) or top < 1:
        raise InvalidInputError(f"top: {top!r}; expected a whole number of at least 1")


def _check_entropies(
    entropies: Sequence[float], expected: Sequence[Mapping[str, float]], chosen: Sequence[str]
) -> None:
    if not len(entropies) == len(expected) + 1 == len(chosen) + 1:
        raise InvalidInputError(
            f"entropies: {len(entropies)} with {len(expected)} expected and {len(chosen)} chosen; "
            "expected one entropy more than actions"
        )
    for step, (options, action) in enumerate(zip(expected, chosen, strict=True)):
        if options and action not in options:
            raise InvalidInputError(f"chosen[{step}]: {action!r}; expected one of: {', '.join(options)}")


def _curves(points: Sequence[Mapping[str, Any]]) -> dict[str, FloatArray]:
    """Return by policy its points by actions, shape [points, 4]: actions, success, low and high end."""
    if not points:
        raise InvalidInputError("points: none given; expected at least one")
    rows: dict[str, list[tuple[float, ...]]] = {}
    for number, point in enumerate(points):
        for key in ("actions", "policy", "success", "interval95"):
            if key not in point:
                raise InvalidInputError(f"points[{number}]: {dict(point)!r}; expected the key {key!r}")
        rows.setdefault(str(point["policy"]), []).append(_row(point, f"points[{number}]"))
    return {policy: np.array(sorted(curve)) for policy, curve in rows.items()}


def _row(point: Mapping[str, Any], place: str) -> tuple[float, ...]:
    try:
        low, high = (float(end) for end in point["interval95"])
        actions, success = float(point["actions"]), float(point["success"])
    except (TypeError, ValueError):
        raise InvalidInputError(f"{place}: {dict(point)!r}; expected numbers, two in 'interval95'") from None
    for key, value in (("success", success), ("interval95", low), ("interval95", high)):
        if not 0 <= value <= 1:
            raise InvalidInputError(f"{place}, key {key!r}: {value}; expected a fraction from 0 to 1")
    return actions, success, low, high
