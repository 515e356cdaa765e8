"""Loops that predict what poses show after actions, compiled: rows are many and short."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import NONE, compiled, compiled_within
from atg_fg.learning.pose_kernels import Rows, different, importance_of
from atg_fg.learning.rates import FAILED
from atg_fg.learning.register_contents import TINY, UNIMPORTANT


@compiled
def patterns_after(
    rows: Rows,
    shown: FloatArray,
    structure: tuple[IntArray, IntArray, FloatArray],
    symbols: IntArray,
    log_evidence: FloatArray,
    log_weights: FloatArray,
    slips: tuple[float, float],
    wrong: float,
) -> tuple[IntArray, FloatArray]:
    """Return the owners that matter, shape [I], and p(pattern shown after an action | owner), shape [A, I, |𝒵|].

    Args:
        rows: What is believed.
        shown: The probability of each symbol in each register of each table, shape [K, P, S].
        structure: Successors of each pose [P', A], the register in each slot of each pose [P', J], and 1 where these
            are different, else 0, of each pose [P'].
        symbols: Of every pattern, shape [|𝒵|, J].
        log_evidence: ln p(what was seen | owner), shape [H].
        log_weights: ln of the weight of each owner, shape [H]; of shape [0] if each is a trial of its own.
        slips: ε and ε′, the probabilities that an action leaves the pose as it is.
        wrong: Probability that a look shows any pattern.
    """
    owner, _, pose, weight, table, events = rows
    successors, registers, possible = structure
    n_actions, n_patterns, importance = successors.shape[1], len(symbols), importance_of(log_evidence, log_weights)
    # Loops: expressions of whole arrays take longer to compile than all of this.
    total, n_owners = np.zeros(len(log_evidence)), 0
    for row in range(len(owner)):
        if weight[row] * importance[owner[row]] > UNIMPORTANT:
            total[owner[row]] += weight[row]
    owners, number = np.empty(len(total), np.int64), np.empty(len(total), np.int64)
    for each in range(len(total)):
        if total[each] > 0:
            owners[n_owners], number[each] = each, n_owners
            n_owners += 1
    result, now, after = np.zeros((n_actions, n_owners, n_patterns)), np.empty(n_patterns), np.empty(n_patterns)
    for row in range(len(owner)):
        if not weight[row] * importance[owner[row]] > UNIMPORTANT:
            continue
        of, own, share = shown[table[row]], number[owner[row]], weight[row] / total[owner[row]]
        fill_patterns(of, registers[pose[row]], symbols, share * possible[pose[row]], now)
        for action in range(n_actions):
            failed_before, target = events[row, FAILED + action], successors[pose[row], action]
            slip = (1.0 - failed_before) * slips[0] + failed_before * slips[1]
            fill_patterns(of, registers[target], symbols, share * possible[target], after)
            for pattern in range(n_patterns):
                result[action, own, pattern] += (1.0 - slip) * after[pattern] + slip * now[pattern]
    for action in range(n_actions):
        for own in range(n_owners):
            for pattern in range(n_patterns):
                result[action, own, pattern] = (1.0 - wrong) * result[action, own, pattern] + wrong / n_patterns
    return owners[:n_owners], result


@compiled
def add_joint(
    table: FloatArray, hypotheses: IntArray, belief: FloatArray, owners: IntArray, patterns: FloatArray
) -> None:
    """Add p(O = i, kind, z | a) to a table of some hypotheses, shape [A, I, |𝒵|].

    Args:
        table: Changed in place.
        hypotheses: Whose rows it has, shape [I].
        belief: p(O, kind), shape [H].
        owners: Hypotheses that may be of the kind, shape [N].
        patterns: p(next pattern | action, owner), shape [A, N, |𝒵|].
    """
    place = np.full(len(belief), NONE)
    for row in range(len(hypotheses)):
        place[hypotheses[row]] = row
    for number in range(len(owners)):
        row, share = place[owners[number]], belief[owners[number]]
        if row >= 0:
            for action in range(len(table)):
                for pattern in range(table.shape[2]):
                    table[action, row, pattern] += share * patterns[action, number, pattern]


@compiled_within
def fill_patterns(
    shown: FloatArray, in_view: IntArray, symbols: IntArray, share: float, probabilities: FloatArray
) -> None:
    """Fill in a share of the probability of every pattern where some registers are in view."""
    factor = share / max(different(shown, in_view), TINY)
    for pattern in range(len(symbols)):
        probabilities[pattern] = factor
        for slot in range(symbols.shape[1]):
            probabilities[pattern] *= shown[in_view[slot], symbols[pattern, slot]]
