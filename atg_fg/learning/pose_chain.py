"""A trial of objects that follow a structure as a chain whose aspects are the poses: the factor graph of a structure.

Given what the registers contain, the pose is all there is to know: X_t is the pose, an action turns it or slips, and a
look shows the contents of the registers in view. So the tables are those of any other recognition trial, and
``RecognitionGraph`` takes them as they are.
"""

from __future__ import annotations

import numpy as np

from atg_fg.core.actions import mixed
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.inference.chain import Chain
from atg_fg.inference.history import History
from atg_fg.learning import register_contents
from atg_fg.learning.rates import Rates
from atg_fg.learning.shared_structure import Poses


def pose_patterns(poses: Poses, contents: FloatArray, rates: Rates, alphabet: PatternAlphabet) -> FloatArray:
    """Return p(pattern | pose, contents) without wrong looks, shape [H, G, |𝒵|].

    Args:
        poses: Of the structure.
        contents: Of H objects, shape [H, P, S].
        rates: Of them κ is used, where a register is not known for certain.
        alphabet: The patterns.
    """
    shown = register_contents.symbol_probabilities(contents, rates.repeat)
    in_view = poses.registers[:, : len(alphabet.slots)]
    by_slot = [shown[:, registers].reshape(-1, alphabet.n_symbols) for registers in in_view.T]
    different = register_contents.distinctness(by_slot, alphabet.symbols)
    patterns: FloatArray = register_contents.pattern_products(by_slot, alphabet.symbols) / different[:, None]
    possible = poses.possible(len(alphabet.slots))[:, None]
    return patterns.reshape(len(contents), len(poses.registers), len(alphabet)) * possible


def pose_chain(
    poses: Poses, contents: FloatArray, prior: FloatArray, rates: Rates, alphabet: PatternAlphabet, history: History
) -> Chain:
    """Return the chain of a trial: O is which of H objects it is, X_s the pose.

    It is exact for objects whose contents are known. Registers that are not known count as drawn anew at each look.

    Args:
        poses: Of the structure.
        contents: Of the objects, shape [H, P, S].
        prior: p(O), shape [H].
        rates: Slip, wrong looks and repeated symbols.
        alphabet: The patterns.
        history: What was seen and done; at least one look.
    """
    if not history.evidence:
        raise InvalidInputError("trial: nothing observed yet; expected a first observation")
    n_objects, n_poses = len(contents), len(poses.registers)
    shown = pose_patterns(poses, contents, rates, alphabet)
    turns = [_transition(poses, action, rates.slip) for action in range(poses.successors.shape[1])]
    return Chain(
        prior,
        np.full((n_objects, n_poses), 1.0 / n_poses),
        tuple(
            np.broadcast_to(mixed(action, turns.__getitem__, np.eye(n_poses)), (n_objects, n_poses, n_poses))
            for action in history.actions
        ),
        tuple(
            (1.0 - rates.wrong) * (shown @ evidence.likelihood)
            + rates.wrong / len(alphabet) * evidence.likelihood.sum()
            for evidence in history.evidence
        ),
    )


def _transition(poses: Poses, action: int, slip: float) -> FloatArray:
    """Return p(next pose | pose, action), shape [G, G]."""
    table = slip * np.eye(len(poses.successors))
    table[np.arange(len(table)), poses.successors[:, action]] += 1.0 - slip
    return table
