"""The recogniser as an agent: from what is seen to an action, in a loop of a user's own.

A loop over a world asks it as it asks a model of Stable-Baselines3, by ``predict``. A robot's loop tells it what was
seen, as often as it likes, and what was done in the end, which may be something else than was proposed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atg_fg.core.actions import NOTHING, GivenAction, UncertainAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import GREATEST_SEED, instance, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import Look, likely_pattern, strength
from atg_fg.core.memory import RobotMemory
from atg_fg.core.open_alphabets import Relabelling
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import MISSING, Evidence, IntArray
from atg_fg.core.records import Verdict
from atg_fg.engines import begin_trial, engine_for, usual_engine
from atg_fg.inference.history import History
from atg_fg.inference.interface import Inference
from atg_fg.policies import Choice, Policy, as_policy, make_policy
from atg_fg.worlds.base import detection_of


class _Rest(NamedTuple):
    """Looks without an action between them, and the action after them, ``None`` at the end or if it is not sure."""

    looks: list[Evidence]
    action: int | None

    @property
    def pattern(self) -> int | None:
        """The first pattern that was seen whole, or that the strongest look makes more probable than not."""
        whole = next((look.pattern for look in self.looks if look.pattern is not None), None)
        return likely_pattern(self.strongest) if whole is None else whole

    @property
    def strongest(self) -> Evidence:
        """The look that says most."""
        return max(self.looks, key=strength)


def learn_history(
    memory: RobotMemory, trial: Inference, matched: str | None, name: str | None = None, *, taught: bool = False
) -> str | None:
    """Let a memory learn from a trial, in one transaction if it is kept in a file; return the name of the ATG.

    Args:
        memory: What learns; labels that it did not know when the trial began are added to its open alphabet.
        trial: What was seen and done.
        matched: Name of the ATG that the object is of, ``None`` if it is new.
        name: Of the ATG of a new object; the next number if not given.
        taught: Whether someone said of which object the trial is.

    Returns:
        ``None`` if no pattern was seen whole or made more probable than not, so that nothing was learned.
    """
    if all(likely_pattern(look) is None for look in trial.history.evidence):
        return None
    alphabet = trial.memory.assumptions.alphabet
    with memory.transaction():
        memory.extend(alphabet.names)
        rests = list(_rests(trial.history, Relabelling(alphabet, memory.assumptions.alphabet)))
        patterns = [rest.pattern for rest in rests]
        measured = [look.measured for look in trial.history.evidence]
        learned = memory.learn(patterns, [rest.action for rest in rests[:-1]], matched, name, measured)
        for piece in _pieces(rests):
            looks = [rest.strongest for rest in piece]
            detections = [look.detection or (None,) * len(memory.assumptions.alphabet.slots) for look in looks]
            actions = [rest.action for rest in piece[:-1] if rest.action is not None]
            confidences = [look.confidences for look in looks] if any(look.confidences for look in looks) else []
            likelihoods = [look.slots for look in looks] if any(look.slots for look in looks) else []
            felt = [tuple(itertools.chain.from_iterable(look.measured for look in rest.looks)) for rest in piece]
            learned = memory.learn_shared(learned, detections, actions, confidences, likelihoods, felt, taught=taught)
    return learned


def _rests(history: History, labels: Relabelling) -> Iterator[_Rest]:
    """Yield the looks of each aspect, under the new labels."""
    looks: list[Evidence] = []
    for time, look in enumerate(history.evidence):
        looks.append(look if labels.new == labels.old else labels.evidence(look))
        action = history.actions[time] if time + 1 < len(history.evidence) else None
        if action != NOTHING:
            yield _Rest(looks, None if isinstance(action, UncertainAction) else action)
            looks = []


def _pieces(rests: list[_Rest]) -> Iterator[list[_Rest]]:
    """Yield the parts of a trial between which it is not sure what was done: each is a raw trial of the object."""
    piece: list[_Rest] = []
    for rest in rests:
        piece.append(rest)
        if rest.action is None:
            yield piece
            piece = []


class Proposal(NamedTuple):
    """What to do next.

    Attributes:
        action: Name of the action, ``None`` if the policy ends the trial.
        expected_entropy: Of identity after it and its look (eq. 3), nats; ``None`` if the policy did not ask.
        purpose: What it is for, or why the trial ends, such as ``settled``, if the policy says so.
    """

    action: str | None
    expected_entropy: float | None = None
    purpose: str | None = None

    @property
    def settled(self) -> bool:
        """Whether there is nothing more to be done."""
        return self.action is None


class AgentVerdict(NamedTuple):
    """What the object is taken for.

    Attributes:
        verdict: ``novel``, ``known``, or ``undecided`` if nothing at all was seen.
        name: Of the object, if it is known.
        probability: Of the verdict.
    """

    verdict: Verdict
    name: str | None
    probability: float


class RecognitionAgent:
    """Takes in what is seen, keeps a belief about the object, and proposes the next action.

    A robot's loop calls ``observe``, ``next_action`` and ``did`` until the proposal is ``settled``, then ``verdict``
    and, if it is to be remembered, ``learn``. A loop over worlds calls ``predict``: in one world, or in many at once;
    then observations have shape [worlds, slots], and there is a belief for each.

    Args:
        memory: The robot memory; only ``learn`` changes it. One that is kept in a database may be used by other
            processes at the same time.
        parameters: α, δ and whether to learn within the trial.
        engine: Name of the inference engine; if not given, the usual one for the parameters.
        policy: Chooses the actions, or its name; it may end trials where ``next_action`` is asked.
        seed: Of the generators of all trials, from which ties are broken.

    Raises:
        UnknownNameError: There is no such engine or policy.
        InvalidInputError: The engine does not know what the parameters ask for.

    Attributes:
        trials: The engine of each world in its present trial.
    """

    def __init__(
        self,
        memory: RobotMemory,
        parameters: ModelParameters,
        *,
        engine: str | None = None,
        policy: str | Policy = "entropy",
        seed: int = 0,
    ) -> None:
        self.memory = instance(memory, "memory", RobotMemory)
        self.parameters = instance(parameters, "parameters", ModelParameters)
        self.engine = usual_engine(parameters, "bayes-filter") if engine is None else engine
        engine_for(self.engine, parameters)
        self.policy: Policy = make_policy(policy) if isinstance(policy, str) else as_policy(policy)
        self._seeds = np.random.SeedSequence(whole_number(seed, "seed", 0, GREATEST_SEED))
        self.trials: list[Inference] = []
        self._names = memory.names
        self._generators: list[np.random.Generator] = []

    def reset(self) -> None:
        """Forget what was seen: the next observation is the first of a trial."""
        self.trials, self._generators = [], []

    @property
    def inference(self) -> Inference:
        """The engine in the present trial, or the first of them.

        Raises:
            InvalidInputError: Nothing has been seen since the last reset.
        """
        if not self.trials:
            raise InvalidInputError("agent: nothing seen yet; expected an observation first")
        return self.trials[0]

    @property
    def belief(self) -> IdentityBelief:
        """p(O | z, a) in the present trial, or the first of them."""
        return self.inference.identity()

    def __call__(self, observation: ArrayLike) -> int:
        """Return the action for an observation of one world."""
        action, _ = self.predict(observation)
        if action.ndim:
            raise InvalidInputError(f"agent: observations of {len(action)} worlds; expected that of one")
        return int(action)

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> tuple[IntArray, None]:
        """Take in what each world shows, and return the actions to take there.

        Args:
            observation: Symbols or ``MISSING``, shape [slots], or [worlds, slots].
            state: Ignored: the agent keeps its beliefs itself.
            episode_start: Whether this is the first observation of a trial, one or shape [worlds]; the very first is
                one in any case.
            deterministic: Ignored: only ties are broken at random, by the seed.

        Returns:
            The index of each action, shape [] or [worlds], and no state.

        Raises:
            InvalidInputError: An observation that is of another shape or not of the alphabet, or a policy that ends the
                trial.
        """
        rows = self._take_in(observation, episode_start)
        actions = [self._act(inference, rng) for inference, rng in zip(self.trials, self._generators, strict=True)]
        return np.array(actions if rows.ndim == 2 else actions[0], dtype=np.int64), None

    def observe(
        self, look: Look | ArrayLike, episode_start: ArrayLike | None = None, *, independent: bool = True
    ) -> None:
        """Take in what is seen without acting on it; several looks may follow each other.

        Args:
            look: As for ``Inference.observe``; or what worlds show, as for ``predict``. A label that the memory's open
                alphabet does not know is known in this trial, and added to the memory when that learns from it.
            episode_start: As for ``predict``.
            independent: As for ``Inference.observe``.

        Raises:
            InvalidInputError: A look that is of another shape, or not of the alphabet.
        """
        given: Any = look if isinstance(look, np.ndarray) else self._numbers_of(look)
        if isinstance(given, np.ndarray):
            self._take_in(given, episode_start, independent=independent)
            return
        if len(self.trials) > 1:
            raise InvalidInputError(f"agent: a look of one world; expected {len(self.trials)} as before")
        self._begin_trials(1, episode_start)
        self.inference.observe(given, independent=independent)

    def _numbers_of(self, look: Look | ArrayLike) -> Any:
        """Return numbers, with ``MISSING`` among them or of many worlds, as an array; any other look as it is."""
        if look is None or isinstance(look, (Evidence, Mapping, str)):
            return look
        rows: list[Any] = list(cast("Sequence[Any]", look))
        of_worlds = bool(rows) and all(isinstance(row, (list, tuple, np.ndarray)) for row in rows)
        return np.asarray(rows) if of_worlds or MISSING in rows else look

    def next_action(self) -> Proposal:
        """Return what to do next; nothing is taken for done before ``did`` says so.

        Raises:
            InvalidInputError: Nothing was seen since the last action.
        """
        choice = self.choice()
        expected = choice.expected_entropies
        if choice.action is None:
            return Proposal(None, None, choice.purpose)
        entropy = None if expected is None else float(expected[choice.action])
        return Proposal(self.memory.assumptions.actions[choice.action], entropy, choice.purpose)

    def choice(self, policy: Policy | None = None) -> Choice:
        """Return what the policy, or another one, chooses in the present trial; ties are broken by its generator.

        Raises:
            InvalidInputError: Nothing was seen since the last action.
        """
        return (policy or self.policy).choose(self.inference, self._generators[0])

    def did(self, action: GivenAction) -> None:
        """Take in what was done, whatever had been proposed: see ``Inference.act``.

        Raises:
            InvalidInputError: There is no such action, or nothing was seen before it.
        """
        self.inference.act(action)

    @property
    def verdict(self) -> AgentVerdict:
        """What the object is taken for, by all that was seen.

        Raises:
            InvalidInputError: Nothing has been seen since the last reset.
        """
        inference = self.inference
        if all(np.ptp(look.likelihood) == 0 for look in inference.history.evidence):
            return AgentVerdict("undecided", None, 1.0)
        belief = inference.conclude()
        best = belief.most_probable_object
        if belief.is_novel or best is None:
            return AgentVerdict("novel", None, float(belief.unseen))
        return AgentVerdict("known", self._names[best], float(belief.objects[best]))

    def learn(self, name: str | None = None) -> str | None:
        """Let the memory learn from the trial, and be ready for the next; return the name of the object.

        Args:
            name: Of the object, if someone has said it; else it is that of the verdict, or a new one.

        Returns:
            ``None`` if there was nothing to learn: no pattern was seen whole, or made more probable than not.

        Raises:
            InvalidInputError: Nothing has been seen since the last reset.
        """
        verdict, trial = self.verdict, self.inference
        matched = name if name is not None and name in self.memory.names else verdict.name if name is None else None
        if matched is not None and matched not in self.memory.names:
            matched = None  # another process has given its trials to other objects meanwhile
        learned = learn_history(self.memory, trial, matched, name, taught=name is not None)
        self.reset()
        return learned

    def _take_in(
        self, observation: ArrayLike, episode_start: ArrayLike | None, *, independent: bool = True
    ) -> NDArray[Any]:
        rows = np.asarray(observation)
        alphabet = self.memory.assumptions.alphabet
        if rows.ndim not in (1, 2) or rows.shape[-1] != len(alphabet.slots) or not rows.size:
            raise InvalidInputError(
                f"agent: observation of shape {rows.shape}; expected ({len(alphabet.slots)},) for one world, or "
                f"(worlds, {len(alphabet.slots)})"
            )
        detections = [detection_of(row) for row in np.atleast_2d(rows)]
        known = [trial.memory.assumptions.alphabet for trial in self.trials] or [alphabet] * len(detections)
        for detection, each in zip(detections, known, strict=False):
            each.check_detection(detection)
        self._begin_trials(len(detections), episode_start)
        for inference, detection in zip(self.trials, detections, strict=True):
            inference.observe(detection, independent=independent)
        return rows

    def _begin_trials(self, n_worlds: int, episode_start: ArrayLike | None) -> None:
        """Make an engine anew in each world where a trial begins."""
        if not self.trials:
            self._names = self.memory.names
            self.trials = [begin_trial(self.engine, self.memory, self.parameters) for _ in range(n_worlds)]
            self._generators = [self._generator() for _ in range(n_worlds)]
            return
        if len(self.trials) != n_worlds:
            raise InvalidInputError(f"agent: observations of {n_worlds} worlds; expected {len(self.trials)} as before")
        starts = np.broadcast_to(False if episode_start is None else np.asarray(episode_start, dtype=bool), n_worlds)
        for world in np.flatnonzero(starts):
            self.trials[world] = begin_trial(self.engine, self.memory, self.parameters)
            self._generators[world] = self._generator()

    def _generator(self) -> np.random.Generator:
        """Return the generator of the next trial."""
        return np.random.default_rng(self._seeds.spawn(1)[0])

    def _act(self, inference: Inference, rng: np.random.Generator) -> int:
        choice = self.policy.choose(inference, rng)
        if choice.action is None:
            raise InvalidInputError("agent: the policy ends the trial; expected one that always acts, or next_action")
        inference.act(choice.action)
        return choice.action
