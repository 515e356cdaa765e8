"""Tests that were recorded, judged once more from the same looks and actions by another model."""

from __future__ import annotations

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import evidence_in
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import TrialRecord, TrialSummary
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import Score, TestResult
from atg_fg.experiments.trial import follow, learn_from
from atg_fg.learning.structured_memory import memory_for
from atg_fg.storage.recorded_test import RecordedTest


def rescore(test: RecordedTest, engine: str, parameters: ModelParameters) -> TestResult:
    """Return the scores that a model gets on the evidence of a recorded test, learning from an empty memory as it goes.

    The actions are those of the record: they suited the model that chose them. A trial in which the object was lost
    stays lost.

    Args:
        test: What ``recorded_tests`` returns.
        engine: Name of the inference engine.
        parameters: Of the model.

    Raises:
        InvalidInputError: The test has no trials.
    """
    if not test.trials:
        raise InvalidInputError(f"{test.place}: no trials; expected at least one")
    memory = memory_for(parameters, RobotMemory(test.assumptions))
    score = Score()
    for recorded in test.trials:
        trial = TrialSummary.of(_judged(recorded, memory, test.assumptions, engine, parameters))
        score.add(trial, learn_from(trial, memory), memory)
        score.mend(memory)
    return score.result(0)


def _judged(
    trial: TrialSummary, memory: RobotMemory, assumptions: Assumptions, engine: str, parameters: ModelParameters
) -> TrialRecord:
    """Return a recorded trial with the beliefs of this model."""
    looks = [evidence_in(assumptions.alphabet, step.observed, step.truth) for step in trial.steps]
    actions = [assumptions.action_index(action) for action in trial.actions]
    inference = begin_trial(engine, memory, parameters)
    record = follow(inference, looks, actions, [step.truth for step in trial.steps])
    record.lost_truth = trial.lost_truth
    return record
