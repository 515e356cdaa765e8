import copy
import itertools
import math

import pytest

from benchmarks import told_random_atgs
from benchmarks.told_random_atgs import Known


@pytest.mark.parametrize("before", [[], [([0, 1, 0, 2], [0, 1, 0])], [([0, 1], [0]), ([0, 2, 0, 3], [0, 1, 0])]])
def test_looks_at_a_random_atg_are_a_distribution(monkeypatch, before):
    monkeypatch.setattr(told_random_atgs, "N_ASPECTS", 4)
    monkeypatch.setattr(told_random_atgs, "N_PATTERNS", 6)
    known = Known()
    for patterns, actions in before:
        known.log_evidence(patterns, actions)
    total = sum(
        math.exp(copy.deepcopy(known).log_evidence(patterns, [0, 0, 1]))
        for patterns in itertools.product(range(6), repeat=4)
    )
    assert total == pytest.approx(1.0)


def test_what_led_to_three_aspects_leads_to_no_fourth_one():
    known = Known()
    for there in (1, 2, 3):
        assert known.log_evidence([0, there], [0]) > -math.inf
    assert known.log_evidence([0, 4], [0]) == -math.inf
    assert known.log_evidence([0, 4], [1]) > -math.inf
    again = Known()
    again.log_evidence([0, 1], [0])
    # The first aspect is one of 24; of the successors' probabilities the mean of the one that came once is 2 of 4.
    assert again.log_evidence([0, 1], [0]) == pytest.approx(math.log(1 / 24 * 2 / 4))
