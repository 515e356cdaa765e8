"""A plot with intervals, in the coordinates of an SVG: what the template draws."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from atg_fg.report.content import Plot, Point

WIDTH: Final = 640
HEIGHT: Final = 320
_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 16, 14, 46
#: Names on the horizontal axis longer than this are slanted, and get more room.
_LONG_NAME: Final = 8
_MOST_TICKS: Final = 12


@dataclass(frozen=True)
class DrawnPoint:
    """A point with its interval, in pixels, and what it says in words."""

    x: float
    y: float
    low: float | None
    high: float | None
    words: str


@dataclass(frozen=True)
class DrawnSeries:
    """A series: its points, and the line through them as an SVG path, empty if they are not joined."""

    name: str
    points: tuple[DrawnPoint, ...]
    path: str


@dataclass(frozen=True)
class DrawnPlot:
    """A plot in pixels.

    Attributes:
        plot: What is drawn.
        height: Of the SVG.
        series: What is drawn, in pixels.
        x_ticks: (place, text) on the horizontal axis.
        y_ticks: (place, text) on the vertical axis.
        frame: (left, top, right, bottom) of the plot's area.
        slanted: Whether the names on the horizontal axis are slanted.
    """

    plot: Plot
    height: float
    series: tuple[DrawnSeries, ...]
    x_ticks: tuple[tuple[float, str], ...]
    y_ticks: tuple[tuple[float, str], ...]
    frame: tuple[float, float, float, float]
    slanted: bool


def drawn(plot: Plot) -> DrawnPlot:
    """Return a plot in pixels."""
    longest = max((len(name) for name in plot.categories), default=0)
    slanted = longest > _LONG_NAME
    bottom = _BOTTOM + (min(130.0, 3.4 * longest) if slanted else 0)
    height = HEIGHT + bottom - _BOTTOM
    frame = (_LEFT, _TOP, WIDTH - _RIGHT, height - bottom)
    x_low, x_high = _x_range(plot)
    y_low, y_high = plot.y_range

    def x_of(value: float) -> float:
        return round(frame[0] + (value - x_low) / (x_high - x_low) * (frame[2] - frame[0]), 2)

    def y_of(value: float) -> float:
        inside = min(max(value, y_low), y_high)
        return round(frame[3] - (inside - y_low) / (y_high - y_low) * (frame[3] - frame[1]), 2)

    series = []
    for each in plot.series:
        points = tuple(
            DrawnPoint(
                x_of(point.x),
                y_of(point.y),
                None if point.low is None else y_of(point.low),
                None if point.high is None else y_of(point.high),
                _words(point, each.name),
            )
            for point in each.points
        )
        path = "M" + " L".join(f"{point.x} {point.y}" for point in points) if each.joined and points else ""
        series.append(DrawnSeries(each.name, points, path))
    y_ticks = tuple(
        (y_of(y_low + share * (y_high - y_low)), f"{y_low + share * (y_high - y_low):g}") for share in _FIFTHS
    )
    x_ticks = tuple((x_of(value), text) for value, text in _x_ticks(plot))
    return DrawnPlot(plot, height, tuple(series), x_ticks, y_ticks, frame, slanted)


_FIFTHS: Final = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


def _x_range(plot: Plot) -> tuple[float, float]:
    if plot.categories:
        return -0.6, len(plot.categories) - 0.4
    values = [point.x for series in plot.series for point in series.points] or [0.0]
    margin = 0.04 * (max(values) - min(values)) or 1.0
    return min(values) - margin, max(values) + margin


def _x_ticks(plot: Plot) -> list[tuple[float, str]]:
    """Return the places that have something to say, but not too many of them."""
    if plot.categories:
        every = math.ceil(len(plot.categories) / 20)
        return [(float(place), name) for place, name in enumerate(plot.categories) if place % every == 0]
    own = sorted({point.x for series in plot.series for point in series.points})
    if len(own) <= _MOST_TICKS and all(value.is_integer() for value in own):
        return [(value, f"{value:g}") for value in own]
    low, high = _x_range(plot)
    steps = (factor * 10.0**power for power in range(-3, 12) for factor in (1, 2, 5))
    step = next(step for step in steps if (high - low) / step <= _MOST_TICKS)
    values = (step * number for number in range(math.ceil(low / step), math.floor(high / step) + 1))
    return [(value, f"{value:g}") for value in values]


def _words(point: Point, series: str) -> str:
    interval = "" if point.low is None or point.high is None else f" ({point.low:.1f}–{point.high:.1f})"
    return f"{point.label or series}: {point.y:.1f}{interval}"
