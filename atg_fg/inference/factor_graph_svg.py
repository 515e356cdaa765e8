"""A recognition factor graph as an SVG picture: variables are circles, factors squares, both with names.

One object is a row: its O above its X_0 … X_t. Several objects are rows one below the other, and a factor on several O
is a square to the left of them all, where no row is in its way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TypeAlias

_STEP, _LEFT, _OBJECT_Y, _ASPECT_Y, _ROW = 120, 70, 40, 150, 240
_STYLE = 'font-family="sans-serif" font-size="13" text-anchor="middle"'
Place: TypeAlias = tuple[float, float]


def recognition_svg(rows: Sequence[Sequence[str]], factor_variables: Sequence[tuple[str, ...]]) -> str:
    """Return an SVG of every object's O above its X_0 … X_t and of every factor between its variables.

    Args:
        rows: Names of the variables of each object, such as ("O", "X0", "X1").
        factor_variables: Names of the variables of each factor, such as ("O", "X0", "X1").
    """
    alone = len(rows) == 1
    left = _LEFT if alone else 2 * _LEFT
    width = left + _LEFT + max(len(row) - 2 for row in rows) * _STEP
    height = len(rows) * _ROW
    objects: dict[str, Place] = {}
    aspects: dict[str, Place] = {}
    for number, (name, *aspect_names) in enumerate(rows):
        middle = left + (len(aspect_names) - 1) * _STEP / 2
        objects[name] = (middle if alone else float(left), float(number * _ROW + _OBJECT_Y))
        for time, aspect in enumerate(aspect_names):
            aspects[aspect] = (float(left + time * _STEP), float(number * _ROW + _ASPECT_Y))
    firsts = {row[1] for row in rows}
    lines: list[str] = []
    squares: list[str] = []
    seen: dict[tuple[str, ...], int] = {}
    for variables in factor_variables:
        repeat = seen.get(variables, 0)
        seen[variables] = repeat + 1
        x, y = _factor_place(variables, objects, aspects, above=repeat == 0 and not firsts.isdisjoint(variables))
        lines += [_line((x, y), (objects | aspects)[name]) for name in variables]
        label = escape(f"factor on {', '.join(variables)}")
        squares.append(f'<rect x="{x - 5}" y="{y - 5}" width="10" height="10"><title>{label}</title></rect>')
    circles = [
        f'<circle cx="{x}" cy="{y}" r="18" fill="white" stroke="black"/>'
        f'<text x="{x}" y="{y + 5}" {_STYLE}>{name}</text>'
        for name, (x, y) in (objects | aspects).items()
    ]
    body = "".join([*lines, *squares, *circles])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'style="background: white; max-width: 100%; height: auto">{body}</svg>'
    )


def _factor_place(
    variables: tuple[str, ...], objects: Mapping[str, Place], aspects: Mapping[str, Place], *, above: bool
) -> Place:
    """Prior right of O, actions between aspects, p(X_0 | O) above X_0, evidence below its aspect, many O at left."""
    beside = [aspects[name] for name in variables if name in aspects]
    if not beside:
        owners = [objects[name] for name in variables]
        if len(owners) > 1:
            return _LEFT / 2, sum(y for _, y in owners) / len(owners)
        return owners[0][0] + 60, owners[0][1]
    x, y = sum(place[0] for place in beside) / len(beside), beside[0][1]
    if len(beside) == 2:
        return x, y
    return x, y - 50.0 if above else y + 50.0


def _line(start: Place, end: Place) -> str:
    return f'<line x1="{start[0]}" y1="{start[1]}" x2="{end[0]}" y2="{end[1]}" stroke="#999"/>'
