import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.experiments.live_session import LiveTrial
from atg_fg.experiments.recognition_agent import RecognitionAgent
from atg_fg.policies import ExplorationPolicy, make_policy
from atg_fg.storage.presets import preset

pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.experiments.live_session import Asked, Ended, LiveSession, Looked, Noted
from atg_fg.senses.tags import TagDetector, Tags
from atg_fg.senses.turns import Patience, TurnWatcher
from atg_fg.senses.video import Frame
from atg_fg.worlds.arcube import ACTION_ROTATIONS
from tests.senses.images import INTRINSICS, cube_picture

FACES = (0, 1, 2, 3, 4, 5)
BLANK = np.full((480, 640, 3), 120, dtype=np.uint8)
LEFT, FLIP = ACTION_ROTATIONS["left"], ACTION_ROTATIONS["flip"]


def begin(memory=None, **options):
    detector = TagDetector(Tags("5X5_50", 0.042, INTRINSICS, symbols={tag: tag for tag in range(12)}))
    watcher = TurnWatcher(ACTION_ROTATIONS, patience=Patience.of_pictures())
    memory = RobotMemory(arcube_assumptions()) if memory is None else memory
    agent = RecognitionAgent(memory, preset("default"), policy=make_policy("entropy", 0.05))
    return LiveSession(detector, watcher, agent, **options)


def feed(session, *pictures):
    return [event for number, picture in enumerate(pictures) for event in session.take(Frame(float(number), picture))]


def test_frames_become_looks_and_an_empty_table_ends_the_trial():
    session = begin(learns=True)
    events = feed(session, cube_picture(FACES, np.eye(3)), cube_picture(FACES, LEFT), BLANK)
    assert [type(event) for event in events] == [Looked, Looked, Ended]
    assert [event.turn for event in events[:2]] == [(), ("left",)]
    assert events[1].step.detection == (2, 4)
    assert events[1].step.pattern == session.memory.assumptions.alphabet.index((2, 4))
    assert min(events[1].step.confidences) > 0.99
    assert events[2].learned == "object-000"
    assert session.trial is None


def test_what_was_hidden_at_rest_is_a_look_more_at_the_same_aspect():
    """A hand hides the front, then nothing, then the top: one look on record, of both tags."""
    session = begin(learns=True)
    whole = cube_picture(FACES, np.eye(3))
    detected = session._detector.detect(whole)
    slots = session._watcher.viewpoint.slots(detected)
    hidden = {}
    for slot, tag in slots.items():
        hidden[slot] = whole.copy()
        x, y = np.split(tag.corners.astype(int), 2, axis=1)
        hidden[slot][y.min() - 5 : y.max() + 5, x.min() - 5 : x.max() + 5] = 120
    events = feed(session, hidden["front"], whole, hidden["top"], whole, cube_picture(FACES, LEFT), BLANK)
    assert [type(event) for event in events] == [Looked, Looked, Looked, Ended]
    assert [event.turn for event in events[:-1]] == [(), (), ("left",)]
    assert events[0].step.detection[0] is None
    assert events[1].step.belief.entropy <= events[0].step.belief.entropy
    record = events[-1].record
    whole_look = events[1].step.detection
    assert None not in whole_look
    assert record.detections == [whole_look, (2, 4)]
    assert record.actions == [1]
    assert events[-1].learned == "object-000"


def test_a_trial_is_learned_from_only_if_that_is_wanted():
    session = begin()
    (_, ended) = feed(session, cube_picture(FACES, np.eye(3)), BLANK)
    assert ended.learned is None
    assert len(session.memory) == 0
    session.learn = True
    (_, ended) = feed(session, cube_picture(FACES, np.eye(3)), BLANK)
    assert ended.learned == "object-000"
    assert not session.learn


def test_a_turn_that_is_not_known_is_asked_for_and_the_answer_counts():
    session = begin(asks=True)
    events = feed(session, cube_picture(FACES, np.eye(3)), cube_picture(FACES, LEFT @ FLIP))
    assert isinstance(events[-1], Asked)
    (looked,) = session.answer(["flip", "left"])
    assert looked.turn == ("flip", "left")
    assert looked.step.detection == (2, 1)
    assert session.trial.record.actions[:2] == [0, 1]


def test_the_answer_that_it_is_another_cube_begins_another_trial():
    session = begin(asks=True)
    feed(session, cube_picture(FACES, np.eye(3)), cube_picture((6, 7, 8, 9, 10, 11), np.eye(3)))
    assert [type(event) for event in session.answer(None)] == [Noted, Ended, Looked]


def test_answers_that_nobody_asked_for_and_actions_that_there_are_not_are_refused():
    session = begin(asks=True)
    with pytest.raises(InvalidInputError, match="answer: nothing was asked"):
        list(session.answer(["flip"]))
    feed(session, cube_picture(FACES, np.eye(3)), cube_picture(FACES, LEFT @ FLIP))
    with pytest.raises(InvalidInputError, match="action: 'jump'; expected one of: flip, left, right"):
        list(session.answer(["jump"]))


def test_another_cube_may_be_said_to_be_one():
    session = begin()
    feed(session, cube_picture(FACES, np.eye(3)))
    assert [type(event) for event in session.begin_anew()] == [Ended]
    (looked,) = feed(session, cube_picture(FACES, np.eye(3)))
    assert looked.turn == ()


def test_oddities_are_noted_once():
    session = begin()
    twice = cube_picture((0, 1, 2, 3, 0, 5), np.eye(3))
    strangers = cube_picture((20, 21, 22, 23, 24, 25), np.eye(3))
    events = feed(session, twice, twice, strangers, strangers)
    assert [event.text for event in events if isinstance(event, Noted)] == [
        "tag 0 is in view twice: it is not believed",
        "tags 20, 24 are none of the tags that count",
    ]
    assert not any(isinstance(event, Looked) for event in events)


def test_the_picture_has_the_tags_drawn_in():
    session = begin()
    assert session.picture is None
    shown = cube_picture(FACES, np.eye(3))
    feed(session, shown)
    assert (session.picture != shown).any()


@pytest.mark.parametrize(
    ("assumptions", "message"),
    [
        (Assumptions(9, 24, ("flip", "left"), arcube_assumptions().alphabet), "memory: actions"),
        (Assumptions(9, 24, ("flip", "left", "right"), PatternAlphabet(("front", "top"), 8)), "number of symbols 8"),
        (Assumptions(9, 24, ("flip", "left", "right"), PatternAlphabet(("a", "b"), 12)), "memory: slots"),
    ],
)
def test_a_memory_of_other_things_is_refused(assumptions, message):
    with pytest.raises(InvalidInputError, match=message):
        begin(RobotMemory(assumptions))


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
