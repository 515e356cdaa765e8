import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.experiments.live_trial import LiveTrial
from atg_fg.experiments.recognition_agent import RecognitionAgent
from atg_fg.policies import ExplorationPolicy, make_policy
from atg_fg.storage.presets import preset

ALPHABET = arcube_assumptions().alphabet
SEEN = [(0, 4), (4, 1), (2, 1), (5, 1)]
TURNS = [0, 1, 1]


@pytest.fixture
def memory():
    """One object, seen from three sides."""
    made = RobotMemory(arcube_assumptions(3))
    made.learn([ALPHABET.index(seen) for seen in SEEN], TURNS, None)
    return made


def live(memory, settled=None, teaching=None, engine="bayes-filter"):
    agent = RecognitionAgent(memory, preset("default"), engine=engine, policy=make_policy("entropy", settled))
    return LiveTrial(agent, teaching)


def look(trial, detection):
    return trial.look(Evidence.of_detection(ALPHABET, detection))


@pytest.mark.parametrize("engine", ["bayes-filter", "enumeration"])
def test_its_beliefs_are_those_of_the_engine_whatever_was_proposed(memory, engine):
    trial, plain = live(memory, engine=engine), begin_trial(engine, memory, preset("default"))
    for number, seen in enumerate(SEEN):
        step = look(trial, seen)
        plain.observe(Evidence.of_detection(ALPHABET, seen))
        np.testing.assert_allclose(step.belief.objects, plain.identity().objects)
        assert step.belief.unseen == pytest.approx(plain.identity().unseen)
        if number < len(TURNS):
            trial.acted([TURNS[number]])
            plain.act(TURNS[number])
    assert trial.ended().actions == TURNS
    assert trial.record.matched == "object-000"


def test_actions_done_at_once_are_actions_with_nothing_seen_between(memory):
    trial, plain = live(memory), begin_trial("enumeration", memory, preset("default"))
    look(trial, SEEN[0])
    trial.acted(TURNS[:2])
    last = look(trial, SEEN[2])
    plain.observe(Evidence.of_detection(ALPHABET, SEEN[0]))
    plain.act(TURNS[0])
    plain.observe(Evidence.of_detection(ALPHABET, (None, None)))
    plain.act(TURNS[1])
    plain.observe(Evidence.of_detection(ALPHABET, SEEN[2]))
    np.testing.assert_allclose(last.belief.objects, plain.identity().objects)
    record = trial.ended()
    assert record.detections == [SEEN[0], (None, None), SEEN[2]]
    assert record.actions == TURNS[:2]


def test_of_looks_at_rest_the_one_that_says_most_counts_alone(memory):
    trial, plain = live(memory), begin_trial("enumeration", memory, preset("default"))
    for seen in ((None, 4), SEEN[0], (0, None)):
        step = look(trial, seen)
    plain.observe(Evidence.of_detection(ALPHABET, SEEN[0]))
    np.testing.assert_allclose(step.belief.objects, plain.identity().objects)
    trial.acted([TURNS[0]])
    look(trial, SEEN[1])
    assert trial.ended().detections == [SEEN[0], SEEN[1]]
    assert trial.record.actions == [TURNS[0]]


def test_the_last_proposal_is_no_action(memory):
    trial = live(memory)
    assert look(trial, SEEN[0]).action is not None
    assert trial.ended().actions == []


def test_what_is_settled_needs_no_action_unless_there_is_more_to_learn(memory):
    assert look(live(RobotMemory(arcube_assumptions()), 0.05), SEEN[0]).action is None
    step = look(live(RobotMemory(arcube_assumptions()), 0.05, ExplorationPolicy()), SEEN[0])
    assert step.action in (0, 1, 2)
    assert step.purpose == "learn"


def test_actions_before_a_look_and_none_at_all_are_refused(memory):
    trial = live(memory)
    with pytest.raises(InvalidInputError, match=r"actions: \[0\]; expected some, after a look"):
        trial.acted([0])
    look(trial, SEEN[0])
    with pytest.raises(InvalidInputError, match=r"actions: \[\]; expected some, after a look"):
        trial.acted([])
