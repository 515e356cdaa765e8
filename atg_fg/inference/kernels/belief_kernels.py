"""The steps of a Bayes filter over object and aspect, and of its decision, each a loop over the hypotheses.

The symbols and the numbers are those of ``docs/model.md``: hypothesis h knows ``n_known[h]`` aspects, states 1 to n;
state 0 is its collection node. With α a transition row is a share of its base, and its edges. p(X_t | O) sums to one in
each row. Loops end at n; the rest of a row is padding.

Functions that Python calls take arrays and numbers in plain tuples: taking named ones apart would cost as much as a
step of a small memory does. Loops take them out of the tuples before they begin, since each access to a member counts
its users. This module loads Numba.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.kernels.compilation import NONE, compiled, compiled_within, written_out
from atg_fg.inference.kernels.table_kernels import SmallIntArray, count, weigh

#: In place of an action: nothing happened, or the trial begins.
REST: Final = -1
BEGIN: Final = -2

#: What a row leaves to its base is one less what its edges carry, unless less than this is left of the difference.
_LEAST_DIFFERENCE: Final = 0.05


class Constants(NamedTuple):
    """Numbers that are the same for all hypotheses: |G|, |𝒵|, α and δ."""

    n_aspects: int
    n_patterns: int
    concentration: float
    noise: float


@compiled
def move(tables: tuple[Any, ...], constants: tuple[Any, ...], aspects: FloatArray, action: int) -> None:
    """Replace p(X_t | O), shape [H, W], by Σ_x p(x | O) p(x' | x, a, O), or at the beginning by p(X_0 | O)."""
    n_known, _, begins, edges, counted, probability = tables
    n_aspects, _, concentration, _ = constants
    scratch = np.empty(64)
    for hypothesis in range(len(n_known)):
        n_states, first, last = n_known[hypothesis] + 1, 0, 0
        kept = 1.0
        if action >= 0:
            first, last = begins[hypothesis, action], begins[hypothesis, action + 1]
            if last - first > len(scratch):
                scratch = np.empty(2 * (last - first))
            for edge in range(first, last):
                carried = aspects[hypothesis, edges[edge, 1]] * probability[edge]
                scratch[edge - first] = carried
                kept -= carried
            if kept < _LEAST_DIFFERENCE:
                kept = _kept(aspects[hypothesis, :n_states], edges[first:last], counted[first:last], concentration)
        share = kept / n_aspects
        aspects[hypothesis, 0] = share * (n_aspects + 1 - n_states)
        for state in range(1, n_states):
            aspects[hypothesis, state] = share
        for edge in range(first, last):
            aspects[hypothesis, edges[edge, 0]] += scratch[edge - first]


@compiled_within
def _kept(aspects: FloatArray, edges: SmallIntArray, counted: FloatArray, concentration: float) -> float:
    """Return Σ_x p(x | O) α / (c + α) of one hypothesis and action, a sum of what may be very small."""
    totals = np.zeros(len(aspects))
    for edge in range(len(edges)):
        totals[edges[edge, 1]] += counted[edge]
    kept = 0.0
    for state in range(len(aspects)):
        kept += aspects[state] * (concentration / (totals[state] + concentration) if totals[state] > 0.0 else 1.0)
    return kept


@compiled
def step(
    tables: tuple[Any, ...],
    constants: tuple[Any, ...],
    belief: tuple[FloatArray, FloatArray, FloatArray],
    action: int,
    evidence: FloatArray,
    learned: tuple[int, int, int, int],
    shown: SmallIntArray,
) -> float:
    """Act, take in a look and learn from it; return ln p(z_t | z_0:t-1).

    If the look is impossible, that is −∞, and nothing but the action is done.

    Args:
        tables: ``Tables``, extended by what is learned; there is room for one more aspect and one more edge a row.
        constants: ``Constants``.
        belief: p(X | O), shape [H, W], ln p(O) and p(O), both of shape [H]; replaced by what they are after the look.
        action: What was done since the last look, ``REST`` or ``BEGIN``.
        evidence: Likelihood of each pattern, shape [|𝒵|].
        learned: What there is to learn: the pattern before, the action since then and the pattern seen now, −1 of what
            there is not; and the pattern that ``shown`` is about.
        shown: The state of each hypothesis that shows a pattern learned before, 0 if none does, shape [H]; replaced by
            that of the pattern learned now.
    """
    n_known, pattern = tables[0], tables[1]
    _, n_patterns, _, delta = constants
    aspects, log_identity, identity = belief
    n_hypotheses = len(n_known)
    if action != REST:
        move(tables, constants, aspects, action)
    allowed, weight, whole = 0, 0.0, NONE
    for each in range(n_patterns):
        if evidence[each] != 0.0:
            weight += evidence[each]
            allowed, whole = allowed + 1, each
    totals, rates, updated = np.empty(n_hypotheses), np.empty(n_hypotheses), np.empty(n_hypotheses)
    states = np.zeros(n_hypotheses, n_known.dtype)
    if allowed == 1:
        _explain_one(tables, constants, aspects, whole, weight, (totals, rates), states)
    else:
        whole = NONE
        _explain(tables, constants, aspects, evidence, (totals, rates))
    peak = -np.inf
    for hypothesis in range(n_hypotheses):
        log_total = np.log(totals[hypothesis]) if totals[hypothesis] > 0.0 else -np.inf
        updated[hypothesis] = log_identity[hypothesis] + log_total
        peak = max(peak, updated[hypothesis])
    if not np.isfinite(peak):
        return -np.inf
    total = 0.0
    for hypothesis in range(n_hypotheses):
        identity[hypothesis] = np.exp(updated[hypothesis] - peak)
        total += identity[hypothesis]
    log_probability = peak + np.log(total)
    observed, noise = 1.0 - delta, delta / n_patterns * weight
    for hypothesis in range(n_hypotheses):
        log_identity[hypothesis] = updated[hypothesis] - log_probability
        identity[hypothesis] /= total
        # A hypothesis that is ruled out keeps its prediction; its weight is zero from here on.
        if totals[hypothesis] > 0.0:
            scale, matching = 1.0 / totals[hypothesis], states[hypothesis]
            aspects[hypothesis, 0] *= (rates[hypothesis] + noise) * scale
            if whole >= 0:
                shows = aspects[hypothesis, matching] * ((observed * weight + noise) * scale)
                for state in range(1, n_known[hypothesis] + 1):
                    aspects[hypothesis, state] *= noise * scale
                if matching > 0:
                    aspects[hypothesis, matching] = shows
            else:
                for state in range(1, n_known[hypothesis] + 1):
                    aspects[hypothesis, state] *= (observed * evidence[pattern[hypothesis, state]] + noise) * scale
    if learned[2] >= 0:
        _learn(tables, constants, aspects, learned, states, whole == learned[2], shown)
    return float(log_probability)


@written_out
def _learn(
    tables: tuple[Any, ...],
    constants: tuple[Any, ...],
    aspects: FloatArray,
    learned: tuple[int, int, int, int],
    states: SmallIntArray,
    is_known: bool,
    shown: SmallIntArray,
) -> None:
    """Extend every hypothesis by a look, and divide the belief of its collection node.

    ``states`` shows the pattern seen now if ``is_known``; for the rest see ``step``.
    """
    n_known, pattern, begins, edges, counted, probability = tables
    n_aspects, n_patterns, concentration, delta = constants
    before, action, seen, shown_before = learned
    noise = delta / n_patterns
    for hypothesis in range(len(n_known)):
        n_own, source = n_known[hypothesis], 0
        if before >= 0:
            source = shown[hypothesis] if before == shown_before else _state_showing(pattern, hypothesis, n_own, before)
        target = states[hypothesis] if is_known else _state_showing(pattern, hypothesis, n_own, seen)
        if target == 0 and n_own < n_aspects:
            target = n_own + 1
            truth = (1.0 - delta) / (n_patterns - n_own)
            revealed = aspects[hypothesis, 0] * (1.0 if target == n_aspects else truth / (truth + noise))
            n_known[hypothesis] = target
            pattern[hypothesis, target] = seen
            aspects[hypothesis, target] = revealed
            aspects[hypothesis, 0] -= revealed
            if before == seen:
                source = target
        if source > 0 and target > 0:
            count(edges, counted, probability, begins, hypothesis, source, action, target, 1.0)
            weigh(edges, counted, probability, begins, hypothesis, source, action, concentration)
        shown[hypothesis] = target


@compiled_within
def _state_showing(patterns: SmallIntArray, hypothesis: int, n_own: int, wanted: int) -> int:
    """Return which state of a hypothesis shows a pattern, 0 if none does."""
    found = 0
    for state in range(1, n_own + 1):
        if patterns[hypothesis, state] == wanted:
            found = state
    return found


@written_out
def _explain_one(
    tables: tuple[Any, ...],
    constants: tuple[Any, ...],
    aspects: FloatArray,
    wanted: int,
    weight: float,
    filled: tuple[FloatArray, FloatArray],
    states: SmallIntArray,
) -> None:
    """Fill in p(z | O), what the collection node adds to the noise, and the state that shows the only pattern."""
    n_known, pattern = tables[0], tables[1]
    n_aspects, n_patterns, _, delta = constants
    totals, rates = filled
    observed, noise = (1.0 - delta) * weight, delta / n_patterns * weight
    for hypothesis in range(len(n_known)):
        n_own = n_known[hypothesis]
        state, rate, total = _state_showing(pattern, hypothesis, n_own, wanted), 0.0, noise
        if state > 0:
            total += aspects[hypothesis, state] * observed
        elif n_own < n_aspects:
            rate = observed / (n_patterns - n_own)
            total += aspects[hypothesis, 0] * rate
        states[hypothesis], totals[hypothesis], rates[hypothesis] = state, total, rate


@written_out
def _explain(
    tables: tuple[Any, ...],
    constants: tuple[Any, ...],
    aspects: FloatArray,
    evidence: FloatArray,
    filled: tuple[FloatArray, FloatArray],
) -> None:
    """Fill in p(z | O), and what the collection node adds to the noise, for evidence that allows any patterns."""
    n_known, pattern = tables[0], tables[1]
    n_aspects, n_patterns, _, delta = constants
    totals, rates = filled
    observed, noise = 1.0 - delta, delta / n_patterns * evidence.sum()
    support = np.flatnonzero(evidence)
    last_knowing = np.full(n_patterns, -1, np.int64)
    for hypothesis in range(len(n_known)):
        total = noise
        for state in range(1, n_known[hypothesis] + 1):
            shows = pattern[hypothesis, state]
            last_knowing[shows] = hypothesis
            total += aspects[hypothesis, state] * (observed * evidence[shows])
        rate = 0.0
        if n_known[hypothesis] < n_aspects:
            # A sum, not a difference of sums: it may be nothing, exactly.
            for each in support:
                if last_knowing[each] != hypothesis:
                    rate += evidence[each]
            rate *= observed / (n_patterns - n_known[hypothesis])
        totals[hypothesis], rates[hypothesis] = total + aspects[hypothesis, 0] * rate, rate
