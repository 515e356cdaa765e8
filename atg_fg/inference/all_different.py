"""Beliefs about several objects that are all different.

The belief in each object is that from its own evidence. All of them together are the product of these beliefs and one
factor on (O_1, …, O_n): zero if two of them are the same remembered object, and U (U − 1) … (U − m + 1) / U^m if m of
them are unseen, the share of ordered choices out of U unseen objects that are all different.

The sums over all assignments run through the remembered objects one after the other and keep only *which* of the n have
been assigned so far (``docs/model.md``). So they take K · n · 2^n additions in place of (K + 1)^n, none of them a
subtraction, and all of them of logarithms: the only assignment that is left may be one that each object's own evidence
finds next to impossible.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError
from atg_fg.core.log_math import log_of
from atg_fg.core.patterns import FloatArray, IntArray

#: Most entries of ``all_different_table``; a decision tree of so many takes some 100 bytes each.
MAX_TABLE: Final = 2_000_000
#: Most entries of a pass over the remembered objects, (K + 1) · 2^n: 160 MB.
MAX_PASS: Final = 20_000_000


def different_identities(beliefs: Sequence[IdentityBelief]) -> list[IdentityBelief]:
    """Return p(O_k | evidence of all, all different) of each of n objects.

    Args:
        beliefs: p(O_k | its own evidence) of each object, from the memory's prior; what is zero in it is ruled out.

    Raises:
        InvalidInputError: A belief is no distribution, or they are about different memories.
        ImpossibleEvidenceError: No assignment of different objects is possible.
        TooLargeError: (K + 1) · 2^n is over ``MAX_PASS``.
    """
    if not beliefs:
        return []
    passes = _passes(beliefs)
    if not np.isfinite(passes.log_probability):
        raise ImpossibleEvidenceError(
            f"all different: no assignment of {len(beliefs)} different objects has a probability above zero; "
            "expected beliefs that leave one"
        )
    return [IdentityBelief.of(passes.marginal(which), beliefs[0].n_unseen) for which in range(len(beliefs))]


def identity_given_others(prior: IdentityBelief, others: Sequence[IdentityBelief]) -> IdentityBelief:
    """Return the belief in one more object given that it is none of the others: its prior when the robot turns to it.

    Args:
        prior: p(O) of the object before this.
        others: p(O_k | its own evidence) of each other object, from the memory's prior. So not the posterior of a trial
            that began with what others left: their evidence would count twice.

    Raises:
        InvalidInputError, ImpossibleEvidenceError, TooLargeError: As ``different_identities``.
    """
    return different_identities([prior, *others])[0]


def log_probability_all_different(beliefs: Sequence[IdentityBelief]) -> float:
    """Return ln p(all different) if each object is drawn from its belief; −∞ if that cannot be.

    The evidence of several trials given that the objects are different is the sum of their log evidences, plus this of
    their posteriors, less this of their priors.

    Raises:
        InvalidInputError: A belief is no distribution, or they are about different memories.
        TooLargeError: (K + 1) · 2^n is over ``MAX_PASS``.
    """
    return _passes(beliefs).log_probability if beliefs else 0.0


def all_different_table(n: int, n_objects: int, n_unseen: int) -> FloatArray:
    """Return the factor on (O_1, …, O_n) as a table, shape [K + 1] · n.

    Raises:
        TooLargeError: It would have over ``MAX_TABLE`` entries.
    """
    if (n_objects + 1) ** n > MAX_TABLE:
        raise TooLargeError(
            f"all different: {n} objects of {n_objects + 1} states make a table of {(n_objects + 1) ** n} entries; "
            f"expected at most {MAX_TABLE}, so use atg_fg.inference.all_different.different_identities"
        )
    is_unseen = np.arange(n_objects + 1) == n_objects
    table: FloatArray = np.exp(_log_shares(n, n_unseen))[reduce(np.add.outer, [is_unseen.astype(np.int64)] * n)]
    pair = np.where(np.eye(n_objects + 1, dtype=bool) & ~is_unseen, 0.0, 1.0)
    for axes in combinations(range(n), 2):
        table *= np.expand_dims(pair, [axis for axis in range(n) if axis not in axes])
    return table


def _log_shares(n: int, n_unseen: int) -> FloatArray:
    """Return ln U (U − 1) … (U − m + 1) / U^m for m = 0 … n, shape [n + 1]; −∞ for m > U."""
    left = np.maximum(n_unseen - np.arange(n), 0) / n_unseen
    return np.append(0.0, np.cumsum(log_of(left)))


class _Sets(NamedTuple):
    """Sets of objects as bits of their number: 2^n sets of n objects.

    Attributes:
        contains: Whether object k is in a set, shape [n, 2^n].
        flipped: The set with object k put in or taken out, shape [n, 2^n].
    """

    contains: NDArray[np.bool_]
    flipped: IntArray

    @classmethod
    def of(cls, n: int) -> _Sets:
        sets, bits = np.arange(2**n), 2 ** np.arange(n)[:, None]
        return cls((sets & bits) > 0, sets ^ bits)


class _Passes(NamedTuple):
    """Sums over assignments, by the set S of those of the n objects that are assigned; all are logarithms.

    Attributes:
        log_beliefs: ln p(O_k), shape [n, K + 1].
        forward: Of assigning S to the first i remembered objects, for i = 0 … K, shape [K + 1, 2^n].
        backward: Of assigning all but S to the others and to unseen objects, for i = 0 … K, shape [K + 1, 2^n].
        sets: The sets.
    """

    log_beliefs: FloatArray
    forward: FloatArray
    backward: FloatArray
    sets: _Sets

    @property
    def log_probability(self) -> float:
        """Return ln Σ over all assignments."""
        return float(self.backward[0, 0])

    def marginal(self, which: int) -> FloatArray:
        """Return p(O_which | all different), shape [K + 1]."""
        before = np.flatnonzero(~self.sets.contains[which])
        after = self.sets.flipped[which, before]
        ways = np.logaddexp.reduce(self.forward[:-1, before] + self.backward[1:, after], axis=1)
        unseen = np.logaddexp.reduce(self.forward[-1, before] + self.backward[-1, before])
        # The factor p(O_which = unseen) is in the last backward sums already.
        logarithms = np.append(self.log_beliefs[which, :-1] + ways, unseen)
        weights = np.exp(logarithms - self.log_probability)
        marginal: FloatArray = weights / weights.sum()
        return marginal


def _passes(beliefs: Sequence[IdentityBelief]) -> _Passes:
    n, n_objects, n_unseen = len(beliefs), len(beliefs[0].objects), beliefs[0].n_unseen
    for belief in beliefs:
        belief.check(n_objects, n_unseen)
    if n_unseen < 1:
        raise InvalidInputError(f"belief: {n_unseen!r} unseen objects; expected at least 1")
    if (n_objects + 1) * 2**n > MAX_PASS:
        raise TooLargeError(
            f"all different: {n} objects and {n_objects} remembered ones make {(n_objects + 1) * 2**n} sums; "
            f"expected at most {MAX_PASS}"
        )
    log_beliefs = log_of(np.array([belief.probabilities for belief in beliefs]))
    sets = _Sets.of(n)
    forward = np.full((n_objects + 1, 2**n), -np.inf)
    forward[0, 0] = 0.0
    backward = np.empty_like(forward)
    rest_unseen = np.where(sets.contains, 0.0, log_beliefs[:, -1:]).sum(axis=0)
    backward[-1] = rest_unseen + _log_shares(n, n_unseen)[n - sets.contains.sum(axis=0)]
    for i in range(n_objects):
        forward[i + 1] = _with_one_more(forward[i], log_beliefs[:, i], sets.flipped, sets.contains)
    for i in range(n_objects - 1, -1, -1):
        backward[i] = _with_one_more(backward[i + 1], log_beliefs[:, i], sets.flipped, ~sets.contains)
    return _Passes(log_beliefs, forward, backward, sets)


def _with_one_more(
    sums: FloatArray, log_beliefs: FloatArray, flipped: IntArray, allowed: NDArray[np.bool_]
) -> FloatArray:
    """Return the sums after one more remembered object: it is none of the n, or one of those ``allowed``."""
    taken = np.where(allowed, sums[flipped] + log_beliefs[:, None], -np.inf)
    result: FloatArray = np.logaddexp(sums, np.logaddexp.reduce(taken, axis=0))
    return result
