"""One trial: the world shows, the engine infers, the policy chooses; every step is kept in a record."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias

import numpy as np

from atg_fg.assumptions import Assumptions
from atg_fg.belief import IdentityBelief
from atg_fg.engines.base import Inference
from atg_fg.errors import InvalidInputError
from atg_fg.json_format import plain_json, write_assumptions
from atg_fg.notebook_views import record_view
from atg_fg.patterns import Detection, Evidence, FloatArray
from atg_fg.policies import Policy
from atg_fg.worlds import World, assumptions_of, detection_of

#: How a trial can end.
Verdict: TypeAlias = Literal["novel", "known", "lost", "undecided"]
#: What the first line of a record says that it is.
TRIAL_FORMAT: Final = "atg-fg/trial"


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
        purpose: What the action is for, or why the policy ended the trial, if the policy says so.
        total_variation_bound: How far the belief may be from exact, if the engine is not but has a bound.
    """

    detection: Detection
    pattern: int | None
    belief: IdentityBelief
    log_evidence: float
    truth: dict[str, Any]
    expected_entropies: FloatArray | None = None
    action: int | None = None
    purpose: str | None = None
    total_variation_bound: float | None = None


@dataclass
class TrialRecord:
    """Everything that happened in a trial.

    Attributes:
        names: Names of the remembered objects, in the order of their index.
        assumptions: What the trial took for granted.
        steps: The looks, t + 1 of them for t actions; one less if the object was lost.
        lost_truth: What the world's ``info`` said when it lost the object, ``None`` if it did not.
    """

    names: tuple[str, ...]
    assumptions: Assumptions
    steps: list[TrialStep] = field(default_factory=list)
    lost_truth: dict[str, Any] | None = None

    @property
    def belief(self) -> IdentityBelief:
        """The belief at the end of the trial."""
        return self.steps[-1].belief

    @property
    def verdict(self) -> Verdict:
        """How the trial ended: ``undecided`` if nothing at all was seen, ``lost`` if the world lost the object."""
        if self.lost_truth is not None:
            return "lost"
        if all(symbol is None for step in self.steps for symbol in step.detection):
            return "undecided"
        return "novel" if self.belief.is_novel else "known"

    @property
    def judged_novel(self) -> bool:
        """Whether the object is judged novel at the end."""
        return self.verdict == "novel"

    @property
    def matched(self) -> str | None:
        """Name of the ATG the object is matched to, ``None`` if it is not judged known."""
        best = self.belief.most_probable_object
        return self.names[best] if self.verdict == "known" and best is not None else None

    @property
    def patterns(self) -> list[int | None]:
        """Index of the pattern seen at each look, ``None`` where it was not complete."""
        return [step.pattern for step in self.steps]

    @property
    def detections(self) -> list[Detection]:
        """The symbol seen in each slot at each look, ``None`` where nothing was."""
        return [step.detection for step in self.steps]

    @property
    def actions(self) -> list[int]:
        """Index of each action, in order."""
        return [step.action for step in self.steps if step.action is not None]

    def _repr_html_(self) -> str:
        return record_view(self)._repr_html_()

    def __repr__(self) -> str:
        return f"<{record_view(self).title}>"

    def to_json_lines(self, frames: Sequence[str] = (), **header: Any) -> str:
        """Return the record as JSON lines: a header, a line a step, the verdict.

        Args:
            frames: Path of the camera picture of each look, from the record's folder, if there are any.
            header: What else the header says.
        """
        assumptions = write_assumptions(self.assumptions)
        lines: list[dict[str, Any]] = [
            {"format": TRIAL_FORMAT, "version": 1, "objects": self.names, "assumptions": assumptions, **header}
        ]
        lines += [self._step_line(time) for time in range(len(self.steps))]
        for line, frame in zip(lines[1:], frames, strict=False):
            line["frame"] = frame
        verdict = {"outcome": self.verdict, "judged_novel": self.judged_novel, "matched": self.matched}
        lines.append({"verdict": {**verdict, "truth": self.lost_truth or self.steps[-1].truth}})
        return "".join(json.dumps(line, default=plain_json, allow_nan=False) + "\n" for line in lines)

    def _step_line(self, time: int) -> dict[str, Any]:
        step, actions = self.steps[time], self.assumptions.actions
        bound = step.total_variation_bound
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
            **({} if step.purpose is None else {"purpose": step.purpose}),
            **({} if bound is None else {"total_variation_bound": bound}),
            "truth": step.truth,
        }


def check_world(world: World, assumptions: Assumptions) -> None:
    """Raise ``InvalidInputError`` if a world's spaces, or the assumptions it states, do not fit the assumptions."""
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
    stated = assumptions_of(world, assumptions.n_objects) if world.has_wrapper_attr("assumptions") else assumptions
    for place, ours, theirs in (
        ("actions", assumptions.actions, stated.actions),
        ("slots", assumptions.alphabet.slots, stated.alphabet.slots),
    ):
        if ours != theirs:
            raise InvalidInputError(f"world: {place} {', '.join(theirs)}; expected those remembered: {', '.join(ours)}")


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
    """Look and act ``n_actions`` times, look once more, and return the record; a policy may end it before.

    A world that ends the episode ends the trial, with a last look at what it shows; one whose ``info`` says that the
    object is ``lost`` ends it without.

    Args:
        world: A world whose spaces fit the memory's assumptions.
        inference: An engine at the beginning of a trial.
        policy: Chooses the actions.
        n_actions: Number of actions, at most.
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
    remaining = n_actions
    while True:
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
            choice.purpose if choice else None,
            None if inference.exact else inference.total_variation_bound,
        )
        record.steps.append(step)
        if on_step is not None:
            on_step(step)
        if choice is None or choice.action is None:
            return record
        inference.act(choice.action)
        observation, _, terminated, truncated, truth = world.step(np.int64(choice.action))
        if truth.get("lost"):
            record.lost_truth = truth
            return record
        remaining = 0 if terminated or truncated else remaining - 1
