"""A recognition factor graph as an SVG picture: variables are circles, factors squares, both with names."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

_STEP, _LEFT, _OBJECT_Y, _ASPECT_Y = 120, 70, 40, 150
_STYLE = 'font-family="sans-serif" font-size="13" text-anchor="middle"'


def recognition_svg(last: int, factor_variables: Sequence[tuple[str, ...]]) -> str:
    """Return an SVG of O above X_0 … X_last and of every factor between its variables.

    Args:
        last: Time of the last aspect variable.
        factor_variables: Names of the variables of each factor, such as ("O", "X0", "X1").
    """
    width = 2 * _LEFT + last * _STEP
    places = {"O": (width / 2, float(_OBJECT_Y))}
    places |= {f"X{time}": (float(_LEFT + time * _STEP), float(_ASPECT_Y)) for time in range(last + 1)}
    lines: list[str] = []
    squares: list[str] = []
    seen: dict[tuple[str, ...], int] = {}
    for variables in factor_variables:
        repeat = seen.get(variables, 0)
        seen[variables] = repeat + 1
        x, y = _factor_place(variables, repeat, places)
        lines += [_line((x, y), places[name]) for name in variables]
        label = escape(f"factor on {', '.join(variables)}")
        squares.append(f'<rect x="{x - 5}" y="{y - 5}" width="10" height="10"><title>{label}</title></rect>')
    circles = [
        f'<circle cx="{x}" cy="{y}" r="18" fill="white" stroke="black"/>'
        f'<text x="{x}" y="{y + 5}" {_STYLE}>{name}</text>'
        for name, (x, y) in places.items()
    ]
    body = "".join([*lines, *squares, *circles])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="240" viewBox="0 0 {width} 240" '
        f'style="background: white; max-width: 100%; height: auto">{body}</svg>'
    )


def _factor_place(
    variables: tuple[str, ...], repeat: int, places: dict[str, tuple[float, float]]
) -> tuple[float, float]:
    """Prior above O, actions between two aspects, p(X_0 | O) above X_0, and evidence below its aspect."""
    aspects = [places[name] for name in variables if name != "O"]
    if not aspects:
        return places["O"][0] + 60, places["O"][1]
    x = sum(place[0] for place in aspects) / len(aspects)
    if len(aspects) == 2:
        return x, float(_ASPECT_Y)
    first_factor_of_x0 = "X0" in variables and repeat == 0
    return (x, _ASPECT_Y - 50.0) if first_factor_of_x0 else (x, _ASPECT_Y + 50.0)


def _line(start: tuple[float, float], end: tuple[float, float]) -> str:
    return f'<line x1="{start[0]}" y1="{start[1]}" x2="{end[0]}" y2="{end[1]}" stroke="#999"/>'
