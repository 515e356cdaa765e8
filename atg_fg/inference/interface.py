"""What every inference engine answers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from copy import copy, deepcopy
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from atg_fg.core.actions import NOTHING, AnyAction, GivenAction, action_from
from atg_fg.core.belief import SHOWN, BeliefTable, IdentityBelief
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.looks import Look, evidence_of, strength
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import check_measured
from atg_fg.core.open_alphabets import Relabelling, new_labels
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, protect
from atg_fg.core.records import Mistake
from atg_fg.inference.belief_components import BeliefComponent, components_of, shown_patterns_of
from atg_fg.inference.belief_tree import BeliefNode, TableBeliefNode
from atg_fg.inference.chain import Chain, build_chain, forward_backward
from atg_fg.inference.expected_entropy import expected_entropies_of
from atg_fg.inference.history import History
from atg_fg.inference.recognition_model import RecognitionModel, Revelation


class TrialSetup(NamedTuple):
    """What a trial begins with.

    Attributes:
        memory: The robot memory; it is not changed, and must not change while the trial goes on.
        parameters: α, δ and whether to learn within the trial.
        prior: p(O); the memory's if ``None``.
    """

    memory: RobotMemory
    parameters: ModelParameters
    prior: IdentityBelief | None = None


class _Told(NamedTuple):
    """A look as it was told, so that it can be read again under an alphabet that knows more labels."""

    look: Look
    independent: bool


class Inference(ABC):
    """Inference in one trial: look, act, look, act …, and ask for the posterior at any time.

    A subclass is an engine. It says by ``exact`` whether its posteriors are those of the model, and by
    ``knows_structure`` whether it can let objects follow a structure that all share. It answers ``identity`` and
    ``scaled_log_evidence``, and fills the hooks ``update`` and ``predict``; it may have a way of its own to
    ``compute_expected_entropies`` and ``compute_smoothed_aspects``. These hooks are for subclasses: whoever uses an
    engine calls ``observe``, ``act`` and ``expected_entropies``, which check what they are given first. Options of an
    engine are keyword-only arguments of its constructor.

    What an engine hands out cannot change it: arrays in public attributes are made read-only after each step, so an
    engine replaces them rather than write to them. A copy, shallow or deep, shares nothing with the engine.

    Args:
        setup: What the trial begins with.

    Attributes:
        model: The tables in force.
        history: What was seen and done so far; evidence of very small or large numbers is scaled.
    """

    name: ClassVar[str]
    exact: ClassVar[bool]
    knows_structure: ClassVar[bool] = False
    #: Whether ``act`` takes actions that are only probable.
    takes_uncertain_actions: ClassVar[bool] = True
    #: The engine's own options that ``begin_trial`` was given.
    options: Mapping[str, Any] = MappingProxyType({})

    def __init__(self, setup: TrialSetup) -> None:
        self.memory, self.parameters, self.prior = setup
        self.model = self.make_tables()
        self.history = History()
        self._log_scale = 0.0
        self._told: list[_Told | AnyAction] = []

    def make_tables(self) -> RecognitionModel:
        """Return the tables in force when the trial begins; an engine that does without some of them overrides this."""
        return RecognitionModel(self.memory, self.parameters, self.prior)

    def _protect(self) -> None:
        protect([each for name, each in vars(self).items() if name[0] != "_" and isinstance(each, (np.ndarray, tuple))])

    def __copy__(self) -> Self:
        return deepcopy(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._protect()

    def observe(self, look: Look, *, independent: bool = True) -> None:
        """Take in the evidence z_t of a look, then learn from it if the parameters say so.

        Several looks may follow each other without an action: they are of one aspect, X_t. A label that an open
        alphabet does not know is added to it: ``memory`` is then one of its own that knows it, and all is as if the
        label had been known when the trial began.

        Args:
            look: Evidence; the symbol in each slot, by number or name; symbols or their likelihoods by slot, and
                readings of the object as a whole by the name of their sense; or ``None`` if nothing was seen.
            independent: Whether a look without an action before it errs by itself. If not, as of frames that show the
                same shadow, the one that says most counts alone.

        Raises:
            InvalidInputError: The look does not fit the alphabet.
            ImpossibleEvidenceError: The evidence has probability zero under the model; nothing has changed.
        """
        alphabet = self.memory.assumptions.alphabet
        labels = new_labels(alphabet, look)
        if labels:
            self._meet(labels, look, independent=independent)
            return
        senses = self.memory.assumptions.object_senses
        evidence = evidence_of(alphabet, look, senses)
        evidence.check(self.model.n_patterns)
        check_measured(senses, dict(evidence.measured), "look")
        if self.history.awaits_evidence:
            self._take_in(evidence)
        elif independent:
            self._look_again(evidence)
        else:
            self._keep_the_strongest(evidence)
        if alphabet.is_open:
            self._told.append(_Told(deepcopy(look), independent))

    def _meet(self, labels: Iterable[str], look: Look, *, independent: bool) -> None:
        """Begin again under an alphabet that knows more labels, and take in the look that has them."""
        again = self._anew(self.memory.extended(labels))
        to = Relabelling(self.memory.assumptions.alphabet, again.memory.assumptions.alphabet)
        for told in self._told:
            if not isinstance(told, _Told):
                again._do(told)
                again._told.append(told)
            elif isinstance(told.look, Evidence):
                again.observe(to.evidence(told.look), independent=told.independent)
            else:
                again.observe(told.look, independent=told.independent)
        again.observe(look, independent=independent)
        self._become(again)

    def _anew(self, memory: RobotMemory) -> Self:
        """Return this engine, with its options, at the beginning of the trial."""
        again = type(self)(TrialSetup(memory, self.parameters, self.prior), **self.options)
        again.options = self.options
        return again

    def _become(self, again: Self) -> None:
        vars(self).clear()
        vars(self).update(vars(again))

    def _look_again(self, evidence: Evidence) -> None:
        """Take in another look at the same aspect: nothing has happened since the last one."""
        before = copy(self)
        self.history.actions.append(NOTHING)
        try:
            self.predict(NOTHING)
            self._take_in(evidence)
        except BaseException:
            vars(self).update(vars(before))
            raise

    def _keep_the_strongest(self, evidence: Evidence) -> None:
        """Replace the looks at rest by this one if it says more; the trial is begun again without them."""
        rest = self.history.looks_at_rest()
        if max(strength(self.history.evidence[time]) for time in rest) >= strength(evidence):
            return
        again = self._anew(self.memory)
        again._told = self._told
        for time, look in enumerate([*self.history.evidence[: rest[0]], evidence]):
            if time:
                again._do(self.history.actions[time - 1])
            again._take_in(look)
        self._become(again)

    def _take_in(self, evidence: Evidence) -> None:
        evidence, log_scale = evidence.scaled()
        self.history.evidence.append(evidence)
        try:
            self.update(evidence)
        except BaseException:
            self.history.evidence.pop()
            raise
        self._log_scale += log_scale
        self._protect()

    def act(self, action: GivenAction) -> None:
        """Predict the effect of an action a_{t+1}.

        Args:
            action: Its index or its name; ``None`` if nothing happened; or the probability of each of these, if it is
                not sure what was done.

        Raises:
            InvalidInputError: It is an observation's turn, there is no such action, or the probabilities do not sum to
                one.
        """
        if self.history.awaits_evidence:
            raise InvalidInputError("trial: an action without an observation before it; expected an observation")
        done = action_from(action, self.memory.assumptions)
        self._do(done)
        if self.memory.assumptions.alphabet.is_open:
            self._told.append(done)

    def _do(self, action: AnyAction) -> None:
        self.history.actions.append(action)
        try:
            self.predict(action)
        except BaseException:
            self.history.actions.pop()
            raise
        self._protect()

    def conclude(self) -> IdentityBelief:
        """Return the belief at the end of the trial, for the verdict.

        It is ``identity`` of engines that have nothing more to find out; one that learns from all trials may look at
        the past again in the light of this one.
        """
        return self.identity()

    def mistakes(self, least: float = 0.5) -> list[Mistake]:
        """Return the labels that are probably wrong, given the whole trial; none of engines that do not ask for them.

        Args:
            least: Labels that are wrong with less probability are left out.
        """
        return []

    def expected_entropies(self) -> FloatArray:
        """E[H(O | z_{t+1}, a, …)] of each action (eq. 3) in nats, shape [A].

        Raises:
            InvalidInputError: Asked before a look or between an action and its look.
        """
        self._check_looked("expected entropy")
        return self.compute_expected_entropies()

    def belief_table(self, shown: int = SHOWN) -> BeliefTable:
        """Return p(O | z_0:t, a_1:t) with the names of the objects, as a table that a notebook shows.

        Args:
            shown: How many objects are shown one by one, the most probable first.
        """
        return self.identity().named(self.memory.names, shown)

    def belief_components(self) -> list[BeliefComponent]:
        """Return what the object may be, and where in it the robot may be; improbable ones are left out."""
        return components_of(self.model, self.aspect_belief)

    def shown_patterns(self) -> FloatArray:
        """Return the probability that each pattern is shown now, given all evidence, shape [|𝒵|].

        Raises:
            InvalidInputError: Asked before a look or between an action and its look.
        """
        self._check_looked("shown patterns")
        return shown_patterns_of(self.model, self.aspect_belief, self.history.evidence[-1])

    def belief_tree(self) -> BeliefNode:
        """Return the present belief as the root of a belief tree; the trial is not changed by what is asked of it.

        An engine that does not predict by the model's tables overrides this.

        Raises:
            InvalidInputError: Asked before a look or between an action and its look.
        """
        self._check_looked("belief tree")
        return TableBeliefNode(copy(self.model), self.aspect_belief)

    def chain(self, hypothesis: int | None = None) -> Chain:
        """Return the trial so far as plain arrays, for all hypotheses or under one of them."""
        hypotheses = None if hypothesis is None else [hypothesis]
        return build_chain(self.memory, self.parameters, self.history, hypotheses, self.prior)

    def _check_looked(self, asked: str) -> None:
        """Raise ``InvalidInputError`` if what is asked for makes no sense before the next look."""
        if self.history.awaits_evidence:
            raise InvalidInputError(f"{asked}: asked before the look; expected an observation first")

    def impossible_evidence(self) -> ImpossibleEvidenceError:
        """Return the error for the last look, if no hypothesis allows it."""
        return ImpossibleEvidenceError(
            f"observation {len(self.history.evidence) - 1}: the evidence has probability zero under the model; "
            "expected evidence that some object could give, or noise above 0"
        )

    @abstractmethod
    def identity(self) -> IdentityBelief:
        """Return p(O | z_0:t, a_1:t) (eq. 1 and 2)."""

    @property
    def log_evidence(self) -> float:
        """Return ln p(z_0:t | a_1:t)."""
        return self.scaled_log_evidence + self._log_scale

    @property
    @abstractmethod
    def scaled_log_evidence(self) -> float:
        """Ln p(z_0:t | a_1:t) of the evidence in ``history``, or what the engine takes it to be."""

    @property
    def total_variation_bound(self) -> float | None:
        """A bound of ½ Σ |p(O) − q(O)| to the exact posterior, 0 of exact engines; ``None`` if the engine has none."""
        return 0.0 if self.exact else None

    @property
    def aspect_belief(self) -> FloatArray:
        """p(O, X_t | z_0:t, a_1:t), shape [H, W]; after an action X_t is the aspect that it leads to."""
        if not self.history.evidence:
            return self.model.prior[:, None] * self.model.base_row
        joint = np.zeros((self.model.n_hypotheses, self.model.n_states))
        identity = self.identity().probabilities
        for hypothesis in np.flatnonzero(identity):
            joint[hypothesis] = identity[hypothesis] * self.smoothed_aspects(int(hypothesis))[-1]
        return joint

    def smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s, each of shape [W_s].

        State 0 is the collection node, state 1 + k the k-th known aspect.

        Raises:
            InvalidInputError: There is no such hypothesis, or nothing was observed yet.
            ImpossibleEvidenceError: The hypothesis or the evidence under it has probability zero.
        """
        if not 0 <= hypothesis < self.model.n_hypotheses:
            raise InvalidInputError(f"hypothesis: {hypothesis}; expected 0 to {self.model.n_hypotheses - 1}")
        if not self.history.evidence:
            raise InvalidInputError("smoothed aspects: nothing observed yet; expected a first observation")
        if not self.model.prior[hypothesis] > 0:
            raise ImpossibleEvidenceError(
                f"smoothed aspects: hypothesis {hypothesis} has prior probability zero; expected one that is possible"
            )
        marginals = self.compute_smoothed_aspects(hypothesis)
        if not all(marginal.sum() > 0 for marginal in marginals):
            raise ImpossibleEvidenceError(
                f"smoothed aspects: the evidence has probability zero under hypothesis {hypothesis}; "
                "expected one that is possible"
            )
        return marginals

    def learn_from_look(self) -> Revelation | None:
        """Let the tables learn from the last look; return how belief in collection nodes is to be divided, if so."""
        return self.model.learn_from(self.history, len(self.history.evidence) - 1)

    @abstractmethod
    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it.

        An engine that keeps a belief divides that of the collection nodes as ``learn_from_look`` returns it.

        Raises:
            ImpossibleEvidenceError: The look is impossible (``impossible_evidence``); raised before any change.
        """

    @abstractmethod
    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``; if this raises, nothing has changed.

        ``mixed`` (``atg_fg.core.actions``) makes a prediction for a sure action one for an action that is not.
        """

    def compute_expected_entropies(self) -> FloatArray:
        """Return E[H(O | z_{t+1}, a, …)] of each action (eq. 3) in nats, shape [A]; called after a look.

        It is exact for the engine's own ``aspect_belief``; an engine with a way of its own overrides this.
        """
        return expected_entropies_of(self.model, self.aspect_belief)

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s, each of shape [W_s], or zeros.

        Called after the first look, for a hypothesis whose prior probability is above zero. It is exact, by
        forward-backward on the trial given the object; an engine with a way of its own overrides this.
        """
        return forward_backward(self.chain(hypothesis))
