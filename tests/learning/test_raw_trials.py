"""Raw trials keep each look as it was given, a likelihood of each slot's symbol too, and learn from the whole of it."""

from collections import Counter

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.learning.raw_trials import RawTrial, Recording
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.memory_files import load_memory, save_memory
from atg_fg.storage.presets import preset

ALPHABET = PatternAlphabet(("label",), 4, exclusive=False)
ASSUMPTIONS = Assumptions(3, 3, ("turn", "tip"), ALPHABET)
SOFT = Evidence.of_slots(ALPHABET, [[0.1, 0.6, 0.2, 0.1]])


def test_evidence_is_kept_as_it_was_given():
    label = Evidence.of_detection(ALPHABET, (2,), (0.7,))
    whole = Evidence.of_likelihood(ALPHABET, [1.0, 0.0, 0.5, 0.5])
    trial = RawTrial.of([label, SOFT, whole], [0, 1], ALPHABET)
    assert trial.detections == ((2,), (None,), (None,))
    assert trial.confidences == ((0.7,), (), ())
    assert trial.likelihoods == ((), ((0.1, 0.6, 0.2, 0.1),), ((1.0, 0.0, 0.5, 0.5),))
    trial.check(ASSUMPTIONS)
    recording = Recording.of([trial], 4)
    assert recording.likelihoods[0, 0, 0].tolist() == [1, 1, 1, 1]
    assert recording.likelihoods[0, 1, 0] == pytest.approx([0.4, 2.4, 0.8, 0.4])


def test_trials_of_labels_alone_carry_no_likelihoods():
    trial = RawTrial.of([Evidence.of_detection(ALPHABET, (2,))], [], ALPHABET)
    assert trial == RawTrial(((2,),), ())
    assert Recording.of([trial], 4).likelihoods.size == 1


@pytest.mark.parametrize(
    ("likelihoods", "message"),
    [
        ((((1.0, 1.0, 1.0, 1.0),),), "trial: 1 likelihoods; expected one for each of 2 looks"),
        ((((1.0, 1.0),), ()), r"look 0: likelihoods, slot 'label': shape \(2,\); expected a weight for each of 4"),
        (((), ((0.0, 0.0, 0.0, 0.0),)), "look 1: likelihoods, slot 'label': .* not all 0"),
        (((), ((1.0, -1.0, 1.0, 1.0),)), "look 1: likelihoods, slot 'label': .* at least 0"),
    ],
)
def test_what_is_no_likelihood_is_refused(likelihoods, message):
    with pytest.raises(InvalidInputError, match=message):
        RawTrial(((None,), (None,)), (0,), (), likelihoods).check(ASSUMPTIONS)


def softly(rng, contents, n_trials, n_looks=12):
    """Trials of objects in turn, of which no look shows more than the odds of 12 : 1 against each other label."""
    successors = np.array([[1, 2, 0], [1, 0, 2]])
    for number in range(n_trials):
        state, looks, actions = int(rng.integers(3)), [], []
        for time in range(n_looks):
            right = contents[number % len(contents)][state]
            seen = right if rng.random() < 0.8 else int(rng.integers(4))
            looks.append(Evidence.of_slots(ALPHABET, [np.where(np.arange(4) == seen, 0.8, 0.2 / 3).tolist()]))
            if time + 1 < n_looks:
                actions.append(int(rng.integers(2)))
                state = int(successors[actions[-1], state])
        yield number % len(contents), looks, actions


@pytest.mark.slow
def test_objects_are_told_apart_by_soft_looks_alone_and_so_is_a_memory_that_was_saved(tmp_path):
    memory, objects = StructuredMemory(ASSUMPTIONS), []
    parameters = preset("learned")
    for presented, looks, actions in softly(np.random.default_rng(1), [(0, 1, 2), (3, 3, 1), (2, 2, 0)], 18):
        inference = begin_trial("learned-structure", memory, parameters)
        for number, look in enumerate(looks):
            inference.observe(look)
            if number < len(actions):
                inference.act(actions[number])
        belief = inference.conclude()
        matched = None if belief.is_novel else memory.names[belief.most_probable_object]
        patterns = [int(np.argmax(look.likelihood)) for look in looks]
        trial = RawTrial.of(looks, actions, ALPHABET)
        name = memory.learn(patterns, actions, matched)
        memory.learn_shared(name, trial.detections, actions, trial.confidences, trial.likelihoods)
        objects.append(presented)
    # As they were mended, at most one trial is with those of another object.
    owners = [
        Counter(owner for owner, each in zip(memory.learner.owners, objects, strict=True) if each == presented)
        for presented in range(3)
    ]
    assert sum(owner.most_common(1)[0][1] for owner in owners) >= 17
    assert len({owner.most_common(1)[0][0] for owner in owners}) == 3
    save_memory(memory, tmp_path / "memory.json")
    assert load_memory(tmp_path / "memory.json").learner.trials == memory.learner.trials
    assert load_memory(tmp_path / "memory.json") == memory
    save_memory(memory, tmp_path / "memory.db")
    assert load_memory(tmp_path / "memory.db").learner.trials == memory.learner.trials
