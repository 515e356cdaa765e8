"""Scores of tests whose memory gives raw trials to other ATGs, by hand."""

import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.core.records import StepSummary, TrialSummary
from atg_fg.experiments.scores import Score
from atg_fg.learning.structured_memory import StructuredMemory

ASSUMPTIONS = Assumptions(4, 3, ("turn",), PatternAlphabet(("label",), 3, exclusive=False))


class Told(StructuredMemory):
    """A memory that is told which trials are of one object."""

    def _mend(self):
        pass


def trial(presented, matched):
    steps = tuple(
        StepSummary((label,), label, 0.5, 0.1, {"object": presented}, action)
        for label, action in ((0, "turn"), (1, None))
    )
    return TrialSummary("novel" if matched is None else "known", matched, steps)


def judged(verdicts):
    """Score trials of (object, ATG that it is matched to), all learned from."""
    memory, score = Told(ASSUMPTIONS), Score()
    for presented, matched in verdicts:
        name = memory.learn([0, 1], [0], matched)
        score.add(trial(presented, matched), memory.learn_shared(name, [(0,), (1,)], [0]))
    return memory, score


def test_a_name_counts_as_of_the_object_that_most_of_its_trials_were_of_once_trials_have_moved():
    memory, score = judged([("a", None), ("b", "object-000"), ("b", "object-000")])
    score.mend(memory)
    assert score.mended is None  # nothing has moved: the ATG is of the object that founded it
    memory.reassign({0: "object-001"})
    score.mend(memory)
    name = memory.learn([0, 1], [0], "object-000")
    score.add(trial("b", "object-000"), memory.learn_shared(name, [(0,), (1,)], [0]))
    # The first trial was right; then b, which was new, was taken for a, and once more; at last it is object-000.
    assert score.result(0).success == (2, 4)
    score.mend(memory)
    assert score.result(0).mended == (4, 4)


def test_a_second_atg_of_one_object_counts_as_one_false_novelty_when_mended():
    memory, score = judged([("a", None), ("a", "object-000"), ("a", "object-000"), ("b", None)])
    memory.reassign({2: "object-007"})
    score.mend(memory)
    assert score.result(0).mended == (3, 4)


def test_a_verdict_counts_as_the_atg_that_its_trial_is_put_in_when_it_ends():
    memory, score = judged([("a", None), ("b", "object-000")])
    name = memory.learn([0, 1], [0], "object-000")
    memory.learn_shared(name, [(0,), (1,)], [0])
    memory.reassign({1: "object-001", 2: "object-001"})  # the second trial of b shows that the first was one, too
    assert score.add(trial("b", "object-000"), "object-001", memory)
    name = memory.learn([0, 1], [0], "object-000")
    memory.learn_shared(name, [(0,), (1,)], [0])
    memory.reassign({3: "object-002"})  # alone in its ATG, it is taken for a new object
    assert score.add(trial("c", "object-000"), "object-002", memory)
    name = memory.learn([0, 1], [0], "object-001")
    memory.learn_shared(name, [(0,), (1,)], [0])
    assert not score.add(trial("a", "object-001"), "object-001", memory)
    assert score.result(0).success == (3, 5)
    assert score.result(0).right == (True, False, True, True, False)


def test_trials_are_given_back_and_atgs_are_as_they_were():
    memory, _ = judged([("a", None), ("a", "object-000"), ("b", None)])
    before = memory.copy()
    memory.reassign({1: "object-001", 2: "object-000"})
    assert [(each.trial, each.old, each.new) for each in memory.reassignments] == [
        (1, "object-000", "object-001"),
        (2, "object-001", "object-000"),
    ]
    assert memory["object-001"].counts == {(0, 0, 1): 1}
    memory.reassign({each.trial: each.old for each in memory.reassignments})
    assert list(memory) == list(before)
    assert memory.learner.owners == before.learner.owners


def test_an_atg_without_trials_is_no_more_and_what_it_knows_from_elsewhere_stays():
    memory, _ = judged([("a", None), ("b", None)])
    memory.reassign({1: "object-000"})
    assert memory.names == ("object-000",)
    assert memory["object-000"].counts == {(0, 0, 1): 2}
    memory.learn([2, 2], [0], "object-000")  # not from a raw trial
    memory.reassign({0: "object-005"})
    assert memory["object-000"].counts == {(0, 0, 1): 2, (2, 0, 2): 1}
    assert memory["object-005"].counts == {(0, 0, 1): 1}


def test_there_has_to_be_such_a_trial():
    memory, _ = judged([("a", None)])
    with pytest.raises(ValueError, match="trial 1; expected less than 1"):
        memory.reassign({1: "object-000"})
