"""Exact engines against brute force on 2,000 random models, each with a trial, at its end; on 250 by default."""

import numpy as np
import pytest

from tests.models import gone_through, random_case
from tests.small import ROUTES

CHUNKS, QUICK_CHUNKS, CHUNK_SIZE = 16, 2, 125
#: The routes make the whole graph anew at each question; each is given a part of the models.


def answers(inference, hypothesis):
    belief = inference.identity()
    numbers = [*belief.objects, belief.unseen, belief.entropy, inference.log_evidence]
    for aspects in inference.smoothed_aspects(hypothesis):
        numbers += aspects.tolist()
    if not inference.history.awaits_evidence:
        numbers += inference.expected_entropies().tolist()
    return numbers


@pytest.mark.parametrize(
    "chunk",
    [*range(QUICK_CHUNKS), *(pytest.param(chunk, marks=pytest.mark.slow) for chunk in range(QUICK_CHUNKS, CHUNKS))],
)
def test_two_thousand_models_come_out_alike(chunk):
    for seed in range(chunk * CHUNK_SIZE, (chunk + 1) * CHUNK_SIZE):
        case = random_case(np.random.default_rng((1, seed)))
        reference = gone_through("enumeration", case)
        hypothesis = reference.identity().most_probable_hypothesis
        expected = answers(reference, hypothesis)
        routes = [ROUTES[seed // 8 % len(ROUTES)]] if seed % 8 == 0 else []
        for engine in ["bayes-filter", "gtsam", *routes]:
            actual = answers(gone_through(engine, case), hypothesis)
            np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12, err_msg=f"model {seed}, {engine}")
