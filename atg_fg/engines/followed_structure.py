"""One believed structure in a trial."""

from __future__ import annotations

import numpy as np

from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.engines.followed import Followed
from atg_fg.inference.belief_components import LEAST_PROBABILITY, BeliefComponent
from atg_fg.inference.chain import Chain, forward_backward
from atg_fg.inference.history import History
from atg_fg.inference.interface import Inference
from atg_fg.learning.believed_structure import BelievedStructure
from atg_fg.learning.completion import most_probable_patterns, pose_graph
from atg_fg.learning.object_kinds import words_of_structure
from atg_fg.learning.pose_chain import pose_chain, pose_patterns
from atg_fg.learning.pose_filter import PoseFilter
from atg_fg.learning.rates import Rates


class FollowedStructure(Followed[PoseFilter]):
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

    def components(self, belief: FloatArray) -> list[BeliefComponent]:
        """Return the component of each probable object, with its poses as aspects.

        Args:
            belief: p(O, the object follows this structure | z_0:t, a_1:t), shape [H].
        """
        components = []
        for hypothesis in np.flatnonzero(belief >= LEAST_PROBABILITY).tolist():
            contents = self.filter.learned_contents(hypothesis)
            if contents is not None:
                graph = pose_graph(self._poses, contents, self._rates, self._alphabet)
                poses = self.filter.poses_of(hypothesis)
                components.append(BeliefComponent(hypothesis, float(belief[hypothesis]), graph, poses))
        return components

    def observe(self, evidence: Evidence) -> None:
        """Take in the evidence of a look."""
        if evidence.pattern is None:
            self.filter.observe_likelihood(evidence.likelihood)
        else:
            self.filter.observe_pattern(self._alphabet.symbols[evidence.pattern])

    def chain(self, hypothesis: int, history: History) -> tuple[Chain, IntArray] | None:
        """Return the trial under one object whose aspects are the poses, and the pattern of each pose, −1 if unknown.

        The contents are those that the trial has left, taken as known. ``None`` if the object has been ruled out.
        """
        learned = self.filter.learned_contents(hypothesis)
        if learned is None:
            return None
        chain = pose_chain(self._poses, learned[None], np.ones(1), self._rates, self._alphabet, history)
        certainty, patterns = most_probable_patterns(self._poses, learned, self._rates, self._alphabet)
        return chain, np.where(certainty > 0.5, patterns, -1)

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
        for time, marginal in enumerate(forward_backward(chain)):
            likelihood = np.ones(len(self._alphabet)) if time >= len(evidence) else evidence[time].likelihood
            noise = self._rates.wrong / len(self._alphabet) * likelihood.sum()
            given_pose = shown * ((1.0 - self._rates.wrong) * likelihood + noise)
            total = given_pose.sum(axis=1)
            patterns.append((marginal / np.where(total > 0, total, 1.0)) @ given_pose)
        return patterns
