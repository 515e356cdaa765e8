"""Patterns that a look saw in part or wrongly, completed from all evidence of the trial.

A memory update from raw patterns skips a look that missed a symbol, and both transitions about it. Given the object,
the looks before and after it often leave one pattern only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.interface import Inference
from atg_fg.inference.recognition_model import COLLECTION

#: A pattern is learned from if it is this probable given all evidence.
CONFIDENCE: Final = 0.95


def pattern_marginals(inference: Inference, hypothesis: int) -> FloatArray:
    """Return p(pattern of the aspect at time s | O = hypothesis, z_0:t, a_1:t), shape [looks, |𝒵|].

    A known aspect has its pattern, whatever was detected. An aspect of the collection node has one that the hypothesis
    does not know, weighted by the evidence of that look.

    Raises:
        InvalidInputError: There is no such hypothesis, or nothing was observed yet.
        ImpossibleEvidenceError: The evidence has probability zero under this hypothesis.
    """
    model = inference.model
    marginals = inference.smoothed_aspects(hypothesis)
    table = np.zeros((len(inference.history.evidence), model.n_patterns))
    for look, evidence in enumerate(inference.history.evidence):
        aspects = marginals[look]
        shown = model.pattern_of[hypothesis, 1 : len(aspects)]
        known = shown >= 0
        np.add.at(table[look], shown[known], aspects[1:][known])
        unknown = model.lacks[hypothesis] * (
            (1 - model.parameters.observation_noise) * evidence.likelihood
            + model.parameters.observation_noise / model.n_patterns * evidence.likelihood.sum()
        )
        if unknown.any():
            table[look] += aspects[COLLECTION] * unknown / unknown.sum()
    return table


def smoothed_patterns(inference: Inference, hypothesis: int, confidence: float = CONFIDENCE) -> list[int | None]:
    """Return the pattern at each look that is at least ``confidence`` probable given all evidence, else ``None``.

    Errors are those of ``pattern_marginals``.
    """
    marginals = pattern_marginals(inference, hypothesis)
    best: Sequence[int] = marginals.argmax(axis=1).tolist()
    return [pattern if row[pattern] >= confidence else None for pattern, row in zip(best, marginals, strict=True)]
