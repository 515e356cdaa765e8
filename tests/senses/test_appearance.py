"""The look of things as a sense: tags as its special case, soft evidence, growth in the trial, refits at milestones."""

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.core.sense import SensedTrial
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.senses.appearance import APPEARANCE, SEEN, AppearanceSense, appearance_space
from atg_fg.senses.feature_space import FeatureSpace
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern

ALPHABET = PatternAlphabet(("front", "top"), 6, exclusive=False)
SPACE = FeatureSpace("one-number", np.zeros(1), np.ones((1, 1)), np.array([1e4]))


def observation(*values):
    seen = [value is not None for value in values]
    return {APPEARANCE: np.array([[0.0 if value is None else value] for value in values]), SEEN: np.array(seen)}


def tags_as_classes(n_tags):
    """A sense of which each class is a tag: its features are one for its own tag, and looks do not differ."""
    alphabet = PatternAlphabet(("front", "top"), n_tags)
    space = FeatureSpace("tags", np.zeros(n_tags), np.eye(n_tags), np.full(n_tags, 1.0))
    sense = AppearanceSense(space, alphabet, within=1e-4)
    for tag in range(n_tags):
        sense.codebook.add(np.eye(n_tags)[tag], tag)
    return sense


@pytest.mark.parametrize("engine", ["bayes-filter", "gtsam", "learned-structure"])
def test_tags_are_the_special_case_of_a_class_a_symbol_without_noise(engine):
    assumptions, cubes = arcube_assumptions(), make_arcubes(4, seed=3)
    memory = RobotMemory(assumptions)
    rng = np.random.default_rng(0)
    for number, cube in enumerate(cubes[:3]):
        state, patterns, actions = 0, [], []
        for _ in range(8):
            patterns.append(assumptions.alphabet.index(shown_pattern(cube, state)))
            actions.append(int(rng.integers(3)))
            state = SUCCESSORS[state][actions[-1]]
        memory.learn(patterns, actions[:-1], None)
        assert len(memory) == number + 1
    parameters = preset("default")
    by_tags, by_classes = (begin_trial(engine, memory, parameters) for _ in range(2))
    senses, state = tags_as_classes(12).begin(), 5
    for time in range(7):
        pattern = shown_pattern(cubes[time % 2], state)
        detection = (pattern[0], None) if time == 3 else pattern
        shown = np.array([np.zeros(12) if tag is None else np.eye(12)[tag] for tag in detection])
        look = senses.look({APPEARANCE: shown, SEEN: np.array([tag is not None for tag in detection])})
        expected = Evidence.of_detection(assumptions.alphabet, detection)
        assert look.evidence.likelihood == pytest.approx(expected.likelihood, abs=1e-12)
        assert (look.evidence.pattern, look.evidence.detection) == (expected.pattern, expected.detection)
        by_tags.observe(expected)
        by_classes.observe(look.evidence)
        ours, theirs = by_classes.identity().probabilities, by_tags.identity().probabilities
        assert ours == pytest.approx(theirs, abs=1e-12)
        assert by_classes.expected_entropies() == pytest.approx(by_tags.expected_entropies(), abs=1e-12)
        action = time % 3
        by_tags.act(action)
        by_classes.act(action)
        state = SUCCESSORS[state][action]


def test_soft_evidence_goes_into_every_exact_engine_alike():
    memory = RobotMemory(Assumptions(5, 6, ("turn",), ALPHABET))
    for patterns in ([0, 7, 14], [1, 7, 20]):
        memory.learn(patterns, [0, 0], None)
    sense = AppearanceSense(SPACE, ALPHABET)
    for number in range(3):
        sense.codebook.add(np.array([4.0 * number]), number)
    looks = [
        sense.begin().look(observation(front, top)).evidence for front, top in ((2.0, 0.3), (3.7, 4.4), (0.1, 2.2))
    ]
    assert any(look.pattern is None for look in looks)
    beliefs = []
    for engine in ("bayes-filter", "gtsam", "enumeration"):
        inference = begin_trial(engine, memory, preset("default"))
        for time, look in enumerate(looks):
            if time:
                inference.act(0)
            inference.observe(look)
        beliefs.append(inference.identity().probabilities)
    assert "enumeration" in ENGINES
    assert beliefs[1] == pytest.approx(beliefs[0], abs=1e-12)
    assert beliefs[2] == pytest.approx(beliefs[0], abs=1e-12)


def test_a_class_met_in_a_trial_is_known_from_then_on_and_only_there():
    sense = AppearanceSense(SPACE, ALPHABET)
    trial = sense.begin()
    assert trial.look(observation(5.0, -20.0)).evidence.detection == (0, 1)
    assert trial.look(observation(-20.4, 4.5)).evidence.detection == (1, 0)
    assert sense.codebook.n_classes == 0


def test_a_look_between_two_classes_is_taken_for_neither_but_says_what_it_says():
    sense = AppearanceSense(SPACE, ALPHABET)
    for number, value in enumerate((0.0, 3.0)):
        for _ in range(50):
            sense.codebook.add(np.array([value]), number)
    look = sense.begin().look(observation(1.5, 0.1))
    assert look.evidence.detection == (None, 0)
    assert look.evidence.pattern is None
    of_front = ALPHABET.slot_likelihoods(look.evidence.likelihood)[0]
    assert of_front[0] == pytest.approx(of_front[1], rel=0.01)
    assert of_front[0] > 5 * of_front[2:].sum()


def test_what_is_not_seen_says_nothing():
    look = AppearanceSense(SPACE, ALPHABET).begin().look(observation(None, None))
    assert look.evidence.detection == (None, None)
    assert look.readings == (None, None)
    assert (look.evidence.likelihood == 1).all()


def learn(memory, looks, actions, matched=None):
    """Let a memory learn from looks at one object, each of two values; return the name of its ATG."""
    senses = memory.sense.begin()
    seen = [senses.look(observation(*look)) for look in looks]
    name = memory.learn([look.evidence.pattern for look in seen], actions, matched)
    memory.learn_readings(name, [look.readings for look in seen], [look.evidence.detection for look in seen], actions)
    return name


def test_classes_that_turn_out_to_be_one_are_merged_and_the_atgs_made_from_them_are_estimated_again():
    # At first sight 0 and 5.5 are two classes; later looks fill the gap between them.
    assumptions = Assumptions(3, 6, ("turn",), ALPHABET)
    memory = RobotMemory(assumptions, sense=AppearanceSense(SPACE, ALPHABET))
    learn(memory, [(0.0, 60.0), (5.5, 60.0)], [0])
    assert [graph.aspects for graph in memory] == [((0, 1), (2, 1))]
    learn(memory, [(float(value), 60.0) for value in (1, 1.5, 2.5, 3, 3, 4, 4.5)], [0] * 6)
    assert {symbol for trial in memory.sense.trials for look in trial.detections for symbol in look} == {0, 1}
    assert [graph.aspects for graph in memory] == [((0, 1),), ((0, 1),)]


def test_readings_of_another_length_are_refused_and_nothing_is_learned():
    sense = AppearanceSense(SPACE, ALPHABET)
    memory = RobotMemory(Assumptions(3, 6, ("turn",), ALPHABET), sense=sense)
    name = memory.learn([0], [], None)
    look, place = ((1.0,), None), "look 1, slot 'front'"
    for readings, detection, message in (
        (
            ((1.0, 2.0), None),
            (0, None),
            rf"{place}: shape \(2,\); expected 1 numbers, as in the codebook of 'one-number'",
        ),
        (((np.nan,), None), (0, None), f"{place}: 1 not finite"),
        (((1.0,), None), (99, None), f"{place}: class: 99; expected a whole number from 0 to"),
        (((1.0,),), (0,), "look 1: 1 slots, 1 classes; expected 2"),
    ):
        with pytest.raises(InvalidInputError, match=message):
            memory.learn_readings(name, [look, readings], [(0, None), detection], [0])
        with pytest.raises(InvalidInputError, match=message):
            sense.restore([SensedTrial(name, (look, readings), ((0, None), detection), (0,))])
    with pytest.raises(InvalidInputError, match="readings: 1 looks; expected 2"):
        sense.restore([SensedTrial(name, (look,), ((0, None), (0, None)), (0,))])
    assert memory.sense.trials == sense.trials == []
    assert memory.sense.codebook.n_classes == sense.codebook.n_classes == 0


@pytest.mark.parametrize(
    ("seen", "message"),
    [
        ([0, 1], "expected 'appearance' and 'seen' of 2 slots"),
        ({APPEARANCE: np.zeros((2, 1))}, "expected 'appearance' and 'seen' of 2 slots"),
        ({APPEARANCE: None, SEEN: np.ones(2)}, "expected 'appearance' and 'seen' of 2 slots"),
        ({APPEARANCE: np.zeros((1, 1)), SEEN: np.ones(2)}, "1 slots; expected 2: front, top"),
        ({APPEARANCE: np.zeros((2, 1)), SEEN: np.ones(3)}, r"'seen': shape \(3,\); expected 0 or 1 of each slot"),
        ({APPEARANCE: np.zeros((2, 1)), SEEN: ("yes", "no")}, "'seen': .*; expected 0 or 1 of each slot: front, top"),
        ({APPEARANCE: np.zeros((2, 1)), SEEN: (np.nan, 1)}, "'seen': 1 not finite"),
        ({APPEARANCE: np.full((2, 1), 1e200), SEEN: np.ones(2)}, r"slot 'front': 1e\+200; expected finite numbers to"),
        ({APPEARANCE: np.zeros((2, 3)), SEEN: np.ones(2)}, r"slot 'front': shape \(3,\); expected 1 numbers"),
        ({APPEARANCE: np.full((2, 1), np.inf), SEEN: np.ones(2)}, "slot 'front': 1 not finite"),
    ],
)
def test_observations_that_do_not_fit_are_refused(seen, message):
    with pytest.raises(InvalidInputError, match=message):
        AppearanceSense(SPACE, ALPHABET).begin().look(seen)


def test_worlds_whose_observations_are_others_are_refused():
    sense = AppearanceSense(SPACE, ALPHABET)
    sense.check_space(appearance_space(2, 1))
    with pytest.raises(InvalidInputError, match="as the memory's sense reads"):
        sense.check_space(appearance_space(2, 7))


def test_a_copy_learns_by_itself():
    sense = AppearanceSense(SPACE, ALPHABET)
    twin = sense.copy()
    twin.learn(SensedTrial("object-000", (((1.0,), (2.0,)),), ((0, 0),), ()))
    assert (sense.codebook.n_classes, twin.codebook.n_classes) == (0, 1)
    assert sense != twin
    assert twin == twin.copy()
