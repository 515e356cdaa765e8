"""What is said of trials that were recognised beside their verdicts."""

import math
from dataclasses import replace

import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.core.recordings import RecordedLook, RecordedTrial, Recording
from atg_fg.core.records import TrialRecord
from atg_fg.experiments import recorded_trials
from atg_fg.experiments.recorded_trials import Recognised, improbable_trials, recognise
from atg_fg.experiments.simulated_recording import simulated_recording
from atg_fg.learning import structured_memory
from atg_fg.learning.evidence_learner import EvidenceLearner
from atg_fg.learning.predictive_checks import WORSE_THAN_CHANCE
from atg_fg.learning.structured_memory import memory_for
from atg_fg.storage.presets import preset

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


def soft(trial, sure=0.8):
    """Return a trial whose detector gives the likelihood of every label in place of the best one."""
    names = ALPHABET.names
    weights = [
        {name: sure if name == look.labels[0] else (1 - sure) / (len(names) - 1) for name in names}
        for look in trial.looks
    ]
    return trial._replace(looks=tuple(RecordedLook((None,), (), (each,)) for each in weights))


def hard(number, *labels):
    return RecordedTrial(f"t{number}", tuple(RecordedLook((label,)) for label in labels), ("go",) * (len(labels) - 1))


TRIALS = (hard(0, "a", "b", "c"), hard(1, "d", "c", "d"), hard(2, "a", "b", "c"))


@pytest.mark.parametrize("engine", ["bayes-filter", "learned-structure"])
def test_likelihoods_alone_are_recognised_and_learned_from(engine):
    """A label that a look makes more probable than not is what the ATG learns; less clear ones are missing there."""
    parameters = preset("default" if engine == "bayes-filter" else "learned")
    memory = memory_for(parameters, RobotMemory(ASSUMPTIONS))
    trials = tuple(map(soft, TRIALS))
    found = recognise(Recording(("label",), ("go",), ALPHABET.names, trials), memory, engine, parameters, learn=True)
    assert [each.record.verdict for each in found] == ["novel", "novel", "known"]
    assert [each.learned for each in found] == ["object-000", "object-001", "object-000"]
    assert [list(map(ALPHABET.text, graph.aspects)) for graph in memory] == [["(a)", "(b)", "(c)"], ["(d)", "(c)"]]
    assert memory["object-000"].counts == {(0, 0, 1): 2, (1, 0, 2): 2}


def test_what_no_look_makes_probable_is_not_learned():
    memory = RobotMemory(ASSUMPTIONS)
    trials = (soft(TRIALS[0], 0.4),)
    (found,) = recognise(
        Recording(("label",), ("go",), ALPHABET.names, trials), memory, "bayes-filter", preset("default"), learn=True
    )
    assert found.record.verdict == "novel"
    assert found.learned is None
    assert len(memory) == 0


def test_trials_of_likelihoods_keep_their_atg_when_they_change_hands_and_labels_are_added():
    open_ones = Assumptions(3, 4, ("go", "turn"), replace(ALPHABET, is_open=True))
    memory = memory_for(preset("learned"), RobotMemory(open_ones))
    trials = tuple(map(soft, TRIALS))
    recognise(
        Recording(("label",), ("go",), ALPHABET.names, trials),
        memory,
        "learned-structure",
        preset("learned"),
        learn=True,
    )
    memory.reassign({2: "cup"})
    assert memory["cup"].counts == memory["object-000"].counts == {(0, 0, 1): 1, (1, 0, 2): 1}
    memory.extend(("e",))
    assert [len(slot) for (slot,) in memory.learner.trials[0].likelihoods] == [5, 5, 5]
    memory.reassign({2: "object-000"})
    assert memory["object-000"].counts == {(0, 0, 1): 2, (1, 0, 2): 2}
    assert "cup" not in memory.names


def test_beyond_the_first_trials_many_are_learned_from_at_once(monkeypatch):
    monkeypatch.setattr(structured_memory, "FIRST_ALONE", 4)
    recording = simulated_recording("detector", 3, 11, 8, seed=101)
    memory = memory_for(preset("learned"), RobotMemory(recording.assumptions()))
    done, verdicts = [], []
    conclude = EvidenceLearner.conclude
    monkeypatch.setattr(EvidenceLearner, "conclude", lambda *args: verdicts.append(1) or conclude(*args))
    recorded_trials.learn(recording, memory, "learned-structure", preset("learned"), lambda: done.append(len(memory)))
    assert len(done) == len(memory.learner.trials) == 11
    assert 1 < len(verdicts) <= 8  # verdicts are asked for the first trials alone
    in_truth = {}
    for trial, name in zip(recording.trials, memory.learner.owners, strict=True):
        in_truth.setdefault(name, set()).add(trial.object)
    assert set(in_truth) == set(memory.names)
    assert all(len(objects) == 1 for objects in in_truth.values())
    # ATGs are those of their raw trials, and learning goes on from there.
    assert [memory[name] for name in memory.names] == [memory._estimated(name) for name in memory.names]
    with pytest.raises(InvalidInputError, match="trials: 9; expected at most 2 to learn from together"):
        memory.learn_together(memory.learner.trials[:9])


def test_trials_are_learned_from_one_by_one_while_models_are_rivals():
    recording = simulated_recording("ideal", 3, 2, 4, seed=101)
    memory = memory_for(preset("learned"), RobotMemory(recording.assumptions()))
    recorded_trials.learn(recording, memory, "learned-structure", preset("learned"))
    assert memory.n_together == 0
    assert len(memory.learner.trials) == 2
