"""Whether a policy is one: what ``check_env`` is to gymnasium's environments, for policies of a user's own."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.log_math import log_sum_exp
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, PatternAlphabet
from atg_fg.core.promises import require, shared_generators
from atg_fg.inference.chain import forward_pass
from atg_fg.inference.interface import Inference, TrialSetup
from atg_fg.policies import Choice, Policy, as_policy, make_policy

_LOOKS: Final = 5
_PARAMETERS: Final = (ModelParameters(0.1, 0.1, learn_in_trial=False), ModelParameters(0.5, 0.05, learn_in_trial=True))


class _Case(NamedTuple):
    """A trial for a policy to choose the actions of.

    Attributes:
        name: For messages.
        memory: What is remembered.
        parameters: Of the model.
        looks: What is seen, whatever is done.
        seed: Of the trial's generator.
    """

    name: str
    memory: RobotMemory
    parameters: ModelParameters
    looks: list[Evidence]
    seed: int


class _ByTheChain(Inference):
    """The plainest exact engine: the forward pass of the whole trial, for each question anew."""

    name: ClassVar[str] = "by-the-chain"
    exact: ClassVar[bool] = True

    def identity(self) -> IdentityBelief:
        if not self.history.evidence:
            return IdentityBelief.of(self.model.prior, self.model.n_unseen)
        log_joint = self._log_joint
        return IdentityBelief.of(np.exp(log_joint - log_sum_exp(log_joint)), self.model.n_unseen)

    @property
    def scaled_log_evidence(self) -> float:
        return log_sum_exp(self._log_joint)

    @property
    def _log_joint(self) -> FloatArray:
        return forward_pass(self.chain()).log_joint

    def update(self, evidence: Evidence) -> None:
        self.learn_from_look()

    def predict(self, action: AnyAction) -> None:
        pass


def check_policy(
    policy: str | Policy | type[Policy], memory: RobotMemory | None = None, *, cases: int = 12, seed: int = 0
) -> int:
    """Raise ``AssertionError`` if a policy is not what ``Policy`` promises; return how many choices were looked at.

    It chooses in trials of small random models, with few objects and many, with one action, with nothing seen and with
    nothing remembered. Each choice must be a ``Choice`` of an action that there is, or the end of the trial. Besides:
    the engine is not changed; all that is random comes from the trial's generator; a trial is the same when it is done
    again, by a policy that has done others before, and by one that was sent to another process.

    Args:
        policy: An instance, a class that is made without arguments, a name that ``make_policy`` takes.
        memory: In place of random ones, for a policy that knows one kind of objects only, such as one with a goal.
        cases: Trials.
        seed: Of the trials.

    Raises:
        AssertionError: The policy breaks a promise; the message says which, in which case, and after which look.
        InvalidInputError: It is no policy at all.
    """
    found = make_policy(policy) if isinstance(policy, str) else as_policy(policy, repr(policy))
    require(isinstance(getattr(found, "name", None), str), f"name is {getattr(found, 'name', None)!r}; expected a str")
    try:
        kept = pickle.dumps(found)
    except Exception as error:
        raise AssertionError(f"cannot be sent to another process: {error}; expected what pickle takes") from error
    n_choices = 0
    for case in _cases(memory, cases, seed):
        chosen = _played(found, case)
        for other, who in ((found, "it was asked again"), (pickle.loads(kept), "it had done no other trial")):
            again = _played(other, case)
            require(
                again == chosen,
                f"{case.name}: chose {_actions(chosen)}, and {_actions(again)} when {who}; expected the same",
            )
        n_choices += len(chosen)
    return n_choices


def _actions(choices: list[tuple[Any, ...]]) -> list[Any]:
    return [action for action, *_ in choices]


def _played(policy: Policy, case: _Case) -> list[tuple[Any, ...]]:
    """Let a policy choose through a trial; return its choices as what can be compared."""
    inference, rng = _ByTheChain(TrialSetup(case.memory, case.parameters)), np.random.default_rng(case.seed)
    choices: list[tuple[Any, ...]] = []
    for number, look in enumerate(case.looks):
        inference.observe(look)
        place = f"{case.name}, after look {number}"
        before, of_all = _state(inference), shared_generators()
        try:
            choice = policy.choose(inference, rng)
        except Exception as error:
            raise AssertionError(f"{place}: {type(error).__name__}: {error}; expected a choice") from error
        _check_choice(choice, len(case.memory.assumptions.actions), place)
        require(_state(inference) == before, f"{place}: the engine has changed; expected that a policy only asks it")
        require(
            of_all == shared_generators(), f"{place}: a generator that all share was used; expected the trial's own"
        )
        entropies = choice.expected_entropies
        choices.append((choice.action, None if entropies is None else entropies.tolist(), choice.purpose))
        if choice.action is None:
            break
        inference.act(choice.action)
    return choices


def _state(inference: Inference) -> tuple[Any, ...]:
    history = inference.history
    belief = inference.identity().probabilities.tolist()
    return len(history.evidence), list(history.actions), belief, inference.model.edges.weight.tolist()


def _check_choice(choice: Any, n_actions: int, place: str) -> None:
    require(isinstance(choice, Choice), f"{place}: {choice!r}; expected a Choice")
    action, entropies = choice.action, choice.expected_entropies
    is_action = isinstance(action, int) and not isinstance(action, bool) and 0 <= action < n_actions
    require(
        action is None or is_action, f"{place}: action {action!r}; expected a whole number from 0 to {n_actions - 1}"
    )
    if entropies is not None:
        sound = isinstance(entropies, np.ndarray) and entropies.shape == (n_actions,) and bool((entropies >= 0).all())
        require(
            sound and bool(np.isfinite(entropies).all()),
            f"{place}: expected entropies {entropies!r}; expected one of at least 0 for each of {n_actions} actions",
        )
    require(
        choice.purpose is None or isinstance(choice.purpose, str),
        f"{place}: purpose {choice.purpose!r}; expected words or None",
    )


def _cases(memory: RobotMemory | None, n_cases: int, seed: int) -> Iterator[_Case]:
    for number in range(n_cases):
        rng = np.random.default_rng((seed, number))
        remembered = _drawn_memory(number, rng) if memory is None else memory
        looks = [_drawn_look(remembered.assumptions.alphabet, rng) for _ in range(_LOOKS)]
        parameters = _PARAMETERS[number % len(_PARAMETERS)]
        yield _Case(f"case {number}", remembered, parameters, looks, int(rng.integers(2**31)))


def _drawn_memory(number: int, rng: np.random.Generator) -> RobotMemory:
    """Return a memory of none to four objects with one to three actions; the first cases are the least ones."""
    actions = ("turn", "tip", "roll")[: 1 + number % 3]
    alphabet = PatternAlphabet(("front", "top")[: int(rng.integers(1, 3))], int(rng.integers(2, 6)))
    n_aspects = int(rng.integers(1, min(len(alphabet), 5) + 1))
    memory = RobotMemory(Assumptions(6, n_aspects, actions, alphabet))
    for _ in range(min(number, int(rng.integers(5)))):
        seen = rng.permutation(len(alphabet))[:n_aspects]
        steps = int(rng.integers(8))
        memory.learn(rng.choice(seen, steps + 1).tolist(), rng.integers(len(actions), size=steps).tolist(), None)
    return memory


def _drawn_look(alphabet: PatternAlphabet, rng: np.random.Generator) -> Evidence:
    pattern = alphabet.patterns[int(rng.integers(len(alphabet)))]
    return Evidence.of_detection(alphabet, [None if rng.random() < 0.25 else symbol for symbol in pattern])
