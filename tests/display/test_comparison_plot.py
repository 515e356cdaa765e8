from types import SimpleNamespace

import numpy as np
import pytest

from atg_fg import plot_comparison
from atg_fg.core.errors import InvalidInputError

pytest.importorskip("matplotlib")


def engine(errors, seconds, refused=None):
    return SimpleNamespace(total_variation=np.array(errors), seconds=np.array(seconds), refused=refused)


def test_an_engine_stands_at_its_median_time_and_mean_error():
    records = {
        "exact": engine([0.0, 0.0, 0.0], [0.001, 0.002, 0.004]),
        "rough$": engine([0.1, 0.2, 0.3], [0.01, 0.01, 0.01]),
        "small": engine([], [], "too large"),
    }
    figure = plot_comparison(records)
    axes = figure.axes[0]
    points = [container.lines[0].get_xydata()[0] for container in axes.containers]
    np.testing.assert_allclose(points, [[2.0, 0.0], [10.0, 0.2]])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["exact", "rough$"]
    low, high = axes.containers[1].lines[2][1].get_segments()[0][:, 1]
    np.testing.assert_allclose([low, high], 0.2 + np.array([-1.96, 1.96]) * 0.1 / np.sqrt(3))


def test_one_look_has_no_interval():
    assert plot_comparison({"exact": engine([0.0], [0.001])}).axes[0].containers


def test_nothing_to_draw_is_refused():
    with pytest.raises(InvalidInputError, match="expected at least one"):
        plot_comparison({"small": engine([], [], "too large")})
