"""Loops of the filter over paths, compiled: its paths are few, and what each may show next is many short sums."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled

_LEAST = np.finfo(np.float64).tiny


@compiled
def take_in(
    looks: FloatArray, in_view: IntArray, tables: FloatArray, paths: tuple[FloatArray, FloatArray, FloatArray]
) -> None:
    """Take in a look along each path.

    Args:
        looks: Likelihood of each symbol in each slot, shape [J, V].
        in_view: The register in each slot at the end of each path, shape [B, J].
        tables: p(symbol in a register) of each owner, shape [K + 1, R, V].
        paths: ln of the weight of each [B], what the trial says of each register on it, of which the scale is in the
            weight [B, R, V], and ln Σ_c of that times the table of each owner [B, R, K + 1]; changed in place.
    """
    log_prior, local, factors = paths
    for path in range(len(in_view)):
        for slot in range(len(looks)):
            said, peak = local[path, in_view[path, slot]], _LEAST
            for symbol in range(len(said)):
                said[symbol] *= looks[slot, symbol]
                peak = max(peak, said[symbol])
            # The scale is in the path's own weight, so that products of many looks stay in range.
            log_prior[path] += np.log(peak)
            for symbol in range(len(said)):
                said[symbol] /= peak
            for owner in range(len(tables)):
                total = 0.0
                for symbol in range(len(said)):
                    total += tables[owner, in_view[path, slot], symbol] * said[symbol]
                factors[path, in_view[path, slot], owner] = np.log(max(total, _LEAST))


@compiled
def patterns_shown(
    pairs: tuple[IntArray, IntArray],
    contents: tuple[FloatArray, FloatArray],
    in_view: IntArray,
    weights: FloatArray,
    labels: FloatArray,
    symbols: IntArray,
) -> FloatArray:
    """Return Σ weight · p(pattern) of each owner after each of some moves, shape [M, I, |𝒵|].

    Args:
        pairs: Paths, and owners of them, ascending, both of shape [Q].
        contents: p(symbol in a register) of each owner [K + 1, R, V], and what the trial says of it on each path,
            shape [B, R, V].
        in_view: The register in each slot after each move of each path, shape [M, B, J].
        weights: Of each pair after each move, shape [M, Q].
        labels: p(label | symbol), shape [V, V].
        symbols: Of every pattern, shape [|𝒵|, J].
    """
    paths, owners = pairs
    tables, local = contents
    n_registers, n_symbols = tables.shape[1:]
    number, n_owners = np.empty(len(owners), np.int64), 0
    for pair in range(len(owners)):
        n_owners += pair == 0 or owners[pair] != owners[pair - 1]
        number[pair] = n_owners - 1
    result = np.zeros((len(in_view), n_owners, len(symbols)))
    shown, product = np.empty((n_registers, n_symbols)), np.empty(len(symbols))
    for pair in range(len(owners)):
        owner, path = owners[pair], paths[pair]
        for register in range(n_registers):
            total = 0.0
            for symbol in range(n_symbols):
                shown[register, symbol] = 0.0
                total += tables[owner, register, symbol] * local[path, register, symbol]
            for symbol in range(n_symbols):
                share = tables[owner, register, symbol] * local[path, register, symbol] / max(total, _LEAST)
                for label in range(n_symbols):
                    shown[register, label] += share * labels[symbol, label]
        for move in range(len(in_view)):
            total = 0.0
            for pattern in range(len(symbols)):
                product[pattern] = 1.0
                for slot in range(symbols.shape[1]):
                    product[pattern] *= shown[in_view[move, path, slot], symbols[pattern, slot]]
                total += product[pattern]
            for pattern in range(len(symbols)):
                result[move, number[pair], pattern] += weights[move, pair] / max(total, _LEAST) * product[pattern]
    return result
