"""How far expected entropy may be off, and when that decides."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.log_math import x_log_x
from atg_fg.engines.large_memory.decision import entropy_bound, is_decided


def conditional_entropy(joint: np.ndarray) -> float:
    """H(O | Z) of p(O, Z), shape [n, |𝒵|]."""
    return float(x_log_x(joint.sum(axis=0)).sum() - x_log_x(joint).sum())


def test_the_bound_is_zero_at_zero_and_never_above_ln_n():
    assert entropy_bound(0.0, 5) == 0
    assert entropy_bound(0.9, 5) == pytest.approx(np.log(5))
    # 0.1 ln 4 + 1.1 h(1/11), h(1/11) = (ln 11 + 10 ln 1.1) / 11
    assert entropy_bound(0.1, 4) == pytest.approx(0.1 * np.log(4) + 0.1 * (np.log(11) + 10 * np.log(1.1)))


@given(seed=st.integers(0, 2**32), share=st.floats(1e-9, 1.0), sharp=st.booleans())
def test_no_two_joint_distributions_differ_more_in_conditional_entropy(seed, share, sharp):
    rng = np.random.default_rng(seed)
    n, n_patterns = int(rng.integers(2, 9)), int(rng.integers(1, 5))
    size = n * n_patterns
    first = np.eye(size)[rng.integers(size)] if sharp else rng.dirichlet(np.full(size, 0.3))
    second = (1 - share) * first + share * rng.dirichlet(np.full(size, 0.3))
    distance = np.abs(first - second).sum() / 2
    entropies = [conditional_entropy(p.reshape(n, n_patterns)) for p in (first, second)]
    assert abs(entropies[0] - entropies[1]) <= entropy_bound(distance, n) + 1e-12


@given(
    entropies=st.lists(st.sampled_from([0.0, 1e-10, 1e-9, 2e-9, 0.1, 0.2, 0.5]), min_size=1, max_size=4),
    bound=st.sampled_from([0.0, 1e-11, 1e-10, 1e-9, 0.01, 0.06, 0.2]),
    data=st.data(),
)
def test_what_is_decided_is_the_same_for_all_values_within_the_bound(entropies, bound, data):
    from atg_fg.inference.expected_entropy import best_actions

    expected = np.array(entropies)
    if is_decided(expected, bound):
        shares = data.draw(st.lists(st.floats(-1, 1), min_size=len(entropies), max_size=len(entropies)))
        assert best_actions(expected + bound * np.array(shares)) == best_actions(expected)
    else:
        assert bound > 0
