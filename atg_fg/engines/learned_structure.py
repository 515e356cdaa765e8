"""Recognition where objects may follow a structure that all of them share, learned from all trials in memory.

Each object either follows one of the structures that are believed in, or is a plain ATG, whose actions may be
uncertain. So next to the Bayes filter of the plain ATGs there is one of those whose actions are uncertain, and a filter
over pose and contents for each structure, and the belief over identity sums over them.
A memory that has learned no structure leaves the Bayes filter alone.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import partial
from typing import ClassVar, Final, NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction, UncertainAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.log_math import log_of, log_sum_exp
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.core.records import Mistake
from atg_fg.engines.bayes_filter import BayesFilter
from atg_fg.engines.followed import FollowedChain, FollowedPlain, FollowedStructure
from atg_fg.engines.tables_on_demand import TablesOnDemand
from atg_fg.inference.belief_components import LEAST_PROBABILITY, BeliefComponent, components_of, shown_patterns_of
from atg_fg.inference.belief_tree import BeliefNode
from atg_fg.inference.chain import Chain
from atg_fg.inference.explanations import best_explanations
from atg_fg.inference.interface import TrialSetup
from atg_fg.inference.recognition_model import COLLECTION
from atg_fg.learning.believed_structure import BelievedStructure
from atg_fg.learning.object_kinds import PLAIN_WORDS
from atg_fg.learning.pose_belief_tree import FilteredBelief, Following, StructureBelief
from atg_fg.learning.rates import Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.structured_memory import StructuredMemory

#: A structure less probable than this, given the trial so far, is left out of the rest of it.
RULED_OUT: Final = 1e-9
#: If no object is more probable than this to have uncertain actions, none is taken to have.
NEGLIGIBLE: Final = 2e-3


class KindExplanation(NamedTuple):
    """One way in which all that was seen can have come about.

    Attributes:
        kind: What kind of thing it is, in words.
        hypothesis: State of O; the last one is *unseen*.
        patterns: Index of the pattern that was shown at every look, −1 where it is not known.
        probability: p(kind, O, X_0:t | z_0:t, a_1:t).
    """

    kind: str
    hypothesis: int
    patterns: tuple[int, ...]
    probability: float


class LearnedStructure(BayesFilter):
    """Bayes filtering of plain ATGs and, beside them, of pose and contents under learned structures.

    Not exact: few structures stand for all, and contents that slips leave in doubt are merged by their mean
    (``atg_fg/learning/pose_filter.py``). What is impossible for plain ATGs is refused.
    """

    name: ClassVar[str] = "learned-structure"
    exact: ClassVar[bool] = False
    knows_structure: ClassVar[bool] = True

    def __init__(self, setup: TrialSetup) -> None:
        super().__init__(setup)
        self._known: tuple[float, list[FloatArray]] | None = None
        believed: list[BelievedStructure] = []
        rates = Rates()
        memory = self.memory if self.parameters.learn_structure else None
        # Where looks err beyond doubt, nobody asks what there would be without.
        if isinstance(memory, StructuredMemory) and memory.log_erring_weights[1] > -np.inf:
            believed, rates = memory.learner.believed(memory.names), memory.learner.rates
        followers = [each.weight * np.append(each.followers, each.share) for each in believed]
        self._log_plain = log_of(np.maximum(1.0 - sum(followers, np.zeros(self.model.n_hypotheses)), 0.0))
        self._followed: list[FollowedStructure | FollowedChain | FollowedPlain] = [
            FollowedStructure(each, log_of(self.model.prior * follow), rates, self.memory)
            for each, follow in zip(believed, followers, strict=True)
        ]
        if isinstance(memory, StructuredMemory):
            if memory.log_erring_weights[1] > -np.inf:
                self._follow_uncertain(memory, sum(followers, np.zeros(self.model.n_hypotheses)))
            self._follow_chains(memory)

    def _follow_uncertain(self, memory: StructuredMemory, followers: FloatArray) -> None:
        """Add the plain ATGs whose actions are uncertain, unless that is next to impossible of all objects."""
        uncertain = memory.learner.uncertain(memory.names)
        if uncertain is None:
            return
        members = np.append(uncertain.members, uncertain.share)
        if members.max() < NEGLIGIBLE:
            return
        self._log_plain = log_of(np.maximum(1.0 - followers - members, 0.0))
        model = TablesOnDemand(memory, uncertain.noise.parameters, self.prior, graphs=list(memory))
        self._followed.append(FollowedPlain(model, log_of(model.prior * members), self.history))

    def _follow_chains(self, memory: StructuredMemory) -> None:
        """Add the chains that were sampled from all raw trials, with the weight that their evidence gives them."""
        log_erring, log_sharp = memory.log_erring_weights
        chains = memory.evidence.believed(memory.names) if log_erring > -np.inf else []
        if not chains:
            return
        self._log_plain = self._log_plain + log_sharp
        self._followed = [each.weighted(log_sharp) for each in self._followed]
        unusual = self.model.prior if self.prior is not None else None
        self._followed += [FollowedChain(each, memory, log_erring, unusual) for each in chains]

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        felt = log_of(self.model.objects.likelihood(evidence.measured)) if evidence.measured else None
        super().update(evidence)
        for each in self._followed:
            each.observe(evidence)
            if felt is not None:
                each.weigh(felt)
        self._known = None
        if self._followed:
            kept = [belief.sum() > RULED_OUT for belief in self._type_beliefs()[1:]]
            if not all(kept):
                self._followed, self._known = list(itertools.compress(self._followed, kept)), None

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        super().predict(action)
        self._known = None
        for each in self._followed:
            each.filter.act(action)

    def identity(self) -> IdentityBelief:
        """Return p(O | z_0:t, a_1:t) (eq. 1 and 2)."""
        if not self._followed:
            return super().identity()
        probabilities = sum(self._type_beliefs(), np.zeros(self.model.n_hypotheses))
        return IdentityBelief.of(probabilities, self.model.n_unseen)

    @property
    def log_evidence(self) -> float:
        """Return ln p(z_0:t | a_1:t)."""
        if not self._followed:
            return super().log_evidence
        return self._beliefs()[0] + self._log_scale

    def conclude(self) -> IdentityBelief:
        """Return the belief at the end of the trial, all raw trials of the memory sampled again in its light.

        What chains say of the object is then what they say once they have moved; how much they say it is as before.
        """
        looks, memory = self.history.evidence, self.memory
        chains = [position for position, each in enumerate(self._followed) if isinstance(each, FollowedChain)]
        actions = [action for action in self.history.actions if not isinstance(action, UncertainAction)]
        if not chains or not isinstance(memory, StructuredMemory) or self.prior is not None:
            return self.identity()
        if len(actions) < len(self.history.actions):
            return self.identity()  # a raw trial has sure actions alone
        verdict = memory.evidence.conclude(RawTrial.of(looks, actions, memory.assumptions.alphabet))
        beliefs = self._type_beliefs()
        erring = sum(float(beliefs[1 + position].sum()) for position in chains)
        total = sum(beliefs[1:], beliefs[0]) - sum(
            (beliefs[1 + position] for position in chains), np.zeros(self.model.n_hypotheses)
        )
        sampled = np.zeros(self.model.n_hypotheses)
        sampled[-1] = verdict.probabilities[-1]
        for name, probability in zip(verdict.names, verdict.probabilities[:-1].tolist(), strict=True):
            sampled[memory.names.index(name)] += probability
        return IdentityBelief.of(np.maximum(total, 0.0) + erring * sampled, self.model.n_unseen)

    def mistakes(self, least: float = 0.5) -> list[Mistake]:
        """Return the look, the slot and the probability of each label that is probably wrong, given the whole trial.

        Only of the model in which looks err, for the object that is most probable under it; empty without.

        Args:
            least: Labels that are wrong with less probability are left out.
        """
        beliefs, looks = self._type_beliefs()[1:], self.history.evidence
        wrong: dict[tuple[int, int], float] = {}
        total = sum(
            (b for b, each in zip(beliefs, self._followed, strict=True) if isinstance(each, FollowedChain)),
            np.zeros(self.model.n_hypotheses),
        )
        hypothesis, weight = int(total.argmax()), float(total.max())
        for belief, each in zip(beliefs, self._followed, strict=True):
            if not isinstance(each, FollowedChain) or not belief[hypothesis] > 0:
                continue
            share = float(belief[hypothesis]) / weight
            for look, slots in enumerate(each.filter.right_labels(hypothesis, list(looks))):
                for slot, right in enumerate(slots):
                    if right is not None:
                        wrong[look, slot] = wrong.get((look, slot), 0.0) + share * (1.0 - right)
        return [Mistake(*place, probability) for place, probability in wrong.items() if probability >= least]

    def kind_belief(self) -> dict[str, float]:
        """Return the probability of each kind that the object may be of, in words, given the trial so far."""
        plain, *others = (float(belief.sum()) for belief in self._type_beliefs())
        kinds: dict[str, float] = {}
        for each, probability in zip(self._followed, others, strict=True):
            kinds[each.words] = kinds.get(each.words, 0.0) + probability
        return {**kinds, PLAIN_WORDS: plain}

    def kind_explanations(self, k: int = 1) -> list[KindExplanation]:
        """Return the k most probable explanations of the trial by kind, object and aspects, best first.

        Where looks err so often that raw trials are sampled, there is none of that kind.
        """
        plain, *others = self._type_beliefs()
        kinds: list[tuple[str, FloatArray, Callable[[int], tuple[Chain, IntArray] | None]]] = [
            (PLAIN_WORDS, plain, lambda hypothesis: (self.chain(hypothesis), self.model.pattern_of[hypothesis]))
        ]
        kinds += [
            (each.words, belief, partial(each.chain, history=self.history))
            for each, belief in zip(self._followed, others, strict=True)
            if not isinstance(each, FollowedChain)
        ]
        found: list[KindExplanation] = []
        for words, belief, chain_of in kinds:
            for hypothesis in np.flatnonzero(belief >= LEAST_PROBABILITY).tolist():
                told = chain_of(hypothesis)
                if told is None:
                    continue
                chain, pattern_of = told
                for path in best_explanations(chain, k):
                    patterns = tuple(int(pattern_of[state]) for state in path.states)
                    probability = float(belief[hypothesis]) * path.probability
                    found.append(KindExplanation(words, hypothesis, patterns, probability))
        return sorted(found, key=lambda each: -each.probability)[:k]

    def _beliefs(self) -> tuple[float, list[FloatArray]]:
        """Return ln p(z_0:t | a_1:t) but for its scale, and p(O, type | z_0:t, a_1:t).

        The latter of being plain, then of following each structure, each of shape [H]; kept until the next look.
        """
        if self._known is None:
            plain = self._log_plain + self._log_identity + self.scaled_log_evidence
            joints = np.array([plain, *(each.log_joint for each in self._followed)])
            total = log_sum_exp(joints)
            self._known = total, list(np.exp(joints - total))
        return self._known

    def _type_beliefs(self) -> list[FloatArray]:
        """Return p(O, type | z_0:t, a_1:t) of being plain, then of following each structure, each of shape [H]."""
        return self._beliefs()[1]

    def _plain_aspects(self, type_beliefs: list[FloatArray]) -> FloatArray:
        """Return p(O, X_t, plain | z_0:t, a_1:t), shape [H, W]."""
        return type_beliefs[0][:, None] * self._belief.aspects

    @property
    def aspect_belief(self) -> FloatArray:
        """p(O, X_t | z_0:t, a_1:t), shape [H, W]; a pose counts as the aspect that shows what it shows."""
        if not self._followed:
            return super().aspect_belief
        beliefs = self._type_beliefs()
        joint = self._plain_aspects(beliefs)
        for each, belief in zip(self._followed, beliefs[1:], strict=True):
            owners, patterns = each.filter.shown_patterns()
            rows = np.repeat(owners, patterns.shape[1])
            np.add.at(joint, (rows, self.model.aspect_of[owners].ravel()), (belief[owners, None] * patterns).ravel())
        return joint

    def belief_components(self) -> list[BeliefComponent]:
        """Return what the object may be, a plain ATG or a follower of a structure, and where in it the robot is."""
        beliefs = self._type_beliefs()
        components = components_of(self.model, self._plain_aspects(beliefs))
        for each, belief in zip(self._followed, beliefs[1:], strict=True):
            components += each.components(belief)
        return components

    def shown_patterns(self) -> FloatArray:
        """Return the probability of each pattern to be the one shown now, given all evidence, shape [|𝒵|].

        Raises:
            InvalidInputError: Asked before a look or between an action and its look.
        """
        if not self._followed:
            return super().shown_patterns()
        self._check_looked("shown patterns")
        beliefs = self._type_beliefs()
        shown = shown_patterns_of(self.model, self._plain_aspects(beliefs), self.history.evidence[-1])
        for each, belief in zip(self._followed, beliefs[1:], strict=True):
            owners, patterns = each.filter.shown_patterns()
            shown += belief[owners] @ patterns
        return shown

    def belief_tree(self) -> BeliefNode:
        """Return the present belief as the root of a belief tree; the trial is not changed by what is asked of it.

        Raises:
            InvalidInputError: Asked before a look or between an action and its look.
        """
        if not self._followed:
            return super().belief_tree()
        self._check_looked("belief tree")
        beliefs = self._type_beliefs()
        following = [Following(each.filter, belief) for each, belief in zip(self._followed, beliefs[1:], strict=True)]
        symbols = self.memory.assumptions.alphabet.symbols
        if self._compiled is not None:
            return FilteredBelief(self.model, self._compiled, beliefs[0], following, symbols)
        return StructureBelief(self.model, self._plain_aspects(beliefs), following, symbols)

    def compute_expected_entropies(self) -> FloatArray:
        """Return eq. 3 for each action, shape [A], from p(O, z | a) summed over types, poses and contents."""
        return self.belief_tree().expected_entropies() if self._followed else super().compute_expected_entropies()

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s, of plain ATGs and poses together.

        A pose counts as the aspect that shows the pose's pattern, or as the collection node if none does.
        """
        marginals = super().compute_smoothed_aspects(hypothesis)
        weights = [float(belief[hypothesis]) for belief in self._type_beliefs()]
        if not sum(weights[1:]) > 0:
            return marginals
        plain = weights[0] / sum(weights)
        mixed = [plain * marginal for marginal in marginals]
        for each, weight in zip(self._followed, weights[1:], strict=True):
            if isinstance(each, FollowedPlain):
                for aspects, own in zip(mixed, each.smoothed_aspects(hypothesis) if weight > 0 else [], strict=False):
                    aspects += weight / sum(weights) * own
                continue
            patterns = each.smoothed_patterns(hypothesis, self) if weight > 0 else []
            for aspects, shown in zip(mixed, patterns, strict=False):
                states = self.model.aspect_of[hypothesis].copy()
                states[states >= len(aspects)] = COLLECTION  # not known yet at that time
                aspects += weight / sum(weights) * np.bincount(states, shown, len(aspects))
        return mixed
