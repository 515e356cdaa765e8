"""Expected entropy of identity (eq. 3) from objects one by one and from classes of them, and how far it may be off."""

from __future__ import annotations

from typing import Final

import numpy as np

from atg_fg.belief import x_log_x
from atg_fg.large_memory.aspect_filter import AspectFilter
from atg_fg.large_memory.never_matched import ClassMasses, NeverMatched
from atg_fg.patterns import FloatArray
from atg_fg.policies.base import TIE_TOLERANCE, best_actions

#: Objects less probable than this are left out: what they add, p ln p in all, is less than rounding does.
NEGLIGIBLE: Final = 1e-22


def expected_entropy(
    action: int,
    matched: AspectFilter,
    weights: FloatArray,
    classes: NeverMatched | None,
    masses: ClassMasses | None,
    log_n_unseen: float,
) -> float:
    """Return Σ_z p(z | a) H(O | z, a) = Σ_z p ln p − Σ_i Σ_z J ln J + p(unseen) ln U for J = p(O = i, z | a), nats.

    Args:
        action: a.
        matched: Objects one by one; *unseen* is row 0.
        weights: p(O | z_0:t) of each of them, shape [R].
        classes: The other objects.
        masses: Of one of them in each class; those of all objects and ``weights`` sum to one.
        log_n_unseen: ln U.
    """
    predictive, terms = _one_by_one(action, matched, weights)
    if classes is not None and masses is not None:
        more, more_terms = _by_class(action, classes, masses)
        predictive += more
        terms += more_terms
    np.maximum(predictive, 0.0, out=predictive)
    return max(0.0, float(x_log_x(predictive).sum()) - terms + float(weights[0]) * log_n_unseen)


def _one_by_one(action: int, matched: AspectFilter, weights: FloatArray) -> tuple[FloatArray, float]:
    """Return Σ_i J, shape [|𝒵|], and Σ_i Σ_z J ln J of objects one by one."""
    delta, n_patterns = matched.parameters.observation_noise, matched.n_patterns
    observed, noise = 1.0 - delta, delta / n_patterns * weights
    kept = np.einsum("rw,rw->r", matched.mass, matched.stay[action]) * weights
    unreached = kept * (observed / matched.n_aspects) + noise
    unknown = kept * (matched.n_unobserved / matched.n_aspects * matched.unknown_rate) + noise
    arrivals = matched.arrivals(action, matched.mass).ravel()
    reached = np.flatnonzero(arrivals)
    rows = reached // matched.width
    gained = observed * arrivals[reached] * weights[rows]
    listed = matched.pattern >= 0
    n_listed = listed.sum(axis=1)
    predictive = np.bincount(matched.pattern[listed], np.repeat(unreached - unknown, n_listed), n_patterns)
    predictive = predictive + np.bincount(matched.pattern.ravel()[reached], gained, n_patterns) + unknown.sum()
    without, of_row = x_log_x(unreached), unreached[rows]
    terms = without @ matched.n_known + x_log_x(unknown) @ (n_patterns - matched.n_known)
    terms += (x_log_x(of_row + gained) - without[rows]).sum()
    return predictive, float(terms)


def _by_class(action: int, classes: NeverMatched, masses: ClassMasses) -> tuple[FloatArray, float]:
    """Return Σ_i J, shape [|𝒵|], and Σ_i Σ_z J ln J of the objects in classes."""
    matched = classes.filter
    delta, n_patterns = matched.parameters.observation_noise, matched.n_patterns
    observed, noise = 1.0 - delta, delta / n_patterns * masses.total
    kept = classes.kept(masses, action)
    unreached = kept * (observed / matched.n_aspects) + noise
    unknown = kept * (classes.collection_share() * classes.unknown_rate()) + noise
    more = unreached - unknown
    predictive = more @ classes.showing + classes.members @ unknown
    shown = classes.shown
    rows, states = np.nonzero(shown >= 0)
    gained = observed * classes.arrivals(masses, action)[rows, states]
    in_all = classes.members[rows] * (more[rows] + gained)
    predictive += np.bincount(shown[rows, states], in_all, n_patterns)
    without = x_log_x(unreached)
    of_one = without * classes.n_known + x_log_x(unknown) * (n_patterns - classes.n_known)
    of_one += np.bincount(rows, x_log_x(unreached[rows] + gained) - without[rows], classes.n_classes)
    return predictive, float(classes.members @ of_one)


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
