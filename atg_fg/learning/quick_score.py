"""How well structures fit trials, for thousands of candidates at once; quick and rough, to guide the search.

Under a structure the actions alone say which register is in view at each look, if none of them slips. An object that
follows the structure has one symbol in each register, and each symbol in one register. So a trial is explained well if
its looks make few different pairs of register and symbol: no more than registers seen, no more than symbols seen.
Where an action is irreversible, it may have been taken before the trial; then it is where the trial begins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import MISSING, FloatArray, IntArray
from atg_fg.learning.raw_trials import RawTrial, side_by_side

#: Nats that each pair costs that a register or a symbol has too many; about what a wrong look in one slot costs.
PAIR_COST: Final = 6.0


class QuickScore:
    """Scores many candidate structures on the same N trials.

    Args:
        trials: At least one.
        assumptions: Actions and alphabet.

    Attributes:
        plain: The like score of each trial for an object that follows no structure, shape [N].
    """

    def __init__(self, trials: Sequence[RawTrial], assumptions: Assumptions) -> None:
        alphabet = assumptions.alphabet
        arrays = side_by_side(trials)
        symbols = arrays.symbols.transpose(1, 0, 2)  # time first, as the poses are made
        self._n_trials, self._n_slots, self._n_symbols = len(trials), len(alphabet.slots), alphabet.n_symbols
        # Where a trial has ended nothing moves: an action of its own, the identity, after all others.
        self._actions: IntArray = np.where(arrays.actions < 0, len(assumptions.actions), arrays.actions).T
        self._seen = np.flatnonzero(symbols.ravel() != MISSING)
        self._symbols = symbols.ravel()[self._seen]
        self._n_shown = np.array([len({s for look in t.detections for s in look} - {None}) for t in trials])
        logarithms = np.log(np.maximum(self._n_symbols - np.arange(self._n_symbols), 1))
        #: ln of the ways to put different symbols into r registers; no more cost where registers outnumber symbols
        self._log_contents = np.concatenate(([0.0], np.cumsum(logarithms)))
        patterns = [len({look for look in trial.detections if None not in look}) for trial in trials]
        self.plain: FloatArray = -math.log(len(alphabet)) * np.array(patterns)

    def from_any_start(self, sources: IntArray) -> FloatArray:
        """Return the score of each trial from its best start: as it is, or after an irreversible action, [B, N].

        Args:
            sources: Of each candidate's actions, shape [B, A, P].
        """
        n_candidates, _, n_registers = sources.shape
        candidate, action = np.nonzero(loses_content(sources))
        rows = np.concatenate((np.arange(n_candidates), candidate))
        upright = np.broadcast_to(np.arange(n_registers), (n_candidates, n_registers))
        scores = self(sources[rows], np.concatenate((upright, sources[candidate, action])))
        best = scores[:n_candidates]
        np.maximum.at(best, candidate, scores[n_candidates:])
        return best

    def __call__(self, sources: IntArray, start: IntArray | None = None) -> FloatArray:
        """Return the score of each trial under each of B structures, about ln p(trial), shape [B, N].

        Args:
            sources: Of each candidate's actions, shape [B, A, P].
            start: The register at each place when a trial begins, shape [B, P]; each at its own if not given.
        """
        n_candidates, _, n_registers = sources.shape
        n_cells = n_candidates * self._n_trials * n_registers
        if start is None:
            start = np.broadcast_to(np.arange(n_registers), (n_candidates, n_registers))
        visible = self._visible(sources, start).reshape(n_candidates, -1)[:, self._seen]
        pairs = np.zeros((n_cells, self._n_symbols), dtype=bool)
        pairs.reshape(-1)[visible * self._n_symbols + self._symbols] = True
        shape = (n_candidates, self._n_trials)
        n_pairs = np.count_nonzero(pairs.reshape(math.prod(shape), -1), axis=1).reshape(shape)
        n_registers_seen = pairs.any(axis=1).reshape(*shape, n_registers).sum(axis=2)
        excess = (n_pairs - n_registers_seen) + (n_pairs - self._n_shown)
        revealed = np.minimum(n_registers_seen, self._n_symbols)
        score: FloatArray = -self._log_contents[revealed] - PAIR_COST * excess
        return score

    def _visible(self, sources: IntArray, start: IntArray) -> IntArray:
        """Return the register in view, counted over all candidates and trials, shape [B, T + 1, N, J]."""
        n_candidates, _, n_registers = sources.shape
        identity = np.broadcast_to(np.arange(n_registers), (n_candidates, 1, n_registers))
        sources = np.concatenate((sources, identity), axis=1)
        n_poses = n_candidates * self._n_trials
        poses = np.arange(n_poses * n_registers).reshape(n_candidates, self._n_trials, n_registers)
        first = poses[:, :, :1]
        poses = first + start[:, None, :]
        visible = np.empty((n_candidates, len(self._actions) + 1, self._n_trials, self._n_slots), dtype=np.int64)
        visible[:, 0] = poses[:, :, : self._n_slots]
        for time, actions in enumerate(self._actions):
            poses = poses.reshape(-1)[first + sources[:, actions]]
            visible[:, time + 1] = poses[:, :, : self._n_slots]
        return visible


def loses_content(sources: IntArray) -> np.ndarray:
    """Return which of the candidates' actions are no permutations, shape [B, A]; argument as above, shape [B, A, P]."""
    lost: np.ndarray = (np.sort(sources, axis=2) != np.arange(sources.shape[2])).any(axis=2)
    return lost
