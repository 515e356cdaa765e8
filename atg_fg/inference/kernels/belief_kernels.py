"""The steps of a Bayes filter over object and aspect, and of its decision, each a loop over the hypotheses.

The symbols and the numbers are those of ``docs/model.md``: hypothesis h knows ``n_known[h]`` aspects, states 1 to n;
state 0 is its collection node. ``prior_weight`` and ``probability`` are what the counts come to with the concentration
α: a transition row is ``prior_weight · base_row`` plus its edges. Loops end at n; the rest
of a row is padding.

This module loads Numba.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, reordered

#: Smallest normal number, in place of zero under a logarithm: x ln x of what is below it is zero up to rounding.
_LEAST: Final = float(np.finfo(np.float64).tiny)

#: Of few bytes; which type it is depends on the sizes.
SmallIntArray = NDArray[Any]


class Tables(NamedTuple):
    """What H hypotheses know, in rows with room for more.

    Attributes:
        n_known: Aspects known, shape [H].
        pattern: Pattern of each state from 1 on, shape [H, W].
        edge_start: First edge of each hypothesis, shape [H].
        n_edges: How many it has, shape [H].
        edges: Action, target and source of each counted transition, ascending in each hypothesis, shape [E, 3].
        counted: How often it was counted, shape [E].
        probability: What it adds to its row, count / (c + α), shape [E].
        prior_weight: What each row leaves to its base, α / (c + α), shape [H, A, W].
    """

    n_known: SmallIntArray
    pattern: SmallIntArray
    edge_start: IntArray
    n_edges: IntArray
    edges: SmallIntArray
    counted: FloatArray
    probability: FloatArray
    prior_weight: FloatArray


class Constants(NamedTuple):
    """Numbers that are the same for all hypotheses: |G|, |𝒵|, α and δ."""

    n_aspects: int
    n_patterns: int
    concentration: float
    noise: float


@compiled
def weigh_row(tables: Tables, hypothesis: int, source: int, action: int, concentration: float) -> None:
    """Set what the counts of a transition row come to."""
    first = tables.edge_start[hypothesis]
    last = first + tables.n_edges[hypothesis]
    total = 0.0
    for edge in range(first, last):
        if tables.edges[edge, 2] == source and tables.edges[edge, 0] == action:
            total += tables.counted[edge]
    total += concentration
    for edge in range(first, last):
        if tables.edges[edge, 2] == source and tables.edges[edge, 0] == action:
            tables.probability[edge] = tables.counted[edge] / total
    tables.prior_weight[hypothesis, action, source] = concentration / total


@compiled
def weigh(tables: Tables, hypotheses: IntArray, concentration: float) -> None:
    """Set what the counts of all rows of some hypotheses come to."""
    for hypothesis in hypotheses:
        tables.prior_weight[hypothesis] = 1.0
        first = tables.edge_start[hypothesis]
        for edge in range(first, first + tables.n_edges[hypothesis]):
            weigh_row(tables, hypothesis, tables.edges[edge, 2], tables.edges[edge, 0], concentration)


@compiled
def spread_by_base(tables: Tables, constants: Constants, aspects: FloatArray) -> None:
    """Fill in p(X_0 | O), shape [H, W]."""
    for hypothesis in range(len(tables.n_known)):
        n_known = tables.n_known[hypothesis]
        aspects[hypothesis, 0] = (constants.n_aspects - n_known) / constants.n_aspects
        for state in range(1, n_known + 1):
            aspects[hypothesis, state] = 1.0 / constants.n_aspects


@compiled
def predict(tables: Tables, constants: Constants, aspects: FloatArray, action: int, predicted: FloatArray) -> None:
    """Fill in Σ_x p(x | O) p(x' | x, a, O), shape [H, W]."""
    share = 1.0 / constants.n_aspects
    for hypothesis in range(len(tables.n_known)):
        n_known = tables.n_known[hypothesis]
        kept = 0.0
        for state in range(n_known + 1):
            kept += aspects[hypothesis, state] * tables.prior_weight[hypothesis, action, state]
        predicted[hypothesis, 0] = kept * ((constants.n_aspects - n_known) / constants.n_aspects)
        for state in range(1, n_known + 1):
            predicted[hypothesis, state] = kept * share
        first = tables.edge_start[hypothesis]
        for edge in range(first, first + tables.n_edges[hypothesis]):
            if tables.edges[edge, 0] == action:
                carried = aspects[hypothesis, tables.edges[edge, 2]] * tables.probability[edge]
                predicted[hypothesis, tables.edges[edge, 1]] += carried


@compiled
def condition(
    tables: Tables,
    constants: Constants,
    evidence: FloatArray,
    aspects: FloatArray,
    log_identity: FloatArray,
    updated: FloatArray,
    log_updated: FloatArray,
    identity: FloatArray,
) -> float:
    """Condition the belief on a look; return ln p(z_t | z_0:t-1), or −∞ if it is impossible.

    Args:
        tables: What is known.
        constants: Of the model.
        evidence: Likelihood of each pattern, shape [|𝒵|].
        aspects: p(X_t | O, z_0:t-1), shape [H, W].
        log_identity: ln p(O | z_0:t-1), shape [H].
        updated: Filled with p(X_t | O, z_0:t).
        log_updated: Filled with ln p(O | z_0:t).
        identity: Filled with p(O | z_0:t).
    """
    observed = 1.0 - constants.noise
    noise = constants.noise / constants.n_patterns * evidence.sum()
    support = np.flatnonzero(evidence)
    last_knowing = np.full(constants.n_patterns, -1, np.int64)
    peak = -np.inf
    for hypothesis in range(len(tables.n_known)):
        n_known = tables.n_known[hypothesis]
        total = 0.0
        for state in range(1, n_known + 1):
            pattern = tables.pattern[hypothesis, state]
            last_knowing[pattern] = hypothesis
            updated[hypothesis, state] = aspects[hypothesis, state] * (observed * evidence[pattern] + noise)
            total += updated[hypothesis, state]
        rate = 0.0
        if n_known < constants.n_aspects:
            # A sum, not a difference of sums: it may be nothing, exactly.
            for pattern in support:
                if last_knowing[pattern] != hypothesis:
                    rate += evidence[pattern]
            rate *= observed / (constants.n_patterns - n_known)
        updated[hypothesis, 0] = aspects[hypothesis, 0] * (rate + noise)
        total += updated[hypothesis, 0]
        if total > 0.0:
            log_updated[hypothesis] = log_identity[hypothesis] + np.log(total)
            for state in range(n_known + 1):
                updated[hypothesis, state] /= total
        else:
            # A hypothesis that is ruled out keeps its prediction; its weight is zero from here on.
            log_updated[hypothesis] = -np.inf
            for state in range(n_known + 1):
                updated[hypothesis, state] = aspects[hypothesis, state]
        peak = max(peak, log_updated[hypothesis])
    if not np.isfinite(peak):
        return -np.inf
    total = 0.0
    for hypothesis in range(len(tables.n_known)):
        total += np.exp(log_updated[hypothesis] - peak)
    log_probability = peak + np.log(total)
    for hypothesis in range(len(tables.n_known)):
        log_updated[hypothesis] -= log_probability
        identity[hypothesis] = np.exp(log_updated[hypothesis])
    return float(log_probability)


@compiled
def learn(tables: Tables, constants: Constants, aspects: FloatArray, previous: int, action: int, pattern: int) -> None:
    """Extend every hypothesis by a complete look, and divide the belief of its collection node.

    There is room for one more aspect and one more edge in each row.

    Args:
        tables: Extended in place.
        constants: Of the model.
        aspects: p(X_t | O, z_0:t), shape [H, W]; changed in place.
        previous: Pattern seen one step earlier, −1 if that look was not complete.
        action: Action since then.
        pattern: Pattern seen now.
    """
    for hypothesis in range(len(tables.n_known)):
        n_known = tables.n_known[hypothesis]
        source, target = 0, 0
        for state in range(1, n_known + 1):
            shown = tables.pattern[hypothesis, state]
            if shown == previous:
                source = state
            if shown == pattern:
                target = state
        if target == 0:
            if n_known == constants.n_aspects:
                continue
            target = n_known + 1
            truth = (1.0 - constants.noise) / (constants.n_patterns - n_known)
            share = truth / (truth + constants.noise / constants.n_patterns)
            revealed = aspects[hypothesis, 0] * (1.0 if target == constants.n_aspects else share)
            tables.n_known[hypothesis] = target
            tables.pattern[hypothesis, target] = pattern
            aspects[hypothesis, target] = revealed
            aspects[hypothesis, 0] -= revealed
            if previous == pattern:
                source = target
        if source > 0:
            count(tables, hypothesis, source, action, target)
            weigh_row(tables, hypothesis, source, action, constants.concentration)


@compiled
def count(tables: Tables, hypothesis: int, source: int, action: int, target: int) -> None:
    """Count a transition once more; there is room for one more edge."""
    first = tables.edge_start[hypothesis]
    place = first + tables.n_edges[hypothesis]
    while place > first and not _precedes(tables, place - 1, action, target, source):
        place -= 1
    new = first + tables.n_edges[hypothesis]
    if place < new:
        edges = tables.edges
        if edges[place, 0] == action and edges[place, 1] == target and edges[place, 2] == source:
            tables.counted[place] += 1.0
            return
    for edge in range(new, place, -1):
        tables.edges[edge] = tables.edges[edge - 1]
        tables.counted[edge], tables.probability[edge] = tables.counted[edge - 1], tables.probability[edge - 1]
    tables.edges[place, 0], tables.edges[place, 1], tables.edges[place, 2] = action, target, source
    tables.counted[place] = 1.0
    tables.n_edges[hypothesis] += 1


@compiled
def _precedes(tables: Tables, edge: int, action: int, target: int, source: int) -> bool:
    """Return whether an edge comes before another."""
    if tables.edges[edge, 0] != action:
        return bool(tables.edges[edge, 0] < action)
    if tables.edges[edge, 1] != target:
        return bool(tables.edges[edge, 1] < target)
    return bool(tables.edges[edge, 2] < source)


@compiled
def joint_terms(
    tables: Tables,
    constants: Constants,
    belief: tuple[FloatArray, FloatArray],
    block: tuple[int, int],
    predictive: FloatArray,
    terms: FloatArray,
    ends: IntArray,
) -> None:
    """Fill in the values x that p(O = i, z_t+1 | a) takes for the hypotheses of a block, and how often.

    ``atg_fg.inference.expected_entropy`` says which these are. The caller takes the logarithms: many at once take much
    less time than one by one. After the last block p(z | a) of each pattern follows, −1 times.

    Args:
        tables: What is known.
        constants: Of the model.
        belief: p(O | z_0:t), shape [H], and p(X_t | O, z_0:t), shape [H, W].
        block: First hypothesis and the one after the last.
        predictive: What earlier blocks add to p(z | a), shape [A, |𝒵|]; that of this block is added.
        terms: Filled with x and how often it counts, shape [A, 2, N]; there are two values a hypothesis, one an edge,
            and one a pattern.
        ends: Filled with the number of terms of each action, shape [A].
    """
    identity, aspects = belief
    observed, n_patterns, n_actions = 1.0 - constants.noise, constants.n_patterns, len(ends)
    added, everywhere = np.zeros((n_actions, n_patterns)), np.zeros(n_actions)
    unreached, more, n_unreached = np.empty(n_actions), np.empty(n_actions), np.empty(n_actions)
    ends[:] = 0
    for hypothesis in range(block[0], block[1]):
        probability, n_known = identity[hypothesis], tables.n_known[hypothesis]
        noise = constants.noise / n_patterns * probability
        rate = 0.0
        if n_known < constants.n_aspects:
            share = (constants.n_aspects - n_known) / constants.n_aspects
            rate = share * (observed / (n_patterns - n_known))
        for action in range(n_actions):
            kept = 0.0
            for state in range(n_known + 1):
                kept += aspects[hypothesis, state] * tables.prior_weight[hypothesis, action, state]
            kept *= probability
            unknown = kept * rate + noise
            unreached[action] = kept * (observed / constants.n_aspects) + noise
            more[action] = unreached[action] - unknown
            n_unreached[action] = n_known
            everywhere[action] += unknown
            term = ends[action]
            terms[action, 0, term], terms[action, 1, term] = max(unknown, _LEAST), n_patterns - n_known
            ends[action] = term + 1
        for state in range(1, n_known + 1):
            pattern = tables.pattern[hypothesis, state]
            for action in range(n_actions):
                added[action, pattern] += more[action]
        edge = tables.edge_start[hypothesis]
        last = edge + tables.n_edges[hypothesis]
        while edge < last:
            action, target = tables.edges[edge, 0], tables.edges[edge, 1]
            arrived = aspects[hypothesis, tables.edges[edge, 2]] * tables.probability[edge]
            edge += 1
            while edge < last and tables.edges[edge, 1] == target and tables.edges[edge, 0] == action:
                arrived += aspects[hypothesis, tables.edges[edge, 2]] * tables.probability[edge]
                edge += 1
            arrived *= observed * probability
            added[action, tables.pattern[hypothesis, target]] += arrived
            n_unreached[action] -= 1.0
            term = ends[action]
            terms[action, 0, term], terms[action, 1, term] = max(unreached[action] + arrived, _LEAST), 1.0
            ends[action] = term + 1
        for action in range(n_actions):
            term = ends[action]
            terms[action, 0, term], terms[action, 1, term] = max(unreached[action], _LEAST), n_unreached[action]
            ends[action] = term + 1
    for action in range(n_actions):
        for pattern in range(n_patterns):
            predictive[action, pattern] += added[action, pattern] + everywhere[action]
    if block[1] == len(tables.n_known):
        for action in range(n_actions):
            for pattern in range(n_patterns):
                # Subtracting may leave a rounding error below zero.
                term = ends[action]
                terms[action, 0, term], terms[action, 1, term] = max(predictive[action, pattern], _LEAST), -1.0
                ends[action] = term + 1


@reordered
def add_up(terms: FloatArray, logarithms: FloatArray, ends: IntArray, sums: FloatArray) -> None:
    """Add Σ x ln x of each action, as often as each counts, to ``sums``, shape [A]; logarithms are of [A, N'] terms."""
    for action in range(len(ends)):
        total = 0.0
        for term in range(ends[action]):
            total += terms[action, 1, term] * terms[action, 0, term] * logarithms[action, term]
        sums[action] += total
