import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.goals import Goal
from atg_fg.core.patterns import PatternAlphabet

ALPHABET = PatternAlphabet(("front", "top"), 12)


def test_a_whole_pattern_is_shown_by_itself_alone():
    goal = Goal(ALPHABET, (3, 7))
    assert np.flatnonzero(goal.patterns).tolist() == [ALPHABET.index((3, 7))]


def test_a_part_of_a_pattern_is_shown_by_all_that_have_it():
    goal = Goal.of_slots(ALPHABET, {"front": 7})
    shown = [ALPHABET.patterns[pattern] for pattern in np.flatnonzero(goal.patterns)]
    assert shown == [(7, top) for top in range(12) if top != 7]


@pytest.mark.parametrize(
    ("text", "symbols"), [("front=3,top=7", (3, 7)), ("top=0", (None, 0)), (" top = 2 , front=1", (1, 2))]
)
def test_a_goal_is_read_from_text(text, symbols):
    assert Goal.parse(ALPHABET, text).symbols == symbols


@given(st.tuples(*[st.none() | st.integers(0, 11)] * 2).filter(lambda pair: pair[0] != pair[1]))
def test_a_goal_is_read_back_from_what_it_prints(symbols):
    goal = Goal(ALPHABET, symbols)
    assert Goal.parse(ALPHABET, str(goal)) == goal


def test_likeness_counts_the_slots_that_are_as_wanted():
    goal = Goal(ALPHABET, (3, 7))
    patterns = [(3, 7), (3, 1), (1, 7), (7, 3)]
    assert [goal.likeness(ALPHABET.index(pattern)) for pattern in patterns] == [2, 1, 1, 0]
    assert Goal(ALPHABET, (None, 7)).likeness(ALPHABET.index((3, 7))) == 1


@pytest.mark.parametrize("text", ["", "front", "front=", "front=x", "front=-1", "front=1,front=2", "front=1;top=2"])
def test_text_that_is_no_goal_is_refused(text):
    with pytest.raises(InvalidInputError, match=r"goal: .*expected slot=symbol"):
        Goal.parse(ALPHABET, text)


def test_goals_that_no_object_can_show_are_refused():
    with pytest.raises(UnknownNameError, match=r"'left'.*front, top"):
        Goal.parse(ALPHABET, "left=1")
    with pytest.raises(InvalidInputError, match="symbol 12; expected 0 to 11"):
        Goal.parse(ALPHABET, "front=12")
    with pytest.raises(InvalidInputError, match="repeated"):
        Goal(ALPHABET, (4, 4))
    with pytest.raises(InvalidInputError, match="at least one slot"):
        Goal(ALPHABET, (None, None))
    with pytest.raises(InvalidInputError, match="one entry for each of 2 slots"):
        Goal(ALPHABET, (4,))
