"""Readings of the object in what a world shows: the space says what they are, and what is none is refused."""

import numpy as np
import pytest
from gymnasium import spaces

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense
from atg_fg.senses.appearance import appearance_space
from atg_fg.senses.object_readings import (
    look_of,
    observed_readings,
    readings_in,
    with_readings,
    without_readings,
)
from atg_fg.worlds.base import looks_space

WEIGHT = ObjectSense("weight", 0.5, 0.6, 0.08, unit="kg")
TILT = ObjectSense("tilt", 0.0, 1.0, 0.1, relative=False)


def test_a_space_says_which_readings_there_may_be():
    space = with_readings(appearance_space(2, 3), (WEIGHT, TILT))
    assert space["weight"].low == 0.0
    assert space["tilt"].low == -np.inf
    assert space["measured"] == spaces.MultiBinary(2)
    assert without_readings(space, (WEIGHT, TILT)) == appearance_space(2, 3)
    assert with_readings(appearance_space(2, 3), ()) == appearance_space(2, 3)


def test_a_look_that_is_an_array_stands_beside_its_readings():
    space = with_readings(looks_space(2, 12), (WEIGHT,))
    assert without_readings(space, (WEIGHT,)) == looks_space(2, 12)
    observation = {"look": np.array([3, -1]), **observed_readings((WEIGHT,), {"weight": 0.4})}
    assert space.contains(observation)
    assert look_of(observation).tolist() == [3, -1]
    assert readings_in((WEIGHT,), observation) == (("weight", 0.4),)
    assert look_of(np.array([3, -1])).tolist() == [3, -1]


def test_what_was_not_measured_is_no_reading():
    observation = observed_readings((WEIGHT, TILT), {"tilt": -0.2})
    assert observation["measured"].tolist() == [0, 1]
    assert readings_in((WEIGHT, TILT), observation) == (("tilt", -0.2),)
    assert readings_in((), {"anything": 1}) == ()


@pytest.mark.parametrize(
    ("observation", "message"),
    [
        ({"weight": np.array([0.4])}, "expected 'measured' and weight"),
        (np.array([3, 4]), "expected 'measured' and weight"),
        ({"weight": np.array([np.nan]), "measured": np.array([1])}, "observation: weight: .*nan.*; expected a number"),
        ({"weight": np.array([-0.4]), "measured": np.array([1])}, "observation: weight: .*-0.4.*; expected a number"),
        ({"weight": np.array([0.4, 0.5]), "measured": np.array([1])}, "expected one number a sense"),
        ({"weight": np.array([0.4]), "measured": np.array([1, 1])}, "expected one number a sense"),
    ],
)
def test_what_is_no_observation_of_them_is_refused_in_one_line(observation, message):
    with pytest.raises(InvalidInputError, match=message) as raised:
        readings_in((WEIGHT,), observation)
    assert "\n" not in str(raised.value)


def test_a_world_that_feels_nothing_is_refused_to_who_counts_on_it():
    with pytest.raises(InvalidInputError, match="expected readings of it, too: weight, measured"):
        without_readings(appearance_space(2, 3), (WEIGHT,))
