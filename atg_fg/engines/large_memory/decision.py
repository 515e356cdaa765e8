"""Expected entropy of identity (eq. 3) from objects one by one and from classes of them, and how far it may be off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.engines.large_memory.aspect_filter import AspectFilter
from atg_fg.engines.large_memory.never_matched import ClassMasses, NeverMatched
from atg_fg.inference.expected_entropy import TIE_TOLERANCE, best_actions

#: Of an object one by one, aspects with no more of its mass than this are taken together if that is allowed; and so are
#: all aspects of an object that is less probable than ``NEGLIGIBLE``.
SMALL: Final = 1e-8


NEGLIGIBLE: Final = 1e-18


#: What is left of an object's mass is a difference of numbers near one.
_ROUNDING: Final = 1e-15


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


class _Followed(NamedTuple):
    """The states whose counted edges are followed.

    Attributes:
        cells: The states, as row · W + state, shape [F].
        rows: Row of each, shape [F].
        is_in: Whether a cell is one of them, shape [R · W].
        rest: p(X_t elsewhere | row), shape [R].
    """

    cells: IntArray
    rows: IntArray
    is_in: NDArray[np.bool_]
    rest: FloatArray


def one_by_one(matched: AspectFilter, weights: FloatArray, *, exact: bool) -> NextLooks:
    """Return the next looks of objects one by one.

    Most of an object's mass is on few aspects. If it need not be exact, the others are taken as if nothing had been
    counted from them; then only the edges of those few have to be followed, and J is off by at most what the others
    hold.

    Args:
        matched: The objects.
        weights: p(O | z_0:t) of each of them, shape [R].
        exact: Whether all edges are to be followed.
    """
    followed = _followed(matched, weights, exact=exact)
    values = _RowValues(matched, weights)
    known, unknown, terms = values.of(weights, slice(None))
    by_pattern = _sums(matched.listed_patterns, (known - unknown)[matched.listed_rows], matched.n_patterns)
    predictive = np.tile(by_pattern + unknown.sum(), (len(matched.edges), 1))
    all_terms = np.full(len(matched.edges), terms.sum())
    for action, edges in enumerate(matched.edges):
        chosen = np.flatnonzero(followed.is_in[edges.source])
        if not len(chosen):
            continue
        source, target = edges.source[chosen], edges.target[chosen]
        here = source // matched.width
        carried = matched.mass.ravel()[source] * edges.probability[chosen] * weights[here]
        here, target, carried = _grouped(here, source, target, carried)
        stays = matched.mass.ravel()[followed.cells] * matched.prior_weight[action].ravel()[followed.cells]
        leaves = np.zeros(matched.n_rows, dtype=bool)
        leaves[here] = True
        rows = np.flatnonzero(leaves)
        kept = ((followed.rest + _sums(followed.rows, stays, matched.n_rows)) * weights)[rows]
        now_known, now_unknown, now_terms = values.of(kept, rows)
        change = np.zeros(matched.n_rows)
        change[rows] = (now_known - now_unknown) - (known - unknown)[rows]
        predictive[action] += _by_listed(matched, change, rows) + (now_unknown - unknown[rows]).sum()
        gained = (1.0 - matched.parameters.observation_noise) * carried
        predictive[action] += _sums(matched.pattern.ravel()[target].astype(np.int64), gained, matched.n_patterns)
        unreached = np.zeros(matched.n_rows)
        unreached[rows] = now_known
        without = unreached[here]
        all_terms[action] += (now_terms - terms[rows]).sum() + (x_log_x(without + gained) - x_log_x(without)).sum()
    return NextLooks(predictive, all_terms, 0.0 if exact else float(weights @ followed.rest) + _ROUNDING)


class _RowValues:
    """The values that J of a row takes where no counted edge leads."""

    def __init__(self, matched: AspectFilter, weights: FloatArray) -> None:
        delta = matched.parameters.observation_noise
        self._noise = delta / matched.n_patterns * weights
        self._rate_known = (1.0 - delta) / matched.n_aspects
        self._rate_unknown = matched.n_unobserved / matched.n_aspects * matched.collection_rate
        self._n_known, self._n_unknown = matched.n_known, matched.n_patterns - matched.n_known

    def of(self, kept: FloatArray, rows: IntArray | slice) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return J of a known pattern and of an unknown one, and Σ_z J ln J, where S of the joint mass is ``kept``."""
        known = kept * self._rate_known + self._noise[rows]
        unknown = kept * self._rate_unknown[rows] + self._noise[rows]
        return known, unknown, x_log_x(known) * self._n_known[rows] + x_log_x(unknown) * self._n_unknown[rows]


def _followed(matched: AspectFilter, weights: FloatArray, *, exact: bool) -> _Followed:
    """Return the cells whose edges are followed: all, or those with more than little of a row's mass."""
    mass = matched.mass.ravel()
    is_in = mass > (0.0 if exact else SMALL)
    cells = np.flatnonzero(is_in)
    rows = cells // matched.width
    if exact:
        return _Followed(cells, rows, is_in, np.zeros(matched.n_rows))
    probable = weights[rows] > NEGLIGIBLE
    is_in[cells[~probable]] = False
    cells, rows = cells[probable], rows[probable]
    return _Followed(cells, rows, is_in, np.maximum(1.0 - _sums(rows, mass[cells], matched.n_rows), 0.0))


def _grouped(
    rows: IntArray, sources: IntArray, targets: IntArray, carried: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return rows, targets and what is carried there, with each target once."""
    one_source = np.zeros(int(rows.max()) + 1, dtype=np.int64)
    one_source[rows] = sources
    if (one_source[rows] == sources).all():  # the edges of one source lead to different targets
        return rows, targets, carried
    each, first, group = np.unique(targets, return_index=True, return_inverse=True)
    return rows[first], each, _sums(group, carried, len(each))


def _by_listed(matched: AspectFilter, change: FloatArray, rows: IntArray) -> FloatArray:
    """Return the sum of ``change`` [R] over the rows that list a pattern, shape [|𝒵|]; it is zero but in ``rows``."""
    if len(rows) > matched.n_rows // 8:
        return _sums(matched.listed_patterns, change[matched.listed_rows], matched.n_patterns)
    shown = matched.pattern[rows]
    listed = shown >= 0
    return _sums(shown[listed].astype(np.int64), np.repeat(change[rows], listed.sum(axis=1)), matched.n_patterns)


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
