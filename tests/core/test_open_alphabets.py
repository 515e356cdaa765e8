"""What was written down is the same under an alphabet that knows more labels."""

from dataclasses import replace

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.open_alphabets import Relabelling, new_labels
from atg_fg.core.patterns import Evidence, PatternAlphabet

SLOTS = ("front", "top")
OLD = PatternAlphabet.named(SLOTS, ("a", "b"), exclusive=False, is_open=True)
#: As another process may have extended it: in an order of its own.
NEW = PatternAlphabet.named(SLOTS, ("c", "b", "a"), exclusive=False, is_open=True)
LABELS = Relabelling(OLD, NEW)


@pytest.mark.parametrize(
    ("look", "labels"),
    [
        (("a", "new"), ["new"]),
        (("new", "new"), ["new"]),
        ({"front": "a", "top": {"b": 0.5, "new": 0.2, "other": 0.1}}, ["new", "other"]),
        ({"front": "a"}, []),
        ((0, None), []),
        (None, []),
        ("new", []),  # no look at all: it is refused as one
        (7, []),
        (([], {}), []),
    ],
)
def test_the_labels_that_a_look_brings(look, labels):
    assert new_labels(OLD, look) == labels


def test_a_closed_alphabet_has_no_new_labels():
    assert new_labels(PatternAlphabet.named(SLOTS, ("a", "b"), exclusive=False), ("new", "a")) == []


def test_patterns_and_detections_keep_their_names():
    for index, pattern in enumerate(OLD.patterns):
        assert NEW.text(NEW.patterns[LABELS.pattern(index)]) == OLD.text(pattern)
    assert LABELS.pattern(None) is None
    assert LABELS.detection((0, None)) == (2, None)


def test_a_detection_agrees_with_the_new_patterns_that_show_it():
    moved = LABELS.evidence(Evidence.of_detection(OLD, ("a", None), (0.5, None)))
    assert moved.detection == (2, None)
    assert moved.confidences == (0.5, None)
    np.testing.assert_array_equal(moved.likelihood, Evidence.of_detection(NEW, ("a", None)).likelihood)
    assert LABELS.evidence(Evidence.of_detection(OLD, ("a", "b"))).pattern == NEW.index(("a", "b"))
    assert LABELS.evidence(Evidence.of_detection(OLD, (None, None))).likelihood.all()


def test_what_a_likelihood_does_not_name_is_as_improbable_as_the_least_probable():
    by_slot = LABELS.evidence(Evidence.of_slots(OLD, [[0.7, 0.2], None], (None, "b")))
    assert by_slot.slots == ((0.2, 0.2, 0.7), None)
    assert by_slot.likelihood[NEW.index(("c", "b"))] == 0.2
    assert by_slot.likelihood[NEW.index(("c", "a"))] == 0.0
    whole = LABELS.evidence(Evidence.of_likelihood(OLD, [0.4, 0.3, 0.2, 0.1]))
    assert whole.likelihood[NEW.index(("a", "b"))] == 0.3
    assert whole.likelihood[NEW.index(("c", "c"))] == 0.1
    soft = Evidence(np.array([0.9, 0.1, 0.1, 0.1]), OLD.index(("a", "a")), (0, 0))  # a detection, but not for sure
    assert LABELS.evidence(soft).likelihood[NEW.index(("c", "c"))] == 0.1
    assert LABELS.evidence(soft).pattern == NEW.index(("a", "a"))


def a_memory(kind=RobotMemory, alphabet=OLD):
    memory = RobotMemory(Assumptions(5, 3, ("turn",), alphabet))
    for looks in ([("a", "b"), ("b", "b"), ("a", "b")], [("b", "a")], [("b", "a"), ("a", "a")]):
        memory.learn([alphabet.index(each) for each in looks], [0] * (len(looks) - 1), None)
    if kind is CompactMemory:
        return CompactMemory.of(memory)
    memory.merge("object-001", "object-002")
    return memory


@pytest.mark.parametrize("kind", [RobotMemory, CompactMemory])
def test_a_memory_extended_is_one_that_knew_the_labels_from_the_start(kind):
    memory, before = a_memory(kind), a_memory(kind)
    extended = memory.extended(("new", "a"))
    assert extended == a_memory(kind, OLD.extended(("new",)))
    assert type(extended) is kind
    assert memory == before
    memory.extend(("new",))
    assert memory == extended
    assert memory.assumptions.extends(before.assumptions)
    assert not before.assumptions.extends(memory.assumptions)
    assert memory.extended(("a", "new")) is memory


def test_other_assumptions_are_no_extension():
    there, numbers = a_memory().assumptions, arcube_assumptions()
    assert there.extends(there)
    assert numbers.extends(numbers)
    assert not there.extends(numbers)
    assert not numbers.extends(there)
    weighed = replace(there, object_senses=(ObjectSense("weight", 0.5, 0.5, 0.05, "kg"),))
    assert not weighed.extends(there)
    assert not a_memory(alphabet=NEW).assumptions.extends(there)  # the same labels and one more, numbered otherwise


def test_a_closed_alphabet_is_not_extended():
    memory = RobotMemory(Assumptions(5, 3, ("turn",), PatternAlphabet.named(SLOTS, ("a", "b"), exclusive=False)))
    with pytest.raises(InvalidInputError, match="symbol 'new'; expected one of: a, b"):
        memory.extend(("new",))
