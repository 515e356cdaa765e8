"""A label that an open alphabet does not know may come in the middle of a trial.

All is then as if it had been in the alphabet from the start and never been seen.
"""

import pickle
from copy import copy

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from tests.small import APPROXIMATE_ENGINES, every_exact_engine

LABELS = ("a", "b", "c")
PARAMETERS = [ModelParameters(0.5, 0.05, learn_in_trial=False), ModelParameters(0.1, 0.1, learn_in_trial=True)]
#: Looks, with whether they are independent of those before at rest, and actions.
TRIAL = [
    ({"front": {"a": 0.8}}, True),
    ({"top": "b"}, True),
    "turn",
    (None, True),
    {"tip": 0.7, None: 0.3},
    (("c", "c"), True),
    ({"front": {"b": 0.3}}, False),
    ({"front": "c", "top": {"new": 0.6, "a": 0.1}}, False),
    "tip",
    (("new", "other"), True),
    "turn",
    (("a", "new"), True),
]


def a_memory(labels, *, is_open=True, exclusive=False, senses=()):
    alphabet = PatternAlphabet.named(("front", "top"), labels, exclusive=exclusive, is_open=is_open)
    memory = RobotMemory(Assumptions(4, 3, ("turn", "tip"), alphabet, senses))
    for name, looks in (("cup", [("a", "b"), ("b", "c"), ("a", "b")]), ("can", [("c", "a"), ("b", "c")])):
        memory.learn([alphabet.index(look) for look in looks], [0] * (len(looks) - 1), None, name)
    return memory


def follow(trial, steps=TRIAL):
    for step in steps:
        if isinstance(step, tuple):
            trial.observe(step[0], independent=step[1])
        else:
            trial.act(step)
    return trial


@pytest.mark.parametrize("parameters", PARAMETERS)
@every_exact_engine
def test_the_posterior_is_that_of_an_alphabet_that_had_the_labels_from_the_start(engine, parameters):
    memory = a_memory(LABELS)
    trial = follow(begin_trial(engine, memory, parameters))
    fresh = follow(begin_trial(engine, a_memory((*LABELS, "new", "other")), parameters))
    exact = follow(begin_trial("enumeration", a_memory((*LABELS, "new", "other")), parameters))
    for other in (fresh, exact):
        np.testing.assert_allclose(trial.identity().probabilities, other.identity().probabilities, atol=1e-12)
        assert trial.log_evidence == pytest.approx(other.log_evidence, abs=1e-12)
        np.testing.assert_allclose(trial.expected_entropies(), other.expected_entropies(), atol=1e-12)
        for ours, theirs in zip(trial.smoothed_aspects(0), other.smoothed_aspects(0), strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert memory == a_memory(LABELS)  # what is remembered learns when the trial is over
    assert trial.memory.assumptions.alphabet.names == (*LABELS, "new", "other")


@every_exact_engine
def test_what_was_felt_stays_felt(engine):
    senses = (ObjectSense("weight", 0.5, 0.5, 0.05, "kg"),)
    small, great = a_memory(LABELS, senses=senses), a_memory((*LABELS, "new"), senses=senses)
    for memory in (small, great):
        memory.learn([0], [], "cup", measured=[(("weight", 0.3),)])
    beliefs = []
    for memory, felt in ((small, {"weight": 0.31}), (great, {"weight": 0.31}), (small, {})):
        trial = begin_trial(engine, memory, PARAMETERS[0])
        trial.observe({"front": "a", **felt})
        trial.act("turn")
        trial.observe({"front": "new"})
        beliefs.append(trial.identity().probabilities)
    np.testing.assert_allclose(beliefs[0], beliefs[1], atol=1e-12)
    assert beliefs[0][0] > 5 * beliefs[2][0]  # it weighs what the cup does


@pytest.mark.parametrize("engine", APPROXIMATE_ENGINES)
def test_approximate_engines_and_their_options_go_on_as_well(engine):
    options = {"n_particles": 50} if engine == "particle" else {}
    steps = [step for step in TRIAL if not isinstance(step, dict)]
    trial = follow(begin_trial(engine, a_memory(LABELS), PARAMETERS[1], **options), steps)
    fresh = follow(begin_trial(engine, a_memory((*LABELS, "new", "other")), PARAMETERS[1], **options), steps)
    np.testing.assert_allclose(trial.identity().probabilities, fresh.identity().probabilities, atol=1e-12)
    assert trial.options == options


def test_evidence_of_the_alphabet_that_there_was_is_read_under_the_new_one():
    """By hand: |𝒵| = 3, as if there had been three labels."""
    alphabet = PatternAlphabet.named(("label",), ("a", "b"), exclusive=False, is_open=True)
    memory = RobotMemory(Assumptions(2, 1, ("turn",), alphabet))
    memory.learn([0], [], None, "cup")
    trial = begin_trial("bayes-filter", memory, ModelParameters(0.0, 0.3, learn_in_trial=False))
    trial.observe(Evidence.of_detection(alphabet, ("a",)))
    trial.observe(("new",))
    known, unseen = (0.7 + 0.1) * 0.1, (1 / 3) ** 2  # δ/|𝒵| = 0.1; the aspect of an unseen object shows any pattern
    assert trial.history.evidence[0].likelihood.tolist() == [1.0, 0.0, 0.0]
    assert trial.log_evidence == pytest.approx(np.log((known + unseen) / 2), abs=1e-12)


def test_copies_and_pickles_meet_labels_of_their_own():
    trial = follow(begin_trial("bayes-filter", a_memory(LABELS), PARAMETERS[1]), TRIAL[:3])
    for twin in (copy(trial), pickle.loads(pickle.dumps(trial))):
        twin.observe(("new", "a"))
        fresh = follow(begin_trial("bayes-filter", a_memory((*LABELS, "new")), PARAMETERS[1]), TRIAL[:3])
        fresh.observe(("new", "a"))
        np.testing.assert_allclose(twin.identity().probabilities, fresh.identity().probabilities, atol=1e-12)
    assert trial.memory.assumptions.alphabet.names == LABELS


def test_looks_that_change_after_they_were_told_change_nothing():
    trial, look = begin_trial("bayes-filter", a_memory(LABELS), PARAMETERS[0]), {"front": {"a": 0.8}}
    trial.observe(look)
    look["front"]["a"] = 0.1
    trial.act("turn")
    trial.observe(("new", "a"))
    fresh = begin_trial("bayes-filter", a_memory((*LABELS, "new")), PARAMETERS[0])
    fresh.observe({"front": {"a": 0.8}})
    fresh.act("turn")
    fresh.observe(("new", "a"))
    np.testing.assert_allclose(trial.identity().probabilities, fresh.identity().probabilities, atol=1e-12)


@pytest.mark.parametrize(
    ("look", "message"),
    [
        ({"front": "new", "side": "a"}, "slot 'side'; expected one of: front, top"),
        (("new",), "one entry for each of 2 slots"),
        (("new", 7), "symbol 7; expected 0 to 3"),
        ({"front": {"new": -1.0}}, "new: -1.0"),
    ],
)
def test_a_look_that_is_wrong_besides_is_refused_and_changes_nothing(look, message):
    trial = follow(begin_trial("bayes-filter", a_memory(LABELS), PARAMETERS[0]), TRIAL[:3])
    before = trial.identity().probabilities
    with pytest.raises(InvalidInputError, match=message):
        trial.observe(look)
    np.testing.assert_array_equal(trial.identity().probabilities, before)
    assert trial.memory.assumptions.alphabet.names == LABELS
    trial.observe(("a", "b"))


def test_a_closed_alphabet_refuses_it_in_one_line():
    trial = begin_trial("bayes-filter", a_memory(LABELS, is_open=False), PARAMETERS[0])
    with pytest.raises(InvalidInputError, match="slot 'front': 'new'; expected one of: a, b, c"):
        trial.observe({"front": "new"})
