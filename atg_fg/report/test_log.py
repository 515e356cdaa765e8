"""The trials of a test (``atg-fg/test``) as a page; what the log leaves out is inferred again from its looks.

A log holds what was seen, done and learned in every trial, so that the robot's memory at the beginning of each follows
from those before it, and the belief over objects from that memory. It is shown only where it agrees with what was
recorded of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialSummary
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import Score
from atg_fg.experiments.trial import can_be_learned, learn_from
from atg_fg.policies import EntropyPolicy
from atg_fg.report.content import Look, Report, TrialPage, shown_parameters
from atg_fg.report.pictures import MOST_CROPS, thumbnails
from atg_fg.report.summaries import looks_of, told_mistakes, told_truth, told_verdict, with_graphs
from atg_fg.report.trial_record import best_objects
from atg_fg.storage.recorded_test import RecordedTest

#: How near a belief that is inferred again must be to the recorded one.
_TOLERANCE: Final = 1e-6
_NOT_INFERRED: Final = (
    "The belief over single objects is not recorded, and not inferred again for this model: what is shown of it is "
    "the probability that the object was never met."
)

_CROPS_LEFT_OUT: Final = "There are more crops than a page takes: later trials are shown with numbers of symbols."


def test_report(test: RecordedTest, folder: Path | None) -> Report:
    """Return the page of a recorded test's trials.

    Args:
        test: What was recorded.
        folder: Where its log is, with crops beside it; ``None`` if it is in a database.

    Raises:
        InvalidInputError: There are none, or they do not follow from each other.
    """
    if not test.trials:
        raise InvalidInputError(f"{test.place}: no trials; expected at least one")
    # Structure that is learned, and merges, take their time; such a memory does not follow from the log alone.
    merging = bool(test.header.get("merge_duplicates"))
    told = Retelling(test.assumptions, inferred=not (test.parameters.learn_structure or merging), merging=merging)
    by_entropy = test.header.get("policy", EntropyPolicy.name) == EntropyPolicy.name
    pages, crops, room = [], dict[int, str](), MOST_CROPS
    for number, trial in enumerate(test.trials):
        with placed(f"{test.place}: trial {number}"):
            page = told.page(trial, f"trial {number}", test.parameters, by_entropy=by_entropy)
            if folder is not None and room > 0:
                looks = ((f"look {look}", step) for look, step in enumerate(trial.steps))
                crops.update(thumbnails(looks, folder, room))
                drawn = {symbol for graph in page.graphs for aspect in graph.aspects for symbol in aspect}
                drawing = {each: crops[each] for each in sorted(drawn & crops.keys())}
                room -= sum(map(len, drawing.values()))
                page = replace(page, thumbnails=drawing if room >= 0 else {})
            pages.append(page)
    pages = with_mended(pages, test.trials)
    title = f"A test of {len(pages)} trials, {told.score.successes} of them right"
    bare = [trial for trial, page in zip(test.trials, pages, strict=True) if not page.thumbnails]
    left_out = folder is not None and any(step.crops for trial in bare for step in trial.steps)
    notes = (*(() if told.inferred else (_NOT_INFERRED,)), *((_CROPS_LEFT_OUT,) if left_out else ()))
    return Report(title, shown_parameters(test.header), notes, test.assumptions, tuple(pages))


def with_mended(pages: Sequence[TrialPage], trials: Sequence[TrialSummary]) -> list[TrialPage]:
    """Return pages of trials that also say which verdicts were mended, and after which trial.

    Raises:
        InvalidInputError: A trial was mended that had not been learned from by then.
    """
    notes: list[list[str]] = [[] for _ in pages]
    learned: list[int] = []
    for number, trial in enumerate(trials):
        if can_be_learned(trial):
            learned.append(number)
        for each in trial.mended:
            if each.trial >= len(learned):
                raise InvalidInputError(f"trial {number}: mended: {each.trial}; expected less than {len(learned)}")
            mended = learned[each.trial]
            change = f"from {each.old} to {each.new}"
            notes[mended].append(f"This verdict was mended after trial {number}: {change}.")
            if mended != number:
                notes[number].append(f"The verdict of trial {mended} was mended after this one: {change}.")
    return [replace(page, notes=(*page.notes, *more)) for page, more in zip(pages, notes, strict=True)]


class Retelling:
    """The robot's memory and the score, trial after trial.

    Args:
        assumptions: Of all trials.
        inferred: Whether beliefs are inferred again; no longer, once they do not agree with what was recorded.
        merging: Whether the robot merged ATGs, so that it is not known how many it had.
        memory: Before the first trial; an empty one if not given. Of which objects its ATGs are nobody knows.
    """

    def __init__(
        self, assumptions: Assumptions, *, inferred: bool, merging: bool = False, memory: RobotMemory | None = None
    ) -> None:
        self._assumptions, self._merging = assumptions, merging
        self._memory = memory or RobotMemory(assumptions)
        self._was_empty = not len(self._memory)
        self.score = Score()
        self.inferred = inferred

    def page(self, trial: TrialSummary, title: str, parameters: ModelParameters, *, by_entropy: bool) -> TrialPage:
        """Return the page of the next trial, and learn from it.

        Args:
            trial: What was recorded.
            title: Of the page.
            parameters: Of the model that judged it.
            by_entropy: Whether the policy looked at expected entropies.

        Raises:
            InvalidInputError: The trial does not follow from those before it.
        """
        looks = looks_of(trial, None if self._merging else self._memory.n_unseen)
        if self.inferred:
            looks = self._with_beliefs(looks, parameters, by_entropy=by_entropy)
        known = self.score.has_met(trial.object)
        met = "met before" if known else "never met before" if self._was_empty else "in none of the trials before"
        truth = f"{told_truth(trial.truths[-1], self.score.name_of(trial.object))}, {met}"
        notes = told_mistakes(trial, self._assumptions)
        page = TrialPage(title, told_verdict(trial.verdict, trial.matched), truth, None, notes=notes)
        page = with_graphs(page, looks, self._memory if self.inferred else None, self._assumptions, trial.matched)
        right = self.score.add(trial, learn_from(trial, self._memory), self._memory)
        return replace(page, right=right if known or self._was_empty else None)

    def _with_beliefs(self, looks: list[Look], parameters: ModelParameters, *, by_entropy: bool) -> list[Look]:
        """Return the looks with the belief over objects, if the memory leads to what was recorded."""
        inference = begin_trial("bayes-filter", self._memory, parameters)
        found = []
        for look in looks:
            inference.observe(Evidence.of_detection(self._assumptions.alphabet, look.seen))
            belief = inference.identity()
            if max(abs(belief.unseen - look.unseen), abs(belief.entropy - look.entropy)) > _TOLERANCE:
                self.inferred = False
                return looks
            expected = look.expected
            if look.action is not None and by_entropy and not expected:
                values = inference.expected_entropies().tolist()
                expected = tuple(zip(self._assumptions.actions, values, strict=True))
            objects = best_objects(self._memory.names, belief.objects.tolist())
            found.append(replace(look, objects=objects, expected=expected))
            if look.action is not None:
                inference.act(self._assumptions.action_index(look.action))
        return found
