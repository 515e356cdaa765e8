"""Names with dollars are names and no formulas, in every figure."""

import io
from dataclasses import replace

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.display.atg_picture import draw_atg
from atg_fg.display.success_plots import plot_ablation, plot_success
from atg_fg.display.trial_plots import plot_atg, plot_belief, plot_entropy
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import follow

text = pytest.importorskip("matplotlib.text")

FORMULA = "$\\frac{1}{$"  # none that matplotlib could read


def assert_named(figure):
    """Assert that a figure can be saved, and that the name is in it as it is."""
    for kind in ("png", "svg"):
        figure.savefig(io.BytesIO(), format=kind, dpi=30)
    assert any(FORMULA in each.get_text() for each in figure.findobj(text.Text))


@pytest.mark.parametrize("n_slots", [1, 2, 3])
def test_atgs_and_trials_are_drawn_with_any_names(n_slots):
    slots = tuple(f"{FORMULA}{slot}" for slot in range(n_slots))
    alphabet = PatternAlphabet.named(slots, [f"{FORMULA}symbol {number}" for number in range(4)])
    memory = RobotMemory(Assumptions(3, 4, (f"{FORMULA}go", f"{FORMULA}stay"), alphabet))
    memory.learn([0, 1, 0], [0, 1], None, f"{FORMULA}cup")
    looks = [Evidence.of_detection(alphabet, alphabet.patterns[pattern]) for pattern in (0, 1)]
    record = follow(begin_trial("bayes-filter", memory, ModelParameters()), looks, [0], [{}, {}])
    record.steps[0] = replace(record.steps[0], action=0, expected_entropies=np.array([0.5, 0.25]))
    for figure in (draw_atg(next(iter(memory))), plot_atg(record), plot_belief(record), plot_entropy(record)):
        assert_named(figure)


def test_results_are_drawn_with_any_names():
    entry = {"world": FORMULA, "noise": FORMULA, "variant": FORMULA, "actions": 1, "success": 0.5}
    curve = [{**entry, "interval95": [0.4, 0.6]}, {**entry, "interval95": [0.4, 0.6], "world": "ideal"}]
    assert_named(plot_ablation(curve))
    point = {"actions": 1, "policy": FORMULA, "success": 0.5, "interval95": [0.4, 0.6]}
    assert_named(plot_success([point, {**point, "actions": 2}], title=FORMULA))
