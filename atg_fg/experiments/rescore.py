"""Tests that were recorded, judged once more from the same looks and actions by another model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialOutcome, TrialRecord, TrialStep
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import Score, TestResult
from atg_fg.experiments.trial import learn_from
from atg_fg.learning.structured_memory import memory_for
from atg_fg.storage.trial_log import read_trials


def rescore(path: Path, assumptions: Assumptions, engine: str, parameters: ModelParameters) -> TestResult:
    """Return the scores that a model gets on the evidence of a recorded test, learning from an empty memory as it goes.

    The actions are those of the record: they suited the model that chose them. A trial in which the object was lost
    stays lost.

    Args:
        path: What ``table1 --records`` wrote, ``….jsonl.gz``.
        assumptions: Under which the trials were made.
        engine: Name of the inference engine.
        parameters: Of the model.

    Raises:
        InvalidInputError: The file cannot be read, or its trials do not fit the assumptions.
    """
    memory = memory_for(parameters, RobotMemory(assumptions))
    score = Score()
    for number, line in enumerate(read_trials(path)):
        try:
            record = _judged(line, memory, engine, parameters)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise InvalidInputError(f"{path}: trial {number}: {error}; expected looks and actions of cubes") from error
        outcome = TrialOutcome.of(record)
        score.add(outcome, learn_from(outcome, memory))
    return score.result(0)


def _judged(line: Mapping[str, Any], memory: RobotMemory, engine: str, parameters: ModelParameters) -> TrialRecord:
    """Return a recorded trial with the beliefs of this model."""
    assumptions = memory.assumptions
    actions = [assumptions.actions.index(action) for action in line["actions"]]
    inference = begin_trial(engine, memory, parameters)
    record = TrialRecord(memory.names, assumptions)
    for time, detection in enumerate(line["observed"]):
        evidence = Evidence.of_detection(assumptions.alphabet, detection)
        inference.observe(evidence)
        action = actions[time] if time < len(actions) else None
        belief, truth = inference.identity(), line["truth"][time]
        seen = tuple(detection)
        record.steps.append(TrialStep(seen, evidence.pattern, belief, inference.log_evidence, truth, None, action))
        if action is not None:
            inference.act(action)
    if line["verdict"] == "lost":
        record.lost_truth = line["truth"][-1]
    return record
