"""What an object has in its registers, as far as it is known: soft tables, and how looks change them.

A table C, shape [..., P, S], has the probability that it is known of a register to hold a symbol. What is left,
v = 1 − Σ_s C(s), is the probability that the register has not been revealed yet; then it holds a symbol that the
object does not have elsewhere, or, with the rate κ, any symbol at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray

#: Keeps divisions by what can be zero in range.
TINY: Final = 1e-12
#: A table that a look would change by less than this stays as it is.
SAME: Final = 1e-6
#: Objects, and what they may have in their registers, are left out of what is predicted if less probable than this.
UNIMPORTANT: Final = 1e-6


def unrevealed(contents: FloatArray) -> FloatArray:
    """Return v of each register, shape [..., P]."""
    rest: FloatArray = np.maximum(1.0 - contents.sum(axis=-1), 0.0)
    return rest


def symbol_probabilities(contents: FloatArray, repeat: float) -> FloatArray:
    """Return the probability of each symbol in each register, shape [..., P, S].

    Args:
        contents: C, shape [..., P, S].
        repeat: κ.
    """
    absent = np.maximum(1.0 - contents, TINY)
    # Symbols that no other register is known to have; for a register half known its own table does not count.
    elsewhere = absent.prod(axis=-2, keepdims=True) / absent
    fresh = elsewhere / elsewhere.sum(axis=-1, keepdims=True)
    drawn = (1.0 - repeat) * fresh + repeat / contents.shape[-1]
    probabilities: FloatArray = contents + unrevealed(contents)[..., None] * drawn
    return probabilities


def distinctness(shown: Sequence[FloatArray], symbols: IntArray) -> FloatArray:
    """Return the probability that independent draws of each slot's symbol are all different, shape [R].

    Args:
        shown: For each slot the probability of each symbol, shape [R, S].
        symbols: Symbols of every pattern, shape [|𝒵|, J].
    """
    if len(shown) == 1:
        return np.ones(len(shown[0]))
    if len(shown) == 2:
        different = 1.0 - np.einsum("rs,rs->r", shown[0], shown[1])
    else:
        different = pattern_products(shown, symbols).sum(axis=1)
    result: FloatArray = np.maximum(different, TINY)
    return result


def pattern_products(shown: Sequence[FloatArray], symbols: IntArray) -> FloatArray:
    """Return Π_j shown_j(z_j) of every pattern z, shape [R, |𝒵|]; arguments are those of ``distinctness``."""
    product = shown[0][:, symbols[:, 0]]
    for slot, probabilities in enumerate(shown[1:], start=1):
        product = product * probabilities[:, symbols[:, slot]]
    return product


def reweigh(
    known: FloatArray, shown: FloatArray, posterior: FloatArray, taken: FloatArray, truth: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return tables of one register after evidence that did not show its symbol for certain, and what it revealed.

    Both are of shape [R, S]; the second is the probability that the register was unrevealed before, is so no longer,
    and has a symbol. The part of the evidence that is the same for all symbols says nothing about an
    unrevealed register, which stays so; what goes beyond it becomes known.

    Args:
        known: C of the register before, shape [R, S].
        shown: The probability of each of its symbols before, shape [R, S].
        posterior: The same given the evidence, shape [R, S].
        taken: The probability that another visible register has the symbol, shape [R, S]. That such a symbol is not
            here follows from the other register's table, and needs none here.
        truth: The probability that the look was not wrong, shape [R].
    """
    factor = posterior / np.maximum(shown, TINY)
    possible = (shown > TINY) & (taken < 0.5)
    common = np.where(possible, factor, np.inf).min(axis=1, initial=np.inf)
    common = np.where(np.isfinite(common), common, 0.0)[:, None]
    revealed = truth[:, None] * (shown - known) * np.maximum(factor - common, 0.0)
    return known + truth[:, None] * (known * factor - known) + revealed, revealed
