from math import inf, nan

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.parameters import ModelParameters


@pytest.mark.parametrize("alpha", [-1e-9, -1, nan, inf, -inf, "1", None, True, 10**400])
def test_a_concentration_that_is_no_finite_number_of_at_least_zero_is_refused(alpha: object) -> None:
    with pytest.raises(InvalidInputError, match="transition_concentration"):
        ModelParameters(transition_concentration=alpha)


@pytest.mark.parametrize("delta", [-1e-9, 1, 1.0, 2, nan, inf, "0.1", None, False])
def test_a_noise_outside_zero_to_below_one_is_refused(delta: object) -> None:
    with pytest.raises(InvalidInputError, match="observation_noise"):
        ModelParameters(observation_noise=delta)


@pytest.mark.parametrize("learn", [0, 1, "yes", None])
def test_learning_is_on_or_off_and_nothing_else(learn: object) -> None:
    with pytest.raises(InvalidInputError, match="learn_in_trial"):
        ModelParameters(learn_in_trial=learn)


@pytest.mark.parametrize(("alpha", "delta"), [(0, 0), (0.0, 0.999), (5, 1e-100), (np.float64(0.5), np.float64(0.5))])
def test_whole_numbers_and_bounds_are_accepted(alpha: float, delta: float) -> None:
    parameters = ModelParameters(alpha, delta)
    assert (parameters.transition_concentration, parameters.observation_noise) == (alpha, delta)


@pytest.mark.parametrize("name", ["transition_concentration", "observation_noise"])
@pytest.mark.parametrize("value", [9e-101, 1e-300, 5e-324])
def test_what_is_too_little_to_reckon_with_is_refused(name: str, value: float) -> None:
    with pytest.raises(InvalidInputError, match=f"{name}: {value!r}; expected 0, or at least 1e-100"):
        ModelParameters(**{name: value})
