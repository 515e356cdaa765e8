"""One trial: the world shows, the engine infers, the policy chooses; every step is kept in a record."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from atg_fg.assumptions import Assumptions
from atg_fg.belief import IdentityBelief
from atg_fg.engines.base import Inference
from atg_fg.errors import InvalidInputError
from atg_fg.patterns import Detection, Evidence, FloatArray
from atg_fg.policies import Policy
from atg_fg.worlds import World, detection_of


@dataclass(frozen=True, eq=False)
class TrialStep:
    """One look and the action chosen after it.

    Attributes:
        detection: The symbol seen in each slot, ``None`` where nothing was.
        pattern: Index of the pattern if the detection was complete.
        belief: p(O | z_0:t, a_1:t).
        log_evidence: ln p(z_0:t | a_1:t).
        expected_entropies: Of each action in nats, shape [A], if the policy looked at them.
        action: Index of the action chosen next; ``None`` at the end of the trial.
        truth: What the world's ``info`` said, for scoring only.
    """

    detection: Detection
    pattern: int | None
    belief: IdentityBelief
    log_evidence: float
    truth: dict[str, Any]
    expected_entropies: FloatArray | None = None
    action: int | None = None


@dataclass
class TrialRecord:
    """Everything that happened in a trial.

    Attributes:
        names: Names of the remembered objects, in the order of their index.
        assumptions: What the trial took for granted.
        steps: The looks, t + 1 of them for t actions.
    """

    names: tuple[str, ...]
    assumptions: Assumptions
    steps: list[TrialStep] = field(default_factory=list)

    @property
    def belief(self) -> IdentityBelief:
        """The belief at the end of the trial."""
        return self.steps[-1].belief

    @property
    def judged_novel(self) -> bool:
        """Whether the object is judged novel at the end."""
        return self.belief.is_novel

    @property
    def matched(self) -> str | None:
        """Name of the ATG the object is matched to, ``None`` if it is judged novel."""
        best = self.belief.most_probable_object
        return None if self.judged_novel or best is None else self.names[best]

    @property
    def patterns(self) -> list[int | None]:
        """Index of the pattern seen at each look, ``None`` where it was not complete."""
        return [step.pattern for step in self.steps]

    @property
    def actions(self) -> list[int]:
        """Index of each action, in order."""
        return [step.action for step in self.steps if step.action is not None]

    def to_json_lines(self, **header: Any) -> str:
        """Return the record as JSON lines: a header, a line a step, the verdict."""
        lines: list[dict[str, Any]] = [{"format": "atg-fg/trial", "version": 1, "objects": self.names, **header}]
        lines += [self._step_line(time) for time in range(len(self.steps))]
        verdict = {"judged_novel": self.judged_novel, "matched": self.matched, "truth": self.steps[-1].truth}
        lines.append({"verdict": verdict})
        return "".join(json.dumps(line, default=_plain, allow_nan=False) + "\n" for line in lines)

    def _step_line(self, time: int) -> dict[str, Any]:
        step, actions = self.steps[time], self.assumptions.actions
        expected = step.expected_entropies
        return {
            "step": time,
            "observed": step.detection,
            "objects": step.belief.objects,
            "unseen": step.belief.unseen,
            "entropy": step.belief.entropy,
            "log_evidence": step.log_evidence,
            "expected_entropy": None if expected is None else dict(zip(actions, expected.tolist(), strict=True)),
            "action": None if step.action is None else actions[step.action],
            "truth": step.truth,
        }


def _plain(value: Any) -> Any:
    """Return NumPy values as JSON knows them."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"a record cannot hold a {type(value).__name__}")


def check_world(world: World, assumptions: Assumptions) -> None:
    """Raise ``InvalidInputError`` if a world's spaces do not fit the assumptions."""
    expected = (
        len(assumptions.actions),
        [assumptions.alphabet.n_symbols + 1] * len(assumptions.alphabet.slots),
    )
    found = (getattr(world.action_space, "n", None), list(getattr(world.observation_space, "nvec", [])))
    if (int(found[0] or 0), [int(size) for size in found[1]]) != expected:
        raise InvalidInputError(
            f"world: {world.action_space} and {world.observation_space}; expected {expected[0]} actions and "
            f"{expected[1]} symbols, counting 'missing', in the slots"
        )


def run_trial(
    world: World,
    inference: Inference,
    policy: Policy,
    n_actions: int,
    rng: np.random.Generator,
    *,
    reset_options: dict[str, Any] | None = None,
    on_step: Callable[[TrialStep], None] | None = None,
) -> TrialRecord:
    """Look and act ``n_actions`` times, look once more, and return the record.

    Args:
        world: A world whose spaces fit the memory's assumptions.
        inference: An engine at the beginning of a trial.
        policy: Chooses the actions.
        n_actions: Number of actions.
        rng: The trial's own generator; the world is seeded from it.
        reset_options: Passed on to the world's ``reset``.
        on_step: Called after every look, with the action already chosen.
    """
    assumptions = inference.memory.assumptions
    if n_actions < 1:
        raise InvalidInputError(f"actions: {n_actions}; expected a whole number of at least 1")
    check_world(world, assumptions)
    record = TrialRecord(inference.memory.names, assumptions)
    observation, truth = world.reset(seed=int(rng.integers(2**31)), options=reset_options)
    for remaining in range(n_actions, -1, -1):
        detection = detection_of(observation)
        evidence = Evidence.of_detection(assumptions.alphabet, detection)
        inference.observe(evidence)
        choice = policy.choose(inference, rng) if remaining else None
        step = TrialStep(
            detection,
            evidence.pattern,
            inference.identity(),
            inference.log_evidence,
            truth,
            choice.expected_entropies if choice else None,
            choice.action if choice else None,
        )
        record.steps.append(step)
        if on_step is not None:
            on_step(step)
        if choice is not None:
            inference.act(choice.action)
            observation, _, _, _, truth = world.step(np.int64(choice.action))
    return record
