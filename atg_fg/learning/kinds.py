"""Kinds of objects: each is a plain ATG, one whose actions are uncertain, or a follower of one of K structures.

Which kind an object is of is a variable of its own, with a Dirichlet prior over the shares of the kinds. Sets of
structures are compared by their evidence of all trials, each given those before it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.learning.candidate import Candidate
from atg_fg.learning.likelihood import BEFORE
from atg_fg.learning.rates import AGAIN, SLIP, WRONG, Rates, Tally

#: Columns of what is no structure: plain, and plain with uncertain actions.
SURE_KIND, UNCERTAIN_KIND, N_PLAIN = range(3)
#: Dirichlet concentration of these, and of each structure 1.
PLAIN_BEFORE: Final = (1.0, 0.05)
#: Structures that one memory may have kinds of.
MAX_KINDS: Final = 5
#: A trial that takes more wrong looks than this for one of a kind, or slips and wrong looks, is none of it: a, b of
#: a + b · looks. What is nearly right would else hide a kind that is not known yet. An action that fails over and over
#: counts once.
WRONG_LIMIT: Final = (1.5, 0.03)
EVENT_LIMIT: Final = (1.5, 0.1)
#: These limits are for rates as they are beforehand: so many times what those in force foretell beyond them is added.
EXCESS_FACTOR: Final = 3.0
PRIOR_RATES: Final = Rates()
#: Nats by which such a trial is less probable than as one of a plain ATG, at least.
REFUSED: Final = 10.0
#: A kind that takes more of its members' looks for errors than a + b · looks is nearly right at best. It is none,
#: however much it explains: the same mistakes come again with the same object, and a new object, whose mistakes are
#: accidents as well, explains them as well as the right one.
MAX_WRONG: Final = (2.0, 0.02)
#: Sets that are believed in at once, and how many nats the others may be behind the best.
MAX_BELIEVED: Final = 3
BELIEVED_WITHIN: Final = 7.0
#: Rounds in which the shares are estimated.
_ROUNDS: Final = 20


class KindShares(NamedTuple):
    """Which kind n objects, or trials, are of.

    Attributes:
        responsibilities: p(kind | row), the two plain kinds first, shape [n, 2 + K].
        shares: Posterior mean of the share of each kind, shape [2 + K].
        log_evidence: ln ∫ Π_t Σ_k π_k p(row t | k) dπ, bounded from below by the responsibilities; the bound is tight
            where each row is clearly of one kind.
    """

    responsibilities: FloatArray
    shares: FloatArray
    log_evidence: float


class KindSet(NamedTuple):
    """A set of kinds.

    Attributes:
        structures: Positions in the pool, ascending.
        log_evidence: Of all trials, the prior of the structures included.
        trials: Which kind each trial is of.
    """

    structures: tuple[int, ...]
    log_evidence: float
    trials: KindShares


def kind_table(kinds: Sequence[Candidate], plain: FloatArray, rates: Rates, given: int = BEFORE) -> FloatArray:
    """Return ln p(trial | kind), the two plain kinds first, shape [n, 2 + K].

    Args:
        kinds: K structures, scored on all trials; one of too many errors is none of a kind's.
        plain: ln p(trial | plain) of the two plain kinds, shape [n, 2].
        rates: Those in force.
        given: What the evidence is given: ``NEW``, ``FILED`` or ``BEFORE``.
    """
    if not kinds:
        return plain
    n_looks = kinds[0].n_looks
    excess_wrong = max(rates.wrong - PRIOR_RATES.wrong, 0.0) * n_looks
    excess_events = excess_wrong + max(rates.slip - PRIOR_RATES.slip, 0.0) * (n_looks - 1)
    most_wrong = WRONG_LIMIT[0] + WRONG_LIMIT[1] * n_looks + EXCESS_FACTOR * excess_wrong
    most_events = EVENT_LIMIT[0] + EVENT_LIMIT[1] * n_looks + EXCESS_FACTOR * excess_events
    events = np.array([kind.events for kind in kinds])
    wrong = events[..., WRONG]
    errs = (wrong > most_wrong) | (wrong + events[..., SLIP] - events[..., AGAIN] > most_events)
    evidence = np.array([kind.log_evidence[given] for kind in kinds])
    table = np.empty((len(plain), N_PLAIN + len(kinds)))
    table[:, :N_PLAIN] = plain
    table[:, N_PLAIN:] = np.where(errs, np.minimum(evidence, plain.max(axis=1) - REFUSED), evidence).T
    return table


def share_kinds(table: FloatArray) -> KindShares:
    """Return which kind each row is of, given ln p(row | kind), shape [n, 2 + K]."""
    from atg_fg.learning import kind_kernels  # they load Numba

    return KindShares(*kind_kernels.share_out(np.ascontiguousarray(table), _before(table.shape[1]), _ROUNDS))


@cache
def _before(n_kinds: int) -> FloatArray:
    """Return the Dirichlet concentration of each kind, plain ones included; not to be written to."""
    return np.array([*PLAIN_BEFORE, *[1.0] * (n_kinds - N_PLAIN)])


def evidence_of_sets(table: FloatArray, sets: Sequence[Iterable[int]]) -> list[float]:
    """Return ln p(all rows) of each set of structures, as ``share_kinds`` does of all, given ln p(row | kind)."""
    from atg_fg.learning import kind_kernels  # they load Numba

    members = np.zeros((len(sets), table.shape[1]), dtype=np.bool_)
    members[:, :N_PLAIN] = True
    for number, kinds in enumerate(sets):
        for kind in kinds:
            members[number, N_PLAIN + kind] = True
    table = np.ascontiguousarray(table)  # the loop is compiled anew for what is laid out otherwise
    result: list[float] = kind_kernels.evidence_of_sets(table, _before(table.shape[1]), members, _ROUNDS).tolist()
    return result


def choose_kinds(
    pool: Sequence[Candidate], plain: FloatArray, rates: Rates, known: dict[frozenset[int], float] | None = None
) -> list[KindSet]:
    """Return the sets of kinds that are believed in, best first: the best, and its best neighbours if not far behind.

    From none, the change that gains most is made for as long as there is one: one structure more, one less, one for
    another, or one for two.

    Args:
        pool: Structures, scored on all trials.
        plain: ln p(trial | plain) of the two plain kinds, shape [n, 2].
        rates: Those in force.
        known: Gets ln p(all trials) of each set that was looked at, its prior included: of none and of each alone, too.
    """
    table = kind_table(pool, plain, rates)
    known = {} if known is None else known
    made: dict[frozenset[int], KindSet | None] = {}

    def of(kinds: frozenset[int]) -> KindSet | None:
        if kinds not in made:
            chosen = tuple(sorted(kinds))
            shares = share_kinds(table[:, [SURE_KIND, UNCERTAIN_KIND, *(N_PLAIN + number for number in chosen)]])
            following = zip(chosen, shares.responsibilities[:, N_PLAIN:].T, strict=True)
            are_kinds = all(_is_kind(pool[number], own) for number, own in following)
            made[kinds] = KindSet(chosen, known[kinds], shares) if are_kinds else None
        return made[kinds]

    best, neighbours = None, [frozenset[int]()]
    while True:
        new = [kinds for kinds in neighbours if kinds not in known]
        for kinds, evidence in zip(new, evidence_of_sets(table, new), strict=True):
            known[kinds] = evidence + sum(pool[number].structure.log_prior for number in sorted(kinds))
        neighbours.sort(key=lambda kinds: -known[kinds])
        least = -np.inf if best is None else best.log_evidence + 1e-6
        better = next((each for kinds in neighbours if known[kinds] > least and (each := of(kinds))), None)
        if better is None:
            break
        best, neighbours = better, _changes(frozenset(better.structures), len(pool))
    assert best is not None
    near = (kinds for kinds in neighbours if known[kinds] > best.log_evidence - BELIEVED_WITHIN)
    return [best, *itertools.islice(filter(None, map(of, near)), MAX_BELIEVED - 1)]


def tally_events(kinds: KindSet, pool: Sequence[Candidate], plain: FloatArray, rates: Rates) -> tuple[Tally, Tally]:
    """Return the events in all trials of a set of structures, and in those of its commonest one if it were alone.

    Args:
        kinds: The set, not empty.
        pool: Structures, scored on all trials.
        plain: ln p(trial | plain) of the two plain kinds, shape [n, 2].
        rates: Those in force.
    """
    following = kinds.trials.responsibilities.T[N_PLAIN:]
    tallies = [pool[number].tally(own) for number, own in zip(kinds.structures, following, strict=True)]
    commonest = pool[kinds.structures[following.sum(axis=1).argmax()]]
    alone = share_kinds(kind_table([commonest], plain, rates)).responsibilities[:, N_PLAIN]
    return Tally(*map(sum, zip(*tallies, strict=True))), commonest.tally(alone)


def _is_kind(candidate: Candidate, following: FloatArray) -> bool:
    """Return whether something follows a structure, and without many errors."""
    wrong = float(following @ candidate.events[:, WRONG])
    return bool(following.max() > 0.5 and wrong <= MAX_WRONG[0] + MAX_WRONG[1] * float(following @ candidate.n_looks))


def _changes(chosen: frozenset[int], n: int) -> list[frozenset[int]]:
    others = [number for number in range(n) if number not in chosen]
    fewer = [chosen - {number} for number in sorted(chosen)]
    pairs = [less - {number} for less in fewer for number in sorted(less)]
    added = [rest | {number} for rest in (chosen, *fewer, *dict.fromkeys(pairs)) for number in others]
    return [kinds for kinds in (*fewer, *added) if len(kinds) <= MAX_KINDS]
