"""One trial: the world shows, the engine infers, the policy chooses; every step is kept in a record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import instance, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import confidences_in, measured_in
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialRecord, TrialStep, TrialSummary
from atg_fg.core.sense import Sense, SenseTrial, likelihoods_of, readings_of
from atg_fg.inference.interface import Inference
from atg_fg.policies import Policy, as_policy
from atg_fg.senses.object_readings import look_of, readings_in, without_readings
from atg_fg.worlds.base import World, detection_of, symbols_of
from atg_fg.worlds.registry import assumptions_of, sense_of


def check_world_fits(world: World, assumptions: Assumptions, sense: Sense | None = None) -> None:
    """Raise ``InvalidInputError`` if a world does not fit what a memory takes for granted.

    Args:
        world: Its spaces, its sense, and the assumptions that it states are looked at.
        assumptions: Of the memory.
        sense: Of the memory.
    """
    of_world = sense_of(world)
    if of_world is not None and of_world.features != (None if sense is None else sense.features):
        have = "without a sense" if sense is None else f"of {sense.features!r}"
        raise InvalidInputError(f"world: features {of_world.features!r}, memory {have}; expected the same features")
    n_actions, n_slots = len(assumptions.actions), len(assumptions.alphabet.slots)
    n_symbols = assumptions.alphabet.n_symbols
    space = without_readings(world.observation_space, assumptions.object_senses)
    if sense is not None:
        sense.check_space(space)
    symbols = [n_symbols] * n_slots if sense is None else []
    if (getattr(world.action_space, "n", 0), symbols_of(space)) != (n_actions, symbols):
        raise InvalidInputError(
            f"world: {world.action_space} and {space}; expected {n_actions} actions and looks of "
            f"{n_slots} slots with numbers from -1, missing, to {n_symbols - 1}"
        )
    stated = assumptions_of(world, assumptions.n_objects) if world.has_wrapper_attr("assumptions") else assumptions
    for place, ours, theirs in (
        ("actions", assumptions.actions, stated.actions),
        ("slots", assumptions.alphabet.slots, stated.alphabet.slots),
        (
            "senses of the object",
            *([f"{each.name} {each.unit}".rstrip() for each in of.object_senses] for of in (assumptions, stated)),
        ),
    ):
        if ours != theirs:
            raise InvalidInputError(f"world: {place} {', '.join(theirs)}; expected those remembered: {', '.join(ours)}")


def sensed_look(
    senses: SenseTrial | None, assumptions: Assumptions, observation: Any, info: dict[str, Any]
) -> tuple[Evidence, dict[str, Any]]:
    """Return the evidence of an observation, and ``info`` with what the sense makes of it.

    Args:
        senses: Reads the observation; ``None`` if it is symbols.
        assumptions: Of the memory.
        observation: Of the world.
        info: That came with it.
    """
    measured, look = readings_in(assumptions.object_senses, observation), look_of(observation)
    if senses is None:
        evidence = Evidence.of_detection(assumptions.alphabet, detection_of(look), confidences_in(info))
    else:
        evidence, readings = senses.look(look)
        unsure = {"likelihoods": evidence.slots} if evidence.slots else {}
        info = {**info, "confidences": evidence.confidences, "readings": readings, **unsure}
    if not measured:
        return evidence, info
    return evidence.with_readings(measured), {**info, "measured": dict(measured)}


def run_trial(
    world: World,
    inference: Inference,
    policy: Policy,
    n_actions: int,
    rng: np.random.Generator,
    *,
    reset_options: dict[str, Any] | None = None,
    on_step: Callable[[TrialStep], None] | None = None,
    is_checked: bool = False,
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
        is_checked: Whether ``check_world_fits`` has been asked already, as before the trials of a test.
    """
    assumptions = instance(inference, "inference", Inference).memory.assumptions
    whole_number(n_actions, "actions", least=1)
    instance(rng, "rng", np.random.Generator)
    policy = as_policy(policy)
    if not is_checked:
        instance(world, "world", gymnasium.Env)
        check_world_fits(world, assumptions, inference.memory.sense)
    senses = None if inference.memory.sense is None else inference.memory.sense.begin()
    record = TrialRecord(inference.memory.names, assumptions)
    observation, truth = world.reset(seed=int(rng.integers(2**31)), options=reset_options)
    remaining = n_actions
    while True:
        evidence, truth = sensed_look(senses, assumptions, observation, truth)
        inference.observe(evidence)
        choice = policy.choose(inference, rng) if remaining else None
        ends = choice is None or choice.action is None
        step = TrialStep(
            evidence.detection or (None,) * len(assumptions.alphabet.slots),
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
            record.mistakes = inference.mistakes()
            return record
        inference.act(choice.action)
        observation, _, terminated, truncated, truth = world.step(np.int64(choice.action))
        if truth.get("lost"):
            record.lost_truth = truth
            return record
        remaining = 0 if terminated or truncated else remaining - 1


def follow(
    inference: Inference, looks: Sequence[Evidence], actions: Sequence[int], truths: Sequence[dict[str, Any]]
) -> TrialRecord:
    """Let an engine go through looks and actions that are given, and return the record with its beliefs.

    Args:
        inference: An engine at the beginning of a trial.
        looks: Evidence of each look, at least one.
        actions: Index of what was done after each; none after the last one, but for an object that was lost then.
        truths: The ``info`` of each look.
    """
    assumptions = inference.memory.assumptions
    record = TrialRecord(inference.memory.names, assumptions)
    for time, (evidence, truth) in enumerate(zip(looks, truths, strict=True)):
        inference.observe(evidence)
        action = actions[time] if time < len(actions) else None
        belief = inference.conclude() if action is None else inference.identity()
        seen = evidence.detection or (None,) * len(assumptions.alphabet.slots)
        record.steps.append(TrialStep(seen, evidence.pattern, belief, inference.log_evidence, truth, action=action))
        if action is not None:
            inference.act(action)
    record.mistakes = inference.mistakes()
    return record


def can_be_learned(trial: TrialSummary) -> bool:
    """Return whether there is anything to learn: a verdict, and a pattern that was seen whole."""
    return trial.verdict not in ("lost", "undecided") and any(pattern is not None for pattern in trial.patterns)


def learn_from(record: TrialRecord | TrialSummary, memory: RobotMemory) -> str | None:
    """Let the memory learn from a trial, in one transaction if it is kept in a file; return the name of the ATG.

    Nothing is learned, and ``None`` returned, if the object was lost or no pattern was seen whole.
    """
    trial = TrialSummary.of(record) if isinstance(record, TrialRecord) else instance(record, "record", TrialSummary)
    with instance(memory, "memory", RobotMemory).transaction():
        name = None
        if can_be_learned(trial):
            name = learn_steps(memory, trial, trial.matched)
        if isinstance(record, TrialRecord):
            memory.add_record(record, name)
    return name


def learn_steps(
    memory: RobotMemory, trial: TrialSummary, matched: str | None, name: str | None = None, *, taught: bool = False
) -> str:
    """Let a memory learn from the looks and actions of a trial; return the name of the ATG.

    Args:
        memory: What learns.
        trial: What was seen and done.
        matched: Name of the ATG that the object is of, ``None`` if it is new.
        name: Of the ATG of a new object; the next number if not given.
        taught: Whether someone said of which object the trial is.
    """
    actions = [memory.assumptions.action_index(action) for action in trial.actions[: len(trial.steps) - 1]]
    looks = [step.truth for step in trial.steps]
    measured = [measured_in(look) for look in looks]
    name = memory.learn(list(trial.patterns), actions, matched, name, measured)
    likelihoods = likelihoods_of(looks)
    name = memory.learn_shared(name, trial.detections, actions, trial.confidences, likelihoods, measured, taught=taught)
    readings = readings_of(looks)
    if readings and memory.sense is not None:
        memory.learn_readings(name, readings, trial.detections, actions)
    return name
