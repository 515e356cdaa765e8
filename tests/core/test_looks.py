"""Looks and actions as a person writes them."""

import numpy as np
import pytest

from atg_fg.core.actions import NOTHING, UncertainAction, action_from, mixed, told
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import evidence_of, strength
from atg_fg.core.patterns import Evidence, PatternAlphabet

ALPHABET = PatternAlphabet.named(("front", "top"), ("logo", "text", "lid"))
ASSUMPTIONS = Assumptions(3, 4, ("rotate", "tip"), ALPHABET)


@pytest.mark.parametrize(
    "look",
    [("logo", "lid"), (0, 2), {"front": "logo", "top": "lid"}, {"front": {"logo": 1.0}, "top": 2}, ("logo", 2)],
)
def test_one_look_in_many_forms_is_the_same_evidence(look):
    assert evidence_of(ALPHABET, look).likelihood.tolist() == [0, 1, 0, 0, 0, 0]


def test_nothing_seen_says_nothing():
    for look in (None, (None, None), {}):
        assert evidence_of(ALPHABET, look).likelihood.tolist() == [1] * 6
    given = Evidence.of_detection(ALPHABET, (0, 1))
    assert evidence_of(ALPHABET, given) is given


def test_confidence_in_one_symbol_leaves_the_rest_to_the_others():
    # p = .6 for logo, .2 each for text and lid; the patterns are (logo, text), (logo, lid), (text, logo), …
    found = evidence_of(ALPHABET, {"front": {"logo": 0.6}})
    np.testing.assert_allclose(found.likelihood, [0.6, 0.6, 0.2, 0.2, 0.2, 0.2])
    all_said = evidence_of(ALPHABET, {"front": {"logo": 3.0, "text": 1.0}})
    assert all_said.likelihood.tolist() == [3, 3, 1, 1, 0, 0]


@pytest.mark.parametrize(
    ("look", "message"),
    [
        ({"side": "logo"}, "slot 'side'; expected one of: front, top"),
        ({"front": "cup"}, "slot 'front': 'cup'; expected one of: logo, text, lid"),
        ({"front": {"cup": 1}}, "slot 'front': 'cup'; expected one of"),
        ({"front": {"logo": -1}}, "slot 'front': logo: -1; expected"),
        (("logo",), "expected one entry for each of 2 slots"),
        ("logo", "expected one entry for each of 2 slots"),
        (("logo", "logo"), "symbol 0 is repeated"),
    ],
)
def test_what_is_no_look_is_one_line(look, message):
    with pytest.raises(InvalidInputError, match=message):
        evidence_of(ALPHABET, look)


def test_actions_go_by_name_number_and_probability():
    assert action_from("tip", ASSUMPTIONS) == action_from(1, ASSUMPTIONS) == action_from({"tip": 1.0}, ASSUMPTIONS) == 1
    assert action_from(None, ASSUMPTIONS) == action_from({None: 1}, ASSUMPTIONS) == NOTHING
    assert action_from({"rotate": 0.5, 1: 0.25, None: 0.25}, ASSUMPTIONS) == UncertainAction(
        ((0, 0.5), (1, 0.25)), 0.25
    )
    assert told(action_from({"rotate": 0.75, None: 0.25}, ASSUMPTIONS), ASSUMPTIONS) == "rotate 75%, nothing 25%"
    assert (told(1, ASSUMPTIONS), told(NOTHING, ASSUMPTIONS)) == ("tip", "nothing")


@pytest.mark.parametrize("action", ["kick", 2, -1, {"rotate": 0.5}, {"rotate": 1.5, None: -0.5}, {"kick": 1}, 1.5])
def test_what_is_no_action_is_refused(action):
    with pytest.raises(InvalidInputError, match="action"):
        action_from(action, ASSUMPTIONS)


def test_a_mixture_is_the_mean_of_what_each_action_makes():
    move = {0: np.array([1.0, 0.0]), 1: np.array([0.0, 1.0])}.__getitem__
    assert mixed(1, move, np.ones(2)).tolist() == [0, 1]
    assert mixed(UncertainAction(((0, 0.5), (1, 0.25)), 0.25), move, np.array([4.0, 8.0])).tolist() == [1.5, 2.25]


def test_a_sure_look_is_the_strongest():
    sure, half, nothing = (evidence_of(ALPHABET, look) for look in (("logo", "lid"), ("logo", None), None))
    assert strength(sure) == 0 > strength(half) > strength(nothing) == pytest.approx(-np.log(6))
