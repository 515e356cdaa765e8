"""Tests that were recorded, judged once more from the same looks and actions by another model."""

from __future__ import annotations

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialRecord, TrialStep, TrialSummary, confidences_in
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import Score, TestResult
from atg_fg.experiments.trial import learn_from
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
        score.add(trial, learn_from(trial, memory))
        score.mend(memory)
    return score.result(0)


def _judged(
    trial: TrialSummary, memory: RobotMemory, assumptions: Assumptions, engine: str, parameters: ModelParameters
) -> TrialRecord:
    """Return a recorded trial with the beliefs of this model."""
    inference = begin_trial(engine, memory, parameters)
    record = TrialRecord(memory.names, assumptions, lost_truth=trial.lost_truth)
    for look in trial.steps:
        evidence = Evidence.of_detection(assumptions.alphabet, look.observed, confidences_in(look.truth))
        inference.observe(evidence)
        action = None if look.action is None else assumptions.action_index(look.action)
        belief = inference.conclude() if action is None else inference.identity()
        evidenced = inference.log_evidence
        record.steps.append(TrialStep(look.observed, evidence.pattern, belief, evidenced, look.truth, None, action))
        if action is not None:
            inference.act(action)
    record.mistakes = inference.mistakes()
    return record
