"""Names with dollars, and names that begin with an underscore, are names as others are, in every figure."""

import io
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.display.atg_picture import draw_atg
from atg_fg.display.comparison_plot import plot_comparison
from atg_fg.display.success_plots import plot_ablation, plot_success
from atg_fg.display.trial_plots import plot_atg, plot_belief, plot_entropy
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import follow

text = pytest.importorskip("matplotlib.text")

#: A formula that matplotlib cannot read, and a name that it keeps for itself: in one, and, slow, each by itself.
NAMES = ("_$\\frac{1}{$", *(pytest.param(each, marks=pytest.mark.slow) for each in ("$\\frac{1}{$", "_")))


def assert_named(figure, *names):
    """Assert that a figure can be saved, and that the names are in it as they are."""
    for kind in ("png", "svg"):
        figure.savefig(io.BytesIO(), format=kind, dpi=30)
    written = [each.get_text() for each in figure.findobj(text.Text)]
    assert all(any(name in each for each in written) for name in names), written


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("n_slots", [1, 2, 3])
def test_atgs_and_trials_are_drawn_with_any_names(n_slots, name):
    slots = tuple(f"{name}{slot}" for slot in range(n_slots))
    alphabet = PatternAlphabet.named(slots, [f"{name}symbol {number}" for number in range(4)])
    actions = (f"{name}go", "not yet tried", "observed")
    memory = RobotMemory(Assumptions(3, 4, actions, alphabet))
    memory.learn([0, 1, 0], [0, 1], None, f"{name}cup")
    looks = [Evidence.of_detection(alphabet, alphabet.patterns[pattern]) for pattern in (0, 1)]
    record = follow(begin_trial("bayes-filter", memory, ModelParameters()), looks, [0], [{}, {}])
    record.steps[0] = replace(record.steps[0], action=0, expected_entropies=np.array([0.5, 0.25, 0.5]))
    (graph,) = memory
    assert_named(draw_atg(graph), *actions, f"{name}cup")
    assert_named(plot_atg(record), *actions)
    assert_named(plot_belief(record), f"{name}cup")
    assert_named(plot_entropy(record), *actions)
    legend = plot_entropy(record).axes[0].get_legend()
    assert [each.get_text() for each in legend.get_texts()] == ["entropy H(O)", *actions, "chosen (filled)"]
    assert len(draw_atg(graph).legends[0].get_texts()) == 4


@pytest.mark.parametrize("name", NAMES)
def test_results_are_drawn_with_any_names(name):
    entry = {"world": name, "noise": name, "variant": f"{name}plain", "actions": 1, "success": 0.5}
    curve = [{**entry, "interval95": [0.4, 0.6]}, {**entry, "interval95": [0.4, 0.6], "world": "ideal"}]
    assert_named(plot_ablation(curve), f"{name}plain")
    point = {"actions": 1, "policy": name, "success": 0.5, "interval95": [0.4, 0.6]}
    assert_named(plot_success([point, {**point, "actions": 2}], title=f"{name}title"), name, f"{name}title")
    record = SimpleNamespace(refused=None, seconds=np.ones(2), total_variation=np.ones(2))
    assert_named(plot_comparison({f"{name}ours": record}), f"{name}ours")
