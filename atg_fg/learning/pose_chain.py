"""A trial of objects that follow a structure as a chain whose aspects are the poses: the factor graph of a structure.

Given what the registers contain, the pose and which actions failed when they were last done are all there is to know:
these are X_t, an action turns the pose or slips, and a look shows the contents of the registers in view. So the tables
are those of any other recognition trial, and ``RecognitionGraph`` takes them as they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from atg_fg.core.actions import AnyAction, UncertainAction, mixed
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.inference.chain import Chain
from atg_fg.inference.history import History
from atg_fg.learning import register_contents
from atg_fg.learning.rates import Rates
from atg_fg.learning.shared_structure import Poses

#: Poses times sets of failed actions that a chain may have.
MAX_STATES: Final = 2_000


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
    """Return the chain of a trial: O is which of H objects it is, X_s the pose and which actions failed.

    State f · G + g is pose g of G, and bit k of f says whether the action at place k of ``repeated_actions`` failed
    when it was last done; f is 0 throughout if that makes no difference. It is exact for objects whose contents are
    known, as long as there is room for all repeated actions; to the others it makes no difference whether they failed.
    Registers that are not known count as drawn anew at each look.

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
    repeated = [] if rates.slip_again is None else repeated_actions(history.actions, n_poses)
    n_states = n_poses * 2 ** len(repeated)
    shown = np.tile(pose_patterns(poses, contents, rates, alphabet), (1, n_states // n_poses, 1))
    turns = [_transition(poses, action, rates, repeated) for action in range(poses.successors.shape[1])]
    initial = np.zeros((n_objects, n_states))
    initial[:, :n_poses] = 1.0 / n_poses
    return Chain(
        prior,
        initial,
        tuple(
            np.broadcast_to(mixed(action, turns.__getitem__, np.eye(n_states)), (n_objects, n_states, n_states))
            for action in history.actions
        ),
        tuple(
            (1.0 - rates.wrong) * (shown @ evidence.likelihood)
            + rates.wrong / len(alphabet) * evidence.likelihood.sum()
            for evidence in history.evidence
        ),
    )


def repeated_actions(actions: Sequence[AnyAction], n_poses: int) -> list[int]:
    """Return the actions that may have been done more than once, as many as there is room for, most frequent first."""
    done = Counter(
        each
        for action in actions
        for each in (dict(action.chances) if isinstance(action, UncertainAction) else [action])
    )
    repeated = [action for action, times in done.most_common() if times > 1]
    return repeated[: (MAX_STATES // n_poses).bit_length() - 1]


def _transition(poses: Poses, action: int, rates: Rates, repeated: Sequence[int]) -> FloatArray:
    """Return p(next state | state, action), shape [F · G, F · G]."""
    n_poses, n_failed = len(poses.successors), 2 ** len(repeated)
    own = 1 << repeated.index(action) if action in repeated else 0
    table, pose = np.zeros((n_failed, n_poses, n_failed, n_poses)), np.arange(n_poses)
    for failed in range(n_failed):
        slip = rates.slips[bool(failed & own)]
        table[failed, pose, failed & ~own, poses.successors[:, action]] += 1.0 - slip
        table[failed, pose, failed | own, pose] += slip
    return table.reshape(n_failed * n_poses, -1)
