"""What is said of trials that were recognised beside their verdicts."""

import math
from dataclasses import replace

import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.core.recordings import RecordedLook, RecordedTrial
from atg_fg.core.records import TrialRecord
from atg_fg.experiments.recorded_trials import Recognised, improbable_trials
from atg_fg.learning.predictive_checks import WORSE_THAN_CHANCE

ALPHABET = PatternAlphabet.named(("label",), ("a", "b", "c", "d"), exclusive=False)
ASSUMPTIONS = Assumptions(3, 4, ("go", "turn"), ALPHABET)


def recognised(log_evidence, labels=("a", None, "b"), name="cup"):
    looks = [Evidence.of_detection(ALPHABET, (label,)) for label in labels]
    record = TrialRecord.from_looks(ASSUMPTIONS, looks, ["go"] * (len(labels) - 1), name)
    record.steps[-1] = replace(record.steps[-1], log_evidence=log_evidence)
    trial = RecordedTrial("t", tuple(RecordedLook((label,)) for label in labels), ("go",) * (len(labels) - 1))
    return Recognised(trial, record)


@pytest.mark.parametrize(("nats", "is_told"), [(0.1, True), (-0.1, False), (-WORSE_THAN_CHANCE, False)])
def test_a_trial_far_less_probable_than_labels_drawn_at_random_is_told(nats, is_told):
    at_random = 2 * math.log(1 / 4)  # of the two labels that were seen
    found = improbable_trials([recognised(at_random - WORSE_THAN_CHANCE - nats)])
    assert [warning.startswith("trial t is less probable than labels drawn at random") for warning in found] == (
        [True] if is_told else []
    )


def test_before_anything_was_learned_there_is_no_model_to_speak_against():
    assert improbable_trials([recognised(-100.0, name=None)]) == []
    assert improbable_trials([recognised(-100.0)])
