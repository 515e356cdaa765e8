"""Scripted trials: one JSON file with assumptions, memory and steps, replayed by any engine.

The same file gives the same posterior in every exact engine; the format is in ``docs/file_formats.md``.
"""

from __future__ import annotations

from typing import Any, Protocol

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.inference.expected_entropy import best_actions
from atg_fg.inference.interface import Inference
from atg_fg.inference.recognition_model import COLLECTION
from atg_fg.storage.scripted_trial import ScriptedTrial


class OnStep(Protocol):
    """Called after each step of a script."""

    def __call__(self, inference: Inference, *, observed: bool) -> None:
        """Take note of a look (``observed``) or of an action."""


def replay(script: ScriptedTrial, engine: str, *, smooth: bool = False) -> dict[str, Any]:
    """Return the document of posteriors that an engine infers at every step.

    Args:
        script: The scripted trial.
        engine: Name of the engine.
        smooth: Add p(X_t | all evidence) of every look, under the most probable object.

    Raises:
        InvalidInputError: Evidence of probability zero; the message names the step.
        TooLargeError: More than the engine can do.
    """
    steps: list[dict[str, Any]] = []

    def enter(inference: Inference, *, observed: bool) -> None:
        steps.append(_entry(len(steps), inference, observed=observed))

    inference = run_script(script, engine, enter)
    document: dict[str, Any] = {"engine": engine, "steps": steps}
    if smooth:
        document["smoothed"] = smoothed(inference)
    return document


def run_script(script: ScriptedTrial, engine: str, on_step: OnStep | None = None) -> Inference:
    """Return an engine that has gone through the whole script.

    Args:
        script: The scripted trial.
        engine: Name of the engine.
        on_step: Called with the engine after each step.

    Raises:
        InvalidInputError: Evidence of probability zero; the message names the step.
        TooLargeError: More than the engine can do.
    """
    inference = begin_trial(engine, script.memory, script.parameters)
    for number, step in enumerate(script.steps):
        try:
            if isinstance(step, Evidence):
                inference.observe(step)
            else:
                inference.act(step)
        except ImpossibleEvidenceError as error:
            raise InvalidInputError(
                f"{script.place}: steps[{number}]: the evidence has probability zero under the model; "
                "expected evidence that some object could give, or noise above 0"
            ) from error
        if on_step is not None:
            on_step(inference, observed=isinstance(step, Evidence))
    return inference


def _entry(number: int, inference: Inference, *, observed: bool) -> dict[str, Any]:
    belief = inference.identity()
    entry: dict[str, Any] = {
        "step": number,
        "kind": "observe" if observed else "act",
        "objects": dict(zip(inference.memory.names, belief.objects.tolist(), strict=True)),
        "unseen": belief.unseen,
        "entropy": belief.entropy,
    }
    if observed:
        expected = inference.expected_entropies()
        actions = inference.memory.assumptions.actions
        entry["expected_entropy"] = dict(zip(actions, expected.tolist(), strict=True))
        entry["best_actions"] = [actions[action] for action in best_actions(expected)]
    entry["log_evidence"] = inference.log_evidence
    bound = inference.total_variation_bound
    if not inference.exact and bound is not None:
        entry["total_variation_bound"] = bound
    return entry


def smoothed(inference: Inference) -> dict[str, Any]:
    """Return p(X_t | all evidence) of every look under the most probable remembered object.

    Where no remembered object is possible it is that under *unseen*, and the object is null.
    """
    belief = inference.identity()
    best = belief.most_probable_object
    hypothesis = best if best is not None and belief.objects[best] > 0 else len(belief.objects)
    marginals = inference.smoothed_aspects(hypothesis)
    patterns = inference.memory.assumptions.alphabet.patterns
    shown = inference.model.pattern_of[hypothesis]
    names = (*inference.memory.names, None)
    return {
        "object": names[hypothesis],
        "steps": [
            {
                "step": 2 * time,
                "aspects": [
                    {"pattern": list(patterns[shown[state]]), "probability": float(probability)}
                    for state, probability in enumerate(marginals[time])
                    if shown[state] >= 0
                ],
                "collection": float(marginals[time][COLLECTION]),
            }
            for time in range(len(inference.history.evidence))
        ],
    }
