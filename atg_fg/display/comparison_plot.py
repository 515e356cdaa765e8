"""Engines compared: how far each is from exact inference, against the time of a decision."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from atg_fg.core.checks import finite_array, instance, plain_text, title_or
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.display.figures import PALETTE, plot_style
from atg_fg.display.plot_parts import figure_with_axes, named_legend

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = "os^Dvp"


@runtime_checkable
class Compared(Protocol):
    """What was measured of an engine: errors and seconds of each decision, shape [looks]; or why it was refused."""

    @property
    def total_variation(self) -> FloatArray:
        """½ Σ |p(O) − q(O)| to the reference, shape [looks]."""

    @property
    def seconds(self) -> FloatArray:
        """Of each decision, shape [looks]."""

    @property
    def refused(self) -> str | None:
        """Why the engine did not do the trials, ``None`` if it did."""


def plot_comparison(records: Mapping[str, Compared], *, title: str | None = None) -> Figure:
    """Plot the error of each engine, mean with 95 % interval, against its time of a decision, median with quartiles.

    Args:
        records: By name, as ``compare_engines`` returns them; engines that were refused are left out.
        title: Title above the plot; one that says what it is if not given.

    Raises:
        InvalidInputError: There is no engine that was not refused, or a record is none.
        MissingDependencyError: matplotlib is not installed.
    """
    ran = {}
    for name, record in instance(records, "comparison plot", Mapping).items():
        instance(record, plain_text(name, "comparison plot"), Compared)
        if record.refused is None and len(_numbers(record.seconds, name)):
            ran[name] = record
            _numbers(record.total_variation, name)
    if not ran:
        raise InvalidInputError("comparison plot: no engine that did the trials; expected at least one")
    with plot_style():
        figure, axes = figure_with_axes(7.2, 3.8)
        for rank, record in enumerate(ran.values()):
            low, median, high = 1000 * np.quantile(record.seconds, (0.25, 0.5, 0.75))
            errors = record.total_variation
            half = 1.96 * errors.std(ddof=1) / np.sqrt(len(errors)) if len(errors) > 1 else 0.0
            axes.errorbar(
                median, errors.mean(), yerr=half, xerr=[[median - low], [high - median]], elinewidth=1, alpha=0.9,
                color=PALETTE[rank % len(PALETTE)], fmt=_MARKERS[rank // len(PALETTE) % len(_MARKERS)],
            )  # fmt: skip
        axes.set(xscale="log", xlabel="time of a decision, ms (median and quartiles)")
        axes.set_ylabel("total variation to exact inference")
        axes.set_ylim(bottom=min(0.0, -0.03 * axes.get_ylim()[1]))
        axes.set_title(title_or(title, "Error against the time of a decision"), parse_math=False)
        named_legend(figure, [*ran], axes.containers, loc="outside right center", fontsize=8)
    return figure


def _numbers(values: FloatArray, name: str) -> FloatArray:
    return finite_array(values, name, (None,), "a number for each look")
