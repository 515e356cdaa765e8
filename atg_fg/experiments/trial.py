"""One trial: the world shows, the engine infers, the policy chooses; every step is kept in a record."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialRecord, TrialStep, TrialSummary, confidences_in
from atg_fg.inference.interface import Inference
from atg_fg.policies import Policy
from atg_fg.worlds.base import World, detection_of
from atg_fg.worlds.registry import assumptions_of


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
        evidence = Evidence.of_detection(assumptions.alphabet, detection, confidences_in(truth))
        inference.observe(evidence)
        choice = policy.choose(inference, rng) if remaining else None
        ends = choice is None or choice.action is None
        step = TrialStep(
            detection,
            evidence.pattern,
            inference.conclude() if ends else inference.identity(),
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


def learn_from(record: TrialRecord | TrialSummary, memory: RobotMemory) -> str | None:
    """Let the memory learn from a trial, in one transaction if it is kept in a file; return the name of the ATG.

    Nothing is learned, and ``None`` returned, if the object was lost or no pattern was seen whole.
    """
    trial = TrialSummary.of(record) if isinstance(record, TrialRecord) else record
    with memory.transaction():
        name = None
        if trial.verdict not in ("lost", "undecided") and any(pattern is not None for pattern in trial.patterns):
            actions = [memory.assumptions.action_index(action) for action in trial.actions[: len(trial.steps) - 1]]
            name = memory.learn(list(trial.patterns), actions, trial.matched)
            name = memory.learn_shared(name, trial.detections, actions, trial.confidences)
        if isinstance(record, TrialRecord):
            memory.add_record(record, name)
    return name
