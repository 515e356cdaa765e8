"""The objects of each kind in a trial, with the filter of that kind, a weight of each object, and what was seen.

A kind is a structure that is believed in, a chain of samples, or plain ATGs whose actions are uncertain, beside those
whose are not.
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from typing import Generic, Self, TypeVar

import numpy as np

from atg_fg.core.log_math import log_of
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence, FloatArray, IntArray, PatternAlphabet
from atg_fg.inference.belief_components import LEAST_PROBABILITY, BeliefComponent, components_of
from atg_fg.inference.chain import Chain, build_chain, forward_backward
from atg_fg.inference.history import History
from atg_fg.inference.interface import Inference
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.learning.believed_structure import BelievedStructure
from atg_fg.learning.completion import most_probable_patterns, pose_graph
from atg_fg.learning.evidence_learner import BelievedChain
from atg_fg.learning.object_kinds import words_of_noise, words_of_structure
from atg_fg.learning.path_filter import PathFilter
from atg_fg.learning.plain_evidence import PlainNoise
from atg_fg.learning.plain_filter import PlainFilter
from atg_fg.learning.pose_chain import pose_chain, pose_patterns
from atg_fg.learning.pose_filter import PoseFilter
from atg_fg.learning.rates import Rates
from atg_fg.learning.shared_structure import Poses
from atg_fg.learning.structured_memory import StructuredMemory

FilterT = TypeVar("FilterT", bound=PoseFilter | PathFilter | PlainFilter)
PosesT = TypeVar("PosesT", bound=PoseFilter | PathFilter)


class Followed(ABC, Generic[FilterT]):
    """Objects of one kind in a trial.

    Args:
        words: What such objects are like.
        log_weights: ln p(O, the object is of this kind), shape [H].
        own: The filter below.

    Attributes:
        words: What such objects are like.
        filter: Over all that is not known of each object of this kind and of *unseen*.
    """

    def __init__(self, words: str, log_weights: FloatArray, own: FilterT) -> None:
        self.words, self.filter, self._log_weights = words, own, log_weights

    def weighted(self, log_weight: float) -> Self:
        """Return the same kind, a factor less probable."""
        twin = copy.copy(self)
        twin._log_weights = self._log_weights + log_weight
        return twin

    def weigh(self, log_likelihood: FloatArray) -> None:
        """Take in what was felt of the object as a whole: ln p(reading | O), shape [H]."""
        self._log_weights = self.filter.log_weights = self._log_weights + log_likelihood

    @property
    def log_joint(self) -> FloatArray:
        """Ln p(O, the object is of this kind, z_0:t | a_1:t), shape [H]."""
        return self._log_weights + self.filter.log_evidence

    @abstractmethod
    def observe(self, evidence: Evidence) -> None:
        """Take in the evidence of a look, the last of the history."""

    @abstractmethod
    def components(self, belief: FloatArray) -> list[BeliefComponent]:
        """Return the component of each probable object.

        Args:
            belief: p(O, the object is of this kind | z_0:t, a_1:t), shape [H].
        """


class FollowedPoses(Followed[PosesT]):
    """Objects of a kind whose aspects are poses; arguments and attributes are those of ``Followed``."""

    _poses: Poses
    _rates: Rates
    _alphabet: PatternAlphabet

    def components(self, belief: FloatArray) -> list[BeliefComponent]:
        """Return the component of each probable object, with its poses as aspects.

        Args:
            belief: p(O, the object is of this kind | z_0:t, a_1:t), shape [H].
        """
        components = []
        for hypothesis in np.flatnonzero(belief >= LEAST_PROBABILITY).tolist():
            contents = self.filter.learned_contents(hypothesis)
            if contents is not None:
                graph = pose_graph(self._poses, contents, self._rates, self._alphabet)
                poses = self.filter.poses_of(hypothesis)
                components.append(BeliefComponent(hypothesis, float(belief[hypothesis]), graph, poses))
        return components


class FollowedStructure(FollowedPoses[PoseFilter]):
    """One believed structure in a trial.

    Args:
        believed: The structure, and what it says of the remembered objects.
        log_weights: ln p(O, the object follows it), shape [H].
        rates: Those in force.
        memory: For its assumptions.

    Attributes:
        filter: Over the pose and contents of each object and of *unseen*.
    """

    def __init__(self, believed: BelievedStructure, log_weights: FloatArray, rates: Rates, memory: RobotMemory) -> None:
        self._poses, self._rates, self._alphabet = believed.structure.poses(), rates, memory.assumptions.alphabet
        new = np.zeros((1, *believed.contents.shape[1:]))
        contents = np.concatenate((believed.contents, new))
        own = PoseFilter(self._poses, contents, rates, self._alphabet, log_weights)
        super().__init__(words_of_structure(believed.structure), log_weights, own)

    def observe(self, evidence: Evidence) -> None:
        """Take in the evidence of a look."""
        if evidence.pattern is None:
            self.filter.observe_likelihood(evidence.likelihood)
        else:
            self.filter.observe_pattern(self._alphabet.symbols[evidence.pattern])

    def chain(self, hypothesis: int, history: History) -> tuple[Chain, IntArray] | None:
        """Return the trial under one object as ``pose_chain`` has it, and the pattern of each state, −1 if unknown.

        The contents are those that the trial has left, taken as known. ``None`` if the object has been ruled out.
        """
        learned = self.filter.learned_contents(hypothesis)
        if learned is None:
            return None
        chain = pose_chain(self._poses, learned[None], np.ones(1), self._rates, self._alphabet, history)
        certainty, patterns = most_probable_patterns(self._poses, learned, self._rates, self._alphabet)
        return chain, np.resize(np.where(certainty > 0.5, patterns, -1), chain.initial.shape[1])

    def smoothed_patterns(self, hypothesis: int, inference: Inference) -> list[FloatArray]:
        """Return p(pattern shown at time s | O = hypothesis, all evidence) of every time s, each of shape [|𝒵|].

        The contents are those that the trial has left, taken as known.
        """
        learned = self.filter.learned_contents(hypothesis)
        if learned is None:
            return []
        contents, evidence = learned[None], inference.history.evidence
        chain = pose_chain(self._poses, contents, np.ones(1), self._rates, self._alphabet, inference.history)
        shown = pose_patterns(self._poses, contents, self._rates, self._alphabet)[0]
        patterns = []
        for time, of_states in enumerate(forward_backward(chain)):
            marginal = of_states.reshape(-1, len(shown)).sum(axis=0)
            likelihood = np.ones(len(self._alphabet)) if time >= len(evidence) else evidence[time].likelihood
            noise = self._rates.wrong / len(self._alphabet) * likelihood.sum()
            given_pose = shown * ((1.0 - self._rates.wrong) * likelihood + noise)
            total = given_pose.sum(axis=1)
            patterns.append((marginal / np.where(total > 0, total, 1.0)) @ given_pose)
        return patterns


class FollowedChain(FollowedPoses[PathFilter]):
    """One chain of samples in a trial.

    Args:
        chain: The chain, and what it says of the remembered objects.
        memory: For the noise and the assumptions.
        log_weight: ln of the weight of all chains.
        prior: p(O) in place of the chain's own, if it is not the memory's.

    Attributes:
        filter: Over paths and contents of each object and of *unseen*.
    """

    def __init__(
        self, chain: BelievedChain, memory: StructuredMemory, log_weight: float, prior: FloatArray | None
    ) -> None:
        self._noise, self._alphabet = memory.evidence.noise, memory.assumptions.alphabet
        beforehand = chain.log_prior
        if prior is not None:
            beforehand = np.where(np.isfinite(beforehand), log_of(prior), -np.inf)
        log_weights: FloatArray = log_weight + np.log(chain.weight) + beforehand
        own = PathFilter(chain, self._noise, self._alphabet, log_weights)
        super().__init__("one whose looks err", log_weights, own)
        n_states = len(chain.registers)
        self._poses = Poses(chain.registers, chain.successors.T, np.arange(n_states), np.full(n_states, 1.0 / n_states))
        self._rates = Rates(slip=chain.slip, wrong=memory.evidence.noise.wrong)

    def observe(self, evidence: Evidence) -> None:
        """Take in the evidence of a look."""
        self.filter.observe(evidence)

    def smoothed_patterns(self, hypothesis: int, inference: Inference) -> list[FloatArray]:
        """Return p(pattern shown at time s | O = hypothesis, all evidence) of every time s, each of shape [|𝒵|]."""
        return self.filter.smoothed_patterns(hypothesis)


class FollowedPlain(Followed[PlainFilter]):
    """Plain ATGs with an α and δ of their own.

    Args:
        model: The tables when the trial begins.
        log_weights: ln p(O, the object is of this kind), shape [H].
        history: Of the trial, to learn from.

    Attributes:
        filter: Over the aspects of each object and of *unseen*.
    """

    def __init__(self, model: RecognitionModel, log_weights: FloatArray, history: History) -> None:
        self._history, parameters = history, model.parameters
        noise = PlainNoise(parameters.transition_concentration, parameters.observation_noise)
        super().__init__(words_of_noise(noise), log_weights, PlainFilter(model, log_weights))

    def observe(self, evidence: Evidence) -> None:
        """Take in the evidence of a look, the last of the history, and learn from it."""
        self.filter.observe(evidence, self._history.step(len(self._history.evidence) - 1))

    def components(self, belief: FloatArray) -> list[BeliefComponent]:
        """Return the component of each probable object.

        Args:
            belief: p(O, the object is of this kind | z_0:t, a_1:t), shape [H].
        """
        return components_of(self.filter.model, belief[:, None] * self.filter.aspects)

    def chain(self, hypothesis: int, history: History) -> tuple[Chain, IntArray]:
        """Return the trial under one object, and the pattern of each of its states, −1 of the collection node."""
        model = self.filter.model
        return build_chain(model.memory, model.parameters, history, [hypothesis]), model.pattern_of[hypothesis]

    def smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, all evidence) of every time s, each of shape [W_s]."""
        return forward_backward(self.chain(hypothesis, self._history)[0])
