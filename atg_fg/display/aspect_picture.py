"""One aspect as a small view of the object, and the arrows between aspects: what pictures of ATGs are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.checks import brief, floats, instance
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.display.figures import GREY, INK, PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Images: TypeAlias = Mapping[int, NDArray[np.uint8]]
#: Slots that are drawn as two faces of a cube; others are drawn as tiles in a row.
CUBE_SLOTS: Final = ("front", "top")
INCHES_PER_UNIT: Final = 0.78
#: How far the top of a cube is sheared to the right and up, as a part of its side.
_SHEAR: Final = 0.42
_HIGHLIGHT: Final = "#E69F00"


@dataclass(frozen=True)
class Look:
    """How an aspect is drawn.

    Attributes:
        ink: Colour of its outline and of what is written on it.
        linestyle: Of its outline.
        strength: Opacity of images on it.
        side: Colour of the blank side of a cube.
    """

    ink: str = INK
    linestyle: str = "solid"
    strength: float = 1.0
    side: str = "#d8d8d8"


def check_images(images: Any) -> None:
    """Raise ``InvalidInputError`` unless these are images of symbols that can be drawn, or none."""
    for symbol, image in instance({} if images is None else images, "symbol images", Mapping).items():
        pixels = floats(image, f"image of symbol {brief(symbol)}", "grey or RGB pixels")
        if pixels.ndim not in (2, 3) or 0 in pixels.shape or pixels.shape[2:] not in ((), (3,)):
            raise InvalidInputError(
                f"image of symbol {brief(symbol)}: shape {pixels.shape}; expected [rows, columns] or [rows, columns, 3]"
            )


def action_color(action: int) -> str:
    """Return the colour that stands for an action."""
    return PALETTE[action % len(PALETTE)]


def draw_arrow(axes: Axes, start: FloatArray, end: FloatArray, bend: float, shrink: float, **style: Any) -> None:
    """Draw an arrow from the border of the aspect at ``start``.

    Args:
        axes: Where to draw; a unit is ``INCHES_PER_UNIT``.
        start: Middle of an aspect.
        end: What it points to.
        bend: How far it bends, as a part of its length.
        shrink: How far from ``end`` it ends, in units.
        style: Of a ``FancyArrowPatch``.
    """
    from matplotlib.patches import FancyArrowPatch

    points = 72 * INCHES_PER_UNIT
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


def draw_aspect(
    axes: Axes,
    alphabet: PatternAlphabet,
    symbols: Sequence[int | None],
    place: FloatArray,
    images: Images,
    look: Look | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Draw an aspect, and return the lower left and the upper right corner of its outline.

    Args:
        axes: Where to draw.
        alphabet: Names slots and symbols.
        symbols: What each slot shows; where it is ``None`` a question mark is drawn.
        place: The middle of the aspect.
        images: Of each symbol, grey of shape [pixels, pixels] or RGB; its name is written where there is none.
        look: How to draw it.
    """
    draw = _draw_cube if alphabet.slots == CUBE_SLOTS else _draw_tiles
    return draw(axes, alphabet, symbols, place, images, look or Look())


def draw_frame(axes: Axes, outline: tuple[FloatArray, FloatArray]) -> None:
    """Draw a frame around an aspect with this outline."""
    from matplotlib.patches import FancyBboxPatch

    low, high = outline
    width, height = (high - low).tolist()
    style = f"round,pad={0.09},rounding_size=0.1"
    axes.add_patch(
        FancyBboxPatch(tuple(low), width, height, style, fill=False, edgecolor=_HIGHLIGHT, linewidth=3, zorder=6)
    )


def _draw_cube(
    axes: Axes, alphabet: PatternAlphabet, symbols: Sequence[int | None], place: FloatArray, images: Images, look: Look
) -> tuple[FloatArray, FloatArray]:
    """Draw the front and the top of a cube with their symbols, and a blank side."""
    side = 0.78
    low = place - side * (1 + _SHEAR) / 2
    right, up, back = np.array([side, 0.0]), np.array([0.0, side]), np.full(2, side * _SHEAR)
    front, top = symbols
    _draw_face(axes, low + right, back, up, look, look.side)
    _draw_symbol(axes, low, right, up, front, _text(alphabet, front), images, look)
    _draw_symbol(axes, low + up, right, back, top, _text(alphabet, top), images, look)
    return low, low + right + up + back


def _draw_tiles(
    axes: Axes, alphabet: PatternAlphabet, symbols: Sequence[int | None], place: FloatArray, images: Images, look: Look
) -> tuple[FloatArray, FloatArray]:
    """Draw one tile a slot in a row, with the slot's name above."""
    side = min(0.6, 1.3 / len(symbols))
    low = place - np.array([side * len(symbols), side]) / 2
    for number, (symbol, slot) in enumerate(zip(symbols, alphabet.slots, strict=True)):
        corner = low + np.array([number * side, 0.0])
        right, up = np.array([side, 0.0]), np.array([0.0, side])
        _draw_symbol(axes, corner, right, up, symbol, _text(alphabet, symbol), images, look)
        middle = corner[0] + side / 2, corner[1] + side + 0.05
        axes.annotate(slot, middle, ha="center", fontsize=6.5, color=GREY, parse_math=False)
    return low, low + np.array([side * len(symbols), side])


def _text(alphabet: PatternAlphabet, symbol: int | None) -> str:
    return "?" if symbol is None else alphabet.name_of(symbol)


def _draw_face(axes: Axes, corner: FloatArray, right: FloatArray, up: FloatArray, look: Look, color: str) -> None:
    """Draw a parallelogram with its lower left ``corner``."""
    from matplotlib.patches import Polygon

    outline = [corner, corner + right, corner + right + up, corner + up]
    axes.add_patch(
        Polygon(outline, facecolor=color, edgecolor=look.ink, linestyle=look.linestyle, linewidth=0.9, zorder=4)
    )


def _draw_symbol(
    axes: Axes,
    corner: FloatArray,
    right: FloatArray,
    up: FloatArray,
    symbol: int | None,
    text: str,
    images: Images,
    look: Look,
) -> None:
    """Draw a face with a symbol in the middle three quarters of it."""
    from matplotlib.transforms import Affine2D

    _draw_face(axes, corner, right, up, look, "white")
    face_to_data = Affine2D(np.array([[right[0], up[0], corner[0]], [right[1], up[1], corner[1]], [0, 0, 1]]))
    if symbol is not None and symbol in images:
        picture = axes.imshow(
            images[symbol], cmap="gray", vmin=0, vmax=255, extent=(1 / 8, 7 / 8, 1 / 8, 7 / 8),
            interpolation="nearest", alpha=look.strength, zorder=5,
        )  # fmt: skip
        picture.set_transform(face_to_data + axes.transData)
    else:
        middle = corner + (right + up) / 2
        size = min(13.0, 42.0 / len(text))
        axes.annotate(
            text, tuple(middle), ha="center", va="center", fontsize=size, color=look.ink, zorder=5, parse_math=False
        )
