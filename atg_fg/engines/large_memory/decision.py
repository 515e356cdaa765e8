"""Expected entropy of identity (eq. 3) from objects one by one and in classes, and how far it may be off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.engines.large_memory.never_matched import ClassMasses, NeverMatched
from atg_fg.inference.expected_entropy import TIE_TOLERANCE, best_actions


class NextLooks(NamedTuple):
    """What may be seen after each action, from J = p(O = i, z | a), summed over some objects.

    Attributes:
        predictive: Σ_i J, shape [A, |𝒵|].
        terms: Σ_i Σ_z J ln J, shape [A].
        unsure: How far J may be off, as a total variation.
    """

    predictive: FloatArray
    terms: FloatArray
    unsure: float


def expected_entropies(parts: Sequence[NextLooks], unseen: float, n_unseen: int) -> FloatArray:
    """Return Σ_z p(z | a) H(O | z, a) = Σ_z p ln p − Σ_i Σ_z J ln J + p(unseen) ln U of each action, nats, shape [A].

    Args:
        parts: Of all objects together.
        unseen: p(unseen | z_0:t).
        n_unseen: U.
    """
    predictive = np.maximum(sum(part.predictive for part in parts), 0.0)
    terms = sum(part.terms for part in parts)
    entropies: FloatArray = x_log_x(predictive).sum(axis=1) - terms + unseen * np.log(n_unseen)
    return np.maximum(entropies, 0.0)


def _sums(cells: IntArray, weights: FloatArray, n_cells: int) -> FloatArray:
    """Return the sum of the weights of each cell, shape [n_cells]."""
    return np.bincount(cells, weights, n_cells).astype(np.float64)


def by_class(classes: NeverMatched, masses: ClassMasses) -> NextLooks:
    """Return the next looks of the objects in classes, as if nothing had been counted from their hidden aspects.

    Args:
        classes: The objects.
        masses: Of one of them in each class, on the scale on which those of all objects sum to one.
    """
    matched, members = classes.filter, classes.members
    delta, n_patterns = matched.parameters.observation_noise, matched.n_patterns
    noise = delta / n_patterns * masses.total
    rate_known, rate_unknown = (1.0 - delta) / matched.n_aspects, classes.collection_share() * classes.collection_rate()
    kept = classes.kept(masses)
    known, unknown = kept * rate_known + noise, kept * rate_unknown + noise
    more, without = known - unknown, x_log_x(known)
    predictive = more @ classes.showing + (unknown @ members)[:, None]
    of_one = without * classes.n_known + x_log_x(unknown) * (n_patterns - classes.n_known)
    rows, states = np.nonzero(classes.shown >= 0)
    if len(rows):
        patterns = classes.shown[rows, states]
        gained = (1.0 - delta) * classes.arrivals(masses)[:, rows, states]
        found = x_log_x(known[:, rows] + gained) - without[:, rows]
        for action, in_all in enumerate((more[:, rows] + gained) * members[rows]):
            predictive[action] += _sums(patterns, in_all, n_patterns)
            of_one[action] += _sums(rows, found[action], classes.n_classes)
    return NextLooks(predictive, of_one @ members, float(members @ masses.unsure_states))


def entropy_bound(total_variation: float, n_objects: int) -> float:
    """Return how far E[H(O | z)] may be off, nats, if p(O, z | a) is off by a total variation τ.

    τ ln n + (1 + τ) h(τ / (1 + τ)) with the binary entropy h, and never more than ln n.

    Args:
        total_variation: τ.
        n_objects: n, the number of objects that O can be, the unseen ones counted one by one.
    """
    if not total_variation > 0:
        return 0.0
    share = total_variation / (1.0 + total_variation)
    binary = -float(x_log_x(np.array([share, 1.0 - share])).sum())
    return float(min(np.log(n_objects), total_variation * np.log(n_objects) + (1.0 + total_variation) * binary))


def is_decided(expected: FloatArray, bound: float) -> bool:
    """Whether the best actions, ties included, are the same for all values within ``bound`` of those expected."""
    if not bound > 0 or len(expected) == 1:
        return True
    best = best_actions(expected)
    others = np.delete(expected, best)
    if len(others) and not others.min() - bound > expected.min() + bound + TIE_TOLERANCE:
        return False
    return len(best) == 1 or bool(expected[best].max() + bound <= expected.min() - bound + TIE_TOLERANCE)
