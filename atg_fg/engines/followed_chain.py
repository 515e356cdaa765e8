"""One chain of samples in a trial."""

from __future__ import annotations

import numpy as np

from atg_fg.core.log_math import log_of
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.engines.followed import Followed
from atg_fg.inference.belief_components import LEAST_PROBABILITY, BeliefComponent
from atg_fg.inference.interface import Inference
from atg_fg.learning.completion import pose_graph
from atg_fg.learning.evidence_learner import BelievedChain
from atg_fg.learning.path_filter import PathFilter
from atg_fg.learning.rates import Rates
from atg_fg.learning.shared_structure import Poses
from atg_fg.learning.structured_memory import StructuredMemory


class FollowedChain(Followed[PathFilter]):
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

    def components(self, belief: FloatArray) -> list[BeliefComponent]:
        """Return the component of each probable object, with its states as aspects.

        Args:
            belief: p(O, the chain | z_0:t, a_1:t), shape [H].
        """
        components = []
        for hypothesis in np.flatnonzero(belief >= LEAST_PROBABILITY).tolist():
            contents = self.filter.learned_contents(hypothesis)
            graph = pose_graph(self._poses, contents, self._rates, self._alphabet)
            poses = self.filter.poses_of(hypothesis)
            components.append(BeliefComponent(hypothesis, float(belief[hypothesis]), graph, poses))
        return components

    def smoothed_patterns(self, hypothesis: int, inference: Inference) -> list[FloatArray]:
        """Return p(pattern shown at time s | O = hypothesis, all evidence) of every time s, each of shape [|𝒵|]."""
        return self.filter.smoothed_patterns(hypothesis)
