import os
import sys

import numpy as np
import pytest

from atg_fg import figures
from atg_fg.belief import IdentityBelief
from atg_fg.errors import InvalidInputError, MissingDependencyError
from atg_fg.plots import plot_belief, plot_entropy, plot_success

NAMES = ("cup", "box")
BELIEFS = [
    IdentityBelief(np.array([0.1, 0.2]), 0.7, 5),
    IdentityBelief(np.array([0.05, 0.9]), 0.05, 5),
]
POINTS = [
    {"actions": actions, "policy": policy, "success": success, "interval95": [success - 0.1, success + 0.1]}
    for policy, success in (("entropy", 0.8), ("random", 0.5))
    for actions in (4, 5)
]


def belief():
    return plot_belief(BELIEFS, NAMES)


def entropy():
    expected = [{"flip": 0.9, "left": 0.5}]
    return plot_entropy([b.entropy for b in BELIEFS], expected, ["left"])


def success():
    return plot_success(POINTS, title="Figure 3")


def words(figure):
    axes = figure.axes[0]
    legends = [text.get_text() for legend in (axes.get_legend(), *figure.legends) if legend for text in legend.texts]
    return " ".join([axes.get_title(loc="left"), *(text.get_text() for text in axes.texts), *legends])


@pytest.mark.parametrize(
    ("plot", "expected"),
    [
        (belief, ["cup", "box", "unseen", "novel"]),
        (entropy, ["flip", "left", "chosen"]),
        (success, ["entropy", "random", "Figure 3"]),
    ],
)
@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_every_plot_is_saved_with_its_words_and_the_same_bytes_each_time(plot, expected, suffix, tmp_path):
    figure = plot()
    assert all(word in words(figure) for word in expected)
    for name in ("one", "other"):
        figures.save_figure(plot(), tmp_path / f"{name}.{suffix}")
    assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"other.{suffix}").read_bytes()


def test_a_figure_shows_itself_in_a_notebook():
    assert belief()._repr_png_().startswith(b"\x89PNG")


def test_an_image_is_saved_as_it_is(tmp_path):
    from matplotlib.image import imread

    image = np.random.default_rng(0).integers(256, size=(4, 5, 3), dtype=np.uint8)
    figures.save_image(image, tmp_path / "image.png")
    np.testing.assert_array_equal(np.round(imread(tmp_path / "image.png")[:, :, :3] * 255), image)


@pytest.mark.parametrize("name", ["figure.jpeg", "figure", "no/folder/figure.png"])
def test_a_path_that_cannot_hold_a_figure_is_refused(name, tmp_path):
    with pytest.raises(InvalidInputError, match=r"expected"):
        figures.save_figure(belief(), tmp_path / name)
    assert os.listdir(tmp_path) == []


def test_without_matplotlib_the_extra_that_brings_it_is_named(monkeypatch):
    figures.figure_class.cache_clear()
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingDependencyError, match=r"atg-fg\[viz\]"):
        belief()


@pytest.mark.parametrize(
    "plot",
    [
        lambda: plot_belief([], NAMES),
        lambda: plot_belief(BELIEFS, ["cup"]),
        lambda: plot_entropy([], [], []),
        lambda: plot_success([]),
    ],
)
def test_nothing_to_draw_is_refused(plot):
    with pytest.raises(InvalidInputError):
        plot()
