"""The belief in one trial under one chain: which object it is, in which state, and what it has in its registers.

Kept is a set of paths: the states that the trial has gone through from one start, with or without slips. Given a path,
what the looks say is a likelihood of each register alone, so that p(looks, path | object) = Π_r Σ_c C(r, c) L(r, c) is
exact. Paths that become negligible are dropped.
"""

from __future__ import annotations

import copy
from typing import Final

import numpy as np

from atg_fg.core.actions import AnyAction, UncertainAction
from atg_fg.core.log_math import log_sum_exp
from atg_fg.core.patterns import Evidence, FloatArray, IntArray, PatternAlphabet
from atg_fg.learning.detector_noise import MOST_CERTAIN, DetectorNoise
from atg_fg.learning.evidence_learner import BelievedChain

#: Paths less probable than this, whatever the object, are dropped, and so are those beyond this number.
NEGLIGIBLE: Final = 1e-7
MAX_PATHS: Final = 256
#: Paths less probable than this are left out of what is predicted for planning.
UNIMPORTANT: Final = 1e-5


class PathFilter:
    """Filters K + 1 objects, *new* last, that are rivals for one trial.

    Args:
        chain: What is believed of them.
        noise: Of the detector.
        alphabet: The patterns.
        log_weights: ln p(object) when the trial begins, shape [K + 1]; −∞ of those that are out of the question.
    """

    def __init__(
        self, chain: BelievedChain, noise: DetectorNoise, alphabet: PatternAlphabet, log_weights: FloatArray
    ) -> None:
        self._chain, self._noise, self._alphabet, self.log_weights = chain, noise, alphabet, log_weights
        n_states, n_registers = len(chain.registers), chain.tables.shape[1]
        self._states = np.arange(n_states)[:, None]
        self._local = np.ones((n_states, n_registers, alphabet.n_symbols))
        self._log_prior = np.full(n_states, -np.log(n_states))
        #: ln Σ_c C(r, c) L(r, c), shape [B, R, K + 1]
        self._factors = np.zeros((n_states, n_registers, len(log_weights)))
        #: p(label | symbol) of a label without a confidence, shape [V, V]
        self._labels = noise.wrong * noise.confusion + (1.0 - noise.wrong) * np.eye(alphabet.n_symbols)
        #: Once asked for after a step: ln p(path, what was seen | object), shape [B, K + 1], and its total over paths
        self._joint: FloatArray | None = None
        self._log_evidence: FloatArray | None = None

    def copy(self) -> PathFilter:
        """Return a filter that goes on alone from here."""
        twin = copy.copy(self)
        # All else is replaced at each step rather than changed.
        twin._local, twin._factors, twin._log_prior = self._local.copy(), self._factors.copy(), self._log_prior.copy()
        return twin

    @property
    def log_evidence(self) -> FloatArray:
        """Ln p(what was seen | object), shape [K + 1]."""
        if self._log_evidence is None:
            logarithms = self._log_joint
            peak = logarithms.max(axis=0)
            self._log_evidence = peak + np.log(np.exp(logarithms - peak).sum(axis=0))
        return self._log_evidence

    @property
    def _log_joint(self) -> FloatArray:
        if self._joint is None:
            self._joint = self._log_prior[:, None] + self._factors.sum(axis=1)
        return self._joint

    def act(self, action: AnyAction) -> None:
        """Take in an action: each path goes on, and leaves another behind for a slip.

        Where it is not sure what was done, each path goes on in all ways that are possible.
        """
        self._joint = self._log_evidence = None
        if isinstance(action, UncertainAction):
            self._act_uncertainly(action)
            return
        states, slip = self._states, self._chain.slip
        moved = np.concatenate((states, self._chain.successors[action, states[:, -1]][:, None]), axis=1)
        stayed = np.concatenate((states, states[:, -1:]), axis=1)
        # Where an action leads nowhere a slip makes no difference.
        differs = moved[:, -1] != stayed[:, -1]
        self._log_prior = np.concatenate(
            (self._log_prior + np.where(differs, np.log1p(-slip), 0.0), self._log_prior[differs] + np.log(slip))
        )
        self._states = np.concatenate((moved, stayed[differs]))
        self._local = np.concatenate((self._local, self._local[differs]))
        self._factors = np.concatenate((self._factors, self._factors[differs]))

    def _act_uncertainly(self, action: UncertainAction) -> None:
        """Let each path go on by each action that may have been done, each with its slip, and stay if it may."""
        before, slip = self._states, self._chain.slip
        ways = [
            (self._chain.successors[index, before[:, -1]], chance * (1.0 - slip)) for index, chance in action.chances
        ]
        ways.append((before[:, -1], action.stays + slip * sum(chance for _, chance in action.chances)))
        ways = [(end, chance) for end, chance in ways if chance > 0]
        self._states = np.concatenate([np.concatenate((before, end[:, None]), axis=1) for end, _ in ways])
        self._log_prior = np.concatenate([self._log_prior + np.log(chance) for _, chance in ways])
        self._local, self._factors = (np.concatenate([each] * len(ways)) for each in (self._local, self._factors))

    def observe(self, evidence: Evidence) -> None:
        """Take in a look, as labels if it is a detection, else as a likelihood of each slot's symbol."""
        from atg_fg.learning import path_kernels  # they load Numba

        self._joint = self._log_evidence = None
        if evidence.detection is None and not evidence.slots:
            likelihood = self._alphabet.slot_likelihoods(evidence.likelihood)
        else:
            likelihood = label_likelihoods(self._noise, evidence)
        for slot, weights in enumerate(evidence.slots):
            if weights is not None:
                likelihood[slot] = MOST_CERTAIN * np.array(weights) + (1.0 - MOST_CERTAIN) * np.mean(weights)
        in_view = self._chain.registers[self._states[:, -1]]
        path_kernels.take_in(likelihood, in_view, self._chain.tables, (self._log_prior, self._local, self._factors))
        self._drop()

    def observe_pattern(self, symbols: IntArray) -> None:
        """Take in a look whose labels, shape [J], came without confidences."""
        self.observe(Evidence(np.zeros(0), None, tuple(symbols.tolist())))

    def _drop(self) -> None:
        best = (self._log_joint + self.log_weights).max(axis=1)
        order = np.argsort(-best, kind="stable")[:MAX_PATHS]
        kept = np.sort(order[best[order] > best.max() + np.log(NEGLIGIBLE)])
        if len(kept) < len(best):
            self._states, self._local = self._states[kept], self._local[kept]
            self._log_prior, self._factors = self._log_prior[kept], self._factors[kept]
            self._joint = self._log_joint[kept]

    def predicted_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the owners that matter, shape [I], and p(next pattern | action, owner) of each, shape [A, I, |𝒵|]."""
        paths, owners, weights = self._pairs()
        last, slip, successors = self._states[:, -1], self._chain.slip, self._chain.successors
        states = np.array([*(of_action[last] for of_action in successors), last])
        chances = np.array([*[1.0 - slip] * len(successors), slip])
        shown = self._shown(paths, owners, states, weights * chances[:, None])
        return np.unique(owners), shown[:-1] + shown[-1]

    def shown_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the owners that matter, shape [I], and p(pattern shown now | owner) of each, shape [I, |𝒵|]."""
        paths, owners, weights = self._pairs()
        (shown,) = self._shown(paths, owners, self._states[None, :, -1], weights[None], self._unblurred)
        return np.unique(owners), shown

    def smoothed_patterns(self, owner: int) -> list[FloatArray]:
        """Return p(pattern shown at time s | owner, all evidence) of every time s, each of shape [|𝒵|]."""
        weights = self._given(owner)
        paths = np.flatnonzero(weights > UNIMPORTANT)
        owners, n_looks = np.full(len(paths), owner), self._states.shape[1]
        shares = np.tile(weights[paths] / weights[paths].sum(), (n_looks, 1))
        return list(self._shown(paths, owners, self._states.T, shares, self._unblurred)[:, 0])

    def right_labels(self, owner: int, looks: list[Evidence]) -> list[tuple[float | None, ...]]:
        """Return p(label is right | owner, all evidence) of each slot at each look, ``None`` where none was seen."""
        weights, result = self._given(owner), []
        posterior = self._chain.tables[owner] * self._local
        posterior /= np.maximum(posterior.sum(axis=2, keepdims=True), np.finfo(float).tiny)
        paths = np.arange(len(weights))
        for states, look in zip(self._states.T, looks, strict=False):
            entry: list[float | None] = []
            for slot, label in enumerate(look.detection or ()):
                register = self._chain.registers[states, slot]
                entry.append(None if label is None else float(weights @ posterior[paths, register, label]))
            result.append(tuple(entry))
        return result

    def poses_of(self, owner: int) -> dict[int, float]:
        """Return the probability of each state of an owner that is not negligible."""
        states = np.bincount(self._states[:, -1], self._given(owner), len(self._chain.registers))
        return {state: float(states[state]) for state in np.flatnonzero(states > NEGLIGIBLE).tolist()}

    def learned_contents(self, owner: int) -> FloatArray:
        """Return p(symbol in a register) of an owner given its most probable path, shape [R, V]."""
        contents = self._chain.tables[owner] * self._local[int(self._given(owner).argmax())]
        result: FloatArray = contents / contents.sum(axis=1, keepdims=True)
        return result

    @property
    def _unblurred(self) -> FloatArray:
        return np.eye(len(self._labels))

    def _given(self, owner: int) -> FloatArray:
        """Return p(path | owner, what was seen), shape [B]."""
        logarithms = self._log_prior + self._factors[:, :, owner].sum(axis=1)
        weights: FloatArray = np.exp(logarithms - log_sum_exp(logarithms))
        return weights

    def _pairs(self) -> tuple[IntArray, IntArray, FloatArray]:
        """Return the paths and owners that matter, ordered by owner, and p(path | owner, what was seen) of each."""
        joint = self._log_joint + self.log_weights
        probability = np.exp(joint - log_sum_exp(joint.ravel()))
        owners, paths = np.nonzero(probability.T > UNIMPORTANT)
        weights = probability[paths, owners]
        total = np.bincount(owners, weights)
        return paths, owners, weights / total[owners]

    def _shown(
        self, paths: IntArray, owners: IntArray, states: IntArray, weights: FloatArray, labels: FloatArray | None = None
    ) -> FloatArray:
        """Return Σ weight · p(pattern) of each owner after each move, shape [M, I, |𝒵|].

        Args:
            paths: Of each pair, shape [Q].
            owners: Of each pair, ascending, shape [Q].
            states: In which each path is after each move, shape [M, B].
            weights: Of each pair after each move, shape [M, Q].
            labels: p(label | symbol), shape [V, V]; as a detector's without confidences if not given.
        """
        from atg_fg.learning import path_kernels  # they load Numba

        blurred = self._labels if labels is None else labels
        result: FloatArray = path_kernels.patterns_shown(
            (np.ascontiguousarray(paths), np.ascontiguousarray(owners)),
            (self._chain.tables, self._local),
            np.ascontiguousarray(self._chain.registers[states]),
            weights,
            blurred,
            self._alphabet.symbols,
        )
        return result


def label_likelihoods(noise: DetectorNoise, evidence: Evidence) -> FloatArray:
    """Return p(label | symbol) of the labels of a detection, 1 where none was seen, shape [J, V]."""
    detection = evidence.detection or ()
    labels = np.array([-1 if label is None else label for label in detection])
    stated = evidence.confidences or (None,) * len(detection)
    confidences = np.array([np.nan if value is None else value for value in stated])
    scaled = noise.likelihoods(labels, confidences)
    result: FloatArray = np.where(labels[:, None] >= 0, scaled / scaled.shape[1], 1.0)
    return result
