"""Figures of experiments: success by policy and number of actions (Figure 3 of the paper), or by what is compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from atg_fg.core.checks import brief, plain_text, sequence, title_or
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.core.statistics import Rate, rates_of, wilson_interval
from atg_fg.display.figures import GREY, INK, PALETTE, figure_class, plot_style
from atg_fg.display.plot_parts import LineEnd, figure_with_axes, label_ends, named_legend, plot_curve

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Scored(Protocol):
    """A test with its scores, each a pair (right, of how many)."""

    identification: tuple[int, int]
    recognition: tuple[int, int]
    success: tuple[int, int]


def plot_success(
    results: Sequence[Mapping[str, Any]] | Sequence[Scored] | Mapping[str, Sequence[Scored]],
    *,
    title: str | None = None,
) -> Figure:
    """Plot success rates with 95 % intervals.

    Args:
        results: One of: the points of ``figure3_points``, drawn over the actions per trial as in Figure 3 of the paper:
            mappings with "actions" (a number), "policy" (a name), "success" (a fraction of trials) and "interval95"
            (its interval, two fractions); tests, drawn as one bar a score of Table 1; or a mapping from names to tests,
            drawn as one bar of success a name.
        title: Title above the plot; one that says what it is if not given.

    Raises:
        InvalidInputError: No results, a key that is missing, or a value that is no fraction.
        MissingDependencyError: matplotlib is not installed.
    """
    if isinstance(results, Mapping):
        bars = {plain_text(name, "results"): _pooled(tests, "success", name) for name, tests in results.items()}
        return _bars(bars, title_or(title, "Success rate"))
    found = sequence(results, "results")
    if len(found) and not isinstance(found[0], Mapping):
        names = ("identification", "recognition", "success")
        return _bars({name: _pooled(found, name, "results") for name in names}, title_or(title, f"{len(found)} tests"))
    return _figure3(rates_of(found, "points", ["policy"]), title_or(title, "Success rate by number of actions"))


def _figure3(rates: Sequence[Rate], title: str) -> Figure:
    curves = {policy: _curve(rates, (policy,)) for policy in dict.fromkeys(rate.names[0] for rate in rates)}
    with plot_style():
        figure, axes = figure_with_axes(6.4, 4.2)
        ends = []
        for rank, (policy, curve) in enumerate(curves.items()):
            color = PALETTE[rank % len(PALETTE)]
            plot_curve(axes, curve, color, "os^Dvp"[rank % 6])
            ends.append(LineEnd(float(curve[-1, 1]), policy, color))
        ticks = sorted({float(actions) for curve in curves.values() for actions in curve[:, 0]})
        axes.set(ylim=(0, 100), xlabel="actions per trial", ylabel="success rate (%)")
        axes.set_xticks(ticks if len(ticks) <= 12 else axes.get_xticks())
        axes.margins(x=0.04)
        label_ends(axes, ends)
        axes.set_title(title, parse_math=False)
        axes.annotate(
            "bands: 95 % confidence", (1, 0), (0, 4), textcoords="offset points", xycoords="axes fraction",
            ha="right", fontsize=8, color=GREY,
        )  # fmt: skip
    return figure


def _pooled(tests: Sequence[Any], score: str, place: str) -> tuple[float, float, float]:
    """Return the rate of a score over all trials of tests, and its interval."""
    counts: list[Any] = [getattr(test, score, None) for test in sequence(tests, place)]
    if not counts or not all(isinstance(count, tuple) and len(count) == 2 for count in counts):
        raise InvalidInputError(f"{place}: {brief(tests)}; expected test results, at least one")
    right, total = sum(count[0] for count in counts), sum(count[1] for count in counts)
    return (right / total if total else 0.0, *wilson_interval(right, total))


def _bars(rates: Mapping[str, tuple[float, float, float]], title: str) -> Figure:
    """Draw a bar for each rate, with its interval, shape (rate, low, high)."""
    if not rates:
        raise InvalidInputError("results: none given; expected at least one")
    with plot_style():
        figure, axes = figure_with_axes(6.4, 1.3 + 0.45 * len(rates))
        for place, (rate, low, high) in enumerate(rates.values()):
            axes.barh(place, 100 * rate, color=PALETTE[place % len(PALETTE)], height=0.6)
            axes.plot([100 * low, 100 * high], [place, place], color=INK, linewidth=1.4)
            axes.text(102, place, f"{100 * rate:.1f} ({100 * low:.1f}–{100 * high:.1f})", va="center", fontsize=9)
        axes.set(xlim=(0, 100), ylim=(len(rates) - 0.5, -0.5), xlabel="%, with 95 % Wilson interval over all trials")
        axes.set_yticks(range(len(rates)), list(rates), parse_math=False)
        axes.grid(False, axis="y")
        axes.grid(True, axis="x")
        axes.set_title(title, parse_math=False)
    return figure


def plot_ablation(entries: Sequence[Mapping[str, Any]]) -> Figure:
    """Plot the success rate of each variant over the actions per trial, a panel for each world and noise.

    Args:
        entries: Mappings with "world", "noise", "variant", "actions", "success" and "interval95", as
            ``summarise_ablation`` returns them.

    Raises:
        InvalidInputError: No entries, a key that is missing, or a value that is no name, number or fraction.
        MissingDependencyError: matplotlib is not installed.
    """
    rates = rates_of(entries, "entries", ["world", "noise", "variant"])
    panels = list(dict.fromkeys(rate.names[:2] for rate in rates))
    variants = list(dict.fromkeys(rate.names[2] for rate in rates))
    n_columns = min(2, len(panels))
    n_rows = -(-len(panels) // n_columns)
    with plot_style():
        figure = figure_class()(figsize=(4.6 * n_columns, 3.2 * n_rows), layout="constrained")
        all_axes = figure.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, (world, noise) in zip(all_axes, panels, strict=False):
            for rank, variant in enumerate(variants):
                curve = _curve(rates, (world, noise, variant))
                if len(curve):
                    plot_curve(axes, curve, PALETTE[rank % len(PALETTE)], "os^Dvp"[rank % 6])
            axes.set_title(noise if len({world for world, _ in panels}) == 1 else f"{world}, {noise}", parse_math=False)
            axes.set(ylim=(0, 101), xlabel="actions per trial", ylabel="success rate (%)")
            axes.set_xticks(sorted({rate.actions for rate in rates}))
            axes.label_outer()
        for axes in all_axes[len(panels) :]:
            axes.remove()
        lines = [line for line in all_axes[0].get_lines() if line.get_marker() not in ("", "None", None)]
        named_legend(figure, variants, lines, loc="outside lower center", ncols=len(variants))
    return figure


def _curve(rates: Sequence[Rate], names: tuple[str, ...]) -> FloatArray:
    """Return the rates of these names by actions, shape [points, 4]: actions, then success, low and high end in %."""
    rows = [[rate.actions, *(100 * share for share in rate[2:])] for rate in rates if rate.names == names]
    return np.array(sorted(rows))
