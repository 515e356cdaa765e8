"""Kinds of objects: each object is of one of several kinds, a plain ATG or a follower of one of K structures.

Which kind an object is of is a variable of its own, with the shares of the kinds uniform beforehand. Sets of structures
are compared by their evidence of all trials, each taken for one of a fresh object.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import FloatArray
from atg_fg.learning.candidate import Candidate
from atg_fg.learning.pose_filter import SLIP, WRONG
from atg_fg.learning.raw_trials import RawTrial

#: Structures that one memory may have kinds of.
MAX_KINDS: Final = 5
#: A trial that takes more wrong looks than this for one of a kind, or slips and wrong looks, is none of it: a, b of
#: a + b · looks. What is nearly right would else hide a kind that is not known yet.
WRONG_LIMIT: Final = (1.5, 0.03)
EVENT_LIMIT: Final = (1.5, 0.1)
#: Nats by which such a trial is less probable than as one of a plain ATG, at least.
REFUSED: Final = 10.0
#: Rounds in which the shares are estimated.
_ROUNDS: Final = 20


class KindShares(NamedTuple):
    """Which kind n objects, or trials, are of.

    Attributes:
        responsibilities: p(kind | object), being plain first, shape [n, K + 1].
        shares: Posterior mean of the share of each kind, being plain first, shape [K + 1].
    """

    responsibilities: FloatArray
    shares: FloatArray


def kind_table(kinds: Sequence[Candidate], plain: FloatArray, trials: Sequence[RawTrial]) -> FloatArray:
    """Return ln p(trial | kind, a fresh object), being plain first, shape [n, K + 1].

    Args:
        kinds: K structures, scored on all trials.
        plain: ln p(trial | plain), shape [n].
        trials: All raw trials, of which too many errors are none of a kind's.
    """
    n_looks = np.array([len(trial.detections) for trial in trials])
    columns = [plain]
    for kind in kinds:
        wrong, events = kind.events[:, WRONG], kind.events[:, WRONG] + kind.events[:, SLIP]
        errs = (wrong > WRONG_LIMIT[0] + WRONG_LIMIT[1] * n_looks) | (
            events > EVENT_LIMIT[0] + EVENT_LIMIT[1] * n_looks
        )
        columns.append(np.where(errs, np.minimum(kind.log_evidence, plain - REFUSED), kind.log_evidence))
    return np.column_stack(columns)


def share_kinds(table: FloatArray) -> KindShares:
    """Return which kind each row is of, given ln p(row | kind), shape [n, K + 1]; shares are uniform beforehand."""
    n_rows, n_kinds = table.shape
    likelihood = np.exp(table - table.max(axis=1, keepdims=True))
    shares = np.full(n_kinds, 1.0 / n_kinds)
    for _ in range(_ROUNDS):
        responsibilities = likelihood * shares
        responsibilities /= responsibilities.sum(axis=1, keepdims=True)
        shares = (1.0 + responsibilities.sum(axis=0)) / (n_kinds + n_rows)
    return KindShares(responsibilities, shares)


def log_evidence_of(table: FloatArray, log_prior: float) -> float:
    """Return ln p(structures) + ln ∫ Π_t Σ_k π_k p(trial t | k) dπ, bounded from below.

    The bound is that of the responsibilities; it is tight where each trial is clearly of one kind.

    Args:
        table: ln p(trial | kind), shape [n, K + 1].
        log_prior: ln p of all structures together.
    """
    following = share_kinds(table).responsibilities
    n_rows, n_kinds = table.shape
    expected = following.sum(axis=0)
    explained = float((following * table).sum()) - float(x_log_x(following).sum())
    log_shares = math.lgamma(n_kinds) - math.lgamma(n_kinds + n_rows)
    log_shares += sum(math.lgamma(1.0 + each) for each in expected.tolist())
    return log_prior + explained + log_shares


def choose_kinds(pool: Sequence[Candidate], plain: FloatArray, trials: Sequence[RawTrial]) -> tuple[list[int], float]:
    """Return which structures of a pool are kinds, as positions, and the log evidence of these kinds.

    From none, the change that gains most is made for as long as there is one: one structure more, one less, one for
    another, or one for two.

    Args:
        pool: Structures, scored on all trials.
        plain: ln p(trial | plain), shape [n].
        trials: All raw trials.
    """
    table = kind_table(pool, plain, trials)
    priors = [each.structure.log_prior for each in pool]
    known: dict[frozenset[int], float] = {}

    def evidence(kinds: frozenset[int]) -> float:
        if kinds not in known:
            columns = [0, *(1 + number for number in sorted(kinds))]
            known[kinds] = log_evidence_of(table[:, columns], sum(priors[number] for number in kinds))
        return known[kinds]

    chosen: frozenset[int] = frozenset()
    while True:
        changes = [kinds for kinds in _changes(chosen, len(pool)) if len(kinds) <= MAX_KINDS]
        best = max(changes, key=evidence, default=chosen)
        if not evidence(best) > evidence(chosen) + 1e-6:
            return sorted(chosen), evidence(chosen)
        chosen = best


def _changes(chosen: frozenset[int], n: int) -> list[frozenset[int]]:
    others = [number for number in range(n) if number not in chosen]
    fewer = [chosen - {number} for number in sorted(chosen)]
    pairs = [less - {number} for less in fewer for number in sorted(less)]
    added = [rest | {number} for rest in (chosen, *fewer, *dict.fromkeys(pairs)) for number in others]
    return fewer + added
