"""Compiled decisions from a table against the readable one."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from atg_fg.inference.expected_entropy import expected_entropies_of_table
from atg_fg.inference.kernels import decision_kernels


@given(arrays(np.float64, (2, 3, 5), elements=st.floats(0, 1)), st.integers(1, 7))
def test_expected_entropies_of_a_table_are_those_of_the_readable_version(weights, n_unseen):
    """Zeros are in it, and hypotheses of which nothing is left."""
    joint = weights / np.maximum(weights.sum(axis=(1, 2), keepdims=True), 1e-9)
    unseen = float(joint[0, -1].sum())
    compiled = decision_kernels.expected_entropies_of_table(joint, unseen, math.log(n_unseen))
    assert compiled == pytest.approx(expected_entropies_of_table(joint, unseen, n_unseen), abs=1e-12)
