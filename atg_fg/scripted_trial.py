"""Scripted trials: one JSON file with assumptions, memory and steps, replayed by any engine.

The same file gives the same posterior in every exact engine; the format is in ``docs/file_formats.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Protocol

from atg_fg.engines import begin_trial
from atg_fg.engines.base import Inference
from atg_fg.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.json_format import (
    check_format,
    parse_json,
    read_assumptions,
    read_list,
    read_memory,
    read_object,
)
from atg_fg.memory import RobotMemory
from atg_fg.model import COLLECTION
from atg_fg.parameters import ModelParameters
from atg_fg.patterns import Evidence
from atg_fg.ties import best_actions

SCRIPT_FORMAT: Final = "atg-fg/scripted-trial"
_KEYS = ("format", "version", "assumptions", "parameters", "memory", "steps")
_PARAMETERS = ("transition_concentration", "observation_noise", "learn_in_trial")


class OnStep(Protocol):
    """Called after each step of a script."""

    def __call__(self, inference: Inference, *, observed: bool) -> None:
        """Take note of a look (``observed``) or of an action."""


@dataclass(frozen=True, eq=False)
class ScriptedTrial:
    """A trial whose every look and action is given.

    Attributes:
        memory: The robot memory when the trial begins.
        parameters: α, δ and whether to learn within the trial.
        steps: Evidence of a look, or the index of an action, in turn; a look is first.
        place: Where the script came from, for error messages.
    """

    memory: RobotMemory
    parameters: ModelParameters
    steps: tuple[Evidence | int, ...]
    place: str


def read_script(text: str, place: str = "script") -> ScriptedTrial:
    """Return the scripted trial in a JSON document.

    Raises:
        InvalidInputError: Anything malformed; the message names the place in the document.
    """
    document = read_object(parse_json(text, place), place, _KEYS)
    check_format(document, SCRIPT_FORMAT, place)
    assumptions = read_assumptions(document["assumptions"], f"{place}: assumptions")
    fields = read_object(document["parameters"], f"{place}: parameters", _PARAMETERS)
    try:
        parameters = ModelParameters(**fields)
    except InvalidInputError as error:
        raise InvalidInputError(f"{place}: parameters.{error}") from error
    memory = read_memory(document["memory"], assumptions, f"{place}: memory")
    steps = read_list(document["steps"], f"{place}: steps")
    if not steps:
        raise InvalidInputError(f"{place}: steps: empty; expected an observation first")
    read = [_read_step(step, index, memory, f"{place}: steps[{index}]") for index, step in enumerate(steps)]
    return ScriptedTrial(memory, parameters, tuple(read), place)


def _read_step(value: Any, index: int, memory: RobotMemory, place: str) -> Evidence | int:
    kind = "act" if index % 2 else "observe"
    if isinstance(value, dict) and list(value) == ["observe" if kind == "act" else "act"]:
        order = "an observation is first" if index == 0 else "observations and actions alternate"
        raise InvalidInputError(f"{place}: {next(iter(value))!r}; expected {kind!r}, since {order}")
    step = read_object(value, place, (kind,))
    if kind == "act":
        return memory.assumptions.action_index(step["act"], f"{place}.act")
    alphabet = memory.assumptions.alphabet
    detection = read_list(step["observe"], f"{place}.observe")
    return Evidence.of_detection(alphabet, alphabet.check_detection(detection, f"{place}.observe"))


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
