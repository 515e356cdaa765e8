"""The trials of a test (``atg-fg/test``) as a page; what the log leaves out is inferred again from its looks.

A log holds what was seen, done and learned in every trial, so that the robot's memory at the beginning of each follows
from those before it, and the belief over objects from that memory. It is shown only where it agrees with what was
recorded of it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialSummary
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import Score
from atg_fg.experiments.trial import learn_from
from atg_fg.policies import EntropyPolicy
from atg_fg.report.content import Look, Report, TrialPage, shown_parameters
from atg_fg.report.summaries import looks_of, told_truth, told_verdict, with_graphs
from atg_fg.report.trial_record import best_objects
from atg_fg.storage.checked_json import placed
from atg_fg.storage.recorded_test import RecordedTest

#: How near a belief that is inferred again must be to the recorded one.
_TOLERANCE: Final = 1e-6
_NOT_INFERRED: Final = (
    "The belief over single objects is not recorded, and not inferred again for this model: what is shown of it is "
    "the probability that the object was never met."
)


def test_report(test: RecordedTest) -> Report:
    """Return the page of a recorded test's trials.

    Raises:
        InvalidInputError: There are none, or they do not follow from each other.
    """
    if not test.trials:
        raise InvalidInputError(f"{test.place}: no trials; expected at least one")
    told = _Test(test)
    pages = [told.page(trial, number) for number, trial in enumerate(test.trials)]
    title = f"A test of {len(pages)} trials, {told.score.successes} of them right"
    notes = () if told.inferred else (_NOT_INFERRED,)
    return Report(title, shown_parameters(test.header), notes, test.assumptions, tuple(pages))


class _Test:
    """The robot's memory and the score, trial after trial."""

    def __init__(self, test: RecordedTest) -> None:
        self._test = test
        self._assumptions = test.assumptions
        self._memory = RobotMemory(test.assumptions)
        self.score = Score()
        # Structure that is learned, and merges, take their time; such a memory does not follow from the log alone.
        self.inferred = not (test.parameters.learn_structure or test.header.get("merge_duplicates"))

    def page(self, trial: TrialSummary, number: int) -> TrialPage:
        """Return the page of the next trial, and learn from it."""
        looks = looks_of(trial)
        if self.inferred:
            looks = self._with_beliefs(looks)
        met = "met before" if self.score.has_met(trial.object) else "never met before"
        truth = f"{told_truth(trial.truths[-1])}, {met}"
        page = TrialPage(f"trial {number}", told_verdict(trial.verdict, trial.matched), truth, None, (), ())
        page = with_graphs(page, looks, self._memory if self.inferred else None, self._assumptions, trial.matched)
        return replace(page, right=self._learn(trial, f"{self._test.place}: trial {number}"))

    def _with_beliefs(self, looks: list[Look]) -> list[Look]:
        """Return the looks with the belief over objects, if the memory leads to what was recorded."""
        inference = begin_trial("bayes-filter", self._memory, self._test.parameters)
        by_entropy = self._test.header.get("policy", EntropyPolicy.name) == EntropyPolicy.name
        found = []
        for look in looks:
            inference.observe(Evidence.of_detection(self._assumptions.alphabet, look.seen))
            belief = inference.identity()
            if max(abs(belief.unseen - look.unseen), abs(belief.entropy - look.entropy)) > _TOLERANCE:
                self.inferred = False
                return looks
            expected: tuple[tuple[str, float], ...] = ()
            if look.action is not None and by_entropy:
                values = inference.expected_entropies().tolist()
                expected = tuple(zip(self._assumptions.actions, values, strict=True))
            objects = best_objects(self._memory.names, belief.objects.tolist())
            found.append(replace(look, objects=objects, expected=expected))
            if look.action is not None:
                inference.act(self._assumptions.action_index(look.action))
        return found

    def _learn(self, trial: TrialSummary, place: str) -> bool:
        """Let the memory learn from a trial; return whether its verdict was right."""
        before = self.score.successes
        with placed(place):
            self.score.add(trial, learn_from(trial, self._memory))
        return self.score.successes > before
