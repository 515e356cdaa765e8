"""Scripted trials of version 2: what they may say, what every exact engine makes of it, and what is refused."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.replay import replay
from atg_fg.storage.scripted_trial import read_script
from tests.small import EXACT_ENGINES

DOCUMENT = json.loads((Path(__file__).parents[1] / "data" / "formats" / "scripted-trial-2.json").read_text())


def script(change=lambda document: None):
    document = copy.deepcopy(DOCUMENT)
    change(document)
    return read_script(json.dumps(document), "trial.json")


def test_a_look_by_slot_is_the_product_of_its_slots():
    trial = script()
    patterns = trial.memory.assumptions.alphabet.patterns
    assert len(patterns) == 9  # with symbols that repeat
    soft = {(1, 1): 0.8, (2, 1): 0.2}
    assert trial.steps[0].likelihood.tolist() == [soft.get(pattern, 0.0) for pattern in patterns]
    assert trial.steps[4].likelihood.tolist() == [{0: 0.5, 1: 0.0, 2: 0.5}[right] for _, right in patterns]


def test_exact_engines_agree_on_soft_looks_of_patterns_that_repeat_symbols():
    trial = script()
    documents = [replay(trial, engine) for engine in EXACT_ENGINES]
    for document in documents[1:]:
        for step, first in zip(document["steps"], documents[0]["steps"], strict=True):
            assert step["unseen"] == pytest.approx(first["unseen"], abs=1e-12)
            assert step["log_evidence"] == pytest.approx(first["log_evidence"], abs=1e-12)


def test_the_first_look_is_right_by_hand():
    # Aspects (1,1) and (1,2) of three; the collection has one aspect, of the seven other patterns.
    of_box = (0.99 * (0.8 + 0.2 / 7) + 3 * 0.01 / 9) / 3
    of_new = 1 / 9
    step = replay(script(), EXACT_ENGINES[0])["steps"][0]
    assert step["objects"]["box"] == pytest.approx(of_box / (of_box + 3 * of_new), abs=1e-12)


def test_certain_weights_are_as_good_as_a_symbol():
    hard = script(lambda d: d["steps"][0].update(observe={"left": 1, "right": 1}))
    listed = script(lambda d: d["steps"][0].update(observe=[1, 1]))
    soft = script(lambda d: d["steps"][0].update(observe={"left": {"1": 3.0}, "right": 1}, confidences=[None, 0.75]))
    assert np.array_equal(hard.steps[0].likelihood, listed.steps[0].likelihood)
    assert np.array_equal(soft.steps[0].likelihood, 3.0 * hard.steps[0].likelihood)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(version=3), "trial.json: version: 3; expected 1 or 2"),
        (lambda d: d.update(version=1), "trial.json: assumptions: 'exclusive' in version 1; expected it in version 2"),
        (lambda d: d["steps"][0]["observe"].pop("left"), r"steps\[0\].observe: key 'left' is missing"),
        (lambda d: d["steps"][0]["observe"].update(top=1), r"steps\[0\].observe: unknown key 'top'"),
        (lambda d: d["steps"][0]["observe"].update(left={"3": 1.0}), "slot 'left': symbol '3'; expected '0' to '2'"),
        (lambda d: d["steps"][0]["observe"].update(left={"01": 1.0}), "slot 'left': symbol '01'; expected '0' to '2'"),
        (lambda d: d["steps"][0]["observe"].update(left={"1": -1.0}), "slot 'left', symbol 1: -1.0; expected"),
        (lambda d: d["steps"][0]["observe"].update(left={"1": 0.0}), r"slot 'left': \[0.0, 0.0, 0.0\]; expected"),
        (lambda d: d["steps"][0]["observe"].update(left={}), r"slot 'left': \[0.0, 0.0, 0.0\]; expected finite"),
        (lambda d: d["steps"][0].update(confidences=[0.5]), r"steps\[0\].confidences: 1; expected one for each of 2"),
        (lambda d: d["steps"][1].update(confidences=[0.5, 0.5]), r"steps\[1\]: unknown key 'confidences'"),
    ],
)
def test_what_is_malformed_is_refused_with_its_place(change, message):
    with pytest.raises(InvalidInputError, match=message):
        script(change)


def test_version_1_knows_nothing_of_it():
    def old(document):
        document.update(version=1, steps=[{"observe": [0, 1], "confidences": [None, 0.5]}])
        del document["assumptions"]["exclusive"]
        document["memory"][0].update(aspects=[[0, 1]], transitions=[])

    with pytest.raises(InvalidInputError, match="unknown key 'confidences'"):
        script(old)


def test_slots_that_exclude_each_other_leave_no_pattern_to_what_repeats():
    def exclusive(document):
        document["assumptions"]["exclusive"] = True
        document["memory"][0].update(aspects=[[0, 1]], transitions=[])
        document["steps"] = [{"observe": {"left": {"1": 1.0}, "right": {"1": 1.0}}}]

    with pytest.raises(InvalidInputError, match=r"steps\[0\].observe: evidence: all zero"):
        script(exclusive)


def test_what_is_felt_stands_beside_a_look():
    def felt(document):
        document["assumptions"]["object_senses"] = [WEIGHT]
        document["steps"][0]["measured"] = {"weight": 0.3}

    plain, weighed = script(), script(felt)
    assert weighed.steps[0].measured == (("weight", 0.3),)
    np.testing.assert_array_equal(weighed.steps[0].likelihood, plain.steps[0].likelihood)

    def wrong(document):
        felt(document)
        document["steps"][0]["measured"] = {"weight": "light"}

    with pytest.raises(
        InvalidInputError, match=r"steps\[0\].measured: weight: 'light'; expected a number above 0, in kg"
    ):
        script(wrong)


WEIGHT = {
    "name": "weight", "unit": "kg", "typical": 0.3, "spread": 0.5, "error": 0.08, "relative": True, "revealed_by": [],
}  # fmt: skip
