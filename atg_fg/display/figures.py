"""How every figure of this project looks, and how it is saved: whole or not at all, the same bytes each time.

matplotlib is imported by the first figure that is drawn, not with the package, and ``pyplot`` not at all.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError, needed_by
from atg_fg.core.visible_text import visible
from atg_fg.storage import plain_files

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Colours of Okabe and Ito that people with any kind of colour blindness tell apart, without the yellow.
PALETTE: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
INK: Final = "#222222"
GREY: Final = "#767676"

# Any: the type of a setting's name is not the same in all versions of matplotlib.
_STYLE: Final[Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib, so figures look the same everywhere
    "font.size": 9.5,
    "text.color": INK,
    "axes.titlesize": 11.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 10,
    "axes.facecolor": "white",
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.8,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "ytick.major.size": 0,
    "lines.linewidth": 2,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "savefig.bbox": None,
    "text.usetex": False,
}

_FILM_COLOURS: Final = 64

#: Metadata that would differ from run to run, by file format.
_UNDATED: Final[dict[str, dict[str, Any]]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}


def check_figure_path(path: Path | str) -> str:
    """Return the format that a figure's path stands for, before any work is done for it.

    Raises:
        InvalidInputError: Another suffix than .png, .svg or .pdf, or a place that cannot be written.
        MissingDependencyError: matplotlib is not installed.
    """
    figure_class()
    kind = Path(path).suffix.lower().removeprefix(".")
    if kind not in _UNDATED:
        raise InvalidInputError(f"figure {str(path)!r}: suffix {kind!r}; expected .png, .svg or .pdf")
    plain_files.check_writable(path)
    return kind


def save_figure(figure: Figure, path: Path | str) -> None:
    """Write a figure as PNG, SVG or PDF, by the suffix of ``path``; errors are those of ``check_figure_path``."""
    kind = check_figure_path(path)
    plain_files.write_bytes_atomically(path, _rendered(figure, kind))


def save_image(image: NDArray[np.uint8], path: Path | str) -> None:
    """Write an RGB or grey image, shape [height, width(, 3)], as PNG; errors are those of ``check_figure_path``."""
    check_figure_path(path)
    from matplotlib import image as matplotlib_image

    buffer = io.BytesIO()
    matplotlib_image.imsave(buffer, image, format="png", cmap="gray", vmin=0, vmax=255, metadata=_UNDATED["png"])
    plain_files.write_bytes_atomically(path, buffer.getvalue())


def check_film_path(path: Path | str) -> None:
    """Raise, before any work is done, what ``save_film`` would raise at the end."""
    figure_class()
    if Path(path).suffix.lower() != ".gif":
        raise InvalidInputError(f"film {str(path)!r}: suffix {Path(path).suffix!r}; expected .gif")
    plain_files.check_writable(path)


def save_film(pictures: Sequence[NDArray[np.uint8]], fps: int, path: Path | str) -> None:
    """Write RGB pictures, each of shape [height, width, 3], as an animated GIF of ``fps`` pictures a second.

    Raises:
        InvalidInputError: No pictures, another suffix than .gif, or a place that cannot be written.
        MissingDependencyError: Pillow, which comes with matplotlib, is not installed.
    """
    check_film_path(path)
    from PIL import Image

    if not pictures:
        raise InvalidInputError(f"film {str(path)!r}: no pictures; expected some")
    # One palette for all pictures, from a few of them, so that what does not move does not flicker.
    sample = np.concatenate(pictures[:: max(1, len(pictures) // 6)])
    palette = Image.fromarray(sample).quantize(_FILM_COLOURS)
    frames = [Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    buffer = io.BytesIO()
    frames[0].save(buffer, "gif", save_all=True, append_images=frames[1:], duration=1000 // fps, loop=0)
    plain_files.write_bytes_atomically(path, buffer.getvalue())


@contextmanager
def plot_style() -> Iterator[None]:
    """Draw in the style of this project in a ``with`` block; matplotlib's settings come back after it.

    Raises:
        MissingDependencyError: matplotlib is not installed.
    """
    figure_class()
    import matplotlib

    with matplotlib.rc_context(_STYLE):
        yield


@functools.cache
def figure_class() -> type[Figure]:
    """Return the class of every figure made here: one that notebooks show without ``pyplot``.

    Raises:
        MissingDependencyError: matplotlib is not installed.
    """
    with needed_by("figures", "matplotlib", "viz"):
        from matplotlib.figure import Figure

    class NotebookFigure(Figure):
        """A figure that IPython shows by itself, which a bare ``Figure`` does only once pyplot is loaded."""

        def _repr_png_(self) -> bytes:
            return _rendered(self, "png", dpi=110)

        def __reduce__(self) -> tuple[Any, ...]:
            # A class inside a function cannot be pickled by name, so the copy is a plain Figure.
            return Figure, (), self.__getstate__()

    return NotebookFigure


def _show_what_steers(figure: Figure) -> None:
    """Write out control characters in all texts of a figure: fonts have no sign for them, and SVG cannot hold them."""
    from matplotlib.text import Text
    from matplotlib.ticker import FixedFormatter

    for text in figure.findobj(Text):
        if isinstance(text, Text):
            text.set_text(visible(text.get_text(), keep="\n"))
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            formatter = axis.get_major_formatter()
            if isinstance(formatter, FixedFormatter):
                axis.set_major_formatter(FixedFormatter([visible(label, keep="\n") for label in formatter.seq]))


def _rendered(figure: Figure, kind: str, dpi: float = 200) -> bytes:
    import matplotlib

    _show_what_steers(figure)
    buffer = io.BytesIO()
    # Without a fixed salt, the ids inside an SVG differ from run to run; fonts of type 42 stay selectable.
    settings: Any = {**_STYLE, "svg.hashsalt": "atg-fg", "pdf.fonttype": 42}
    with matplotlib.rc_context(settings):
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=_UNDATED[kind])
    return buffer.getvalue()
